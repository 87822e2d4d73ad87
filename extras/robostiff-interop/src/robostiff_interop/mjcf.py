"""Trees of rigid links, joint by joint, from what MuJoCo makes of an MJCF file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from robostiff.errors import FileError, Location, Words
from robostiff.io.rigid_tree import (
    JointType,
    Mimic,
    RigidTree,
    TreeJoint,
    TreeLoop,
    mass_of_body,
    question_place,
    warn_of_parts_not_read,
)
from robostiff.model import Actuated, Passive, Role, spherical
from robostiff.spatial import Frame
from robostiff_interop.compiled_model import (
    AFFINE,
    NOTHING,
    ON_JOINTS,
    CompiledModel,
    compiled_model,
    read_model,
)


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
    """

    bodies: list[str]
    sites: list[str]
    joints: list[str]

    def __init__(self, model: CompiledModel) -> None:
        links: set[str] = set()
        self.bodies = [_name(own, f"body{i}", links) for i, own in enumerate(model.bodies)]
        self.sites = [
            _name(own, f"site{i + 1}", links, " site") for i, own in enumerate(model.sites)
        ]
        joints: set[str] = set()
        self.joints = [
            _name(own, f"joint of {self.bodies[int(model.jnt_bodyid[i])]}", joints)
            for i, own in enumerate(model.joints)
        ]


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
_LOOPS = {_CONNECT: "connect", _WELD: "weld"}
_SITE = 6  # mjOBJ_SITE


def read_equalities(
    model: CompiledModel, names: ElementNames, drives: Mapping[int, float], file: str
) -> tuple[tuple[TreeLoop, ...], dict[str, Mimic]]:
    """Loops, and for each joint that follows another one how it does.

    Constraints that are not active are left out. A joint without a drive follows one that has one.
    """
    loops: list[TreeLoop] = []
    mimics: dict[str, Mimic] = {}
    taken = set(names.joints)
    for i, name in enumerate(model.equalities):
        if not model.eq_active0[i]:
            continue
        kind = int(model.eq_type[i])
        if kind in _LOOPS:
            own = _name(name, f"{_LOOPS[kind]}{i + 1}", taken, " loop")
            loops.append(_loop(model, names, i, own, kind))
        elif kind == _JOINT:
            follower, mimic = _joint(model, names, drives, i, file)
            if follower in mimics:
                raise FileError(
                    Location(file),
                    f"joint {follower!r}",
                    got=Words(
                        f"a joint that follows {mimics[follower].joint!r} and {mimic.joint!r}"
                    ),
                    expected="one joint that it follows; the other may follow it",
                )
            mimics[follower] = mimic
        else:
            raise FileError(
                Location(file),
                f"equality {name or i + 1}",
                got=Words("a constraint on tendons or deformable parts"),
                expected="connect, weld or joint",
            )
    return tuple(loops), mimics


def _at(point: np.ndarray) -> Frame:
    return Frame(np.eye(3), np.array(point, dtype=float))


def _loop(model: CompiledModel, names: ElementNames, i: int, name: str, kind: int) -> TreeLoop:
    """What coincides: origins (connect) or frames (weld) of two sites, or frames on two bodies."""
    frames, data = (Frame.identity(), Frame.identity()), model.eq_data[i]
    of_bodies = int(model.eq_objtype[i]) != _SITE
    if of_bodies and kind == _CONNECT:  # a point of each body
        frames = (_at(data[0:3]), _at(data[3:6]))
    elif of_bodies:  # a point of the second body, and that with the second's axes in the first
        frames = (frame_of(data[3:6], data[6:10]), _at(data[0:3]))
    turns = kind == _CONNECT or data[10] == 0  # a weld whose torques are scaled to nothing
    element = spherical(Passive(), name=name) if turns else None
    known = names.bodies if of_bodies else names.sites
    links = known[int(model.eq_obj1id[i])], known[int(model.eq_obj2id[i])]
    return TreeLoop(name, links, frames, element)


