"""What is to be identified: springs, zeros and parameters by name; what readings tell of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import Enum
from fnmatch import fnmatchcase
from functools import partial
from typing import Any, cast

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen, replace
from robostiff.kept import kept
from robostiff.kinematics import find_posture
from robostiff.markup import number
from robostiff.model import (
    Actuated,
    Chain,
    Element,
    Joint,
    Link,
    ParallelBlock,
    Rigid,
    Robot,
    Telescope,
)
from robostiff.model.joint import JointKind, Locked
from robostiff.spatial import Frame, is_formula, skew

# Of the nominal value: what a compliance is at least.
_LEAST = 1e-6
# Of a compliance, by whether it turns.
_UNITS = {False: "m/N", True: "rad/(N m)"}
_AWAY = 1e-3  # of a parameter, to see what it moves


class UnknownKind(Enum):
    """Kinds of unknowns; where no measurement distinguishes some, they are fixed in this order."""

    GEOMETRY = "geometry"
    OTHER = "other"
    COMPLIANCE = "compliance"
    FACTOR = "factor"
    FRAME = "frame"


#: Of springs: readings are in proportion to these where loads are small.
ELASTIC = UnknownKind.COMPLIANCE, UnknownKind.FACTOR


@frozen
class Unknown:
    """A number that is to be found."""

    name: str  # of a spring, ``leg/part``, a factor or zero, or a parameter of the model
    kind: UnknownKind
    nominal: float  # where the search begins [SI]
    unit: str = ""
    least: float = -np.inf  # what it is at least
    # that of the model file whose reciprocal it is, or it itself; empty of a part
    parameter: str = ""
    plays: str = ""  # the joint whose play it is, ``leg/joint``
    # of a coordinate of an instrument or a marker: ``place`` or ``turn``, and of what
    frame: tuple[str, str] = ("", "")

    @property
    def stiffness_unit(self) -> str:
        """Of the reciprocal of a compliance."""
        return "N m/rad" if self.unit.startswith("rad") else "N/m"


# An entry of a part by itself, and what the part becomes with a symbol in its place.
_Change = Callable[[Any, Any], tuple[Element, ...]]
_Candidate = tuple[Unknown, _Change]


@kept
def with_unknowns(
    robot: Robot,
    patterns: tuple[str, ...],
    fixed: tuple[str, ...] = (),
    *,
    shared: bool = False,
    by_joints: bool = True,
) -> tuple[Robot, tuple[Unknown, ...]]:
    """The robot with symbols for what is to be found, and what that is.

    Patterns are names, which may have ``*``; those that are fixed keep their values. A shared one
    is one number for all springs that fit it. Postures are known in joints, or as poses.

    Raises InputError when a name fits nothing, or lengths are asked for where poses are given.
    """
    candidates = {pair[0].name: pair for pair in _candidates(robot.numeric)}
    symbols = {str(symbol): symbol for symbol in robot.symbols}
    groups = _groups(robot, [*symbols, *candidates], patterns, fixed, shared)
    chosen = {name for names in groups.values() for name in names}
    constants = {name: robot.nominal[name] for name in symbols if name not in chosen}
    if constants:
        robot = robot.substituted(constants)
    unknowns, changes = [], {}
    for group, names in groups.items():
        if names[0] in symbols:
            for name in names:
                robot, unknown = _of_symbol(robot, name)
                unknowns.append(unknown)
            continue
        first, *alike = (candidates[name][0] for name in names)
        _check_shared(group, first, alike)
        unknowns.append(replace(first, name=group))
        symbol = _symbol(group, positive=first.kind is not UnknownKind.GEOMETRY or None)
        changes |= {name: (candidates[name][1], symbol) for name in names}
    lengths = [unknown.name for unknown in unknowns if unknown.kind is UnknownKind.GEOMETRY]
    if lengths and not by_joints:
        raise InputError(
            f"{lengths[0]!r} of {robot.name!r}",
            got=Words("a length or an angle, with poses as postures"),
            expected="postures in joints: what the drives are commanded to",
            hint="give joints of an arm; of legs, identify compliances",
        )
    legs = tuple(
        replace(leg, chain=_with_symbols(leg.chain, f"{leg.name}/", changes)) for leg in robot.legs
    )
    nominal = {**robot.nominal, **{unknown.name: unknown.nominal for unknown in unknowns}}
    return replace(robot, legs=legs, nominal=nominal), tuple(unknowns)


def _groups(
    robot: Robot, names: Sequence[str], patterns: Sequence[str], fixed: Sequence[str], shared: bool
) -> dict[str, list[str]]:
    """Which of the known names are one number, by the name of their unknown.

    Raises InputError when a pattern fits nothing, or nothing is left.
    """
    for pattern in (*patterns, *fixed):
        if not any(_fits(name, pattern) for name in names):
            purpose = "to identify" if pattern in patterns else "that is fixed"
            hint = 'or a parameter of the file; in Python load(file, symbols=("R",)) keeps it'
            raise InputError(
                f"parameter of {robot.name!r} {purpose}",
                got=pattern,
                expected="one of " + ", ".join(names[:40]),
                hint=None if "/" in pattern else hint,
            )
    free = [name for name in names if not any(_fits(name, other) for other in fixed)]
    groups: dict[str, list[str]] = {}
    for pattern in patterns:
        fits = [name for name in free if _fits(name, pattern)]
        free = [name for name in free if name not in fits]
        groups |= {pattern: fits} if shared and fits else {name: [name] for name in fits}
    if not groups:
        got = "none that is not fixed" if patterns else "none"
        raise InputError("parameters to identify", got=got, expected='names, such as "arm/joint*"')
    return groups


def _check_shared(group: str, first: Unknown, others: Sequence[Unknown]) -> None:
    """Raise InputError where one number cannot stand for all of some unknowns."""
    got = expected = ""
    if any(other.kind is not first.kind or other.unit != first.unit for other in others):
        got, expected = "parts of several kinds", "one kind"
    elif not np.allclose([other.nominal for other in others], first.nominal, rtol=1e-9):
        got, expected = "parts of different compliance", "equal parts"
    elif first.plays and others:
        got, expected = "play", "one number for each joint"
    if got:
        raise InputError(f"shared {group!r}", got=Words(got), expected=expected)


def _fits(name: str, pattern: str) -> bool:
    """Whether a name has a pattern, and both the same ending."""
    ending = name.rpartition("/")[2].partition(".")[1:]
    return ending == pattern.rpartition("/")[2].partition(".")[1:] and fnmatchcase(name, pattern)


def _symbol(name: str, *, positive: bool | None = None) -> Any:
    import sympy as sp

    return sp.Symbol(name, real=True, positive=positive)


def _candidates(robot: Robot) -> Iterator[_Candidate]:
    for leg in robot.legs:
        yield from _of_chain(leg.chain, f"{leg.name}/")


def _of_chain(chain: Chain, prefix: str) -> Iterator[_Candidate]:
    def compliance(c: float, unit: str) -> Unknown:
        return Unknown(name, UnknownKind.COMPLIANCE, c, unit, _LEAST * c)

    for element in chain.elements:
        name = prefix + element.name
        if isinstance(element, ParallelBlock):
            for branch in element.branches:
                yield from _of_chain(branch.chain, f"{name}/{branch.name}/")
            continue
        if isinstance(element, Joint | Telescope):
            k = element.role.stiffness if isinstance(element.role, Actuated | Locked) else None
            turns = all(screw.turns for screw in element.freedoms)
            if isinstance(k, int | float | np.number):
                yield compliance(1 / float(k), _UNITS[turns]), _with_compliance
            kind = JointKind.PRISMATIC if isinstance(element, Telescope) else element.kind
            if kind in (JointKind.REVOLUTE, JointKind.PRISMATIC):
                zero = Unknown(f"{name}.zero", UnknownKind.GEOMETRY, 0.0, "rad" if turns else "m")
                yield zero, _with_zero
                if k:
                    yield replace(zero, name=f"{name}.play", plays=name), _with_zero
        elif isinstance(element, Link) and not element.elasticity.is_rigid:
            C = element.elasticity.compliance
            yield Unknown(f"{name}.factor", UnknownKind.FACTOR, 1.0, "", _LEAST), _with_factor
            for part, turns in ((slice(0, 3), False), (slice(3, 6), True)):
                size = float(np.trace(C[part, part]))
                if size and np.isclose(size, np.trace(C)) and np.linalg.matrix_rank(C) == 1:
                    yield compliance(size, _UNITS[turns]), partial(_with_factor, size=size)


def _with_compliance(joint: Any, c: Any) -> tuple[Element, ...]:
    return (replace(joint, role=replace(joint.role, stiffness=1 / c)),)


def _with_factor(element: Element, factor: Any, size: float = 1.0) -> tuple[Element, ...]:
    """A link whose compliance is ``factor / size`` times its own: of a beam by its moduli."""
    assert isinstance(element, Link)  # noqa: S101
    elasticity, beam, factor = element.elasticity, element.elasticity.beam, factor / size
    if beam is not None:
        beam = replace(beam, E=beam.E / factor, G=beam.G / factor)
    compliance = elasticity.compliance.astype(object) * factor
    segments = elasticity.segments and tuple(C.astype(object) * factor for C in elasticity.segments)
    changed = Elasticity(compliance, elasticity.freedoms, elasticity.bounds, beam, segments)
    return (replace(element, elasticity=changed),)


def _with_zero(element: Element, zero: Any) -> tuple[Element, ...]:
    """A joint behind a turn about its axis, or a shift along it."""
    import sympy as sp

    assert isinstance(element, Joint | Telescope)  # noqa: S101
    freedom = element.freedoms[0]
    whole = [not is_formula(x) and x == round(x) for x in freedom.axis]
    n = np.array([sp.nsimplify(x) if k else x for x, k in zip(freedom.axis, whole, strict=True)])
    frame = Frame(np.eye(3), n * zero)
    if freedom.turns:
        X = skew(n)
        R = sp.eye(3) + sp.Matrix(X) * sp.sin(zero) + sp.Matrix(X @ X) * (1 - sp.cos(zero))
        frame = Frame(np.array(R.tolist(), dtype=object), np.zeros(3))
    return (Rigid(frame, f"zero of {element.name}"), element)


def _with_symbols(chain: Chain, prefix: str, changes: Mapping[str, tuple[_Change, Any]]) -> Chain:
    """A chain with symbols at the parts of these names."""
    if not any(name.startswith(prefix) for name in changes):
        return chain
    elements: list[Element] = []
    for element in chain.elements:
        name = prefix + element.name
        if isinstance(element, ParallelBlock):
            branches = (
                replace(
                    branch, chain=_with_symbols(branch.chain, f"{name}/{branch.name}/", changes)
                )
                for branch in element.branches
            )
            elements.append(replace(element, branches=tuple(branches)))
            continue
        several: tuple[Element, ...] = (element,)
        for part in (name, f"{name}.factor", f"{name}.zero", f"{name}.play"):
            if part in changes:
                change, symbol = changes[part]
                several = (*several[:-1], *change(several[-1], symbol))
        elements += several
    return replace(chain, elements=tuple(elements))


def _of_symbol(robot: Robot, name: str) -> tuple[Robot, Unknown]:
    """A parameter of the model: the compliance whose stiffness it is, or it itself."""
    value = robot.nominal[name]
    stiffnesses: list[tuple[Any, bool]] = [
        (k, screw.turns)
        for leg in robot.legs
        for role, screw in zip(leg.chain.roles, leg.chain.freedoms, strict=True)
        for k in cast("list[Any]", [getattr(role, "stiffness", None)])
        if is_formula(k) and name in map(str, k.free_symbols)
    ]
    symbol = next(symbol for symbol in robot.symbols if str(symbol) == name)
    unit, compliance = _UNITS[bool(stiffnesses and stiffnesses[0][1])], UnknownKind.COMPLIANCE
    if stiffnesses and all(k == symbol for k, _ in stiffnesses):
        unknown = Unknown(f"1/{name}", compliance, 1 / value, unit, _LEAST / value, name)
        inverse = _symbol(unknown.name, positive=True)
        nominal = {**robot.nominal, unknown.name: unknown.nominal}
        changed = robot.substituted({name: 1 / inverse})
        return replace(changed, nominal={k: nominal[k] for k in nominal if k != name}), unknown
    if stiffnesses and all(k == 1 / symbol for k, _ in stiffnesses):
        return robot, Unknown(name, compliance, value, unit, _LEAST * value, name)
    rest = {str(x): robot.nominal[str(x)] for x in robot.symbols}
    away = value + _AWAY * (abs(value) or 1.0)
    near, far = (robot.substituted({**rest, name: x}) for x in (value, away))
    home = find_posture(near)
    if robot.is_posed_by_joints:
        pairs = [(home.pose, find_posture(far).pose)]
    else:  # of a platform in the same place
        there = find_posture(far, home.pose.reshape(-1, 6)[0, robot.coordinate_places])
        pairs = [*zip(home.coordinates, there.coordinates, strict=True)]
    moves = not all(np.allclose(a, b, rtol=0, atol=1e-12) for a, b in pairs)
    least = 0.0 if symbol.is_positive else -np.inf
    kind = UnknownKind.GEOMETRY if moves else UnknownKind.OTHER
    return robot, Unknown(name, kind, value, robot.units.get(name, ""), least, name)


def spring_values(robot: Robot) -> dict[str, float]:
    """Compliances of all drives and springs of a robot of numbers, by name."""
    unknowns = (unknown for unknown, _ in _candidates(robot))
    return {u.name: u.nominal for u in unknowns if u.kind is UnknownKind.COMPLIANCE}


# Of the largest column of its kind, of the largest singular value, and of readings: what is
# nothing.
_NO_COLUMN, _NO_VALUE, _NO_CHANGE = 1e-9, 1e-8, 1e-12
# Of the largest singular value, and correlations: what is little.
_WEAK, _CORRELATED = 1e-4, 0.98
# Correlations that are reported, but are no more than usual.
_REPORTED = 0.9
_PART = 1e-4  # of the largest entry of a null vector


@frozen
class Identifiability:
    """What some rates of readings tell of the unknowns, in sentences."""

    fixed: tuple[int, ...]  # unknowns that have to keep their values
    not_identified: tuple[str, ...]
    weak: tuple[str, ...]
    correlated: tuple[str, ...]  # by 0.9 to 0.98, which is not weak yet


def identifiability(
    J: np.ndarray, unknowns: Sequence[Unknown], read: float = 0.0
) -> Identifiability:
    """What readings tell of the unknowns, by their rates J (M, n) over standard deviations.

    Columns of rates are scaled to length 1. A combination of them that vanishes is one that no
    reading sees: one of its members is fixed for each, lengths and angles before frames. Beside
    `read`, the norm of the readings over their standard deviations, rates may be rounding.

    References
    ----------
    Golub, Van Loan: Matrix Computations, 4th edition, section 5.4.
    """
    n, length = len(unknowns), np.linalg.norm(J, axis=0)
    # columns that are nothing beside those of their kind
    scaled = length * [abs(u.nominal) if u.kind in ELASTIC else 1.0 for u in unknowns]
    kinds = [(unknown.kind, unknown.unit) for unknown in unknowns]
    largest = {kind: max(scaled[[other == kind for other in kinds]]) for kind in kinds}
    # and those by whose whole values readings change no more than rounding does
    whole = length * [
        1.0 if u.kind is UnknownKind.FRAME else abs(u.nominal) or 1.0 for u in unknowns
    ]
    none = (whole <= _NO_CHANGE * read) | (scaled <= [_NO_COLUMN * largest[kind] for kind in kinds])
    fixed = np.flatnonzero(none).tolist()
    without = [unknowns[k] for k in fixed]
    sentences = [
        f"no measurement depends on {unknown.name}: no load strains it (a force that is parallel "
        "to its axis, or meets it, does not); add a load in another direction or at another point"
        for unknown in without
        if unknown.kind in ELASTIC
    ]
    sentences += [
        f"no measurement depends on {name}; add other postures or markers"
        for name in names_in_words([unknown for unknown in without if unknown.kind not in ELASTIC])
    ]
    free = [k for k in range(n) if k not in fixed]
    weak, correlated = [], []
    if free:
        S = J[:, free] / length[free]
        R: np.ndarray = np.asarray(np.linalg.qr(S, mode="r"))
        _, s, Vt = np.linalg.svd(R, full_matrices=True)
        s = np.append(s, np.zeros(len(free) - len(s)))
        null = Vt[s <= _NO_VALUE * s[0]].T
        order = np.array([[*UnknownKind].index(unknowns[k].kind) for k in free])
        effect = length[free] * [abs(unknowns[k].nominal) or 1.0 for k in free]
        # one member is fixed for each null vector: of those that are clearly a part of what is
        # left, the first in order, and among them that of least effect
        pivots, rest = [], null.copy()
        for _ in range(null.shape[1]):
            size = np.linalg.norm(rest, axis=1)
            size[pivots] = 0.0
            able = np.flatnonzero(size > 0.1 * size.max())
            pivots.append(int(able[np.lexsort((effect[able], order[able]))[0]]))
            direction = rest[pivots[-1]] / np.linalg.norm(rest[pivots[-1]])
            rest = rest - np.outer(rest @ direction, direction)
        # null vectors, each with one member that no other has
        vectors = null @ np.linalg.inv(null[pivots])
        for pivot, vector in zip(pivots, vectors.T, strict=True):
            size = np.abs(vector)
            members = [i for i in np.argsort(-size) if size[i] > _PART * size.max() and i != pivot]
            unknown, others = unknowns[free[pivot]], [unknowns[free[i]] for i in members]
            words = f"no measurement distinguishes {_names_in_words([unknown, *others])}"
            if len(others) == 1 and unknown.kind is others[0].kind is UnknownKind.COMPLIANCE:
                ratio = vector[members[0]] / vector[pivot]
                if abs(ratio * length[free[pivot]] / length[free[members[0]]] + 1) < 1e-3:
                    words = f"only the sum of {unknown.name} and {others[0].name} is determined"
            sentences.append(f"{words}: {unknown.name} keeps its value")
            fixed.append(free[pivot])
        several = [unknowns[k] for k in free if k not in fixed]
        if several:
            R = R[:, [k not in fixed for k in free]]
            _, s, Vt = np.linalg.svd(R, full_matrices=False)
            for value, vector in zip(s, Vt, strict=True):
                if value < _WEAK * s[0]:
                    size = np.abs(vector)
                    group = [several[i] for i in np.argsort(-size) if size[i] > 0.1]
                    are = "are" if len(group) > 1 else "is"
                    weak.append(
                        f"{_names_in_words(group)} {are} hardly determined: errors grow "
                        f"{number(s[0] / value, 1)} times in this direction"
                    )
            weak += _correlations(R, several, _CORRELATED, np.inf)
            correlated = _correlations(R, several, _REPORTED, _CORRELATED)
    return Identifiability(tuple(fixed), tuple(sentences), tuple(weak), tuple(correlated))


def _correlations(
    R: np.ndarray, unknowns: Sequence[Unknown], least: float, most: float
) -> list[str]:
    """Parameters whose errors go together with those of others, by correlations between two."""
    inverse = np.linalg.pinv(R)
    covariance = inverse @ inverse.T
    d = np.sqrt(np.diag(covariance))
    size = np.abs(covariance / np.outer(d, d))
    together = (size > least) & (size <= most)
    sentences = []
    for i, unknown in enumerate(unknowns):
        others = [unknowns[j] for j in range(i + 1, len(unknowns)) if together[i, j]]
        if others and unknown.kind is not UnknownKind.FRAME:
            sentences.append(
                f"errors of {unknown.name} go together with those of {_names_in_words(others)}, "
                f"correlations above {least}: other postures or loads would distinguish them"
            )
    return sentences


def _names_in_words(unknowns: Sequence[Unknown]) -> str:
    """Names in a sentence; of many the first ones."""
    names = names_in_words(unknowns)
    shown = [*names[:6], *([f"{len(names) - 6} more"] if len(names) > 6 else [])]
    if len(shown) == 1:
        return shown[0]
    return f"{', '.join(shown[:-1])} and {shown[-1]}"


def names_in_words(unknowns: Sequence[Unknown]) -> list[str]:
    """Names of unknowns; several coordinates of an instrument or a marker are its place or turn."""
    frames = [unknown.frame for unknown in unknowns]
    whole = {frame for frame in frames if frame[0] and frames.count(frame) > 1}
    names = []
    for unknown in unknowns:
        of = unknown.frame[1]
        words = " and ".join(what for what in ("place", "turn") if (what, of) in whole)
        names.append(f"the {words} of {of}" if unknown.frame in whole else unknown.name)
    return list(dict.fromkeys(names))
