"""Every way from a robot frozen at a pose to its stiffness matrix."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import robostiff as rs
from robostiff.elastostatics import Form, Status, Tolerance
from robostiff.errors import InputError, NoAnswerError, TooFewDigitsError
from robostiff.io.document import parse_document
from robostiff.io.snapshot import (
    network_from_document,
    network_to_data,
    snapshot_from_document,
    snapshot_to_data,
)
from robostiff.model import CoupledFreedom, PlacedBlock, PlacedFreedom, PlacedLeg, PlacedSpring
from robostiff.network import energy_stiffness, network_of_snapshot
from robostiff.spatial import Screw, Space
from tests.campaign.answers import Answer, Judge
from tests.campaign.placed import with_parts
from tests.campaign.reference import Reference, _extent, reference
from tests.campaign.rounded import neighbours, rounded
from tests.generators.chains import random_rotation

_FAR = 30.0  # lengths of the robot: less costs a digit or two


def answer_of(way: str, ask: Callable[[], Any]) -> Answer:
    """The answer of a way, or its exception; refusals that are part of the contract too."""
    try:
        result = ask()
    except Exception as error:  # whatever is raised is a finding
        return Answer(way, error=f"{type(error).__name__}: {error}")
    if isinstance(result, Answer):
        return result
    K = result.K if bool(np.all(result.answered)) else None
    return Answer(way, K, result.status, int(result.rank))


#: What the default way says, which others begin with.
Known = rs.Stiffness
Ask = Callable[[rs.Snapshot, np.random.Generator, Known], Any]


@dataclass(frozen=True)
class Way:
    """A way, and how much it costs: one in `every` robots takes it."""

    name: str
    ask: Ask
    every: int = 1


def _form(form: Form) -> Ask:
    return lambda snapshot, rng, known: rs.stiffness(snapshot, method=form)


def _network(snapshot: rs.Snapshot, rng: np.random.Generator, known: Known) -> Any:
    return rs.stiffness(network_of_snapshot(snapshot))


def _energy(snapshot: rs.Snapshot, rng: np.random.Generator, known: Known) -> Any:
    # It has no status of its own: a robot in doubt is in doubt by energy too, also whether it is
    # rigid in some direction.
    status = known.status
    nothing_to_compare = Answer("energy", None, Status.FORM_DOES_NOT_HOLD)
    try:
        K = energy_stiffness(network_of_snapshot(snapshot), Tolerance())
    except TooFewDigitsError:
        return nothing_to_compare
    except NoAnswerError:
        if status & (Status.RIGID_DIRECTION | Status.ILL_CONDITIONED):
            return nothing_to_compare
        return Answer("energy", error="NoAnswerError: no energy, and no rigid direction")
    return nothing_to_compare if status & Status.ILL_CONDITIONED else Answer("energy", K)


def written(snapshot: rs.Snapshot) -> str:
    """The snapshot as a file; a flexible platform as a graph.

    Raises
    ------
    InputError
        When the format cannot say it.
    """
    if snapshot.platform is not None:
        return json.dumps(network_to_data(network_of_snapshot(snapshot)))
    return json.dumps(snapshot_to_data(snapshot))


def read(text: str) -> Any:
    """What a file says."""
    document = parse_document(text, file="written.json")
    is_graph = "legs" not in document.data
    return network_from_document(document) if is_graph else snapshot_from_document(document)


def _file(snapshot: rs.Snapshot, rng: np.random.Generator, known: Known) -> Any:
    try:
        text = written(snapshot)
    except InputError as error:
        if "compliance" in str(error) or "free and rigid" in str(error):
            return Answer("file", None, Status.FORM_DOES_NOT_HOLD)  # cannot be said in the format
        raise
    return rs.stiffness(read(text))


def _verify(snapshot: rs.Snapshot, rng: np.random.Generator, known: Known) -> Any:
    found = rs.verify(snapshot)
    worst = [f"{c.method} {c.reason}" for c in found.comparisons if c.outcome.value == "differs"]
    if worst:
        return Answer("verify", error=f"FalseAlarm: {'; '.join(worst)}")
    return Answer("verify", None, Status.FORM_DOES_NOT_HOLD)


def _compliance(snapshot: rs.Snapshot, rng: np.random.Generator, known: Known) -> Any:
    try:
        return Answer("compliance", None, known.status, int(known.rank), rs.compliance(snapshot))
    except NoAnswerError as error:
        if int(known.rank) < known.space.size:
            return Answer("compliance", None, Status.FORM_DOES_NOT_HOLD)
        return Answer("compliance", error=f"NoAnswerError: {error}")


def _deflection(snapshot: rs.Snapshot, rng: np.random.Generator, known: Known) -> Any:
    n = snapshot.space.size
    if int(known.rank) < n:
        return Answer("deflection", None, Status.FORM_DOES_NOT_HOLD)
    columns, status = [], Status.OK
    for F in np.eye(n):
        bent = rs.deflection(snapshot, wrench=F)
        if not bent.has_answer:
            return Answer("deflection", error=f"NoDeflection: {bent.status}")
        columns.append(bent.twist)
        status |= bent.status
    return Answer("deflection", None, status, int(known.rank), np.array(columns).T)


def _indices(snapshot: rs.Snapshot, rng: np.random.Generator, known: Known) -> Any:
    """Nothing is compared: it must answer, or say why not."""
    try:
        found = rs.indices(known)
        repr(found)
        for name in ("principal", "collinear", "worst", "condition"):
            getattr(found, name, None)
    except NoAnswerError:
        pass
    return Answer("indices", None, Status.FORM_DOES_NOT_HOLD)


def _turned(snapshot: rs.Snapshot, rng: np.random.Generator, known: Known) -> Any:
    R, shift = random_frame(rng, snapshot.space)
    moved = in_frame(snapshot, R, shift, 1.0)
    result = rs.stiffness(moved)
    n, t = snapshot.space.size, snapshot.space.translations
    T = np.zeros((n, n))
    T[:t, :t] = R[:t, :t]
    T[t:, t:] = R if n == 6 else 1.0
    K = T.T @ result.K @ T if bool(result.answered) else None
    return _far(snapshot, moved, T, Answer("frame", K, result.status, int(result.rank)))


def _millimetres(snapshot: rs.Snapshot, rng: np.random.Generator, known: Known) -> Any:
    coupled = any(isinstance(e, CoupledFreedom) for leg in snapshot.legs for e in leg.parts)
    if snapshot.platform is not None or coupled:  # nodes and ratios are in metres
        return Answer("millimetres", None, Status.FORM_DOES_NOT_HOLD)
    moved = in_frame(snapshot, np.eye(3), np.zeros(3), 1e3)
    result = rs.stiffness(moved)
    n, t = snapshot.space.size, snapshot.space.translations
    d = np.where(np.arange(n) < t, 1e3, 1.0)
    K = result.K * np.outer(d, d) / 1e3 if bool(result.answered) else None
    answer = Answer("millimetres", K, result.status, int(result.rank))
    return _far(snapshot, moved, np.diag(d) / np.sqrt(1e3), answer)


def _far(snapshot: rs.Snapshot, moved: rs.Snapshot, T: np.ndarray, answer: Answer) -> Answer:
    """Far from the origin another robot is true, with coordinates that were rounded anew."""
    furthest = max(float(np.abs(leg.end).max()) for leg in (*snapshot.legs, *moved.legs))
    if snapshot.platform is not None or furthest < _FAR * _extent(snapshot):
        return answer

    def back(truth: Reference) -> Reference:
        return truth if truth.K is None else replace(truth, K=T.T @ truth.K @ T, C=None)

    truth = reference(moved)
    if truth is None:
        return answer
    return replace(answer, truth=back(truth), neighbours=lambda: [*map(back, neighbours(moved))])


def _point(snapshot: rs.Snapshot, rng: np.random.Generator, known: Known) -> Any:
    """Computed about another point, and asked for about the robot's own."""
    v = rng.uniform(-1, 1, 3)
    if snapshot.space is Space.PLANAR:
        v[2] = 0.0
    away = replace(snapshot, reference_point=snapshot.reference_point + v)
    result = rs.stiffness(away, at=snapshot.reference_point)
    K = result.K if bool(result.answered) else None
    return Answer("point", K, result.status, int(result.rank))


