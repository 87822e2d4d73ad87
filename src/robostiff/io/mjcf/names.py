"""Names of bodies, sites and joints of a MuJoCo model, made different from each other."""

from __future__ import annotations

from typing import Any


class Names:
    """A name for every body, site and joint; those without one are numbered.

    Bodies and sites both become links, so that a site called like a body is ``NAME site``.

    Attributes
    ----------
    bodies, sites, joints : list of str
    """

    def __init__(self, model: Any) -> None:
        links: set[str] = set()
        self.bodies = [_name(model.body(i).name, f"body{i}", links) for i in range(model.nbody)]
        self.sites = [
            _name(model.site(i).name, f"site{i + 1}", links, " site") for i in range(model.nsite)
        ]
        joints: set[str] = set()
        self.joints = [
            _name(model.joint(i).name, self._unnamed(model, i), joints) for i in range(model.njnt)
        ]

    def _unnamed(self, model: Any, joint: int) -> str:
        return f"joint of {self.bodies[int(model.jnt_bodyid[joint])]}"


def _name(own: str, otherwise: str, taken: set[str], ending: str = "") -> str:
    wanted = own or otherwise
    if wanted in taken:
        wanted += ending
    name, number = wanted, 2
    while name in taken:
        name, number = f"{wanted} {number}", number + 1
    taken.add(name)
    return name
