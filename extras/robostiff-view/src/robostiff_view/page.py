"""The page: sliders on one side, tables on the other, the robot between them."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from io import StringIO
from typing import Any

import numpy as np

from robostiff.errors import RobostiffError
from robostiff.markup import element
from robostiff.plot import LAYERS
from robostiff.spatial import Space
from robostiff_view.answer import Look, ShownAnswer
from robostiff_view.handshake import guarded_server
from robostiff_view.machines import Machine
from robostiff_view.scene import LayeredScene
from robostiff_view.sliders import Slider, load_sliders

_WIDE, _NARROW = 440.0, 330.0  # [px]
_NEEDED = 0.6  # width of the picture beside its height, in which the start shows all of a robot
_MOST = 1e6  # exaggeration
_EMPTY = "There is nothing to show."
_NO_LOAD = "Move a component of the load: there is none yet."
_LOG = logging.getLogger(__name__)


class LivePage:
    """A robot in the browser, served to this computer alone, at an address with a token.

    Attributes
    ----------
    url : str
        The address; no other opens the page.

    Parameters
    ----------
    machine : Machine
    parameters : sequence of Slider
        Of the model file.
    rebuilt : callable
        The robot with parameters by name, as they are written in a model file.
    wrench : (n,) array, optional
        Load at the beginning.
    port : int
        Where to listen; the next free one is taken where it is in use.
    """

    url: str

    def __init__(
        self,
        machine: Machine,
        parameters: Sequence[Slider] = (),
        rebuilt: Callable[[Mapping[str, str]], Any] | None = None,
        wrench: Sequence[float] | None = None,
        port: int = 8080,
    ) -> None:
        self._machine, self._rebuilt = machine, rebuilt
        self._written: dict[str, str] = {}
        self._changed, self._closing = threading.Event(), threading.Event()
        self._drawing = threading.Lock()
        self._server, self.url = guarded_server(port, machine.name)
        self._gui = self._server.gui
        start = np.zeros(machine.space.size) if wrench is None else wrench
        self._build(load_sliders(machine.space, list(start)), parameters)
        self.update()
        self._aim()
        self._worker = threading.Thread(target=self._follow, daemon=True)
        self._worker.start()

    def close(self) -> None:
        """Stop serving."""
        self._closing.set()
        self._changed.set()
        self._worker.join()
        with redirect_stdout(StringIO()):
            self._server.stop()

    def wait(self) -> None:
        """Wait until it is closed, or interrupted."""
        while not self._closing.wait(0.5):
            pass

    def move(self, name: str, value: float) -> None:
        """Move a slider to a value in its own unit; the picture follows."""
        self._handles[name].value = value
        self._changed.set()

    def update(self) -> ShownAnswer:
        """Compute and draw where the sliders are now."""
        with self._drawing:
            try:
                answer = self._answer()
                self._draw(answer)
            except Exception as error:  # what is shown must never be of another pose
                if not isinstance(error, RobostiffError | np.linalg.LinAlgError):
                    _LOG.exception("the view of %r", self._machine.name)
                answer = ShownAnswer("no answer", "bad", (str(error),))
                self._draw(answer)
        return answer

    def _answer(self) -> ShownAnswer:
        values = {s.name: s.factor * self._value(s) for s in self._of_pose}
        wrench = np.array([self._value(slider) for slider in self._of_load])
        of_parameters = [(s, self._value(s)) for s in self._of_parameters]
        written = {
            slider.name: f"{value!r} {slider.unit}".strip()
            for slider, value in of_parameters
            if value != slider.start
        }
        if written != self._written and self._rebuilt is not None:
            self._machine = self._machine.like(self._rebuilt(written))
            self._written = written
        exaggeration = None
        if not self._automatic.value:
            exaggeration = min(_MOST, max(0.0, float(self._exaggeration.value)))
        seen = frozenset(name for name, box in self._seen.items() if box.value)
        return self._machine.answer(values, wrench, Look(exaggeration, seen))

    def _value(self, slider: Slider) -> float:
        """Where a slider is, within its ends: a page may send any number, and NaN."""
        return min(slider.high, max(slider.low, float(self._handles[slider.key].value)))

    def _draw(self, answer: ShownAnswer) -> None:
        seen = {name: answer.layers[name] for name in answer.layers if self._seen[name].value}
        with self._server.atomic():
            self._scene.show(seen)
            self._head.content = _framed(answer.head)
            self._stiffness.content = _framed(answer.stiffness or f"<p>{_EMPTY}</p>")
            missing = f"<p>{_NO_LOAD}</p>" if answer.layers else ""
            self._load.content = _framed(answer.load or missing)

    def _follow(self) -> None:
        """Draw the latest values; those that came while it was computing are passed over."""
        while True:
            self._changed.wait()
            self._changed.clear()
            if self._closing.is_set():
                return
            try:
                self.update()
            except Exception:  # the next values may be drawn
                _LOG.exception("the view of %r", self._machine.name)

    def _build(self, of_load: Sequence[Slider], of_parameters: Sequence[Slider]) -> None:
        gui, machine = self._gui, self._machine
        self._of_pose, self._of_load = machine.sliders, tuple(of_load)
        self._of_parameters = tuple(of_parameters)
        self._handles: dict[str, Any] = {}
        gui.configure_theme(show_logo=False, show_share_button=False)
        flat = machine.space is Space.PLANAR
        self._scene = LayeredScene(self._server.scene, machine.size, is_flat=flat)
        tables = gui.add_panel()
        with tables.add_tab("Results"):
            self._stiffness = gui.add_html("")
            self._load = gui.add_html("")
        tables.dock_left()
        tables.set_width(_WIDE)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(_NARROW)
        self._head = gui.add_html("")
        if machine.sliders:
            with gui.add_folder("Pose"):
                self._add(machine.sliders)
                self._add_reset("home", machine.sliders)
        with gui.add_folder("Load on the platform"):
            self._add(of_load)
            self._add_reset("no load", of_load, 0.0)
            self._automatic = gui.add_checkbox("automatic scale", initial_value=True)
            self._exaggeration = gui.add_number(
                "displacements ×", 1000.0, min=0.0, max=_MOST, visible=False
            )
            self._automatic.on_update(self._let_scale)
            for handle in (self._automatic, self._exaggeration):
                self._watch(handle)
        if of_parameters:
            with gui.add_folder("Parameters", expand_by_default=False):
                self._add(of_parameters)
                self._add_reset("as in the file", of_parameters)
        with gui.add_folder("Picture", expand_by_default=False):
            self._seen = {name: gui.add_checkbox(name, seen) for name, seen in LAYERS.items()}
            for handle in self._seen.values():
                self._watch(handle)

    def _add(self, sliders: Sequence[Slider]) -> None:
        for slider in sliders:
            handle = self._gui.add_slider(
                slider.label, slider.low, slider.high, slider.step, slider.start
            )
            self._handles[slider.key] = handle
            self._watch(handle)

    def _add_reset(self, label: str, sliders: Sequence[Slider], to: float | None = None) -> None:
        def reset(_: Any) -> None:
            for slider in sliders:
                self._handles[slider.key].value = slider.start if to is None else to

        self._gui.add_button(label).on_click(reset)

    def _watch(self, handle: Any) -> None:
        handle.on_update(lambda _: self._changed.set())

    def _let_scale(self, _: Any) -> None:
        if not self._automatic.value:
            self._exaggeration.value = min(_MOST, self._machine.exaggeration)
        self._exaggeration.visible = not self._automatic.value

    def _aim(self) -> None:
        """A grid below the robot, and a view of all of it."""
        low, high = self._machine.box
        middle, size = 0.5 * (low + high), self._machine.size
        scene, camera = self._server.scene, self._server.initial_camera
        scene.configure_default_lights(cast_shadow=False)
        cell = 10.0 ** np.floor(np.log10(size / 2))
        wide = 2 * float(np.ceil(size / cell)) * cell
        floor = (*np.round(middle[:2] / cell) * cell, float(low[2]))
        scene.add_grid(
            "/grid",
            wide,
            wide,
            cell_size=cell,
            section_size=5 * cell,
            cell_color=(232, 232, 232),
            section_color=(200, 200, 200),
            position=floor,
        )
        scene.add_frame("/world", axes_length=0.08 * size, axes_radius=0.002 * size)
        if self._machine.space is Space.PLANAR:
            scene.set_up_direction("+y")
            camera.up = (0.0, 1.0, 0.0)
            camera.position = tuple(middle + np.array([0.0, -1e-3 * size, 1.3 * size]))
        else:
            camera.position = tuple(middle + size * np.array([0.75, -1.0, 0.55]))
        camera.look_at = tuple(middle)
        self._server.on_client_connect(see_all)


def see_all(client: Any) -> None:
    """Move the camera away where the panels of a narrow window leave too little of the robot."""
    width = 1.0  # of the picture, beside what a robot needs; 1 where there is enough

    def step_back(camera: Any) -> None:
        nonlocal width
        before, width = width, min(1.0, camera.aspect / _NEEDED)
        if width != before:
            middle = np.array(camera.look_at)
            camera.position = middle + (camera.position - middle) * before / width

    client.camera.on_update(step_back)


_STYLE = """<style>
.robostiff {font-size: 0.76rem; line-height: 1.35; padding: 0.2em 0.7em; overflow-x: auto}
.robostiff table {border-collapse: collapse}
.robostiff th, .robostiff td {padding: 0.1em 0.35em !important; text-align: left}
.robostiff td.number {text-align: right}
.robostiff ul {margin: 0.3em 0; padding-left: 1.2em}
.robostiff .advice {background: #fff4e0; color: #5a3000; border-left: 3px solid #b86a00;
  padding: 0.1em 0.5em}
.robostiff .quiet {opacity: 0.75}
</style>"""


def _framed(html: str) -> str:
    return _STYLE + element("div", html, class_="robostiff")
