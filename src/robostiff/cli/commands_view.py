"""The command ``view``, after parsing."""

from __future__ import annotations

import webbrowser
from collections.abc import Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from typing import Any

from robostiff.cli.output import say
from robostiff.cli.written_arguments import (
    PoseArguments,
    SideFile,
    parameters_from,
    pose_from,
    wrench_from,
)
from robostiff.linkage import Linkage
from robostiff.robots import load, shipped_linkages
from robostiff.view import LivePage, machine_of, parameter_sliders, parameters_written


@dataclass(frozen=True)
class Page:
    """Load at the beginning, port, and whether a browser is opened."""

    wrench: str | None
    port: int
    opens: bool


def show_view(
    source: str, place: PoseArguments, page: Page, settings: Sequence[str], side: SideFile
) -> int:
    """Serve a view until it is interrupted; 0 then."""
    given = parameters_from(settings)

    def built(moved: Mapping[str, str]) -> Any:
        if source in shipped_linkages():
            return _linkage(source, {**given, **moved})
        return load(source, {**given, **moved}, **side.options)

    robot = built({})
    pose = None if isinstance(robot, Linkage) else pose_from(robot, place)
    machine = machine_of(robot, pose)
    wrench = None if page.wrench is None else wrench_from(page.wrench, machine.space)
    written = {**parameters_written(source, side.file), **given} if source != "-" else {}
    live = LivePage(machine, parameter_sliders(written), built, wrench, page.port)
    with closing(live), suppress(KeyboardInterrupt):
        say(f"{live.url}\nCtrl-C ends the view.")
        if page.opens:
            webbrowser.open(live.url)
        live.wait()
    return 0


def _linkage(source: str, parameters: Mapping[str, str]) -> Linkage:
    from robostiff.robots.descriptions import load_linkage

    return load_linkage(source, parameters)