def _batch(snapshot: rs.Snapshot, rng: np.random.Generator, known: Known) -> Any:
    R, shift = random_frame(rng, snapshot.space)
    group = [in_frame(snapshot, R, shift, 1.0), snapshot, snapshot]
    return rs.stiffness(stacked(group))[1]


def _alike(snapshot: rs.Snapshot) -> rs.Snapshot:
    """A robot whose joints that turn are all the same."""

    def one(part: PlacedFreedom | PlacedSpring) -> PlacedFreedom | PlacedSpring:
        if isinstance(part, PlacedSpring) or part.slides:
            return part
        return replace(part, axis=np.array([0.0, 0, 1]), point=snapshot.reference_point.copy())

    return with_parts(snapshot, one)


def _bad_company(snapshot: rs.Snapshot, rng: np.random.Generator, known: Known) -> Any:
    """Beside it one whose joints are all alike, and one without compliance."""

    def rigid(part: PlacedFreedom | PlacedSpring) -> PlacedFreedom | PlacedSpring:
        if isinstance(part, PlacedFreedom):
            return part
        return replace(part, elasticity=rs.Elasticity(np.zeros((6, 6)), part.elasticity.freedoms))

    return rs.stiffness(stacked([_alike(snapshot), snapshot, with_parts(snapshot, rigid)]))[1]


