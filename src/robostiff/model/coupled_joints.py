"""Coupled joints: gears, differentials and mimic joints as sums of joint coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import islice, permutations
from typing import Any, cast

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.frozen import frozen
from robostiff.model.joint import Actuated, Joint, Locked, Passive
from robostiff.spatial import as_float
from robostiff.spatial.formula import Scalar, exact_together, is_formula

_GEAR = Locked()
_ROUNDING = 1e-9  # part of a factor: less is left of a sum that others contain
_ORDERS = 120  # in which couplings choose the joints that follow


@frozen
class Coupling:
    """A sum of joint coordinates of one chain, ``s = a_1 q_1 + a_2 q_2 + ...``, and what holds it.

    A gear ``q_2 = r q_1 + c`` is the sum ``q_2 - r q_1``, which is locked at c. The two motors of a
    differential are the sum and the difference of its joints, both actuated. Every coupling takes
    the place of one passive joint among the coordinates of the chain: its coordinate is s.

    Attributes
    ----------
    terms : tuple of (str, float or formula)
        Names of joints of the chain that have one coordinate, with their factors. s is a length or
        an angle as the coordinate of the first is; the factors of others convert theirs.
    role : Locked or Actuated
        Locked by a gear, rigid or with a stiffness against s; actuated where s is what a drive
        moves.
    home : float, formula or None
        s in the home configuration [m, rad]; that of the joints' home coordinates for None.
    name : str

    Examples
    --------
    >>> gear = coupling("wrist 2", follows="wrist 1", ratio=-1.5)
    >>> gear.terms, gear.home
    ((('wrist 2', 1.0), ('wrist 1', 1.5)), 0.0)
    """

    terms: tuple[tuple[str, Scalar], ...]
    role: Locked | Actuated = _GEAR
    home: Any = None
    name: str = ""

    def __post_init__(self) -> None:
        terms = tuple((joint, factor) for joint, factor in self.terms)
        names = [joint for joint, _ in terms]
        subject = f"coupling of {', '.join(map(repr, names))}" if names else "coupling"
        if not self.name:
            object.__setattr__(self, "name", f"coupling of {' and '.join(names)}")
        if len(terms) < 2 or len(set(names)) < len(names):
            raise InputError(
                subject, got=names, expected="the names of at least two joints, each once"
            )
        for joint, factor in terms:
            what, expected = f"factor of {joint!r} in the {subject}", "a number other than 0"
            if not is_formula(factor) and as_float(what, factor, expected) == 0:
                hint = "leave out a joint that the others do not move"
                raise InputError(what, got=factor, expected=expected, hint=hint)
        if self.home is not None and not is_formula(self.home):
            as_float(f"sum of the {subject}", self.home, "a number")
        if isinstance(self.role, Passive):
            raise InputError(
                f"role of the {subject}",
                got=Words("passive"),
                expected="locked, or actuated where a drive moves the sum",
            )
        object.__setattr__(self, "terms", terms)

    @property
    def in_words(self) -> str:
        """The sum, such as ``wrist 2 + 1.5 wrist 1``."""
        text = ""
        for joint, factor in self.terms:
            if is_formula(factor):
                text += f" + ({factor}) {joint}"
                continue
            sign, size = ("-" if factor < 0 else "+"), abs(float(factor))
            text += f" {sign} " + (joint if size == 1 else f"{size:.6g} {joint}")
        return text.removeprefix(" + ").strip()


def coupling(
    joint: str,
    *,
    follows: str,
    ratio: Scalar,
    offset: Scalar = 0.0,
    stiffness: Any = None,
    name: str = "",
) -> Coupling:
    """A joint that follows another one, ``q = ratio q_followed + offset``: a gear, belt or rack.

    Parameters
    ----------
    joint, follows : str
        Names of two joints of the chain.
    ratio : float or formula
        A number between two turns or two slides; of a slide that follows a turn, its advance for
        one radian [m/rad].
    offset : float or formula
        [m, rad]
    stiffness : float or formula, optional
        Of a belt or gear at `joint`, while the other one is locked [N/m, N m/rad]; rigid when
        left out.
    """
    if not is_formula(ratio) and ratio == 0:
        subject = f"ratio of {joint!r} to {follows!r}"
        hint = "a joint that does not move is locked"
        raise InputError(subject, got=ratio, expected="a number other than 0", hint=hint)
    return Coupling(((joint, 1.0), (follows, -ratio)), Locked(stiffness), offset, name)


@frozen
class Transmission:
    """How the coordinates p of a chain move its joints, ``q = T p``, ``p = A q``."""

    # (n, n): inverse of each other; rows of the identity where a joint is a coordinate by itself
    A: np.ndarray
    T: np.ndarray
    # the couplings, by the place of the joint whose place in p they take
    sums: Mapping[int, Coupling]


def transmission(
    joints: Mapping[str, tuple[int, Any]], size: int, couplings: Sequence[Coupling]
) -> Transmission:
    """The transmission of a chain of so many coordinates.

    Its moving elements come by their names, with their places among the coordinates. Raises
    InputError when a coupling names a joint that is not there or has several freedoms, leaves no
    passive joint to follow, or follows from those before it.
    """
    for relation in couplings:
        for name, _ in relation.terms:
            if name not in joints:
                known = ", ".join(map(repr, joints)) or "none"
                expected = f"a joint of the same chain: {known}"
                raise InputError(f"joint of {relation.name!r}", got=name, expected=expected)
            element = joints[name][1]
            if not isinstance(element, Joint) or element.size != 1:
                raise InputError(
                    f"joint {name!r} of {relation.name!r}",
                    got=element.kind.value if isinstance(element, Joint) else "telescope",
                    expected="a joint with one coordinate",
                    hint="write its freedoms as joints one after the other",
                )
    at = {name: place for name, (place, _) in joints.items()}
    flat = iter(exact_together(*(factor for c in couplings for _, factor in c.terms)))
    rows = [{name: next(flat) for name, _ in c.terms} for c in couplings]
    chosen = _followers(couplings, rows, joints)
    places = [at[name] for name in chosen]
    exact = any(is_formula(factor) for row in rows for factor in row.values())
    A = np.eye(size, dtype=int).astype(object) if exact else np.eye(size)
    T = A.copy()
    for place, row in zip(places, rows, strict=True):
        A[place] = 0
        for name, factor in row.items():
            A[place, at[name]] = factor
    others = [k for k in range(size) if k not in places]
    S = _inverse(A[np.ix_(places, places)])
    T[np.ix_(places, places)] = S
    T[np.ix_(places, others)] = -(S @ A[np.ix_(places, others)])
    return Transmission(A, T, dict(zip(places, couplings, strict=True)))


def _followers(
    couplings: Sequence[Coupling], rows: Sequence[Mapping[str, Any]], joints: Mapping[str, Any]
) -> list[str]:
    """The joint whose place each coupling takes; others choose first where that leaves it none."""
    first: InputError | None = None
    for order in islice(permutations(range(len(rows))), _ORDERS):
        reduced: dict[str, Mapping[str, Any]] = {}
        try:
            for k in order:
                row = dict(rows[k])
                for pivot, before in reduced.items():
                    share = row.get(pivot, 0)
                    if not _is_nothing(share, 0.0):
                        of_pivot = share / before[pivot]
                        for name in row.keys() | before.keys():
                            row[name] = row.get(name, 0) - of_pivot * before.get(name, 0)
                        row[pivot] = 0
                reduced[_follower(couplings[k], row, list(reduced), joints)] = row
        except InputError as error:
            first = first or error
            continue
        taken = dict(zip(order, reduced, strict=True))
        return [taken[k] for k in range(len(rows))]
    raise cast("InputError", first)


def _follower(
    relation: Coupling,
    row: Mapping[str, Any],
    taken: Sequence[str],
    joints: Mapping[str, tuple[int, Any]],
) -> str:
    """The passive joint whose place among the coordinates a coupling takes: the first that can."""
    factors = dict(relation.terms)
    turns = joints[relation.terms[0][0]][1].freedoms[0].turns
    passive = [name for name in row if isinstance(joints[name][1].role, Passive)]
    if not any(isinstance(joints[name][1].role, Passive) for name in factors):
        subject = f"roles of {', '.join(map(repr, factors))} in {relation.name!r}"
        expected = "role: passive of a joint that follows the others"
        raise InputError(subject, got=Words("no passive joint"), expected=expected)
    in_order = [*factors, *(name for name in row if name not in factors)]
    sizes = {name: 0.0 if is_formula(x) else abs(x) for name, x in factors.items()}
    open_ = (name for name in in_order if name in passive and name not in taken)
    candidates = [x for x in open_ if not _is_nothing(row[x], sizes.get(x, 1.0))]
    if not candidates:
        raise InputError(
            relation.name,
            got=Words("a relation that follows from the others, or contradicts them"),
            expected="at most one coupling for each passive joint, none a sum of others",
            hint="leave it out",
        )
    for name in candidates:
        if joints[name][1].freedoms[0].turns is turns:
            return name
    kind, unit = ("joint that turns", "an angle") if turns else ("slide", "a length")
    raise InputError(
        f"roles in {relation.name!r}",
        got=Words("passive joints of the other kind only"),
        expected=f"a passive {kind}, as the sum is {unit}",
        hint="write first a joint that is passive",
    )


def _is_nothing(value: Any, scale: float) -> bool:
    """Whether nothing is left of a factor; an entry of a record is something."""
    if not is_formula(value):
        return bool(abs(value) <= _ROUNDING * scale)
    if not hasattr(value, "xreplace"):
        return False
    import sympy as sp

    return sp.cancel(value) == 0


def _inverse(S: np.ndarray) -> np.ndarray:
    """Inverse of a regular matrix of numbers or formulas, by elimination."""
    if S.dtype != object:
        return np.linalg.inv(S)
    size = len(S)
    M = np.empty((size, 2 * size), dtype=object)
    M[:, :size], M[:, size:] = S, np.eye(size, dtype=int)
    for k in range(size):
        pivot = next(i for i in range(k, size) if not _is_nothing(M[i, k], 0.0))
        M[[k, pivot]] = M[[pivot, k]]
        M[k] = M[k] / M[k, k]
        for i in range(size):
            if i != k and not _is_nothing(M[i, k], 0.0):
                M[i] = M[i] - M[i, k] * M[k]
    return M[:, size:]