def _joint(
    model: CompiledModel, names: ElementNames, drives: Mapping[int, float], i: int, file: str
) -> tuple[str, Mimic]:
    """A joint that is a polynomial of another one, about their reference coordinates."""
    follower, leader = int(model.eq_obj1id[i]), int(model.eq_obj2id[i])
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
    offset += start - factor * float(model.qpos0[model.jnt_qposadr[leader]])
    if factor and follower in drives and leader not in drives:
        follower, leader, factor, offset = leader, follower, 1 / factor, -offset / factor
    return names.joints[follower], Mimic(names.joints[leader], factor, offset)


_FREE, _BALL, _SLIDE, _HINGE = range(4)
_TYPES = {
    _FREE: JointType.FLOATING,
    _BALL: JointType.SPHERICAL,
    _SLIDE: JointType.PRISMATIC,
    _HINGE: JointType.REVOLUTE,
}
_ONE_AXIS = (JointType.REVOLUTE, JointType.PRISMATIC)


def read_mjcf(source: Path | str) -> RigidTree:
    """Read an MJCF file.

    Bodies and sites become links. Of several joints of one body, all but the last hang on links of
    their own, ``BODY before JOINT``. A joint with an actuator is actuated, with the stiffness
    ``kp gear^2`` of its position servos; one with a stiffness has a spring beside it; any other is
    passive. ``connect``, ``weld`` and ``joint`` equalities become loops and joints that follow
    others.

    Parameters
    ----------
    source : path or str

    Raises
    ------
    FileError
        When it cannot be read, or holds what has no counterpart here.
    InputError
        When mujoco is not installed.
    """
    return _tree(compiled_model(source), source)


def tree_of_mujoco(model: Any) -> RigidTree:
    """The tree of an ``mujoco.MjModel``, as `read_mjcf` makes it of a file.

    Raises
    ------
    FileError
        When it holds what has no counterpart here.
    """
    read = read_model(model)
    return _tree(read, f"model of MuJoCo {read.name!r}")


def _tree(model: CompiledModel, source: Path | str) -> RigidTree:
    names = ElementNames(model)
    drives = _drives(model, names, str(source))
    loops, mimics = read_equalities(model, names, drives, str(source))
    joints: list[TreeJoint] = []
    for body in range(1, len(model.bodies)):
        joints += _joints_of_body(model, names, body, mimics, drives, str(source))
    for site, name in enumerate(names.sites):
        seen = frame_of(model.site_pos[site], model.site_quat[site])
        joints.append(_fixed(name, names.bodies[int(model.site_bodyid[site])], seen))
    links = [names.bodies[0], *(joint.child for joint in joints)]
    masses = {}  # as MuJoCo has them of what is written or of their shapes
    for i, name in enumerate(names.bodies):
        seen = frame_of(model.body_ipos[i], model.body_iquat[i])
        moments = np.where(model.body_inertia[i] > NOTHING, model.body_inertia[i], 0.0)
        if i and model.body_mass[i] > NOTHING:
            inertia, place = seen.R @ np.diag(moments) @ seen.R.T, Location(str(source))
            mass = mass_of_body(name, float(model.body_mass[i]), seen.p, inertia, place)
            masses |= {} if mass is None else {name: mass}
    return RigidTree(
        name=Path(source).stem if model.name in ("", "MuJoCo Model") else model.name,
        file=str(source),
        links=tuple(links),
        joints=tuple(joints),
        loops=loops,
        masses=masses,
        keyframes=tuple(key or "without a name" for key in model.keyframes),
    )