def _tilted(snapshot: rs.Snapshot, rng: np.random.Generator, known: Known) -> Any:
    """A passive joint twice, the second tilted by forty times the tolerance: not redundant."""
    nothing = Answer("tilted", None, Status.FORM_DOES_NOT_HOLD)
    places = [
        (i, k)
        for i, leg in enumerate(snapshot.legs)
        for k, part in enumerate(leg.elements)
        if isinstance(part, PlacedFreedom) and part.is_passive and part.turns
        if not isinstance(part, CoupledFreedom)
    ]
    if not places or snapshot.platform is not None or snapshot.space is Space.PLANAR:
        return nothing
    i, k = places[rng.integers(len(places))]
    leg = snapshot.legs[i]
    joint: Any = leg.elements[k]
    across = np.cross(joint.axis, rng.normal(size=3))
    axis = joint.axis + 4e-8 * across / np.linalg.norm(across)
    twin = replace(joint, axis=axis / np.linalg.norm(axis), name=f"{joint.name} tilted")
    elements = (*leg.elements, twin)
    legs = (*snapshot.legs[:i], replace(leg, elements=elements), *snapshot.legs[i + 1 :])
    tilted = replace(snapshot, legs=legs)
    truth = reference(tilted)
    if truth is None or not any(1e-8 < m < 1e-7 for m in truth.margins):
        return nothing
    found = rs.stiffness(tilted)
    return Answer("tilted", None, found.status, int(found.rank), truth=truth)


def _bad_compliance(snapshot: rs.Snapshot, rng: np.random.Generator, known: Known) -> Any:
    """Compliance of a batch whose other pose is singular: refused with words, or answered."""
    if int(known.rank) == snapshot.space.size:
        with suppress(NoAnswerError):
            rs.compliance(stacked([snapshot, _alike(snapshot)]))
    return Answer("compliance in bad company", None, Status.FORM_DOES_NOT_HOLD)


FORMS: tuple[Form, ...] = (rs.SaddlePoint(), rs.Block(), rs.Recursive(), rs.IndexRules())
# The dearer, the rarer: each costs about half of what the default way does, the network more.
WAYS = (
    *(Way(form.name, _form(form), 2) for form in FORMS),
    Way("batch", _batch, 3),
    Way("bad company", _bad_company, 4),
    Way("compliance in bad company", _bad_compliance, 8),
    Way("network", _network, 6),
    Way("energy", _energy, 8),
    Way("file", _file, 8),
    Way("frame", _turned, 4),
    Way("point", _point, 4),
    Way("millimetres", _millimetres, 4),
    Way("compliance", _compliance, 4),
    Way("deflection", _deflection, 16),
    Way("indices", _indices, 8),
    Way("verify", _verify, 24),
    Way("rounded", rounded, 6),
    Way("tilted", _tilted, 12),
)


def judged(
    snapshot: rs.Snapshot, seed: list[int], only: frozenset[str] | None = None
) -> tuple[Judge, list[str]]:
    """A robot at a pose by the reference, the default way and a share of the others.

    Parameters
    ----------
    snapshot : Snapshot
    seed : list of int
        Decides which ways, and what is drawn for them.
    only : set of str, optional
        Just these ways, and the default.

    Returns
    -------
    judge : Judge
    taken : list of str
        Names of the ways.
    """
    size = _extent(snapshot)
    has_blocks = any(leg.blocks for leg in snapshot.legs) or snapshot.platform is not None
    truth = reference(snapshot)
    judge = Judge(truth, size, has_blocks, lambda: neighbours(snapshot))
    solved: list[Known] = []
    default = answer_of("default", lambda: solved.append(rs.stiffness(snapshot)) or solved[0])
    judge.hear(default, None)
    taken = ["default"] if truth is None else ["default", "reference"]
    if not solved:  # as all ways would
        return judge, taken
    for i, way in enumerate(WAYS):
        rng = np.random.default_rng([*seed, i])
        if rng.integers(way.every) if only is None else way.name not in only:
            continue
        taken.append(way.name)
        answer = replace(
            answer_of(way.name, lambda w=way, r=rng: w.ask(snapshot, r, solved[0])), way=way.name
        )
        judge.hear(answer, default)
    return judge, taken


