"""The wrench basis form on recorded entries: a leg in a working frame, and its elimination.

In that frame joints look trivial; pivots are chosen once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations_with_replacement, pairwise
from typing import Any

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.frozen import field, frozen
from robostiff.model import CoupledFreedom, PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.record import Entry, Record, is_number, is_zero, least_size, most_size, shortened
from robostiff.spatial import Screw

#: A wrench or twist: six entries or numbers, or three in the plane.
Column = list[Any]

_MOST_FRAMES, _OF_LONG_LEGS = 64, 12
_SQUARE = 1e-12  # cosine of a right angle: rounding


@frozen
class WorkingFrame:
    """Axes (columns of R, world) and origin p in which a leg is worked on."""

    R: np.ndarray
    p: np.ndarray


@frozen
class LocalSpring:
    """An elastic part in a working frame: own axes R (columns), place p, compliance (6, 6)."""

    R: np.ndarray
    p: np.ndarray
    compliance: np.ndarray

    def wrench(self, w: Column) -> Column:
        """A wrench about the frame's origin, moved to the end of the part, in the part's axes."""
        force, moment = w[:3], w[3:]
        moment = [m - c for m, c in zip(moment, cross(self.p, force), strict=True)]
        return [*turned_back(self.R, force), *turned_back(self.R, moment)]


@frozen
class LocalLeg:
    """A leg in a working frame."""

    twists: list[Column]  # J_q, one column a passive freedom, about the frame's origin
    springs: list[LocalSpring]
    drives: list[tuple[Column, Any]]  # twists of the elastic joints
    # The branches of each parallel block
    blocks: list[tuple[LocalLeg, ...]] = field(default_factory=list)

    @property
    def entries(self) -> int:
        """Number of entries that are not numbers; fewer give a shorter record."""
        seen = [x for twist in self.twists for x in twist]
        seen += [x for spring in self.springs for x in (*spring.R.flat, *spring.p)]
        seen += [x for twist, _ in self.drives for x in twist]
        inner = sum(branch.entries for block in self.blocks for branch in block)
        return sum(isinstance(x, Entry) for x in seen) + inner


def local_leg(leg: PlacedLeg, frame: WorkingFrame, record: Record, length: float) -> LocalLeg:
    """A leg in a working frame; entries that are 0 or 1 there at all poses become numbers."""
    twists, springs, drives = [], [], []
    blocks = [
        tuple(local_leg(branch, frame, record, length) for branch in block.branches)
        for block in leg.blocks
    ]
    for element in leg.own_parts:
        if isinstance(element, PlacedFreedom):
            twist = _twist(element, frame, record, length)
            if element.is_passive:
                twists.append(twist)
            elif element.stiffness is not None:
                drives.append((twist, element.stiffness))
            continue
        p = [record.simplify(x, length) for x in turned_back(frame.R, element.point - frame.p)]
        rows, columns = frame.R.T, element.rotation.T
        R = [[record.simplify(dot(row, column)) for column in columns] for row in rows]
        axes, at = np.array(R, dtype=object), np.array(p, dtype=object)
        spring = LocalSpring(axes, at, element.elasticity.compliance)
        springs.append(spring)
        for freedom in element.elasticity.freedoms.T:
            move, turn = ([dot(row, part) for row in R] for part in (freedom[:3], freedom[3:]))
            lever = cross(spring.p, turn)
            twists.append([*(a + b for a, b in zip(move, lever, strict=True)), *turn])
    return LocalLeg(twists, springs, drives, blocks)


def working_frames(leg: PlacedLeg, world: WorkingFrame) -> Iterator[WorkingFrame]:
    """Candidate frames: the world, and the axes of springs and joints at each of their points.

    A slide or turn and the next axis across it make a frame, too. A long leg has too many pairs of
    axes and points: axes are then tried at points as far along the leg.
    """
    yield world
    rotations = [e.rotation for e in leg.springs]
    for first, second in pairwise(() if rotations else leg.freedoms):
        if most_size(dot(first.axis, second.axis)) < _SQUARE:
            columns = [first.axis, second.axis, cross(first.axis, second.axis)]
            rotations.append(np.array(columns, dtype=object).T)
    rotations = rotations or [world.R]
    points = [e.point for e in leg.parts if isinstance(e, PlacedSpring) or e.turns]
    pairs = [(R, p) for R in rotations for p in points]
    if len(pairs) > _MOST_FRAMES:
        along = np.arange(_OF_LONG_LEGS) / _OF_LONG_LEGS
        axes, at = ((along * len(choices)).astype(int) for choices in (rotations, points))
        pairs = [(rotations[i], points[k]) for i, k in zip(axes, at, strict=True)]
    tried: set[tuple[Any, ...]] = set()
    for R, p in pairs:
        key = (*map(_key, R.flat), *map(_key, p))
        if key not in tried:
            tried.add(key)
            yield WorkingFrame(R, p)


def energy_of(leg: LocalLeg, wrenches: Sequence[Column], rows: Sequence[int]) -> list[list[Any]]:
    """W^T C W of a leg's wrenches (in some rows of six), spring by spring, blocks left out."""
    whole = [_whole(w, rows) for w in wrenches]
    energy: list[list[Any]] = [[0] * len(whole) for _ in whole]
    pairs = [*combinations_with_replacement(range(len(whole)), 2)]
    for spring in leg.springs:
        seen = [spring.wrench(w) for w in whole]
        given = [[dot(w, column) for column in spring.compliance.T] for w in seen]
        for i, j in pairs:
            energy[i][j] = energy[j][i] = energy[i][j] + dot(given[i], seen[j])
    for twist, stiffness in leg.drives:
        work = [dot(w, twist) for w in whole]
        for i, j in pairs:
            if not (is_zero(work[i]) or is_zero(work[j])):
                energy[i][j] = energy[j][i] = energy[i][j] + work[i] * work[j] / stiffness
    return energy


