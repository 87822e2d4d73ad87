"""Equality constraints of MuJoCo as loops, and as joints that follow others; frames and names."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from robostiff.errors import FileError, Location
from robostiff.io.mjcf.compiled import CompiledModel
from robostiff.io.rigid_tree.tree import JointType, Mimic, TreeLoop
from robostiff.io.suggest import Words
from robostiff.spatial import Frame


def frame_of(position: np.ndarray, quaternion: np.ndarray) -> Frame:
    """Frame from a position and a quaternion (w, x, y, z).

    Examples
    --------
    >>> frame_of(np.zeros(3), np.array([0.0, 0, 0, 1])).R @ [1, 0, 0]
    array([-1.,  0.,  0.])
    """
    w, x, y, z = (float(part) for part in quaternion)
    return Frame(Rotation.from_quat([x, y, z, w]).as_matrix(), np.array(position, dtype=float))


class ElementNames:
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


_CONNECT, _WELD, _JOINT = range(3)
_SITE = 6  # mjOBJ_SITE


def read_equalities(
    model: CompiledModel, names: ElementNames, file: str
) -> tuple[tuple[TreeLoop, ...], dict[str, Mimic]]:
    """Loops, and for each joint that follows another one how it does.

    Constraints that are not active are left out.

    Raises
    ------
    FileError
        For constraints that are no loops of rigid bodies.
    """
    loops: list[TreeLoop] = []
    mimics: dict[str, Mimic] = {}
    for i, name in enumerate(model.equalities):
        if not model.eq_active0[i]:
            continue
        kind = int(model.eq_type[i])
        if kind == _CONNECT:
            loops.append(_connect(model, names, i, name or f"connect{i + 1}"))
        elif kind == _WELD:
            loops.append(_weld(model, names, i, name or f"weld{i + 1}"))
        elif kind == _JOINT:
            follower, mimic = _joint(model, names, i, file)
            mimics[follower] = mimic
        else:
            raise FileError(
                Location(file),
                f"equality {name or i + 1}",
                got=Words("a constraint on tendons or deformable parts"),
                expected="connect, weld or joint",
            )
    return tuple(loops), mimics


def _links(model: CompiledModel, names: ElementNames, i: int) -> tuple[str, str]:
    known = names.sites if int(model.eq_objtype[i]) == _SITE else names.bodies
    return known[int(model.eq_obj1id[i])], known[int(model.eq_obj2id[i])]


def _at(point: np.ndarray) -> Frame:
    return Frame(np.eye(3), np.array(point, dtype=float))


def _connect(model: CompiledModel, names: ElementNames, i: int, name: str) -> TreeLoop:
    """A point of each of two bodies, or the origins of two sites, that coincide."""
    frames = (Frame.identity(), Frame.identity())
    if int(model.eq_objtype[i]) != _SITE:
        data = model.eq_data[i]
        frames = (_at(data[0:3]), _at(data[3:6]))
    return TreeLoop(name, JointType.SPHERICAL, _links(model, names, i), frames)


def _weld(model: CompiledModel, names: ElementNames, i: int, name: str) -> TreeLoop:
    """The pose of the second body in the first, or the frames of two sites, that coincide."""
    frames = (Frame.identity(), Frame.identity())
    if int(model.eq_objtype[i]) != _SITE:
        data = model.eq_data[i]
        frames = (frame_of(data[3:6], data[6:10]), Frame.identity())
    return TreeLoop(name, JointType.FIXED, _links(model, names, i), frames)


def _joint(model: CompiledModel, names: ElementNames, i: int, file: str) -> tuple[str, Mimic]:
    """A joint that is a polynomial of another one, about their reference coordinates."""
    follower = int(model.eq_obj1id[i])
    leader = int(model.eq_obj2id[i])
    offset, factor, *higher = (float(c) for c in model.eq_data[i][:5])
    if any(higher):
        raise FileError(
            Location(file),
            f"joint {names.joints[follower]!r}",
            got=Words("a polynomial of degree two or more of another joint"),
            expected="a linear one",
        )
    start = float(model.qpos0[model.jnt_qposadr[follower]])
    if leader < 0:  # held where it is
        return names.joints[follower], Mimic(names.joints[follower], 0.0, start + offset)
    start -= factor * float(model.qpos0[model.jnt_qposadr[leader]])
    return names.joints[follower], Mimic(names.joints[leader], factor, start + offset)
