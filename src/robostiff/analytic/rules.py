"""What a passive joint is, in words: trivial, quasi-trivial, oblique, redundant."""

from __future__ import annotations

from typing import Any

from robostiff.spatial import Space


def rule_in_words(J: Any, *, redundant: bool) -> str:
    """Name the rule by which a joint is eliminated, eq. (15), (18)-(20).

    Examples
    --------
    >>> import sympy as sp
    >>> rule_in_words(sp.Matrix([0, 0, 0, 0, 0, 1]), redundant=False)
    'rotation about z at the reference point: trivial joint (19), row and column 6 vanish'
    >>> rule_in_words(sp.Matrix([0, 0, -sp.Symbol("L"), 0, 1, 0]), redundant=False)
    'rotation about y away from the reference point: quasi-trivial joint (18)'
    """
    motion, kind = _motion_and_rule(J)
    return f"{motion}: redundant, mu = 0, nothing changes" if redundant else f"{motion}: {kind}"


def _motion_and_rule(J: Any) -> tuple[str, str]:
    space = Space.of_size(J.rows)
    t = space.translations
    axes = [name[-1] for name in space.twist_order]
    moves = [p for p in range(t) if J[p, 0] != 0]
    turns = [p for p in range(t, space.size) if J[p, 0] != 0]
    if not turns and len(moves) == 1:
        p = moves[0]
        vanish = f"row and column {p + 1} vanish"
        return f"translation along {axes[p]}", f"trivial joint (19), {vanish}"
    if len(turns) == 1 and not moves:
        p = turns[0]
        vanish = f"row and column {p + 1} vanish"
        motion = f"rotation about {axes[p]} at the reference point"
        return motion, f"trivial joint (19), {vanish}"
    if len(turns) == 1:
        motion = f"rotation about {axes[turns[0]]} away from the reference point"
        return motion, "quasi-trivial joint (18)"
    motion = "oblique rotation" if turns else "oblique translation"
    return motion, "recursion (15)"
