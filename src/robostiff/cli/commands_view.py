"""The command ``view``, after parsing."""

from __future__ import annotations

import webbrowser
from collections.abc import Mapping
from contextlib import closing, suppress
from typing import Any

from robostiff.cli.options import Model, Place
from robostiff.cli.output import say
from robostiff.cli.picture_commands import Page
from robostiff.cli.written_arguments import pose_from, wrench_from
from robostiff.linkage import Linkage
from robostiff.robots import shipped_linkages
from robostiff.view import LivePage, machine_of, parameter_sliders, parameters_written


def show_view(model: Model, place: Place, page: Page) -> int:
    """Serve a view until it is interrupted; 0 then."""
    source, given = model.source, model.parameters

    def built(moved: Mapping[str, str]) -> Any:
        if source in shipped_linkages():
            return _linkage(source, {**given, **moved})
        return model.load(moved)

    robot = built({})
    pose = None if isinstance(robot, Linkage) else pose_from(robot, place)
    machine = machine_of(robot, pose)
    wrench = None if page.wrench is None else wrench_from(page.wrench, machine.space)
    written = {**parameters_written(source, model.side), **given} if source != "-" else {}
    live = LivePage(machine, parameter_sliders(written), built, wrench, page.port)
    with closing(live), suppress(KeyboardInterrupt):
        say(f"{live.url}\nCtrl-C ends the view.")
        if not page.no_browser:
            webbrowser.open(live.url)
        live.wait()
    return 0


def _linkage(source: str, parameters: Mapping[str, str]) -> Linkage:
    from robostiff.robots.descriptions import load_linkage

    return load_linkage(source, parameters)
