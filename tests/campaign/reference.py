"""Stiffness and compliance of a machine at a pose in 50 digits, from plain geometry.

Written apart from the package: a leg, a branch of a block, a part of a platform and a connection of
a linkage are all one thing, chains that carry wrenches. The unknowns are the wrenches f of all
chains about one point, and what sums of joints carry. A passive joint takes the work of its twist
from them, J^T f = 0; wrenches on a body are in balance. Among what is left, f = N z, the energy
1/2 z^T A z with A = N^T C N is least. Ranks are decided in double precision, on unit wrenches;
numbers are computed in balls of 180 bits.
"""
# pyright: reportOperatorIssue=false

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from flint import arb, arb_mat, ctx
from scipy.linalg import null_space

import robostiff as rs
from robostiff.model import CoupledFreedom, PlacedBlock, PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.spatial import Screw
from tests.campaign.balls import certain, cross, cut, floats, of_rank, put, stacked

BITS = 180
CUT = 1e-9
#: Singular values between these decide nothing for certain.
DOUBT = (1e-13, 1e-5)
_FAR = 10.0  # lengths of the robot
_ZERO = 1e-13  # part of the largest compliance of a spring below which a direction is rigid


@dataclass(frozen=True)
class Reference:
    """What is true of a robot at a pose.

    Attributes
    ----------
    K, C : array or None
        About the reference point, world axes; None where a direction is rigid, or free.
    rank : int
    is_rigid, is_free, is_redundant : bool
    in_doubt : bool
        Whether a decision was so near that another arithmetic may decide otherwise.
    margins : tuple of float
        The singular values next to the cut.
    """

    K: np.ndarray | None
    C: np.ndarray | None
    rank: int
    is_rigid: bool
    is_free: bool
    is_redundant: bool
    in_doubt: bool
    margins: tuple[float, ...] = ()


@dataclass
class Chain:
    """Springs and passive twists one after the other, each with its factors in sums of joints."""

    springs: list[tuple[arb_mat, arb_mat, np.ndarray, dict[int, float]]] = field(
        default_factory=list
    )
    twists: list[tuple[arb_mat, dict[int, float]]] = field(default_factory=list)


@dataclass
class Carriers:
    """Chains between bodies, of which some act on the platform.

    Attributes
    ----------
    chains : list of Chain
    balances : list of dict of int to float
        Signs of the chains whose wrenches add up to zero.
    ends : dict of int to float
        Those of the chains whose wrenches add up to that on the platform.
    sums : list of float or None
        Stiffness of the sums of joints; None where they are held.
    """

    chains: list[Chain] = field(default_factory=list)
    balances: list[dict[int, float]] = field(default_factory=list)
    ends: dict[int, float] = field(default_factory=dict)
    sums: list[float | None] = field(default_factory=list)

    def chain(self) -> int:
        """A new chain, by its number."""
        self.chains.append(Chain())
        return len(self.chains) - 1

    def block(self, number: int, inside: list[int]) -> None:
        """Chains side by side carry together what another one carries."""
        self.balances.append({number: -1.0, **dict.fromkeys(inside, 1.0)})


Sums = Sequence[tuple[Mapping[str, float], float | None]]


def reference(snapshot: rs.Snapshot, sums: Sums = ()) -> Reference | None:
    """Stiffness, compliance and rank of a snapshot at one pose.

    Sums of joints, which have factors by their names, are held, or have a stiffness. None where a
    rank that double precision decided leaves a singular system: no verdict.
    """
    points = _points(snapshot)
    whole = Whole(snapshot.space.rows, snapshot.reference_point, _extent(snapshot), points)
    return whole.answer(lambda: _carriers(whole, snapshot, sums))


def redundant_joints(snapshot: rs.Snapshot) -> list[tuple[int, int]]:
    """Places (leg, element) of passive joints without which their leg moves as it does with them.

    Joints of branches are left alone.
    """
    whole, found = Whole(snapshot.space.rows, snapshot.reference_point, _extent(snapshot)), []
    for number, leg in enumerate(snapshot.legs):
        passive = [
            place
            for place, part in enumerate(leg.elements)
            if isinstance(part, PlacedFreedom) and isinstance(part.role, rs.Passive)
        ]
        chain = Chain()
        for place in passive:
            part = leg.elements[place]
            assert isinstance(part, PlacedFreedom)
            whole.joint(chain, part)
        if len(chain.twists) < len(passive) or len(passive) < 2:  # one does not move anything
            continue
        twists = [twist for twist, _ in chain.twists]
        rank = _rank(twists, whole.scale)
        for i, place in enumerate(passive):
            if _rank(twists[:i] + twists[i + 1 :], whole.scale) == rank:
                found.append((number, place))
    return found


