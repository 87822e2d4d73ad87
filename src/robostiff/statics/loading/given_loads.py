"""What is given beside the wrench: forces, masses, gravity, and force laws of joints."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError, Words
from robostiff.frozen import field, frozen, replace
from robostiff.model import ForceLaw, Mass, PlacedMass, Robot, Snapshot, gravity_vector
from robostiff.model.cable import Weight
from robostiff.network import Network
from robostiff.network.assembly import unknown_name
from robostiff.spatial import Space, as_float, as_floats
from robostiff.statics.chains.beam_bowing import Beams, Bowing, Division
from robostiff.statics.equations.problem import DeadForces

Loads = Mapping[str, Any]
Masses = Mapping[str, Any]
_BOWING = Bowing()
Laws = Mapping[str, ForceLaw]
Gravity = ArrayLike | str | None
Frame = tuple[np.ndarray, np.ndarray]
FrameOf = Callable[[str], Frame | None]
_NONE = np.zeros(3)
# Attributes of machines and of parts that list their parts.
_PARTS = ("legs", "elements", "beams", "springs", "branches", "nodes", "connections", "parts")
# Of the stiffness of a drive: how far that of its law without motion may be off.
_ALIKE = 1e-6


@frozen
class StandingLoads:
    """What acts beside the wrench, and on what beams; as for `equilibrium`."""

    loads: Loads | None = None
    gravity: Gravity = None
    preload: Mapping[str, Any] | None = None
    beams: Beams = _BOWING

    @property
    def given(self) -> dict[str, Any]:
        """As arguments of `equilibrium`."""
        return {name: getattr(self, name) for name in ("loads", "gravity", "preload", "beams")}


@frozen
class Acting(StandingLoads):
    """The same, with the point of the wrench, and how beams are divided.

    Joints follow the laws of the robot, and these beside them, unless `laws` is None.
    """

    at: ArrayLike | None = None
    laws: Laws | None = None
    division: Division = field(default_factory=Division)


@frozen
class DeadForce:
    """A force that keeps its direction in the world, at a point of a body of the robot.

    Attributes
    ----------
    force : (3,) array
        In world axes [N].
    point : (3,) array or None
        Where it acts at the unloaded posture, in the world [m]; None for the place of the part
        that names the body: the end of a link, the first freedom of a joint; of the platform the
        reference point.

    Examples
    --------
    >>> DeadForce([0, 0, -120]).point is None
    True
    """

    force: Any
    point: Any = None


def comparable_gravity(robot: Robot, gravity: Gravity) -> str | tuple[float, ...] | None:
    """Gravity as it is given: none, the name of an axis, or numbers compared by their values."""
    if gravity is None or isinstance(gravity, str):
        return gravity
    return tuple(acting_gravity(robot.numeric, gravity).tolist())


def acting_gravity(
    robot: Robot | Snapshot | Network, gravity: Gravity, loads: Loads | None = None
) -> np.ndarray:
    """Acceleration of free fall (3,) [m/s^2]: as given, or as the robot has it, or none.

    It pulls at the masses of the robot, and at those among the loads.

    Raises
    ------
    InputError
        When it is given for a robot without masses, or is no vector.
    """
    if gravity is None:
        of_robot = getattr(getattr(robot, "in_floats", robot), "gravity", None)
        return _NONE if of_robot is None else of_robot
    pull = gravity_vector("gravity", gravity)
    several = [x if isinstance(x, Sequence) else (x,) for x in (loads or {}).values()]
    if any(isinstance(one, Mass) for group in several for one in group):
        return pull
    if np.any(pull) and not has_masses(robot):
        raise InputError(
            f"gravity on {robot.name!r}",
            got=Words("a robot without masses"),
            expected="masses of its parts: mass: in the file, or a density of materials",
            hint='or weights as loads: loads={"platform": rs.Mass(12)}, --weight "platform=12 kg"',
        )
    return pull


def has_masses(machine: Any) -> bool:
    """Whether a machine, or any part of one, has a mass, or a material with a density."""
    masses = getattr(machine, "masses", ())
    several = masses.values() if isinstance(masses, Mapping) else (masses,)
    density = getattr(getattr(machine, "material", None), "density", None)
    known = (getattr(machine, "mass", None), density)
    if any(several) or getattr(machine, "platform_masses", ()) or any(x is not None for x in known):
        return True
    inner = [part for name in _PARTS for part in getattr(machine, name, ())]
    inner += [getattr(machine, name, None) for name in ("chain", "element", "platform")]
    return any(has_masses(part) for part in inner if part is not None)


def given_forces(
    loads: Loads | None, gravity: np.ndarray, space: Space, frame_of: FrameOf
) -> dict[str, tuple[DeadForce, ...]]:
    """Forces by the names of bodies; masses are pulled by gravity, or down where there is none.

    Parameters
    ----------
    loads : mapping of str to force, DeadForce, Mass, Weight or a sequence of them
    gravity : (3,) array
        [m/s^2].
    space : Space
        Down is -z, and -y of a planar robot.
    frame_of : callable
        Axes (3, 3) and origin (3,) of a body in the world by its name [m]; None of one without.

    Raises
    ------
    InputError
        When one is neither, or is in a frame that is not known.
    """
    down = gravity
    if not np.any(gravity):
        down = gravity_vector("gravity", "-y" if space is Space.PLANAR else "-z")
    found: dict[str, tuple[DeadForce, ...]] = {}
    for name, value in (loads or {}).items():
        for load in each_load(name, value):
            if isinstance(load, Mass):
                force, at = down * load.value, _place(name, load, frame_of)
            elif isinstance(load, DeadForce):
                at = None if load.point is None else load_vector("point", name, load.point)
                force = load_vector("force", name, load.force)
            else:
                force, at = load.force, _in_frame(name, load.point, frame_of)
            found[name] = (*found.get(name, ()), DeadForce(force, at))
    return found


def each_load(name: str, value: Any) -> tuple[DeadForce | Mass | Weight, ...]:
    """The loads on a body, as they were given: one, several, or a force (3,) [N]."""
    kinds = (DeadForce, Mass, Weight)
    several = [value] if isinstance(value, kinds) else value
    if isinstance(several, Sequence) and several and all(isinstance(v, kinds) for v in several):
        return tuple(several)
    return (DeadForce(load_vector("force", name, value)),)


def on_platform(forces: Sequence[DeadForce], point: np.ndarray) -> DeadForces:
    """Forces on the platform, about a point of it (3,) [m], of numbers or of entries."""
    force = np.zeros(3, dtype=int).astype(point.dtype)
    levers = np.outer(force, force)
    for load in forces:
        force = force + load.force
        if load.point is not None:
            levers = levers + np.outer(load.point - point, load.force)
    return DeadForces(force, levers)


def _place(name: str, mass: Mass, frame_of: FrameOf) -> np.ndarray | None:
    """Where a given mass is in the world (3,) [m]; None for the place of its part."""
    if mass.centre is None:
        return None if mass.point is None else load_vector("point", name, mass.point)
    return _in_frame(name, load_vector("centre", name, mass.centre), frame_of)


def _in_frame(name: str, point: Any, frame_of: FrameOf) -> np.ndarray:
    """A point of the frame of a body in the world (3,) [m]."""
    frame = frame_of(name)
    if frame is None:
        raise InputError(
            f"centre of the load on {name!r}",
            got=Words("a body whose frame is not known, such as those of a snapshot"),
            expected="its place in the world at the unloaded posture [m]",
            hint="write rs.Mass(12, point=[0.3, 0, 0.5]), or rs.DeadForce(force, point); a Robot "
            "has the frames of its bodies",
        )
    R, p = frame
    return p + R @ np.asarray(point, dtype=float)


def load_vector(what: str, name: str, value: object) -> np.ndarray:
    """Force [N] or point [m] of a load on a body (3,)."""
    units = "N" if what == "force" else "m"
    subject = f"{what} of the load on {name!r}"
    return as_floats(subject, value, f"three numbers [{units}]", units, (3,))


def given_masses(
    masses: Masses, places: Mapping[str, np.ndarray], frame_of: FrameOf
) -> dict[str, list[PlacedMass]]:
    """Masses in the world by the names of bodies, those with an inertia as six.

    Parameters
    ----------
    masses : mapping of str to float, Mass or a sequence of them
    places : mapping of str to (3,) arrays
        Of a mass without a place of its own, by name [m].
    frame_of : callable
        As of `given_forces`.

    Raises
    ------
    InputError
        When one is not more than zero, or is in a frame that is not known.
    """
    found: dict[str, list[PlacedMass]] = {}
    for name, value in masses.items():
        subject, expected = f"mass of {name!r}", "more than zero [kg], or a Mass"
        are_several = isinstance(value, Sequence) and not isinstance(value, str | bytes)
        for one in value if are_several else (value,):
            mass = as_float(subject, one.value if isinstance(one, Mass) else one, expected, "kg")
            if not (np.isfinite(mass) and mass > 0):
                raise InputError(subject, got=mass, expected=expected)
            given = one if isinstance(one, Mass) else Mass(mass, name=name)
            centre, frame = _place(name, given, frame_of), frame_of(name)
            centre = places.get(name, np.zeros(3)) if centre is None else centre
            R = np.eye(3) if frame is None or given.point is not None else frame[0]
            bare = replace(given, centre=None, point=None, span=None)
            found.setdefault(name, []).extend(bare.placed(name, R, centre))
    return found


def check_own_laws(laws: Laws, snapshot: Snapshot) -> None:
    """Raise unless the laws of a robot go with the stiffness of its joints.

    Raises
    ------
    InputError
        When a name is no joint, or a law has another stiffness without motion than its drive.
    """
    joints = {f"{leg.name}/{joint.name}": joint for leg in snapshot.legs for joint in leg.freedoms}
    for name, law in laws.items():
        joint = joints.get(name)
        if joint is None:
            raise unknown_name("laws", name, joints, "leg/joint")
        k = 0.0 if joint.stiffness is None else float(joint.stiffness)
        slope = law.tangent(0.0)
        if abs(slope - k) > _ALIKE * max(abs(slope), abs(k)):
            raise InputError(
                f"law of {name!r}",
                got=Words(f"a slope of {slope:.8g} without motion"),
                expected="the stiffness of its drive, " + (f"{k:.8g}" if k else "which is rigid"),
                hint=f"small loads meet that of the drive: write stiffness: {slope:.8g} there",
            )
