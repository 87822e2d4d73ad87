"""The command ``view``, after parsing."""

from __future__ import annotations

import webbrowser
from collections.abc import Mapping
from contextlib import closing, suppress
from typing import Any

from robostiff.cli.options import Model, Place
from robostiff.cli.output import show
from robostiff.cli.picture_commands import Page
from robostiff.cli.written_arguments import loaded, pose_from, wrench_from
from robostiff.view import LivePage, machine_of, parameter_sliders, parameters_written


def show_view(model: Model, place: Place, page: Page) -> int:
    """Serve a view until it is interrupted; 0 then."""
    source, given = model.source, model.parameters

    def built(moved: Mapping[str, str]) -> Any:
        return loaded(model, moved=moved)

    robot = built({})
    machine = machine_of(robot, pose_from(robot, place))
    wrench = None if page.wrench is None else wrench_from(page.wrench, machine.space)
    written = {**parameters_written(source, model.side), **given} if source != "-" else {}
    live = LivePage(machine, parameter_sliders(written), built, wrench, page.port)
    with closing(live), suppress(KeyboardInterrupt):
        show(f"{live.url}\nCtrl-C ends the view.")
        if not page.no_browser:
            webbrowser.open(live.url)
        live.wait()
    return 0