def _carriers(whole: Whole, snapshot: rs.Snapshot, sums: Sums) -> list[Carriers]:
    """Those of each leg; with sums of joints and on a flexible platform, all together."""

    def grow(own: Carriers, leg: PlacedLeg) -> int:
        here = own.chain()
        for element in leg.elements:
            if isinstance(element, PlacedBlock):
                own.block(here, [grow(own, branch) for branch in element.branches])
            elif isinstance(element, PlacedSpring):
                whole.spring(own.chains[here], element)
            else:
                factors = {k: s[element.name] for k, (s, _) in enumerate(sums) if element.name in s}
                whole.joint(own.chains[here], element, factors)
        return here

    if snapshot.platform is None and not sums:
        legs = [Carriers() for _ in snapshot.legs]
        for own, leg in zip(legs, snapshot.legs, strict=True):
            own.ends = {grow(own, leg): 1.0}
        return legs
    own, placed = Carriers(sums=[k for _, k in sums]), snapshot.platform
    if placed is None:
        own.ends = {grow(own, leg): 1.0 for leg in snapshot.legs}
        return [own]
    on_nodes: dict[str, dict[int, float]] = {node.name: {} for node in placed.platform.nodes}
    for leg, node in zip(snapshot.legs, placed.holds, strict=True):
        on_nodes[node][grow(own, leg)] = 1.0
    for part in placed.platform.parts:
        number = own.chain()
        on_nodes[part.a][number], on_nodes[part.b][number] = -1.0, 1.0
        point, axes = placed.in_world(part.point), placed.rotation @ part.axes
        spring = PlacedSpring(part.name, point, axes, part.elasticity)
        whole.spring(own.chains[number], spring)
    own.ends = on_nodes.pop(placed.platform.tool)
    own.balances += [balance for balance in on_nodes.values() if balance]
    return [own]