def _joints_of_body(
    model: CompiledModel,
    names: ElementNames,
    body: int,
    mimics: dict[str, Mimic],
    drives: dict[int, float],
    file: str,
) -> list[TreeJoint]:
    """The joint, joints or weld by which a body is connected to its parent."""
    name, parent = names.bodies[body], names.bodies[int(model.body_parentid[body])]
    question_place(np.abs(model.body_pos[body]), Location(file, path=f"body {name}"))
    drawn = frame_of(model.body_pos[body], model.body_quat[body])
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    if count == 0:
        return [_fixed(name, parent, drawn)]
    joints = []
    for i in range(first, first + count):
        own = names.joints[i]
        last = i == first + count - 1
        child = name if last else f"{name} before {names.joints[i + 1]}"
        kind = _TYPES[int(model.jnt_type[i])]
        anchor = _at(model.jnt_pos[i])
        if kind is JointType.FLOATING:
            anchor = Frame.identity()
        axis = np.array(model.jnt_axis[i], dtype=float)
        home = float(model.qpos0[model.jnt_qposadr[i]]) if kind in _ONE_AXIS else 0.0
        back = Frame.identity()  # to zero from the reference coordinate, where it is described
        if kind is JointType.REVOLUTE:
            back = Frame(Rotation.from_rotvec(-home * axis).as_matrix(), np.zeros(3))
        elif kind is JointType.PRISMATIC:
            back = _at(-home * axis)
        joints.append(
            TreeJoint(
                name=own,
                type=kind,
                parent=parent,
                child=child,
                before=drawn @ anchor @ back,
                axis=axis,
                after=anchor.inverse,
                role=_role(model, i, drives),
                spring=float(model.jnt_stiffness[i]) * (kind is not JointType.FLOATING),
                inertia=float(model.dof_armature[model.jnt_dofadr[i]]),
                home=home,
                mimic=mimics.get(own),
            )
        )
        parent, drawn = child, Frame.identity()
    return joints


def _drives(model: CompiledModel, names: ElementNames, file: str) -> dict[int, float]:
    """For each driven joint the stiffness of its position servos, 0 for none; warns of others.

    The force of a servo is ``gear (gain u + b_0 + b_1 l)`` with the length ``l = gear q``.
    """
    drives, unread = dict[int, float](), dict[str, list[str]]()
    for i, kind in enumerate(model.actuator_trntype):
        if kind not in ON_JOINTS:
            continue
        joint = int(model.actuator_trnid[i][0])
        is_servo = model.actuator_biastype[i] == AFFINE
        k = -float(model.actuator_biasprm[i][1] * model.actuator_gear[i][0] ** 2) * is_servo
        turns_once = _TYPES[int(model.jnt_type[joint])] in _ONE_AXIS
        if k < 0 or (k > 0 and not turns_once):
            what = "drives of negative stiffness" if turns_once else "servos of ball or free joints"
            unread.setdefault(what, []).append(names.joints[joint])
            k = 0.0
        drives[joint] = drives.get(joint, 0.0) + k
    for i, name in enumerate(names.joints):
        start, kind = int(model.jnt_qposadr[i]), _TYPES[int(model.jnt_type[i])]
        if np.any(model.jnt_stiffnesspoly[i]):
            unread.setdefault("the powers of the deflection of springs", []).append(name)
        if not model.jnt_stiffness[i]:
            if model.dof_armature[model.jnt_dofadr[i]] and i not in drives:
                unread.setdefault("the armature of joints without a drive,", []).append(name)
            continue
        if kind is JointType.FLOATING:
            unread.setdefault("springs of free joints", []).append(name)
        elif kind in _ONE_AXIS and model.qpos0[start] != model.qpos_spring[start]:
            unread.setdefault("the load at home of springs with a springref,", []).append(name)
    place = Location(file)
    warn_of_parts_not_read({kind: [(n, place) for n in found] for kind, found in unread.items()})
    return drives


def _role(model: CompiledModel, joint: int, drives: dict[int, float]) -> Role:
    if joint not in drives:
        return Passive()
    limits = None
    if model.jnt_limited[joint]:
        low, high = (float(value) for value in model.jnt_range[joint])
        one_axis = _TYPES[int(model.jnt_type[joint])] in _ONE_AXIS
        limits = (low, high) if low < high and one_axis else None
    return Actuated(drives[joint] or None, limits)


def _fixed(child: str, parent: str, frame: Frame) -> TreeJoint:
    return TreeJoint(f"{child} on {parent}", JointType.FIXED, parent, child, frame, np.zeros(3))