def to_world(
    w: Column, frame: WorkingFrame, reference: np.ndarray, rows: tuple[int, ...]
) -> Column:
    """A wrench of a working frame in world axes, about the reference point."""
    whole = _whole(w, rows)
    force = [dot(row, whole[:3]) for row in frame.R]
    moment = [dot(row, whole[3:]) for row in frame.R]
    arm = frame.p - reference
    moment = [m + c for m, c in zip(moment, cross(arm, force), strict=True)]
    both = [*force, *moment]
    return [both[row] for row in rows]


def from_world(
    w: Column, frame: WorkingFrame, reference: np.ndarray, rows: tuple[int, ...]
) -> Column:
    """A wrench about the reference point in world axes, in a working frame."""
    whole = _whole(w, rows)
    moment = [m - c for m, c in zip(whole[3:], cross(frame.p - reference, whole[:3]), strict=True)]
    both = [*turned_back(frame.R, whole[:3]), *turned_back(frame.R, moment)]
    return [both[row] for row in rows]


def turned_back(R: np.ndarray, v: Any) -> Column:
    """R^T v."""
    return [dot(R[:, k], v) for k in range(3)]


def cross(a: Any, b: Any) -> Column:
    """Cross product of a and b."""
    return [
        dot((a[1], a[2]), (b[2], -b[1])),
        dot((a[2], a[0]), (b[0], -b[2])),
        dot((a[0], a[1]), (b[1], -b[0])),
    ]


def _twist(freedom: Screw, frame: WorkingFrame, record: Record, length: float) -> Column:
    """Column (17) about the frame's origin."""
    if isinstance(freedom, CoupledFreedom):
        moves = [(t, _twist(screw, frame, record, length)) for _, t, screw in freedom.moves]
        return [dot([t for t, _ in moves], [twist[row] for _, twist in moves]) for row in range(6)]
    p = [record.simplify(x, length) for x in turned_back(frame.R, freedom.point - frame.p)]
    axis = [record.simplify(x) for x in turned_back(frame.R, freedom.axis)]
    here = Screw(np.array(axis, dtype=object), np.array(p, dtype=object), freedom.pitch)
    return here.twist(np.zeros(3, dtype=int)).tolist()


def _whole(w: Column, rows: Sequence[int]) -> Column:
    whole: Column = [0] * 6
    for row, x in zip(rows, w, strict=True):
        whole[row] = x
    return whole


def _key(value: Any) -> Any:
    return ("entry", value.step) if isinstance(value, Entry) else float(value)


