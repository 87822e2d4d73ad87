"""How wrong it is to zero the rows and columns of a stiffness matrix that a joint sets free.

The shortcut sounds right: a free rotation carries no moment, so its row of K must vanish, and by
symmetry its column. It must indeed, but the other entries change as well, because the freed
coordinate moves while the others are displaced, and relieves them. This file is the only place
where the shortcut exists; it is here to be measured.

    python examples/zeroing_rows_is_wrong.py
"""

import numpy as np

from robostiff.elasticity import beam_stiffness, circle, material
from robostiff.elastostatics import aggregate_matrices, eliminate_index
from robostiff.spatial import rotate_stiffness

LENGTH = 0.5  # m
SECTION = circle(0.020)
STEEL = material("steel")
TURNS = (3, 4, 5)  # rows of rx, ry, rz

RightAndWrong = tuple[np.ndarray, np.ndarray]


def main() -> None:
    """Print how wrong it is."""
    hinged, shortcut = hinged_link()
    print("Steel bar, 500 mm long, 20 mm thick, clamped at its base; hinge about z at its tip")
    print("lateral stiffness K[Fy, dy] [N/mm]")
    print(f"  beam formula 3EI/L^3       {1e-3 * textbook_hinged():8.2f}")
    print(f"  joint eliminated, eq. (19) {1e-3 * hinged[1, 1]:8.2f}")
    print(f"  row and column zeroed      {1e-3 * shortcut[1, 1]:8.2f}")
    print(f"  too stiff by a factor of   {shortcut[1, 1] / hinged[1, 1]:8.2f}")
    print()
    right, wrong = table_on_three_columns()
    print("Table on three such bars, standing, with a ball joint on each; top at their tips")
    print("             eliminated      zeroed   factor")
    for name, i, scale, unit in (
        ("Fx, dx", 0, 1e-3, "N/mm"),
        ("Fz, dz", 2, 1e-3, "N/mm"),
        ("Mz, rz", 5, 1.0, "N m/rad"),
    ):
        a, b = scale * right[i, i], scale * wrong[i, i]
        print(f"  K[{name}] {a:11.2f} {b:11.2f} {b / a:8.2f}   {unit}")


def zeroed(K: np.ndarray, *rows: int) -> np.ndarray:
    """The shortcut: rows and columns set to zero, all other entries left as they were."""
    shortcut = K.copy()
    shortcut[list(rows), :] = 0
    shortcut[:, list(rows)] = 0
    return shortcut


def eliminated(K: np.ndarray, *rows: int) -> np.ndarray:
    """One trivial joint after the other, eq. (19)."""
    for row in rows:
        K = eliminate_index(K, row)
    return K


def hinged_link() -> RightAndWrong:
    """K of a bar with a hinge about z at its tip, right and by the shortcut."""
    K0 = beam_stiffness(LENGTH, STEEL, SECTION)
    return eliminated(K0, 5), zeroed(K0, 5)


def textbook_hinged() -> float:
    """Stiffness of a cantilever under a force across its tip [N/m]."""
    return 3 * STEEL.E * SECTION.Iz / LENGTH**3


def table_on_three_columns() -> RightAndWrong:
    """K of a plate on three standing bars with ball joints, right and by the shortcut."""
    upright = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])  # the bar's own x points up
    K0 = rotate_stiffness(beam_stiffness(LENGTH, STEEL, SECTION), upright)
    angles = np.radians([90, 210, 330])
    to_centre = [-0.2 * np.array([np.cos(a), np.sin(a), 0]) for a in angles]
    return (
        aggregate_matrices([eliminated(K0, *TURNS)] * 3, to_centre),
        aggregate_matrices([zeroed(K0, *TURNS)] * 3, to_centre),
    )


if __name__ == "__main__":
    main()
