"""Names of bodies, sites and joints of a MuJoCo model, made different from each other."""

from __future__ import annotations

from robostiff.io.mjcf.compiled import CompiledModel


class Names:
    """A name for every body, site and joint; those without one are numbered.

    Bodies and sites both become links, so that a site called like a body is ``NAME site``.

    Attributes
    ----------
    bodies, sites, joints : list of str
    """

    def __init__(self, model: CompiledModel) -> None:
        links: set[str] = set()
        self.bodies = [_name(own, f"body{i}", links) for i, own in enumerate(model.bodies)]
        self.sites = [
            _name(own, f"site{i + 1}", links, " site") for i, own in enumerate(model.sites)
        ]
        joints: set[str] = set()
        self.joints = [
            _name(own, self._unnamed(model, i), joints) for i, own in enumerate(model.joints)
        ]

    def _unnamed(self, model: CompiledModel, joint: int) -> str:
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