def dot(a: Sequence[Any] | np.ndarray, b: Sequence[Any] | np.ndarray) -> Any:
    """Sum of products; zeros leave no trace."""
    total: Any = 0
    for x, y in zip(a, b, strict=True):
        if (isinstance(x, Entry) or x != 0) and (isinstance(y, Entry) or y != 0):
            total = total + x * y
    return total


_LOST = 1e-9  # a joint nearer than this to those before is redundant, as in `Tolerance`
_FEW_DIGITS = 0.01  # a pivot of drives loses but half as many digits as its square says
_SAFE = 0.2  # of a drive: where it is larger at all samples, shorter wrenches are preferred
_LITTLE = 1e-4  # of a pivot of energies: what is left of it has few digits
_ROUNDING = 1e-11  # of a wrench: what elimination leaves of zero
_RIGID = 1e-13  # of a compliance: what is left of it is rounding


@frozen
class Transmitted:
    """Wrenches that the passive joints of a chain transmit."""

    wrenches: list[Column]  # basis W of null(J_q^T)
    # Of each recorded pivot: 1 where it is as safe as it can be, towards infinity where it vanishes
    losses: list[Any]
    redundant: tuple[bool, ...]  # which joints add no freedom to those before
    # Of each joint a square that vanishes where it becomes redundant, and that nothing is divided
    # by; 1 elsewhere
    alone: tuple[Any, ...]


@frozen
class Conjugate:
    """Wrenches made conjugate to one another: W^T C W = diag(mu), so K = sum of w w^T / mu."""

    wrenches: list[Column]
    mu: list[Any]  # compliance under each
    # By how much mu is smaller than the compliance of the wrench as it came: the digits lost
    losses: list[Any]


def transmitted_by(
    twists: Sequence[Column], start: Sequence[Column], scale: Sequence[float]
) -> Transmitted:
    """Basis of the wrenches that do no work on passive twists, by elimination.

    All of a start are transmitted to begin with, perhaps with further entries that come along; each
    joint removes the one that drives it (16), a trivial joint by deletion as in (19). Entries of
    twists are multiplied by a scale to be compared, and those of wrenches divided: 1 for a shift or
    force, the characteristic length [m] for a turn or moment.
    """
    wrenches = [list(w) for w in start]
    losses: list[Any] = []
    redundant = []
    alone: list[Any] = []
    for twist in twists:
        drives = [dot(w, twist) for w in wrenches]
        size_of_twist = _norm([t * s for t, s in zip(twist, scale, strict=True)])
        sizes = [wrench_size(w, scale) * size_of_twist for w in wrenches]
        # A pivot is lost if it is small at all samples, safe if it is large at each of them.
        drives = [
            0 if most_size(drive) <= _LOST * size else drive
            for drive, size in zip(drives, sizes, strict=True)
        ]
        # What passes a joint that none of the wrenches moves has no size.
        safety = [
            least_size(drive) / size if size else 0.0
            for drive, size in zip(drives, sizes, strict=True)
        ]
        active = [i for i, drive in enumerate(drives) if not is_zero(drive)]
        redundant.append(not active)
        alone.append(drives[active[0]] * drives[active[0]] if len(active) == 1 else 1)
        if not active:
            continue

        # Numbers come before entries, short wrenches before long ones, then the safest.
        entries = {i: sum(isinstance(x, Entry) for x in wrenches[i]) for i in active}
        kind = {i: int(not is_number(drives[i])) + 2 * (safety[i] <= _SAFE) for i in active}
        pivot = min(active, key=lambda i: (kind[i], entries[i], -safety[i]))
        taken, drive = wrenches[pivot], drives[pivot]
        if isinstance(drive, Entry) and len(active) == 2:
            # Of two wrenches one combination is left, which needs no division: it holds wherever
            # one of the two drives does not vanish.
            (other,) = (i for i in active if i != pivot)
            both = drive * drive + drives[other] * drives[other]
            whole = float(np.hypot(sizes[pivot], sizes[other]))
            losses.append(_loss(both, float(np.sqrt(least_size(both))) / whole))
            alone[-1] = both
            combined = [
                (0 if is_zero(x) else drive * x) - (0 if is_zero(y) else drives[other] * y)
                for x, y in zip(wrenches[other], taken, strict=True)
            ]
            wrenches = [combined if i == other else w for i, w in enumerate(wrenches) if i != pivot]
            continue
        if isinstance(drive, Entry):
            losses.append(_loss(drive * drive, safety[pivot]))
        remaining = []
        for i, w in enumerate(wrenches):
            if i == pivot:
                continue
            factor = shortened(drives[i] / drive) if i in active else 0
            remaining.append(
                w if is_zero(factor) else [a - factor * b for a, b in zip(w, taken, strict=True)]
            )
        wrenches = remaining
    return Transmitted(wrenches, losses, tuple(redundant), tuple(alone))


