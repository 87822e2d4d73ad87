"""The command ``view``."""

from __future__ import annotations

import webbrowser
from collections.abc import Mapping
from contextlib import closing, suppress
from typing import Any

import click

from robostiff.cli import Answer, Command, Model, Posing, group, option, wrench_option


class View(Command, name="view"):
    """Show a robot in the browser, with sliders for its pose, its parameters and a load.

    Stiffness, ellipsoids, free motions, deflection and elastic energy follow the sliders. Only
    this computer can open the page. Ctrl-C ends it.

    $ view hexapod --wrench "500 N 0 0 0 0 0"

    Exit status: 0 when it is ended, 1 when given joints are out of reach, 2 for bad input.
    """

    model: Model = group(Model)
    place: Posing = group(Posing, "pose", "joints")
    wrench: str | None = wrench_option("Load on the platform at the beginning")
    port: int = option(
        "--port",
        metavar="NUMBER",
        type=click.IntRange(1, 65535),
        default=8080,
        help="Where to listen on this computer, from 1 to 65535; the next free port is taken where "
        "it is in use.",
    )
    no_browser: bool = option("--no-browser", help="Print the address, and open no browser.")
    answer: Answer = group(Answer, "as_json")

    def run(self) -> int:
        """Serve a view until it is interrupted; 0 then."""
        from robostiff.cli import load_machine, pose, show, wrench
        from robostiff_view import LivePage, machine_of, parameter_sliders, parameters_written

        model = self.model
        source, given = model.source, model.parameters

        def built(moved: Mapping[str, str]) -> Any:
            return load_machine(model, moved=moved)

        robot = built({})
        machine = machine_of(robot, pose(robot, self.place))
        load = wrench(self.wrench, machine.space)
        written = {**parameters_written(source, model.side), **given} if source != "-" else {}
        live = LivePage(machine, parameter_sliders(written), built, load, self.port)
        with closing(live), suppress(KeyboardInterrupt):
            show({"url": live.url} if self.answer.as_json else f"{live.url}\nCtrl-C ends the view.")
            if not self.no_browser:
                webbrowser.open(live.url)
            live.wait()
        return 0
