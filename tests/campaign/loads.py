"""Random machines under loads, against the minimum of an energy of bodies in the world.

Displacements, stiffness, energies and frequencies of robots whose elastic parts are linear are
those of `bodies`, to rounding; with beams as they are by default, those of beams cut into four.
Kernels are asked in every form of input.
"""
# pyright: reportArgumentType=false

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sympy as sp

import robostiff as rs
from robostiff.spatial import Space
from tests.campaign import loaded_cables, loaded_networks
from tests.campaign.answers import Complaint, Judge
from tests.campaign.assembled import Assembly, NotAssembledError, of_robot
from tests.campaign.bodies import (
    DeadPull,
    Minimum,
    NoMinimumError,
    SingleJoint,
    State,
    curvatures,
    frequencies,
)
from tests.campaign.laws_under_load import keep_laws, loaded_linkage
from tests.campaign.minima import compare, least
from tests.campaign.posed import KINDS, random_posed
from tests.campaign.reread import placed, turned

_OF_BEAMS = 0.01  # of the displacement: beams as they are by default, and cut into four
#: The same by the turn of a beam [rad] and by how far its flexural rigidities differ: its energy
#: has no term in which a twist turns the planes of bending.
_OF_TWISTED_BEAMS = 0.1
_OF_FIRST = 0.01  # of the first frequency, masses along beams
_FINE = 4
_STIFF = 1e5  # times the first frequency: beyond, bodies have next to no mass
_LARGEST = 64  # bodies: more take too long
_q = sp.Symbol("q")


@dataclass
class Case:
    """A robot at a posture, and what acts on it; bodies of the same, and the same loads."""

    robot: rs.Robot
    pose: Any
    coordinates: list[np.ndarray]
    six: np.ndarray
    length: float
    wrench: np.ndarray
    more: dict[str, Any]
    at: np.ndarray | None
    judge: Judge

    def assembly(self, beams: int) -> Assembly:
        """Its bodies under all that acts beside the wrench."""
        T = placed(turned(self.six[3:]), self.six[:3])
        own = of_robot(self.robot, self.coordinates, T, self.length, beams)
        if self.at is not None:
            own.bodies.centres[1] = np.array(self.at)
        for name, load in self.more.get("loads", {}).items():
            body, place = (1, load.point) if name == "platform" else own.behind[name]
            point = place if load.point is None else load.point
            own.bodies.pulls.append(DeadPull(body, np.asarray(point), np.asarray(load.force)))
        for name, force in self.more.get("preload", {}).items():
            _energy(own, name, 0, -force)
        for name, law in self.more.get("laws", {}).items():
            _energy(own, name, 3, float(sp.Poly(law.force, _q).coeff_monomial(_q**3)) / 4)
        if "gravity" in self.more:
            own.fall(np.asarray(self.more["gravity"]))
        return own

    @property
    def scale(self) -> np.ndarray:
        """Units of a displacement."""
        return np.array([self.length if row < 3 else 1.0 for row in self.robot.space.rows])

    def ask(self, **how: Any) -> Any:
        """The equilibrium that the library finds."""
        return rs.equilibrium(self.robot, self.pose, self.wrench, at=self.at, **self.more, **how)


def _energy(own: Assembly, name: str, power: int, value: float) -> None:
    """Change a coefficient of the energy of a joint."""
    i = own.drives[name]
    joint = own.bodies.joints[i]
    energy = np.zeros(9)
    energy[: len(joint.energy)] = joint.energy
    energy[power] = value
    own.bodies.joints[i] = SingleJoint(**{**joint.__dict__, "energy": tuple(energy)})


def loaded_machine(rng: np.random.Generator) -> list[Complaint]:
    """A machine of some kind under loads, by its own reference."""
    names = list(SHARES)
    weights = np.array([share for share, _ in SHARES.values()])
    kind = names[rng.choice(len(names), p=weights / weights.sum())]
    return SHARES[kind][1](rng)


def loaded_robot(rng: np.random.Generator) -> list[Complaint]:
    """A robot with masses, forces, preloads, laws and springs."""
    for _ in range(10):
        case = _drawn(rng)
        if case is not None:
            break
    else:
        return []
    try:
        own = case.assembly(0)
        if len(own.bodies.centres) > _LARGEST:
            return []
        truth = least(own, case.wrench)
    except NotAssembledError:
        return []
    except NoMinimumError:
        return []
    compare(case.judge, case.ask, own, truth, case.scale)
    ways: tuple[tuple[float, Callable[..., None]], ...] = (
        (0.3, _with_beams),
        (0.4, _frequencies),
        (0.4, _kernels),
        (0.4, _laws),
    )
    for share, way in ways:
        if rng.uniform() < share:
            way(case, own, truth)
    return case.judge.complaints