def made_conjugate(wrenches: Sequence[Column], energy: list[list[Any]], leg: str) -> Conjugate:
    """Gram-Schmidt of wrenches in the energy W^T C W, the safest pivot first.

    A wrench that meets no compliance is an `InputError` that names the leg. (One that holds nothing
    may: it is left out.)
    """
    columns = [list(w) for w in wrenches]
    n = len(columns)
    M = [list(row) for row in energy]
    first = [least_size(M[i][i]) for i in range(n)]
    little = _RIGID * max(first, default=0.0)
    for i, held in enumerate(columns):
        if first[i] <= little and all(map(is_zero, held)):
            first[i] = 0.0  # stress within rigid parts, but for rounding
    done: list[Column] = []
    mu: list[Any] = []
    losses: list[Any] = []
    start = [M[i][i] for i in range(n)]
    open_ = list(range(n))
    while open_:
        part = {i: least_size(M[i][i]) / first[i] if first[i] > 0 else 0.0 for i in open_}

        # Pivots that keep their digits and internal stress come first, then what is alone.
        holds = {i: not all(map(is_zero, columns[i])) for i in open_}
        coupled = {i: sum(not is_zero(M[i][j]) for j in range(n) if j != i) for i in open_}
        lost = {i: (part[i] < _LITTLE) + (part[i] <= _RIGID) for i in open_}
        pivot = min(open_, key=lambda i: (lost[i], holds[i], coupled[i], -part[i]))
        if part[pivot] <= _RIGID:
            largest = max(most_size(x) for w in wrenches for x in w)
            if all(most_size(x) <= _LOST * largest for i in open_ for x in columns[i]):
                break  # internal stress between rigid branches
            raise InputError(
                f"leg {leg!r}",
                got=Words("a transmitted wrench that meets no compliance"),
                expected="elasticity on every path that carries a load",
                hint="give a link or an actuator of the leg its elasticity",
            )
        open_.remove(pivot)
        diagonal = M[pivot][pivot]
        if isinstance(diagonal, Entry) and diagonal is not start[pivot]:
            losses.append(start[pivot] / diagonal)
        mu.append(diagonal)
        done.append(columns[pivot])
        for i in open_:
            shared = M[pivot][i]
            if is_zero(shared):
                continue
            factor = shortened(shared / diagonal)
            columns[i] = [a - factor * b for a, b in zip(columns[i], columns[pivot], strict=True)]
            for j in open_:
                if j >= i:
                    M[i][j] = M[j][i] = M[i][j] - factor * M[pivot][j]
    return Conjugate(done, mu, losses)


def _norm(column: Sequence[Any]) -> float:
    """Norm of a column, the mean over the samples."""
    squares = sum(np.mean(x.sample**2) if isinstance(x, Entry) else float(x) ** 2 for x in column)
    return float(np.sqrt(squares))


def _loss(square: Any, safety: float) -> Any:
    """Square of a pivot at the samples over its square; larger where it was less safe."""
    usual = float(np.mean(square.sample))
    return square.reciprocal() * (_FEW_DIGITS * usual / safety**2)


@frozen
class Carried:
    """Ways in which a leg can carry load."""

    # W, what each way holds the end of the leg by; of several ways around a loop, some may hold it
    # alike, or not at all
    wrenches: list[Column]
    # Twice the elastic energy of their combinations; W^T C W where nothing is parallel
    energy: list[list[Any]]
    losses: list[Any]  # of the recorded pivots
    # Of the passive joints: those of the leg, those of the branches of its blocks, and whether each
    # further block leaves anything free that the blocks before do
    redundant: tuple[bool, ...]
    alone: tuple[Any, ...]  # of the passive joints, in the same order; see `Transmitted`


