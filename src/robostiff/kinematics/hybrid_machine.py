"""Hybrid machines: modules in series, each of them a robot or a chain of elements.

Modules in series add their compliances at the tool, and their free motions. The machine is a robot
of one leg in which every module of several legs is a parallel block, so that each way to a result
holds for it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robostiff.errors import InputError, Words
from robostiff.frozen import frozen, replace
from robostiff.kinematics.closure.loops import (
    determine_pose,
    fitting_coordinates,
    platform_mobility,
)
from robostiff.kinematics.frames import place_chain
from robostiff.kinematics.posture_finder import posture_finder
from robostiff.model import (
    Branch,
    Chain,
    Coordinate,
    Joint,
    Leg,
    ParallelBlock,
    Rigid,
    Robot,
    Telescope,
    with_entries,
)
from robostiff.model.chain import Element
from robostiff.spatial import Frame, Space, exact_number

_AT_HOME = 1e-9  # a coordinate that differs by less is the one that was given


@frozen
class Module:
    """A part of a hybrid machine, from one body to the next.

    Attributes
    ----------
    name : str
        Names of its parts begin with it: ``head/tilt``, ``tricept/strut1/telescope1``.
    part : Robot or Chain
        A robot leads from its world frame to its platform frame. A chain may be rigid, such as a
        tool, or elastic, such as a machine frame or a rail.
    mount : Frame or None
        Where the part begins, in the platform frame of the module before, or in the world for the
        first one; in its origin when left out.
    """

    name: str
    part: Robot | Chain
    mount: Frame | None = None

    def __post_init__(self) -> None:
        if not (isinstance(self.name, str) and self.name) or "/" in self.name:
            raise InputError("name of a module", got=self.name, expected="a text without /")
        robot, part = self.robot, self.part
        chains = [part] if isinstance(part, Chain) else [leg.chain for leg in part.legs]
        if any(chain.is_coupled for chain in chains):
            raise InputError(
                f"module {self.name!r}",
                got=Words("coupled joints"),
                expected="joints that move by themselves",
                hint="write the whole machine as a model file, with its couplings",
            )
        if robot is not None:
            robot.check_platform_is_rigid(f"module {self.name!r}: series of modules")
            robot.check_has_no_springs(f"module {self.name!r}: series of modules")
            if robot.laws:
                raise InputError(
                    f"module {self.name!r}",
                    got=Words(f"force laws of {', '.join(robot.laws)}"),
                    expected="drives with stiffnesses alone",
                    hint="give the laws to the machine: replace(machine, laws={...})",
                )
        if self.mount is not None:
            object.__setattr__(self, "mount", Frame.of(self.mount))

    @property
    def robot(self) -> Robot | None:
        """The part where it is a robot; None where it is a chain."""
        return None if isinstance(self.part, Chain) else self.part

    @property
    def begins_at(self) -> Frame:
        """Where it begins, in the frame in which the module before ends."""
        return Frame.identity() if self.mount is None else self.mount

    @property
    def is_posed_by_joints(self) -> bool:
        """Whether its joints alone say where it ends: no loop in it, and no home of a platform."""
        if isinstance(self.part, Chain):
            return not self.part.has_blocks
        return self.part.is_posed_by_joints


def hybrid_machine(
    modules: Sequence[Module],
    *,
    name: str = "machine",
    coordinates: Sequence[Coordinate] | None = None,
    reference_point: ArrayLike | None = None,
    gravity: Any = None,
    title: str = "",
    source: str = "",
) -> Robot:
    r"""Modules in series from base to tool, as a robot of one leg.

    A load on the tool acts on every module, so that compliances add at the tool point, ``C = \sum_i
    J_i C_i J_i^T`` with the transport J_i of twists from module i to the tool, and so do the
    motions that passive joints leave free. A wrench that one module does not transmit, the machine
    does not transmit. The legs of a module share a load with the least energy.

    Parameters
    ----------
    modules : sequence of Module
        From base to tool. Redundant axes, such as a rail under a hexapod, are admitted.
    name, title, source : str
    coordinates : sequence of Coordinate, optional
        Those of the tool pose that can be chosen. When left out, as many as the machine has
        freedoms at home; none where its joints alone pose it.
    reference_point : (3,) array, optional
        Point of the tool about which stiffness is given, in the platform frame of the last
        module [m]; that of the last module when left out.
    gravity : (3,) array or axis, optional
        In the world [m/s^2]; that of the first module when left out.

    Returns
    -------
    Robot
        It is posed by the tool, by `ActuatorCoordinates`, or by `ToolPose`.

    Raises
    ------
    InputError
        Without a module, for names that are not unique, for a flexible platform, for coordinates
        that do not determine the pose, or for a module that does not close at home.

    Examples
    --------
    >>> from robostiff.model import Actuated, revolute
    >>> from robostiff.robots import load
    >>> turn = revolute([0, 0, 1], Actuated(1e6), name="turn")
    >>> tool = Rigid(Frame(np.eye(3), np.array([0.0, 0.0, 0.15])), "tool")
    >>> head = Module("head", Chain((turn, tool)))
    >>> machine = hybrid_machine([Module("tripod", load("3-prs")), head])
    >>> machine.legs[0].chain.elements[1].name
    'head/turn'
    >>> [coordinate.value for coordinate in machine.coordinates]
    ['z', 'rx', 'ry', 'rz']
    """
    modules = tuple(modules)
    for i, module in enumerate(modules):
        if not isinstance(module, Module):
            raise InputError(f"modules[{i}]", got=module, expected="a Module(name, part, mount)")
    if not modules:
        raise InputError("modules", got=Words("none"), expected="at least one Module")
    names = [module.name for module in modules]
    if len(set(names)) < len(names):
        raise InputError("names of the modules", got=names, expected="each name once")
    robots = [module.robot for module in modules if module.robot is not None]
    first, *others = modules
    own_gravity = None if first.robot is None else first.robot.gravity
    own_gravity = None if own_gravity is None else first.begins_at.R @ own_gravity
    for module in others if gravity is None else ():
        if module.robot is not None and module.robot.gravity is not None:
            raise InputError(
                f"gravity of module {module.name!r}",
                got=module.robot.gravity,
                expected="none: it was given for the module by itself",
                hint="give the machine its own: hybrid_machine(..., gravity='-z')",
            )
    last, home = modules[-1].robot, Frame.identity()
    by_joints = all(module.is_posed_by_joints for module in modules)
    for module in () if by_joints else modules:
        home = home @ module.begins_at @ _end_at_home(module.part)
    elements = tuple(
        element
        for module in modules
        for element in _elements(module, carries_next=module is not modules[-1])
    )
    if reference_point is None:
        reference_point = np.zeros(3) if last is None else last.reference_point
    spaces = {own.robot.space for own in modules if own.robot is not None}
    robot = Robot(
        name,
        (Leg("machine", Frame.identity(), Chain(elements), Frame.identity()),),
        home=None if by_joints else home,
        reference_point=reference_point,  # pyright: ignore[reportArgumentType]
        coordinates=tuple(coordinates or ()),
        space=Space.PLANAR if spaces == {Space.PLANAR} else Space.SPATIAL,
        title=title,
        source=source,
        nominal=_nominal_values(modules),
        meanings={name: text for own in robots for name, text in own.meanings.items()},
        units={name: unit for own in robots for name, unit in own.units.items()},
        platform_masses=() if last is None else last.platform_masses,
        gravity=own_gravity if gravity is None else gravity,
    )
    if robot.has_formulas:
        robot = with_entries(robot, exact_number)
    return robot if by_joints else _with_coordinates(robot, chosen=coordinates is not None)


def modules_of(machine: Robot) -> tuple[Module, ...]:
    """The modules of a machine of one leg: its robots, and the elements between them one by one.

    None of a leg with blocks that were no robots by themselves.
    """
    (leg,), found = machine.legs, list[Module]()
    about: Any = {"nominal": machine.nominal, "meanings": machine.meanings}
    for number, element in enumerate(leg.chain.elements):
        if not isinstance(element, ParallelBlock):
            found.append(Module(f"part {number}", Chain((element,))))
        elif element.robot is None:
            return ()
        else:
            found.append(Module(element.name, replace(element.robot, name=element.name, **about)))
    return tuple(found)


def closed_at_home(machine: Robot) -> Robot:
    """A machine in numbers, each of its modules at home, as it is read from a file."""
    own = hybrid_machine(modules_of(machine), coordinates=machine.coordinates)
    return replace(machine, legs=own.legs)


def _nominal_values(modules: Sequence[Module]) -> dict[str, float]:
    """Values of the symbols of all modules; InputError where two give one symbol other values."""
    nominal: dict[str, float] = {}
    for module in modules:
        for symbol, value in ({} if module.robot is None else module.robot.nominal).items():
            if nominal.setdefault(symbol, value) != value:
                raise InputError(
                    f"symbol {symbol!r} of module {module.name!r}",
                    got=value,
                    expected=f"{nominal[symbol]:g}, as in the modules before: "
                    "a symbol has one value",
                )
    return nominal


def _elements(module: Module, *, carries_next: bool) -> Iterator[Element]:
    """The elements of a module, its mount first, closed at home; masses of a platform between."""

    def named(chain: Chain) -> Iterator[Element]:
        return (replace(own, name=f"{module.name}/{own.name}") for own in chain.elements)

    if module.mount is not None:
        yield Rigid(module.mount, f"{module.name}/mount")
    part = module.part
    if isinstance(part, Chain):
        yield from named(part)
        return
    homes = [solver.home for solver in posture_finder(part.numeric).solvers]
    legs = [
        replace(leg, chain=_with_home(leg.chain, iter(q)))
        for leg, q in zip(part.legs, homes, strict=True)
    ]
    if part.is_serial:
        (leg,) = legs
        yield Rigid(leg.base, f"{module.name}/base")
        yield from named(leg.chain)
        yield Rigid(leg.attachment.inverse, f"{module.name}/end")
    else:
        branches = (Branch(leg.name, leg.base, leg.chain, leg.attachment) for leg in legs)
        own = replace(
            part, reference_point=np.zeros(3, dtype=int), platform_masses=(), gravity=None
        )
        yield ParallelBlock(tuple(branches), module.name, own)
    if carries_next and part.platform_masses:
        yield Rigid(Frame.identity(), f"{module.name}/platform", part.platform_masses)


def _with_home(chain: Chain, q: Iterator[float]) -> Chain:
    """The chain with the next home coordinates, which close it, where others are given."""

    def at(element: Element) -> Element:
        if isinstance(element, Joint):
            return replace(element, home=tuple(_kept(given, next(q)) for given in element.home))
        if isinstance(element, Telescope):
            return replace(element, home=_kept(element.home, next(q)))
        if isinstance(element, ParallelBlock):
            own = (replace(one, chain=_with_home(one.chain, q)) for one in element.branches)
            return replace(element, branches=tuple(own))
        return element

    return Chain(tuple(map(at, chain.elements)))


def _kept(given: Any, found: float) -> Any:
    """A home coordinate as it was given, formulas included, where it closes its leg."""
    is_number = not getattr(given, "free_symbols", None)
    same = is_number and abs(float(given) - found) <= _AT_HOME
    return given if same or not is_number else float(found)


def _end_at_home(part: Robot | Chain) -> Frame:
    if isinstance(part, Chain):
        placed = place_chain(part, part.home, np.eye(3), np.zeros(3))
        return Frame(placed.R, placed.p)
    if part.home is not None:
        return part.home
    leg = part.legs[0]
    return leg.base @ _end_at_home(leg.chain) @ leg.attachment.inverse


def _with_coordinates(robot: Robot, *, chosen: bool) -> Robot:
    """The machine with coordinates that determine its pose at home."""
    finder = posture_finder(robot.numeric if robot.has_formulas else robot)
    q = [solver.home for solver in finder.solvers]
    mobility = platform_mobility(finder.robot, finder.home_pose, q, finder.length)
    fitting = fitting_coordinates(mobility)
    if not chosen:
        return replace(robot, coordinates=fitting)
    if len(robot.coordinates) < 6 and not determine_pose(mobility, robot.coordinates):
        raise InputError(
            f"coordinates of {robot.name!r}",
            got=" ".join(coordinate.value for coordinate in robot.coordinates) or "none",
            expected=f"as many as the {len(fitting)} freedoms of the tool at home, and independent",
            hint=f"write {' '.join(c.value for c in fitting)}, or leave them out",
        )
    return robot
