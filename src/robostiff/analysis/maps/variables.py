"""The arrays of a map: names, dimensions, units and fill values, by quantity."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from enum import Enum
from typing import Any

import numpy as np

from robostiff.analysis.maps.pose_columns import Mapped
from robostiff.elastostatics import Status
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen, replace
from robostiff.linkage import Linkage
from robostiff.model import Actuated
from robostiff.model.cable import CableRobot

EXCLUDED = 256
NOT_COMPUTED = 512
NO_RANK = -1


@frozen
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
    is_symmetric: bool = False  # a matrix of which a store has the upper triangle, row by row

    @property
    def magnitude(self) -> Variable | None:
        """Length of a vector as a variable; None of others, and of a single component."""
        if not self.is_vector or self.shape == (1,):
            return None
        words = f"magnitude of the {self.long_name}"
        return Variable(f"{self.name}_magnitude", (), (), self.units, words)

    @property
    def stored_shape(self) -> tuple[int, ...]:
        """Shape of what a store has of a pose: of a symmetric matrix each entry once."""
        n = self.shape[0] if self.shape else 0
        return (n * (n + 1) // 2,) if self.is_symmetric else self.shape

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
    """Every flag of the variable ``status``: of `Status`, and two of the map."""
    flags = {int(member): str(member) for member in Status if member}
    return dict(sorted((flags | {EXCLUDED: "excluded", NOT_COMPUTED: "not-computed"}).items()))


def status_words(code: int) -> str:
    """A status code in words."""
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


def map_variables(
    robot: Mapped, quantities: Iterable[Quantity], dtype: str = "float64", is_loaded: bool = False
) -> tuple[Variable, ...]:
    """The arrays of a map of a robot, rank and status last; K of a type, symmetric without load."""
    variables = [variable for quantity in quantities for variable in _variables_of(quantity, robot)]
    is_symmetric = not (is_loaded or isinstance(robot, CableRobot))
    whole = {"dtype": dtype, "is_symmetric": is_symmetric}
    return (*(replace(v, **whole) if v.name == "K" else v for v in variables), RANK, STATUS)


def _variables_of(quantity: Quantity, robot: Mapped) -> Iterator[Variable]:
    space = robot.space
    d, twist = space.translations, space.twist_order
    match quantity:
        case Quantity.STIFFNESS:
            # as UDUNITS reads them; a radian is 1, and so is a metre per metre
            named = ("N m-1", "N", "N m rad-1")
            turns = [name.startswith("r") for name in twist]
            yield Variable(
                "K",
                ("row", "column"),
                (space.size, space.size),
                tuple(tuple(named[row + column] for column in turns) for row in turns),
                "Cartesian stiffness matrix about the reference point, world axes",
                labels=(space.wrench_order, twist),
                note="force or moment (row) per displacement or rotation (column)",
            )
        case Quantity.PRINCIPAL_STIFFNESS:
            words = "eigenvalues of the {} block of K, {} held; ascending"
            for kind, size, unit, *parts in (
                ("translation", d, "N/m", "force-displacement", "rotations"),
                ("rotation", space.size - d, "N m/rad", "moment-rotation", "displacements"),
            ):
                name, dims = f"{kind}al_stiffness", (f"principal_{kind}",)
                yield Variable(name, dims, (size,), unit, words.format(*parts))
        case Quantity.WORST_DEFLECTION:
            words = "largest displacement per unit force over all directions, no moment"
            note = "none where a force can drive a free motion"
            yield Variable("worst_deflection", (), (), "m/N", words, note=note)
        case Quantity.INDICES:
            yield Variable("smallest_eigenvalue", (), (), "N/m", "of K scaled to lengths")
            yield Variable("largest_eigenvalue", (), (), "N/m", "of K scaled to lengths")
            words = "smallest over largest eigenvalue of K, 0 to 1"
            yield Variable("isotropy", (), (), "1", words)
            words, note = "log10 of the determinant of K scaled to N/m", "none where K is singular"
            yield Variable("log10_determinant", (), (), "1", words, note=note)
        case Quantity.DEFLECTION:
            for name, axes, unit, words in (
                ("displacement", twist[:d], "m", "displacement of the reference point"),
                ("rotation", twist[d:], "rad", "rotation of the platform"),
            ):
                about = (f"{name}_axis",), (len(axes),), unit, f"{words} under the wrench"
                yield Variable(name, *about, labels=(axes,), is_vector=True)
        case Quantity.ACTUATOR_FORCES:
            yield _actuator_forces(robot)
        case Quantity.TENSIONS:
            if not isinstance(robot, CableRobot):
                subject = f"quantity of a map of {robot.name!r}"
                expected = "another one: it has no cables"
                raise InputError(subject, got=quantity.value, expected=expected)
            names = tuple(robot.cable_names)
            words = "tensions of the cables that balance weight and load before winches are locked"
            yield Variable("tension", ("cable",), (len(names),), "N", words, labels=(names,))
            yield Variable("least_tension", (), (), "N", f"least of the {words}")
            yield Variable("greatest_tension", (), (), "N", f"greatest of the {words}")


def _actuator_forces(robot: Mapped) -> Variable:
    """Of every actuated freedom, ``leg/joint``."""
    if isinstance(robot, Linkage):
        raise InputError(
            f"quantity of a map of linkage {robot.name!r}",
            got=Quantity.ACTUATOR_FORCES.value,
            expected="another one",
            hint="rs.deflection(linkage, values, wrench) has the loads of actuators at each pose",
        )
    if isinstance(robot, CableRobot):
        forces = [(name, "N") for name in robot.cable_names]
    else:
        forces = [
            (f"{leg.name}/{name}", screw.load_unit)
            for leg in robot.legs
            for name, role, screw in zip(
                leg.chain.coordinate_names, leg.chain.roles, leg.chain.freedoms, strict=True
            )
            if isinstance(role, Actuated)
        ]
    if not forces:
        subject = f"actuator forces of {robot.name!r}"
        raise InputError(subject, got=Words("no actuated joint"), expected="at least one")
    names, units = map(tuple, zip(*forces, strict=True))
    return Variable(
        "actuator_force",
        ("actuator",),
        (len(names),),
        units[0] if len(set(units)) == 1 else units,
        "load on the actuator along its coordinate under the wrench",
        labels=(names,),
        note="the drive holds the opposite",
    )
