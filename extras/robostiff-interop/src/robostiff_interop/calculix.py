"""A network as an input file of CalculiX: nodes, equations between them, and springs.

A body is two nodes, one for its displacement and one for its rotation. The elongation of each
spring of a connection is a coordinate of another node, bound to the bodies by `*EQUATION`, so that
matrices of 6 x 6 and joints in any direction are exact. CalculiX makes solids of beams; here they
are their six springs.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from robostiff.elastostatics import DEFAULT_TOLERANCE
from robostiff.errors import InputError, Words
from robostiff.network import Equations, Motion, Network, equations_of, held_coordinates, redundancy
from robostiff_interop.written_network import in_one_ascii_line, warn_of_free_motions

# Equations of rigid parts that are solved at once; they are dense.
_MOST_EQUATIONS = 3000
_NONE = 1e-13  # of the largest coefficient of an equation
_TERMS_A_LINE = 4


def calculix_input(network: Network) -> str:
    """Input file of CalculiX that computes the compliance of a network.

    Each of its steps loads the reference point of the platform by a unit force or moment, and
    prints the displacement there (node 1) and the rotation (node 2): a column of the compliance
    matrix. SI units.

    Parameters
    ----------
    network : Network

    Raises
    ------
    InputError
        When rigid parts and joints lead to more than 3000 equations.

    Examples
    --------
    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, beam_between
    >>> wall, tip = Node("wall", np.zeros(3)), Node("tip", np.array([1.0, 0, 0]))
    >>> rod = beam_between(wall, tip, material("steel"), circle(0.02), name="rod")
    >>> network = Network("rod", (wall, tip), ("wall",), "tip", tip.point, beams=(rod,))
    >>> calculix_input(network).splitlines()[3:6]
    ['*NODE, NSET=BODIES', '1, 1.000000000000e+00, 0.000000000000e+00, 0.000000000000e+00', ...]
    """
    warn_of_free_motions(network, "CalculiX")
    equations = equations_of(network, DEFAULT_TOLERANCE)
    model = _CalculixModel(equations)
    model.add_rigid()
    for connection in equations.connections:
        model.add_springs(connection)
    steps = [
        line
        for row in network.space.rows
        for line in (
            *("*STEP", "*STATIC", "*CLOAD, OP=NEW", f"{1 + row // 3}, {row % 3 + 1}, 1."),
            *("*NODE PRINT, NSET=BODIES", "U", "*END STEP"),
        )
    ]
    lines = [
        "** A column of the compliance matrix a step, displacement (node 1) and rotation (node 2)",
        "** of the platform at the reference point, for unit loads there. m, rad, N, N m",
        f"** Network {in_one_ascii_line(network.name)}.",
        *model.lines(),
        *steps,
    ]
    return "\n".join(lines) + "\n"


Term = tuple[int, int, float]


@dataclass
class _CalculixModel:
    """Nodes of bodies, then those of springs, and what binds them."""

    equations: Equations
    bound: list[list[Term]] = field(default_factory=list)
    stiffness: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        network = self.equations.network
        names = [network.platform, *(n.name for n in network.nodes if n.name != network.platform)]
        self.number = {name: i for i, name in enumerate(names)}
        self.points = {**self.equations.points, network.platform: network.reference_point}
        self.held = {(self.number[name], row) for name, row in held_coordinates(self.equations)}

    def _rates(self, connection: Motion, chosen: np.ndarray) -> np.ndarray:
        """How much each coordinate of the bodies elongates a connection (k, 6 N).

        The columns of `chosen` (m, k) combine its wrenches.
        """
        own = self.equations
        rates = np.zeros((chosen.shape[1], 6 * len(self.number)))
        for name, point, part in connection.ends:
            D = own.between(self.points[name], point) * own.scale
            first = 6 * self.number[name]
            rates[:, first + np.array(own.network.space.rows)] += chosen.T @ part @ D
        rates[:, [6 * body + row for body, row in self.held]] = 0.0
        return rates

    def add_springs(self, connection: Motion) -> None:
        """A spring for each of the conjugate wrenches of a connection."""
        elastic = np.eye(len(connection.S))[:, ~connection.rigid]
        soft = np.ix_(~connection.rigid, ~connection.rigid)
        values, vectors = np.linalg.eigh(connection.S[soft])
        for compliance, rates in zip(
            values, self._rates(connection, elastic @ vectors), strict=True
        ):
            self.stiffness.append(self.equations.stiffness / float(compliance))
            node, row = divmod(len(self.stiffness) - 1, 3)
            first = 2 * len(self.number) + 1
            self.bound.append([(first + node, row + 1, -1.0), *_terms(rates)])

    def add_rigid(self) -> None:
        """What rigid parts and joints ask of the bodies, each for another coordinate."""
        dropped = redundancy(self.equations, platform_fixed=False).dropped
        rows = [np.zeros((0, 6 * len(self.number)))]
        for k, connection in enumerate(self.equations.connections):
            kept = connection.rigid.copy()
            kept[dropped.get(k, [])] = False
            rows.append(self._rates(connection, np.eye(len(kept))[:, kept]))
        A = np.concatenate(rows)
        if len(A) > _MOST_EQUATIONS:
            raise InputError(
                f"network {self.equations.network.name!r} for CalculiX",
                got=Words(f"{len(A)} equations of rigid parts and joints"),
                expected=f"{_MOST_EQUATIONS} at most",
                hint="write it for OpenSees",
            )
        self.bound += [_terms(row, first) for row, first in _solved(A)]

    def lines(self) -> Iterator[str]:
        """Nodes, equations, springs and what is held."""
        yield "*NODE, NSET=BODIES"
        for name, number in self.number.items():
            for node in (2 * number + 1, 2 * number + 2):
                yield _row(node, *self.points[name])
        first, count = 2 * len(self.number) + 1, len(self.stiffness)
        springs = range(first, first + -(-count // 3))
        yield "*NODE, NSET=SPRINGS"
        yield from (_row(node, 0.0, 0.0, 0.0) for node in springs)
        for terms in self.bound:
            yield "*EQUATION"
            yield str(len(terms))
            for k in range(0, len(terms), _TERMS_A_LINE):
                yield ", ".join(_row(*term) for term in terms[k : k + _TERMS_A_LINE])
        for k, stiffness in enumerate(self.stiffness):
            yield f"*ELEMENT, TYPE=SPRING1, ELSET=S{k + 1}"
            yield f"{k + 1}, {springs[k // 3]}"
            yield f"*SPRING, ELSET=S{k + 1}"
            yield f"{k % 3 + 1}"
            yield _number(stiffness)
        yield "*BOUNDARY"
        for body, row in sorted(self.held):
            yield f"{2 * body + 1 + row // 3}, {row % 3 + 1}, {row % 3 + 1}"
        unused = range(count % 3, 3) if count % 3 else ()
        yield from (f"{springs[-1]}, {row + 1}, {row + 1}" for row in unused)


def _terms(rates: np.ndarray, first: int | None = None) -> list[Term]:
    """What is not zero of an equation over the coordinates of bodies; one of them comes first."""
    size = np.abs(rates).max(initial=0.0)
    columns = [int(i) for i in np.flatnonzero(np.abs(rates) > _NONE * size) if i != first]
    columns = columns if first is None else [first, *columns]
    return [(i // 3 + 1, i % 3 + 1, float(rates[i])) for i in columns]


def _solved(A: np.ndarray) -> Iterator[tuple[np.ndarray, int]]:
    """Rows of the same meaning, each with a coordinate that is in no other."""
    from scipy.linalg import qr, solve_triangular

    if not len(A):
        return
    triangular: Any = qr(A, mode="economic", pivoting=True)
    _, R, order = triangular
    m = len(A)
    rest = solve_triangular(R[:m, :m], R[:m, m:])
    for i in range(m):
        row = np.zeros(A.shape[1])
        row[order[i]] = 1.0
        row[order[m:]] = rest[i]
        yield row, int(order[i])


def _row(*values: float) -> str:
    return ", ".join(str(v) if isinstance(v, int) else _number(v) for v in values)


def _number(value: float) -> str:
    """In the twenty characters that CalculiX reads."""
    return f"{value:.12e}"