class Whole:
    """A machine: its space, the point of its stiffness, its length, and a place amid it."""

    def __init__(
        self,
        rows: Sequence[int],
        given: np.ndarray,
        length: float,
        points: Sequence[np.ndarray] = (),
    ) -> None:
        self.rows = list(rows)
        self.n = len(self.rows)
        self.shifts = 2 if self.n == 3 else 3
        self.length = length
        self.given = np.asarray(given, dtype=float).reshape(3)
        # Unit twists about a point far away differ little: ranks are decided amid the machine.
        centre = np.mean(points, axis=0) if len(points) else self.given
        far = np.linalg.norm(self.given - centre) > _FAR * self.length
        self.at = centre if far else self.given
        self.scale = np.array([1.0] * self.shifts + [self.length] * (self.n - self.shifts))
        self.margins: list[float] = []

    def answer(self, made: Callable[[], list[Carriers]]) -> Reference | None:
        """What is true of carriers side by side, which are made in balls of so many bits."""
        before = ctx.prec
        ctx.prec = BITS
        try:
            return self._answer(made())
        except ZeroDivisionError:
            return None
        finally:
            ctx.prec = before

    def _answer(self, carriers: list[Carriers]) -> Reference:
        solved = [_Solved(self, own) for own in carriers]
        held = np.hstack([own.held for own in solved])
        rank = self.rank_of(held)
        is_rigid = any(own.is_rigid for own in solved)
        K = None
        if not is_rigid:
            total = arb_mat(self.n, self.n)
            for own in solved:
                total += own.stiffness()
            X = self._shift(1)
            K = floats(X.transpose() * total * X)
        inverse = self._compliance(solved) if rank == self.n else None
        C = None
        if inverse is not None:
            X = self._shift(-1)
            C = certain(X * inverse * X.transpose())
            aligned = max([DOUBT[0], *(value for value in self.margins if value < CUT)])
            softest = max((own.softest for own in solved), default=0.0)
            if C is not None and np.max(np.abs(C)) <= aligned**2 * softest:
                C = np.zeros_like(C)  # the square of what axes that count as aligned are off
        low, high = DOUBT
        return Reference(
            K=K,
            C=C,
            rank=rank,
            is_rigid=is_rigid,
            is_free=rank < self.n,
            is_redundant=any(own.is_redundant for own in solved),
            in_doubt=any(low < value < high for value in self.margins),
            margins=tuple(sorted(value for value in self.margins if value < high)),
        )

    def rank_of(self, matrix: np.ndarray) -> int:
        """Rank by singular values; those near the cut are kept as margins."""
        if 0 in matrix.shape:
            return 0
        values = np.linalg.svd(matrix, compute_uv=False)
        self.margins += [float(v) for v in values if v < DOUBT[1]]
        return int(np.count_nonzero(values > CUT))

    def _shift(self, sign: int) -> arb_mat:
        """Twists about the given point to twists about `at` (1), or back (-1)."""
        v = [
            sign * (arb(float(g)) - arb(float(a))) for g, a in zip(self.given, self.at, strict=True)
        ]
        X = arb_mat(np.eye(6).tolist())
        put(X, arb_mat([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]]), 0, 3)
        return cut(X, self.rows, self.rows)

    def _compliance(self, legs: list[_Solved]) -> arb_mat | None:
        """From min 1/2 z^T A z under P z = F, all legs at once; its multiplier is the twist."""
        size = sum(leg.A.nrows() for leg in legs)
        G = np.zeros((sum(len(leg.G) for leg in legs), size))
        A, P = arb_mat(size, size), arb_mat(self.n, size)
        row = column = 0
        for leg in legs:
            m = leg.A.nrows()
            G[row : row + len(leg.G), column : column + m] = leg.G
            put(A, leg.A, column, column)
            put(P, leg.P, 0, column)
            row, column = row + len(leg.G), column + m
        felt = np.vstack([G, floats(P) / self.scale[:, None]])
        _, kept = _pivots(felt, self.rank_of(_unit_columns(felt)))
        m = len(kept)
        S = arb_mat(m + self.n, m + self.n)
        put(S, cut(A, kept, kept), 0, 0)
        P = cut(P, range(self.n), kept)
        put(S, P, m, 0)
        put(S, P.transpose(), 0, m)
        try:
            inverse = S.inv()
        except ZeroDivisionError:  # not certain in balls of this size: no verdict on C
            return None
        last = range(m, m + self.n)
        return -1 * cut(inverse, last, last)

    def joint(
        self,
        chain: Chain,
        joint: PlacedFreedom | CoupledFreedom,
        sums: Mapping[int, float] = MappingProxyType({}),
    ) -> None:
        """A joint in a chain, with its factors in sums of joints."""
        moves = joint.moves if isinstance(joint, CoupledFreedom) else [("", 1.0, joint)]
        twist = [arb(0)] * 6
        for _, share, screw in moves:
            twist = [
                x + arb(float(share)) * y for x, y in zip(twist, self._twist(screw), strict=True)
            ]
        column = arb_mat(self.n, 1, [twist[row] for row in self.rows])
        if isinstance(joint.role, rs.Passive):
            if any(x != 0 for x in np.ravel(floats(column))):
                chain.twists.append((column, dict(sums)))
        elif joint.role.stiffness is not None:
            C = arb_mat([[1 / arb(float(joint.role.stiffness))]])
            chain.springs.append((column.transpose(), C, np.eye(1), dict(sums)))

    def _twist(self, joint: PlacedFreedom | Screw) -> list[arb]:
        axis = [arb(float(x)) for x in np.ravel(joint.axis)]
        if joint.pitch is None:
            return [*axis, arb(0), arb(0), arb(0)]
        arm = [
            arb(float(o)) - arb(float(p))
            for o, p in zip(self.at, np.ravel(joint.point), strict=True)
        ]
        h = arb(float(joint.pitch))
        return [*(c + h * e for c, e in zip(cross(axis, arm), axis, strict=True)), *axis]

    def spring(self, chain: Chain, spring: PlacedSpring) -> None:
        """An elastic part in a chain."""
        R = arb_mat(np.reshape(spring.rotation, (3, 3)).tolist()).transpose()
        r = [
            arb(float(o)) - arb(float(p))
            for o, p in zip(self.at, np.ravel(spring.point), strict=True)
        ]
        cross = arb_mat([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
        T = arb_mat(6, 6)
        put(T, R, 0, 0)
        put(T, R * cross, 3, 0)
        put(T, R, 3, 3)
        T = cut(T, range(6), self.rows)
        C = np.reshape(spring.elasticity.compliance, (6, 6))
        for twist in np.reshape(spring.elasticity.freedoms, (6, -1)).T:
            column = T.transpose() * arb_mat(6, 1, [float(x) for x in twist])
            chain.twists.append((column, {}))
        s = np.repeat([1.0, self.length], 3)
        size = np.sqrt(np.maximum(np.diag(C) * s * s, 0))
        soft = size > 0  # scaled to a unit diagonal: softness is no geometry
        U = np.zeros((6, 0))
        if soft.any():
            unit = 0.5 * (C + C.T) * np.outer(s, s)
            unit[np.ix_(soft, soft)] /= np.outer(size[soft], size[soft])
            values, vectors = np.linalg.eigh(unit[np.ix_(soft, soft)])
            U = np.zeros((6, len(values)))
            U[soft] = vectors
            U = U[:, values > _ZERO]
        chain.springs.append((T, of_rank(C, U, soft), U, {}))


class _Solved:
    """Wrenches that carriers can carry: f = N z, their energy A, and P z on the platform."""

    def __init__(self, whole: Whole, own: Carriers) -> None:
        n, s = whole.n, whole.scale
        count = n * len(own.chains)
        size = count + len(own.sums)
        unit = np.concatenate([np.tile(s, len(own.chains)), self._units(own, s)])
        rows = self._rows(own, n, s, size)
        B = np.array([np.ravel(floats(row)) for row in rows]).reshape(-1, size) * unit
        rank = whole.rank_of(B)
        self.is_redundant = any(
            chain.twists and _rank([twist for twist, _ in chain.twists], s) < len(chain.twists)
            for chain in own.chains
        )
        chosen, basic = _pivots(B, rank)
        free = [i for i in range(size) if i not in set(basic)]
        N = arb_mat(size, len(free))
        if basic:
            X = stacked(rows, chosen, basic).solve(stacked(rows, chosen, free))
            for i, place in enumerate(basic):
                for j in range(len(free)):
                    N[place, j] = -X[i, j]
        for j, place in enumerate(free):
            N[place, j] = 1
        places = range(len(free))
        of_chain = [cut(N, range(n * i, n * i + n), places) for i in range(len(own.chains))]
        of_sum = [cut(N, [count + i], places) for i in range(len(own.sums))]
        self.P = arb_mat(n, len(free))
        for i, sign in own.ends.items():
            self.P += arb(sign) * of_chain[i]
        self.A = arb_mat(len(free), len(free))
        felt, self.softest = [], 0.0
        for i, chain in enumerate(own.chains):
            for T, C, U, sums in chain.springs:
                w = T * of_chain[i]
                for k, factor in sums.items():
                    w -= arb(factor) * of_sum[k]
                self.A += w.transpose() * C * w
                self.softest = max(self.softest, float(np.max(floats(C))))
                weight = np.ones(1) if T.nrows() == 1 else np.repeat([1.0, whole.length], 3)
                felt.append(U.T @ (floats(w) / weight[:, None]))
        for w, k in zip(of_sum, own.sums, strict=True):
            if k is not None:
                self.A += w.transpose() * w * (1 / arb(k))
                felt.append(floats(w))
        G = np.vstack(felt) if felt else np.zeros((0, len(free)))
        # decisions on orthonormal wrenches
        basis = null_space(B, rcond=CUT) if len(B) else np.eye(size)
        basis = basis[:, : size - rank]
        z = basis[free] * unit[free][:, None]
        end = sum((sign * basis[n * i : n * i + n] for i, sign in own.ends.items()), 0.0)
        self.held = self._orthonormal(np.asarray(end), whole)
        self.of_G = whole.rank_of(G @ z) if free else 0
        V = np.linalg.svd(G @ z)[2] if free else np.zeros((0, 0))
        # A row of rounding, made a unit row, would be a pivot.
        self.G = np.where(np.linalg.norm(G @ z, axis=1, keepdims=True) > CUT, G, 0.0)
        idle = V[self.of_G :].T
        carried = end @ idle if free else np.zeros((n, 0))
        whole.margins += [float(v) for v in np.ravel(np.abs(carried)) if 1e-12 < v < DOUBT[1]]
        self.is_rigid = bool(np.any(np.abs(carried) > 1e-8))
        self.n = n

    @staticmethod
    def _units(own: Carriers, s: np.ndarray) -> np.ndarray:
        """Of what sums of joints carry: so large that joints feel no more than of unit wrenches."""
        most = np.full(len(own.sums), 1e-300)
        for chain in own.chains:
            parts = [*chain.twists, *((T.transpose(), sums) for T, _, _, sums in chain.springs)]
            for column, sums in parts:
                for k, factor in sums.items():
                    size = float(np.linalg.norm(np.ravel(floats(column)) * s))
                    most[k] = max(most[k], abs(factor) / size)
        return 1 / most

    @staticmethod
    def _rows(own: Carriers, n: int, s: np.ndarray, size: int) -> list[arb_mat]:
        """Work on passive joints, and balances, of unit wrenches."""
        rows: list[arb_mat] = []
        for i, chain in enumerate(own.chains):
            for twist, sums in chain.twists:
                norm = arb(float(np.linalg.norm(np.ravel(floats(twist)) * s)))
                row = arb_mat(1, size)
                put(row, twist.transpose() * (1 / norm), 0, n * i)
                for k, factor in sums.items():
                    row[0, n * len(own.chains) + k] = -arb(factor) / norm
                rows.append(row)
        for balance in own.balances:
            for k in range(n):
                row = arb_mat(1, size)
                for i, sign in balance.items():
                    row[0, n * i + k] = arb(sign) / arb(float(s[k]))
                rows.append(row)
        return rows

    @staticmethod
    def _orthonormal(columns: np.ndarray, whole: Whole) -> np.ndarray:
        rank = whole.rank_of(columns)
        U, _, _ = np.linalg.svd(columns, full_matrices=False)
        return U[:, :rank]

    def stiffness(self) -> arb_mat:
        """P A^-1 P^T, the coordinates left out that no spring feels."""
        _, kept = _pivots(self.G, self.of_G)
        if not kept:
            return arb_mat(self.n, self.n)
        P = cut(self.P, range(self.n), kept)
        return P * cut(self.A, kept, kept).solve(P.transpose())


def _rank(twists: list[arb_mat], s: np.ndarray) -> int:
    J = np.array([np.ravel(floats(twist)) for twist in twists]).T * s[:, None]
    values = np.linalg.svd(J / np.linalg.norm(J, axis=0), compute_uv=False)
    return int(np.count_nonzero(values > CUT))


def _extent(snapshot: rs.Snapshot) -> float:
    """A length of the robot: largest distance of its springs, turns and ends from their mean."""
    points = _points(snapshot)
    away = np.linalg.norm(points - np.mean(points, axis=0), axis=-1)
    size = float(np.sqrt(np.mean(away**2)))
    C = np.zeros((6, 6))
    for leg in snapshot.legs:
        for spring in leg.springs:
            C = C + np.reshape(spring.elasticity.compliance, (6, 6))
    shift, turn = np.trace(C[:3, :3]), np.trace(C[3:, 3:])
    own = float(np.sqrt(shift / turn)) if shift > 0 and turn > 0 else 0.0
    parts = [part for leg in snapshot.legs for part in leg.parts]
    own = max([own, *(abs(part.pitch or 0.0) for part in parts if isinstance(part, PlacedFreedom))])
    # Points nearer than rounding are one, and so are those of which no spring feels the distance.
    if size > 1e-12 * float(np.max(np.abs(points))) and size > 1e-9 * own:
        return size
    return own or 1.0


def _points(snapshot: rs.Snapshot) -> list[np.ndarray]:
    points = [np.ravel(leg.end) for leg in snapshot.legs]
    for leg in snapshot.legs:
        for part in leg.parts:
            if isinstance(part, PlacedSpring) or part.pitch is not None:
                points.append(np.ravel(part.point))
    return points


def _pivots(B: np.ndarray, rank: int) -> tuple[list[int], list[int]]:
    """Rows and columns of the first pivots of elimination with complete pivoting."""
    B = _unit_rows(B).copy()
    rows, columns = [], []
    for _ in range(rank):
        r, c = np.unravel_index(np.argmax(np.abs(B)), B.shape)
        rows.append(int(r))
        columns.append(int(c))
        B -= np.outer(B[:, c] / B[r, c], B[r])
        B[:, c] = 0.0
        B[r] = 0.0
    return rows, columns


def _unit_rows(B: np.ndarray) -> np.ndarray:
    size = np.linalg.norm(B, axis=1, keepdims=True)
    return B / np.where(size > 0, size, 1.0)


def _unit_columns(B: np.ndarray) -> np.ndarray:
    return _unit_rows(B.T).T
