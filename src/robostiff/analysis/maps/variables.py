"""The arrays of a map: names, dimensions, units and fill values, by quantity."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from robostiff.analysis.maps.pose_columns import Mapped, joint_columns
from robostiff.elastostatics import Status
from robostiff.errors import InputError
from robostiff.linkage import Linkage
from robostiff.model import Actuated
from robostiff.model.cable import CableRobot

EXCLUDED = 256
NOT_COMPUTED = 512
NO_RANK = -1


@dataclass(frozen=True)
class Variable:
    """An array of a map."""

    name: str
    dims: tuple[str, ...]  # after those of the poses
    shape: tuple[int, ...]
    # Nested like the entries of a pose where they have several: ``NAME_units`` has them
    units: str | tuple[Any, ...]
    long_name: str
    dtype: str = "float32"  # of NumPy
    # Of its last dimension, where the places have names (of both dimensions for K)
    labels: tuple[tuple[str, ...], ...] = ()
    note: str = ""  # what a reader must know
    is_vector: bool = False  # whether its entries are components of a vector

    @property
    def magnitude(self) -> Variable | None:
        """Length of a vector as a variable; None of others, and of a single component."""
        if not self.is_vector or self.shape == (1,):
            return None
        words = f"magnitude of the {self.long_name}"
        return Variable(f"{self.name}_magnitude", (), (), self.units, words)

    def poses_first(self, values: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
        """Values (*self.shape, N) as an array (*shape, *self.shape) of N poses in that shape."""
        own = len(self.shape)
        whole = values.reshape(*self.shape, *shape)
        return np.moveaxis(whole, range(own), range(-own, 0))

    @property
    def is_float(self) -> bool:
        """Whether the fill value is NaN."""
        return np.dtype(self.dtype).kind == "f"

    @property
    def missing(self) -> float | int:
        """Fill value of poses without an answer."""
        if self.is_float:
            return float("nan")
        return NO_RANK if self.name == "rank" else NOT_COMPUTED

    @property
    def bytes_a_pose(self) -> int:
        """Memory for one pose."""
        return int(np.prod(self.shape, dtype=int)) * np.dtype(self.dtype).itemsize


RANK = Variable(
    "rank",
    (),
    (),
    "1",
    "number of independent wrenches that hold the platform",
    dtype="int8",
    note=f"{NO_RANK} where the pose is out of reach or was not computed",
)
STATUS = Variable(
    "status",
    (),
    (),
    "1",
    "status of the pose",
    dtype="uint16",
    note="0: nothing to report; several flags may hold at once",
)


def status_flags() -> dict[int, str]:
    """Every flag of the variable ``status``: of `Status`, and two of the map.

    Examples
    --------
    >>> status_flags()[64], status_flags()[256]
    ('unreachable', 'excluded')
    """
    flags = {int(member): str(member) for member in Status if member}
    return dict(sorted((flags | {EXCLUDED: "excluded", NOT_COMPUTED: "not-computed"}).items()))


def status_words(code: int) -> str:
    """A status code in words.

    Examples
    --------
    >>> status_words(0), status_words(9)
    ('ok', 'free-motions+beyond-limits')
    """
    return "+".join(name for flag, name in status_flags().items() if code & flag) or "ok"


class Quantity(Enum):
    """What to compute at every pose; rank and status are always there.

    ``STIFFNESS``
        K, a 6 x 6 matrix (3 x 3 in the plane).
    ``PRINCIPAL_STIFFNESS``
        Eigenvalues of the force-displacement block of K (rotations held), and of its
        moment-rotation block (displacements held).
    ``WORST_DEFLECTION``
        Largest displacement of the reference point per unit force, over all directions of the
        force.
    ``INDICES``
        Smallest and largest eigenvalue of K scaled by a characteristic length, their ratio, and
        log10 of the determinant.
    ``DEFLECTION``
        Displacement and rotation under a wrench, and their magnitudes.
    ``ACTUATOR_FORCES``
        Loads on the actuators under a wrench.
    ``TENSIONS``
        Of the cables of a cable robot, by its rule, and the least and greatest of them.
    """

    STIFFNESS = "stiffness"
    PRINCIPAL_STIFFNESS = "principal-stiffness"
    WORST_DEFLECTION = "worst-deflection"
    INDICES = "indices"
    DEFLECTION = "deflection"
    ACTUATOR_FORCES = "actuator-forces"
    TENSIONS = "tensions"

    @property
    def needs_wrench(self) -> bool:
        """Whether it is about a load."""
        return self in {Quantity.DEFLECTION, Quantity.ACTUATOR_FORCES}


def map_variables(robot: Mapped, quantities: Iterable[Quantity]) -> tuple[Variable, ...]:
    """The arrays of a map of a robot, rank and status last.

    Examples
    --------
    >>> import robostiff as rs
    >>> robot = rs.load("3-rpr")
    >>> [v.name for v in map_variables(robot, [Quantity.PRINCIPAL_STIFFNESS])]
    ['translational_stiffness', 'rotational_stiffness', 'rank', 'status']
    """
    found: list[Variable] = []
    for quantity in quantities:
        found += _of(quantity, robot)
    return (*found, RANK, STATUS)


def actuator_labels(robot: Mapped) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """``leg/joint`` of every actuated freedom, and the unit of its load."""
    names, units = [], []
    if isinstance(robot, CableRobot):
        return tuple(robot.cable_names), ("N",) * len(robot.cables)
    if isinstance(robot, Linkage):
        raise InputError(
            f"quantity of a map of linkage {robot.name!r}",
            got=Quantity.ACTUATOR_FORCES.value,
            expected="another one",
            hint="rs.deflection(linkage, values, wrench) has the loads of actuators at each pose",
        )
    for leg in robot.legs:
        columns = joint_columns(leg)
        for name, role, screw in zip(
            columns.names, leg.chain.roles, leg.chain.freedoms, strict=True
        ):
            if isinstance(role, Actuated):
                names.append(f"{leg.name}/{name}")
                units.append(screw.load_unit)
    return tuple(names), tuple(units)


def _of(quantity: Quantity, robot: Mapped) -> Iterator[Variable]:
    space = robot.space
    d, n = space.translations, space.size
    twist = space.twist_order
    match quantity:
        case Quantity.STIFFNESS:
            # as UDUNITS reads them; a radian is 1, and so is a metre per metre
            named = ("N m-1", "N", "N m rad-1")
            turns = [name.startswith("r") for name in twist]
            yield Variable(
                "K",
                ("row", "column"),
                (n, n),
                tuple(tuple(named[row + column] for column in turns) for row in turns),
                "Cartesian stiffness matrix about the reference point, world axes",
                dtype="float64",
                labels=(space.wrench_order, twist),
                note="force or moment (row) per displacement or rotation (column)",
            )
        case Quantity.PRINCIPAL_STIFFNESS:
            yield Variable(
                "translational_stiffness",
                ("principal_translation",),
                (d,),
                "N/m",
                "eigenvalues of the force-displacement block of K, rotations held; ascending",
            )
            yield Variable(
                "rotational_stiffness",
                ("principal_rotation",),
                (n - d,),
                "N m/rad",
                "eigenvalues of the moment-rotation block of K, displacements held; ascending",
            )
        case Quantity.WORST_DEFLECTION:
            yield Variable(
                "worst_deflection",
                (),
                (),
                "m/N",
                "largest displacement per unit force over all directions, no moment",
                note="none where a force can drive a free motion",
            )
        case Quantity.INDICES:
            yield Variable("smallest_eigenvalue", (), (), "N/m", "of K scaled to lengths")
            yield Variable("largest_eigenvalue", (), (), "N/m", "of K scaled to lengths")
            yield Variable("isotropy", (), (), "1", "smallest over largest eigenvalue of K, 0 to 1")
            yield Variable(
                "log10_determinant",
                (),
                (),
                "1",
                "log10 of the determinant of K scaled to N/m",
                note="none where K is singular",
            )
        case Quantity.DEFLECTION:
            yield Variable(
                "displacement",
                ("displacement_axis",),
                (d,),
                "m",
                "displacement of the reference point under the wrench",
                labels=(twist[:d],),
                is_vector=True,
            )
            yield Variable(
                "rotation",
                ("rotation_axis",),
                (n - d,),
                "rad",
                "rotation of the platform under the wrench",
                labels=(twist[d:],),
                is_vector=True,
            )
        case Quantity.ACTUATOR_FORCES:
            names, units = actuator_labels(robot)
            if not names:
                raise InputError(
                    f"actuator forces of {robot.name!r}",
                    got="no actuated joint",
                    expected="at least one",
                )
            yield Variable(
                "actuator_force",
                ("actuator",),
                (len(names),),
                units[0] if len(set(units)) == 1 else units,
                "load on the actuator along its coordinate under the wrench",
                labels=(names,),
                note="the drive holds the opposite",
            )
        case Quantity.TENSIONS:
            if not isinstance(robot, CableRobot):
                raise InputError(
                    f"quantity of a map of {robot.name!r}",
                    got=quantity.value,
                    expected="another one: it has no cables",
                )
            names = tuple(robot.cable_names)
            which = "that balance weight and load before winches are locked"
            words = f"tensions of the cables {which}"
            yield Variable("tension", ("cable",), (len(names),), "N", words, labels=(names,))
            for end in ("least", "greatest"):
                yield Variable(f"{end}_tension", (), (), "N", f"{end} of the tensions {which}")
