"""What to compute at every pose."""

from __future__ import annotations

from enum import Enum


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