def random_frame(rng: np.random.Generator, space: Space) -> tuple[np.ndarray, np.ndarray]:
    """A turn and a shift that leave the plane of a planar robot."""
    if space is Space.SPATIAL:
        return random_rotation(rng), rng.uniform(-1, 1, 3)
    a = rng.uniform(-np.pi, np.pi)
    R = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1.0]])
    return R, np.append(rng.uniform(-1, 1, 2), 0.0)


def in_frame(snapshot: rs.Snapshot, R: np.ndarray, shift: np.ndarray, unit: float) -> rs.Snapshot:
    """The same robot elsewhere, lengths in other units (`unit` of them in a metre)."""

    def place(p: np.ndarray) -> np.ndarray:
        return (R @ p + shift) * unit

    d = np.repeat([unit, 1.0], 3)

    def one(part: PlacedFreedom | PlacedSpring) -> PlacedFreedom | PlacedSpring:
        if isinstance(part, PlacedSpring):
            own = part.elasticity
            C = own.compliance * np.outer(d, d) / unit
            elasticity = rs.Elasticity(C, own.freedoms * d[:, None])
            return replace(
                part, point=place(part.point), rotation=R @ part.rotation, elasticity=elasticity
            )
        role = part.role
        if part.stiffness is not None and unit != 1.0:
            by = unit if part.turns else 1 / unit
            role = replace(role, stiffness=part.stiffness * by)  # pyright: ignore[reportCallIssue]
        pitch = part.pitch and part.pitch * unit
        return replace(part, point=place(part.point), axis=R @ part.axis, pitch=pitch, role=role)

    moved = with_parts(snapshot, one, place)

    platform = snapshot.platform
    if platform is not None:
        if unit != 1.0:
            raise NotImplementedError("platforms in other units")
        platform = replace(platform, rotation=R @ platform.rotation, origin=place(platform.origin))
    return replace(moved, reference_point=place(snapshot.reference_point), platform=platform)


def _side_by_side(*moves: Any) -> Any:
    """What a coordinate of coupled joints moves, at several poses."""
    (name, share, first), screws = moves[0], [screw for _, _, screw in moves]
    axes, points = ([getattr(own, name) for own in screws] for name in ("axis", "point"))
    return name, share, Screw(np.stack(axes), np.stack(points), first.pitch)


def stacked(group: list[rs.Snapshot]) -> rs.Snapshot:
    """Snapshots of one robot at several poses as a batch."""

    def legs_of(legs: list[PlacedLeg]) -> PlacedLeg:
        elements = []
        for parts in zip(*(leg.elements for leg in legs), strict=True):
            first = parts[0]
            if isinstance(first, PlacedBlock):
                branches = zip(*(p.branches for p in parts), strict=True)  # type: ignore[union-attr]
                own = tuple(legs_of(list(branch)) for branch in branches)
                elements.append(PlacedBlock(first.name, own))
                continue
            point = np.stack([p.point for p in parts])  # type: ignore[union-attr]
            if isinstance(first, PlacedFreedom):
                axis = np.stack([p.axis for p in parts])  # type: ignore[union-attr]
                own = replace(first, point=point, axis=axis)
                if isinstance(own, CoupledFreedom):
                    each = zip(*(p.moves for p in parts), strict=True)  # type: ignore[union-attr]
                    own = replace(own, moves=tuple(_side_by_side(*moves) for moves in each))
                elements.append(own)
            else:
                C = np.stack([p.elasticity.compliance for p in parts])  # type: ignore[union-attr]
                turn = np.stack([p.rotation for p in parts])  # type: ignore[union-attr]
                elasticity = rs.Elasticity(C, first.elasticity.freedoms)
                elements.append(replace(first, point=point, rotation=turn, elasticity=elasticity))
        end = np.stack([leg.end for leg in legs])
        return replace(legs[0], elements=tuple(elements), end=end)

    legs = tuple(legs_of(list(own)) for own in zip(*(s.legs for s in group), strict=True))
    first = group[0]
    platform = first.platform
    if platform is not None:
        platform = replace(
            platform,
            rotation=np.stack([s.platform.rotation for s in group if s.platform]),
            origin=np.stack([s.platform.origin for s in group if s.platform]),
        )
    reference_point = np.stack([s.reference_point for s in group])
    return replace(first, legs=legs, reference_point=reference_point, platform=platform)