def _laws(case: Case, own: Assembly, truth: Minimum) -> None:
    """Beams as they are by default."""
    if case.at is None:
        rng = np.random.default_rng(len(own.bodies.centres))
        robot, pose, more = case.robot, case.pose, case.more
        keep_laws(rng, case.judge, robot, pose, case.wrench, more, case.length)


def _with_beams(case: Case, own: Assembly, truth: Minimum) -> None:
    """Beams of one element to rounding, those by default against beams cut into four."""
    single = case.assembly(1)
    if not any(part.stretch for part in single.bodies.elastic):
        return
    try:
        whole = least(single, case.wrench)
    except NoMinimumError:
        return
    compare(case.judge, case.ask, single, whole, case.scale, rs.Bowing(1))
    fine = case.assembly(_FINE)
    if len(fine.bodies.centres) > _LARGEST:
        return
    try:
        truth = least(fine, case.wrench)
    except NoMinimumError:
        return
    found = case.ask()
    doubt = rs.Status.FREE_MOTIONS | rs.Status.REDUNDANT_JOINTS | rs.Status.ILL_CONDITIONED
    if not found.has_answer or found.status & doubt:
        return
    curved = curvatures(fine.bodies, truth.state)
    moved = np.max(np.abs(truth.displacement / case.scale))
    off = np.max(np.abs((found.displacement - truth.displacement) / case.scale))
    detail = f"{found.status}, margin {found.margin:.2g}, moved {moved:.1e}, off {off:.1e}"
    if found.stable and curved[0] < -1e-6 * curved[-1] and off < 0.05 * moved:
        case.judge.say("beams", "called stable, and is not", detail)
    bent = [np.diag(part.K)[4:] for part in fine.bodies.elastic if part.stretch]
    uneven = max(float(np.max(k) / np.min(k)) for k in bent) - 1
    limit = _OF_BEAMS + _OF_TWISTED_BEAMS * uneven * moved
    if found.margin > 0.4 and moved < 0.1 and not off <= limit * moved + 1e-9:
        case.judge.say("beams", "another place than beams cut into four", detail)