def carried_by(leg: LocalLeg, rows: Sequence[int], length: float) -> Carried:
    """Ways in which a leg can carry load, in its working frame: in all rows of six, or in some.

    The branches of a block add their ways to one another, and the joints of the leg take ways away.
    Of several blocks each must carry what the first does.
    """
    n = len(rows)
    twists = [[twist[row] for row in rows] for twist in leg.twists]
    scale = [1.0 if row < 3 else length for row in rows]
    if not leg.blocks:
        start = [[int(i == k) for i in range(n)] for k in range(n)]
        found = transmitted_by(twists, start, scale)
        energy = energy_of(leg, found.wrenches, rows)
        return Carried(found.wrenches, energy, found.losses, found.redundant, found.alone)
    blocks = [[carried_by(branch, rows, length) for branch in block] for block in leg.blocks]
    ways = [[w for branch in block for w in branch.wrenches] for block in blocks]
    inner = sum(map(len, ways))
    columns: list[Column] = []
    conditions: list[Column] = []
    for number, group in enumerate(ways):
        first = len(columns)
        for k, w in enumerate(group):
            end = w if number == 0 else [0] * n
            columns.append([*end, *(int(j == first + k) for j in range(inner))])
        if number:
            # It carries the same wrench as the first block does: F - A x = 0.
            for row in range(n):
                condition: Column = [int(row == i) for i in range(n)] + [0] * inner
                condition[n + first : n + first + len(group)] = [-w[row] for w in group]
                conditions.append(condition)
    scale += [1.0 / wrench_size(w, scale) for group in ways for w in group]
    idle = [0] * inner
    found = transmitted_by([*conditions, *([*t, *idle] for t in twists)], columns, scale)
    branches = [branch for block in blocks for branch in block]
    wrenches = ends_of(found.wrenches, n, scale)
    energy = energy_of(leg, wrenches, rows)
    add_energy_in_shares(energy, [way[n:] for way in found.wrenches], branches)
    return Carried(
        wrenches=wrenches,
        energy=energy,
        losses=[*found.losses, *(loss for branch in branches for loss in branch.losses)],
        redundant=(
            *found.redundant[len(conditions) :],
            *(r for branch in branches for r in branch.redundant),
            *(any(found.redundant[k : k + n]) for k in range(0, len(conditions), n)),
        ),
        alone=(
            *found.alone[len(conditions) :],
            *(x for branch in branches for x in branch.alone),
            *(1 for _ in range(0, len(conditions), n)),
        ),
    )


def add_energy_in_shares(
    energy: list[list[Any]], ways: Sequence[Column], parts: Sequence[Carried]
) -> None:
    """Add the energy of parts (m, m) in place; every way has a share of the wrenches of each."""
    start = 0
    for part in parts:
        stop = start + len(part.wrenches)
        shares = [way[start:stop] for way in ways]
        given = [[dot(row, share) for row in part.energy] for share in shares]
        for i, j in combinations_with_replacement(range(len(ways)), 2):
            energy[i][j] = energy[j][i] = energy[i][j] + dot(given[i], shares[j])
        start = stop


def ends_of(ways: Sequence[Column], n: int, scale: Sequence[float]) -> list[Column]:
    """What ways around loops hold the end by, their first n entries; 0 where that is rounding.

    Free motions are no stiffness then, and internal stress holds nothing.
    """
    sizes = [_ROUNDING * wrench_size(way, scale) for way in ways]
    return [
        [0 if most_size(x) <= size * s else x for x, s in zip(way[:n], scale[:n], strict=True)]
        for way, size in zip(ways, sizes, strict=True)
    ]


def wrench_size(wrench: Column, scale: Sequence[float]) -> float:
    """Norm of a scaled wrench, the mean over the samples; 1 of one that holds nothing."""
    squares = [
        np.mean((x.sample if isinstance(x, Entry) else float(x)) ** 2) / s**2
        for x, s in zip(wrench, scale, strict=False)
    ]
    return float(np.sqrt(sum(squares))) or 1.0
