"""Quantities of a map, and the arrays that each needs."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum

from robostiff.analysis.maps.pose_columns import joint_columns
from robostiff.analysis.maps.variables import RANK, STATUS, Variable
from robostiff.errors import InputError
from robostiff.linkage import Linkage
from robostiff.model import Actuated, Robot


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
        Displacement and rotation under a wrench.
    ``ACTUATOR_FORCES``
        Loads on the actuators under a wrench.
    """

    STIFFNESS = "stiffness"
    PRINCIPAL_STIFFNESS = "principal-stiffness"
    WORST_DEFLECTION = "worst-deflection"
    INDICES = "indices"
    DEFLECTION = "deflection"
    ACTUATOR_FORCES = "actuator-forces"

    @property
    def needs_wrench(self) -> bool:
        """Whether it is about a load."""
        return self in {Quantity.DEFLECTION, Quantity.ACTUATOR_FORCES}


def map_variables(robot: Robot | Linkage, quantities: Iterable[Quantity]) -> tuple[Variable, ...]:
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


def actuator_labels(robot: Robot | Linkage) -> tuple[tuple[str, ...], str]:
    """``leg/joint`` of every actuated freedom, and the unit of their loads."""
    names, units = [], set()
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
                units.add(screw.load_unit)
    return tuple(names), units.pop() if len(units) == 1 else "N or N m"


def _of(quantity: Quantity, robot: Robot | Linkage) -> list[Variable]:
    space = robot.space
    d, n = space.translations, space.size
    twist = space.twist_order
    match quantity:
        case Quantity.STIFFNESS:
            return [
                Variable(
                    "K",
                    ("row", "column"),
                    (n, n),
                    "",
                    "Cartesian stiffness matrix about the reference point, world axes",
                    dtype="float64",
                    labels=(space.wrench_order, twist),
                    note="force or moment (row) per displacement or rotation (column)",
                )
            ]
        case Quantity.PRINCIPAL_STIFFNESS:
            return [
                Variable(
                    "translational_stiffness",
                    ("principal_translation",),
                    (d,),
                    "N/m",
                    "eigenvalues of the force-displacement block of K, rotations held; ascending",
                ),
                Variable(
                    "rotational_stiffness",
                    ("principal_rotation",),
                    (n - d,),
                    "N m/rad",
                    "eigenvalues of the moment-rotation block of K, displacements held; ascending",
                ),
            ]
        case Quantity.WORST_DEFLECTION:
            return [
                Variable(
                    "worst_deflection",
                    (),
                    (),
                    "m/N",
                    "largest displacement per unit force over all directions, no moment",
                    note="none where a force can drive a free motion",
                )
            ]
        case Quantity.INDICES:
            return [
                Variable("smallest_eigenvalue", (), (), "N/m", "of K scaled to lengths"),
                Variable("largest_eigenvalue", (), (), "N/m", "of K scaled to lengths"),
                Variable("isotropy", (), (), "1", "smallest over largest eigenvalue of K, 0 to 1"),
                Variable(
                    "log10_determinant",
                    (),
                    (),
                    "1",
                    "log10 of the determinant of K scaled to N/m",
                    note="none where K is singular",
                ),
            ]
        case Quantity.DEFLECTION:
            return [
                Variable(
                    "displacement",
                    ("displacement_axis",),
                    (d,),
                    "m",
                    "displacement of the reference point under the wrench",
                    labels=(twist[:d],),
                ),
                Variable(
                    "rotation",
                    ("rotation_axis",),
                    (n - d,),
                    "rad",
                    "rotation of the platform under the wrench",
                    labels=(twist[d:],),
                ),
            ]
        case Quantity.ACTUATOR_FORCES:
            names, unit = actuator_labels(robot)
            if not names:
                raise InputError(
                    f"actuator forces of {robot.name!r}",
                    got="no actuated joint",
                    expected="at least one",
                )
            return [
                Variable(
                    "actuator_force",
                    ("actuator",),
                    (len(names),),
                    unit,
                    "load on the actuator along its coordinate under the wrench",
                    labels=(names,),
                    note="the drive holds the opposite",
                )
            ]