def _frequencies(case: Case, own: Assembly, truth: Minimum) -> None:
    """All frequencies where masses are on bodies, else the first."""
    if not own.bodies.masses or own.bodies.springs or np.any(case.wrench[len(case.wrench) // 2 :]):
        return
    alone = not own.spread
    known = _all_frequencies(own, truth.state) if alone else _first_frequency(case)
    if known is None:
        return
    how: dict[str, Any] = {"beams": rs.Linear()} if alone else {}
    found = rs.modes(case.robot, case.pose, wrench=case.wrench, at=case.at, **case.more, **how)
    if not found.each or found.status & rs.Status.REDUNDANT_JOINTS:
        return
    mine, known = (own[own < _STIFF * own[0]] for own in (found.frequencies, known))
    count, limit = (len(known), 1e-5) if alone else (1, _OF_FIRST)
    if alone and len(mine) != len(known):
        case.judge.say("modes", "another number of them", f"{len(mine)} for {len(known)}")
        return
    off = float(np.max(np.abs(mine[:count] / known[:count] - 1)))
    if not off <= limit:
        what = "another frequency" if alone else "another first frequency with masses along beams"
        case.judge.say("modes", what, f"{off:.1e}: {mine[:3]} for {known[:3]}; {found.status}")


def _all_frequencies(own: Assembly, state: State) -> np.ndarray | None:
    curved = curvatures(own.bodies, state)
    return frequencies(own.bodies, state) if curved[0] > 1e-8 * curved[-1] else None


def _first_frequency(case: Case) -> np.ndarray | None:
    """From beams cut into two and four whose masses are lumped: errors fall with the square."""
    first = []
    for parts in (_FINE // 2, _FINE):
        own = case.assembly(parts)
        if len(own.bodies.centres) > _LARGEST:
            return None
        try:
            truth = least(own, case.wrench)
        except NoMinimumError:
            return None
        own.lump()
        found = _all_frequencies(own, truth.state)
        if found is None:
            return None
        first.append(found[0])
    return np.array([(4 * first[1] - first[0]) / 3])


def _kernels(case: Case, own: Assembly, truth: Minimum) -> None:
    """Kernels in every form of input: poses, joints, drives."""
    robot, more = case.robot, dict(case.more)
    if curvatures(own.bodies, truth.state)[0] < 0:
        return  # a saddle: they may come to rest elsewhere
    if more.pop("laws", None) or case.at is not None or own.bodies.springs:
        return
    if max(len(leg.chain.part_names) for leg in robot.legs) > 12:
        return
    try:
        fast = rs.compile_loaded(robot, beams=rs.Linear(), backend=rs.Backend.ARRAYS, **more)
    except (rs.InputError, rs.NoAnswerError):  # with the reason
        return
    forms: dict[str, Any] = {}
    if not robot.is_posed_by_joints:
        forms["poses"] = case.six[None][:, robot.coordinate_places]
    if robot.is_serial:
        forms["joints"] = rs.JointCoordinates(case.coordinates[0][None])
    drives = {
        f"{leg.name}/{name}": float(x)
        for leg, q in zip(robot.legs, case.coordinates, strict=True)
        for name, role, x in zip(leg.chain.coordinate_names, leg.chain.roles, q, strict=True)
        if isinstance(role, rs.Actuated)
    }
    if drives and not robot.is_coupled:
        names = rs.actuator_names(robot)
        if set(names) == set(drives):
            forms["drives"] = rs.ActuatorCoordinates([[drives[name] for name in names]])
    for form, pose in forms.items():
        try:
            answer = fast.evaluate(pose, case.wrench)
        except rs.RobostiffError:
            continue
        if not answer.answered[0] or answer.status & rs.Status.REDUNDANT_JOINTS:
            continue
        moved = np.max(np.abs(truth.displacement / case.scale))
        off = np.max(np.abs((answer.displacement[0] - truth.displacement) / case.scale))
        if not off <= 1e-6 * moved + 1e-10:
            guarded = "guarded" if answer.guarded[0] else "not guarded"
            detail = f"off {off:.1e} of {moved:.1e}, {guarded}, {answer.status}"
            case.judge.say(f"kernel by {form}", "another place than the minimum", detail)


def _drawn(rng: np.random.Generator) -> Case | None:
    names = list(KINDS)
    posed = random_posed(rng, names[rng.integers(len(names))], 2)
    if posed is None:
        return None
    row = posed.rows[rng.integers(len(posed.rows))]
    robot, pose = posed.robot, rs.JointCoordinates(row) if posed.by_joints else row
    robot = _with_masses(rng, robot)
    posture = rs.find_posture(robot, pose)
    if not posture.reached[0]:
        return None
    snapshot = posture.snapshot.one(0)
    length = float(snapshot.characteristic_length) or 1.0
    unloaded = rs.stiffness(robot, pose)
    C = unloaded.compliance
    doubt = rs.Status.ILL_CONDITIONED | rs.Status.UNREACHABLE | rs.Status.FREE_MOTIONS
    if C is None or unloaded.status & doubt or not np.any(C):
        return None
    n = robot.space.size
    lengths = np.array([length if row < 3 else 1.0 for row in robot.space.rows])
    F = rng.normal(size=n) * lengths
    if rng.uniform() < 0.3:
        F[robot.space.translations :] = 0.0
    F *= 10 ** rng.uniform(-5, -1.7) / np.max(np.abs(C @ F / lengths))
    force = float(np.max(np.abs(F / lengths))) * length
    if not 0 < force < 1e9 or np.linalg.cond(C / np.outer(lengths, lengths)) > 1e7:
        return None
    coordinates = [c[0] for c in posture.coordinates]
    judge = Judge(None, 1.0, False)
    case = Case(robot, pose, coordinates, posture.pose[0], length, F, {}, None, judge)
    _beside(rng, case, force, snapshot.reference_point)
    return case


def _with_masses(rng: np.random.Generator, robot: rs.Robot) -> rs.Robot:
    """With masses on rigid parts, along elastic ones and on the platform."""
    plane = robot.space is Space.PLANAR

    def mass() -> rs.Mass:
        centre = rng.uniform(-0.2, 0.2, 3) * ([1, 1, 0] if plane else 1)
        A = rng.normal(size=(3, 3)) * 0.1
        inertia = None if rng.uniform() < 0.4 else np.trace(A @ A.T) * np.eye(3) - A @ A.T
        return rs.Mass(float(10 ** rng.uniform(-1, 1)), centre, inertia=inertia)

    spread = rng.uniform() < 0.5

    def element(e: Any) -> Any:
        if isinstance(e, rs.Rigid) and rng.uniform() < 0.3:
            return replace(e, masses=(mass(),))
        if isinstance(e, rs.Link):
            own = (rs.Mass(float(rng.uniform(0, 1))),) if spread and np.any(e.to) else ()
            return replace(e, masses=own)
        return e

    legs = tuple(
        replace(leg, chain=replace(leg.chain, elements=tuple(map(element, leg.chain.elements))))
        for leg in robot.legs
    )
    more = (replace(mass(), value=20.0),) if rng.uniform() < 0.7 else ()
    return replace(robot, legs=legs, platform_masses=more)


def _beside(rng: np.random.Generator, case: Case, force: float, point: np.ndarray) -> None:
    """What acts beside the wrench, each in some robots."""
    robot, in_space = case.robot, np.isin(np.arange(3), case.robot.space.rows)
    try:
        T = placed(turned(case.six[3:]), case.six[:3])
        own = of_robot(robot, case.coordinates, T, case.length)
    except NotAssembledError:
        return
    names = [name for name in own.behind if "coupl" not in name and "sum" not in name]
    loads: dict[str, Any] = {}
    for name in names:
        if rng.uniform() < 0.4 / len(names):
            place = own.behind[name][1] + 0.1 * case.length * rng.normal(size=3) * in_space
            place = None if rng.uniform() < 0.5 else place
            loads[name] = rs.DeadForce(0.2 * force * rng.normal(size=3) * in_space, place)
    if rng.uniform() < 0.2:
        place = point + 0.1 * case.length * rng.normal(size=3) * in_space
        loads["platform"] = rs.DeadForce(0.2 * force * rng.normal(size=3) * in_space, place)
    drives = [n for n, i in own.drives.items() if len(own.bodies.joints[i].energy) == 2]
    drives = (
        []
        if robot.is_coupled
        else [n for n in drives if own.bodies.joints[own.drives[n]].energy[1]]
    )
    preload, laws = {}, {}
    for name, i in own.drives.items():
        if len(own.bodies.joints[i].energy) == 1 and not robot.is_coupled and rng.uniform() < 0.1:
            preload[name] = float(0.02 * force * case.length * rng.normal())  # passive
    for name in drives:
        if rng.uniform() < 0.15:
            preload[name] = float(0.2 * force * case.length * rng.normal())
        elif rng.uniform() < 0.15:
            k = 2 * own.bodies.joints[own.drives[name]].energy[1]
            laws[name] = rs.ForceLaw(k * _q + float(k * 10 ** rng.uniform(0, 3)) * _q**3)
    case.more |= {k: v for k, v in (("loads", loads), ("preload", preload), ("laws", laws)) if v}
    if (own.bodies.masses or own.spread) and rng.uniform() < 0.5:
        case.more["gravity"] = rng.uniform(-10, 10, 3) * in_space
    if rng.uniform() < 0.2:
        case.at = point + rng.uniform(-0.5, 0.5, 3) * case.length * in_space
    if rng.uniform() < 0.2:
        bodies = [*rng.permutation(["base", "platform"])[:1], *rng.permutation(list(own.frames))]
        bodies = bodies[:2] if len(bodies) > 1 and rng.uniform() < 0.6 else ["base", "platform"]
        a, b = (rs.BodyPoint(str(o), rng.uniform(-0.3, 0.3, 3) * in_space) for o in bodies)
        k, rest = force / case.length * 10 ** rng.uniform(-1, 1), float(rng.uniform(0, 0.5))
        spring = rs.BodySpring("spring", (a, b), stiffness=k, free_length=rest)
        case.robot = robot.with_springs([spring])


#: How often each kind is drawn, and what judges it.
SHARES: dict[str, tuple[float, Callable[[np.random.Generator], list[Complaint]]]] = {
    "robots": (50, loaded_robot),
    "networks": (20, loaded_networks.loaded_network),
    "linkages": (10, loaded_linkage),
    "cables": (6, loaded_cables.cable_robot),
}
