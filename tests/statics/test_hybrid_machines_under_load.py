"""Hybrid machines under weights and loads: balance and vibrations from their energy alone.

Bodies are placed by products of exponentials in complex numbers, whose imaginary parts are exact
derivatives; of the library there are the coordinates in which it says that the machine rests.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from scipy.spatial.transform import Rotation

import robostiff as rs
from robostiff.model import Actuated, Chain, Mass, PlacedBlock, PlacedFreedom, PlacedLeg
from tests.statics.robots_under_load import loaded

H = 1e-30
DOWN = np.array([0, 0, -9.80665])
W = np.array([300.0, -200, -500, 40, 30, -20])
AT, FORCE = np.array([0.1, 0.2, 0.3]), np.array([30.0, -20, 40])


def without_masses_of_links(leg: rs.Leg) -> rs.Leg:
    """The same leg, its elastic parts weightless."""
    each = (replace(e, masses=()) if isinstance(e, rs.Link) else e for e in leg.chain.elements)
    return replace(leg, chain=Chain(tuple(each)))


def machine(name: str, *, rail: bool, light: bool = False) -> rs.Robot:
    """A parallel module that carries a head of two axes, on a rail if wanted, all with masses."""

    def arm(x: float, y: float, *masses: Mass) -> rs.Rigid:
        return rs.Rigid(rs.Frame(np.eye(3), np.array([x, y, -0.1])), "arm", masses=masses)

    robot = rs.load(f"examples/{name}.yaml" if name == "tricept" else name)
    robot = replace(
        robot, platform_masses=(Mass(20, [0.01, 0.02, 0.03]), Mass(5, inertia=[1, 2, 1.5]))
    )
    if light:
        robot = replace(robot, legs=tuple(map(without_masses_of_links, robot.legs)))
    c = rs.revolute([0, 0, 1], Actuated(1e4), name="c")
    a = rs.revolute([1, 0, 0], Actuated(2e4), name="a")
    tool = Mass(2), Mass(1, [0, 0.1, 0.02], inertia=[0.01, 0.01, 0.01])
    head = Chain(
        (c, arm(0.05, 0, Mass(4, [0.1, 0, 0])), a, replace(arm(0, 0.02, *tool), name="tool"))
    )
    modules = [rs.Module(name, robot), rs.Module("head", head)]
    if rail:
        slide = rs.prismatic([1, 0, 0], Actuated(3e6), name="slide")
        modules.insert(0, rs.Module("rail", Chain((slide, arm(0, 0.3, Mass(30))))))
    return rs.hybrid_machine(modules)


def turned(r: np.ndarray) -> np.ndarray:
    S = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    u = r @ r
    if abs(u) < 1e-6:
        return np.eye(3) + (1 - u / 6 + u * u / 120) * S + (0.5 - u / 24 + u * u / 720) * S @ S
    t = np.sqrt(u)
    return np.eye(3) + np.sin(t) / t * S + (1 - np.cos(t)) / u * S @ S


def moved(R: Any, point: np.ndarray, shift: Any) -> np.ndarray:
    T = np.eye(4, dtype=complex)
    T[:3, :3], T[:3, 3] = R, point + shift - R @ point
    return T


class Energy:
    """A machine of one leg at coordinates: energy, closures, tool, and points with masses."""

    def __init__(self, answer: rs.Equilibrium, gravity: np.ndarray, part: str = "") -> None:
        assert answer.problem is not None
        assert answer.found is not None
        assert answer.snapshot is not None
        legs, x = answer.problem.legs, answer.found.state.legs.x
        self.parts: list[tuple[Any, np.ndarray]] = [
            (legs.chains[c].elements[k], x[place]) for (c, k), place in legs.places.items()
        ]
        self.z = np.concatenate([x for _, x in self.parts])
        sizes = [np.ones(1) if e.size == 1 else 1 / np.abs(e.modes).max(0) for e, _ in self.parts]
        self.unit = np.concatenate(sizes)
        self.leg, self.point = answer.snapshot.legs[0], answer.problem.point
        self.gravity, self.part = gravity, part

    def at(self, z: np.ndarray) -> tuple[Any, Any, list[Any], list[Any]]:
        self.U: Any = 0
        self.gaps: list[Any] = []
        self.masses: list[Any] = []
        parts, places = iter(self.parts), np.cumsum([0] + [len(x) for _, x in self.parts])
        own = iter([(e, z[i:j]) for (e, _), i, j in zip(parts, places, places[1:], strict=False)])
        T = self.along(self.leg, np.eye(4, dtype=complex), own)
        return self.U, T, self.gaps, self.masses

    def along(
        self, leg: PlacedLeg, T: np.ndarray, parts: Iterator[tuple[Any, np.ndarray]]
    ) -> np.ndarray:
        bodies = [T]
        for e in leg.elements:
            if isinstance(e, PlacedBlock):
                T, *others = [self.along(branch, T, parts) for branch in e.branches]
                self.gaps += [np.linalg.inv(other) @ T for other in others]
            elif not (isinstance(e, PlacedFreedom) and e.stiffness is None and not e.is_passive):
                like, y = next(parts)
                assert like.name == e.name
                self.U += 0.5 * np.sum(like.stiffness * y * y)
                if isinstance(e, PlacedFreedom):
                    R = turned(e.axis * y[0]) if e.turns else np.eye(3)
                    T = T @ moved(R, e.point, e.axis * e.advance(1.0) * y[0])
                else:
                    V = like.modes
                    C = e.elasticity.compliance
                    assert np.allclose(V @ V.T, C, rtol=1e-9, atol=1e-12 * np.abs(C).max())
                    th, R = V @ y, e.rotation
                    T = T @ moved(R @ turned(th[3:]) @ R.T, e.point, R @ th[:3])
            bodies.append(T)
            if self.part and e.name == self.part:
                self.U -= FORCE @ (T @ [*AT, 1])[:3]
        for mass in leg.masses:
            points = [(mass.after, float(mass.value), mass.centre)]
            if mass.start is not None:
                carrier: Any = leg.elements[mass.after - 1]
                each = mass.lumped(1, np.asarray(carrier.point))
                points = [(mass.after - 1 + one.after, one.value, one.point) for one in each]
            self.masses += [(m, (bodies[k] @ [*at, 1])[:3]) for k, m, at in points]
            self.U -= sum(m * self.gravity @ (bodies[k] @ [*at, 1])[:3] for k, m, at in points)
        return T

    def rates(self, z: np.ndarray, wrench: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Gradient less the work of the wrench, closures (c, n), and motions of the masses."""
        force, closures, roots = [], [], []
        _, T, _, _ = self.at(z.astype(complex))
        back, tip = np.linalg.inv(T.real), (T.real @ [*self.point, 1])[:3]
        for i in range(len(z)):
            U, T, gaps, masses = self.at(z + 1j * H * np.eye(len(z))[i])
            D = T.imag / H @ back
            turn = np.array([D[2, 1], D[0, 2], D[1, 0]])
            twist = np.concatenate([D[:3, 3] + np.cross(turn, tip), turn])
            force.append(U.imag / H - wrench @ twist)
            closures.append(
                [x for g in gaps for x in (g.imag / H)[[0, 1, 2, 2, 0, 1], [3, 3, 3, 1, 2, 0]]]
            )
            roots.append([np.sqrt(m) * x.imag / H for m, x in masses])
        B = np.array(roots).reshape(len(z), -1).T
        return np.array(force), np.array(closures).T, B

    def frequencies(self, wrench: np.ndarray) -> np.ndarray:
        """Of small vibrations [Hz], fastest last; the wrench without moment, whose work is dead."""
        force, C, B = self.rates(self.z, wrench)
        held = np.linalg.lstsq(C.T, force)[0]
        K = np.zeros((len(self.z),) * 2)
        for i, unit in enumerate(np.diag(1e-5 * self.unit)):
            ahead, behind = (self.rates(self.z + way * unit, wrench) for way in (1, -1))
            difference = ahead[0] - behind[0] - (ahead[1] - behind[1]).T @ held
            K[:, i] = difference / (2 * unit[i])
        Z = scipy.linalg.null_space(C * self.unit, 1e-10) * self.unit[:, None]
        M = (B @ Z).T @ (B @ Z)
        squares = scipy.linalg.eigh(M, Z.T @ (0.5 * (K + K.T)) @ Z, eigvals_only=True)[::-1]
        return 1 / np.sqrt(squares[squares > 1e-12 * squares[0]]) / (2 * np.pi)


@pytest.mark.parametrize(("name", "rail"), [("3-prs", True), ("3-rps", False), ("tricept", True)])
@pytest.mark.parametrize("how", ["weights", "load in a module", "held"])
def test_nothing_is_left_that_moves_the_machine(name: str, how: str, rail: bool):
    robot, part = machine(name, rail=rail), ""
    given: dict[str, Any] = {"wrench": 10 * W, "gravity": DOWN}
    if how == "held":
        given = {"displacement": 1e-3 * np.array([1, -2, 1, 2, 10, -20]), "gravity": DOWN}
    elif how == "load in a module":
        snapshot = rs.find_posture(robot).snapshot
        (block,) = (e for e in snapshot.legs[0].elements if isinstance(e, PlacedBlock))
        part = block.branches[-1].elements[1].name
        path = f"machine/{part}"
        given = {"wrench": W, "loads": {path: [rs.DeadForce(FORCE, AT)]}}
    answer = loaded(robot, beams=rs.Linear(), **given)
    assert str(answer.status) == "ok"
    energy = Energy(answer, given.get("gravity", np.zeros(3)), part)
    force, C, _ = energy.rates(energy.z, answer.wrench)
    whole = energy.rates(energy.z, np.zeros(6))[0]
    Z = scipy.linalg.null_space(C * energy.unit, 1e-10) * energy.unit[:, None]
    assert np.abs(Z.T @ force).max() < 1e-11 * np.abs(Z.T @ whole).max()
    _, T, gaps, masses = energy.at(energy.z.astype(complex))
    assert max(np.abs(gap - np.eye(4)).max() for gap in gaps) < 1e-13
    tip = (T.real @ [*energy.point, 1])[:3] - energy.point
    turn = Rotation.from_matrix(T.real[:3, :3]).as_rotvec()
    assert np.allclose(answer.displacement, [*tip, *turn], rtol=1e-10, atol=1e-13)
    if "gravity" in given:  # module 25, head 7, rail 30, and what the parts of its legs weigh
        assert sum(m for m, _ in masses) > 32 + 30 * rail
        lift = answer.wrench[:3] + sum(m for m, _ in masses) * DOWN
        assert np.allclose(np.sum(answer.reactions, axis=0)[:3], lift, rtol=1e-9, atol=1e-6)


def test_it_vibrates_as_its_energy_says():
    """Masses on rigid parts, as the points of their energy."""
    wrench = np.array([900.0, -600, -1500, 0, 0, 0])
    robot = machine("3-prs", rail=False, light=True)
    answer = loaded(robot, wrench=wrench, gravity=DOWN, beams=rs.Linear())
    expected = Energy(answer, DOWN).frequencies(wrench)
    found = rs.modes(robot, wrench=wrench, gravity=DOWN, beams=rs.Linear()).frequencies
    assert np.allclose(found[:15], expected[:15], rtol=1e-8)


def test_loads_on_the_platform_of_an_inner_module():
    """By the name of the module: as a force on a rigid part that its platform carries."""
    robot, force = rs.load("examples/tricept-with-head.yaml"), np.array([200.0, 100, -300])
    name, at = "machine/tricept", [0.1, 0.05, 0.2]
    flange = rs.Link(np.zeros(3), rs.Elasticity(1e-14 * np.eye(6)), np.eye(3), "flange")
    (leg,) = robot.legs
    block, *others = leg.chain.elements
    marked = replace(robot, legs=(replace(leg, chain=Chain((block, flange, *others))),))
    for load in (force, rs.DeadForce(force, at), rs.Mass(20, [0.1, 0, 0.2])):
        pairs = ((robot, name), (marked, "machine/flange"))
        for moved in (
            [rs.deflection(own, loads={body: load}).twist for own, body in pairs],
            [loaded(own, loads={body: load}).displacement for own, body in pairs],
        ):
            assert np.abs(moved[1]).max() > 1e-7
            assert np.allclose(moved[0], moved[1], rtol=0, atol=3e-6 * np.abs(moved[1]).max())
    heavy = rs.Mass(50, [0.02, 0.1, 0.1], inertia=[1, 2, 2.5])
    found = rs.modes(robot, masses={name: heavy}).frequencies
    known = rs.modes(marked, masses={"machine/flange": heavy}).frequencies
    assert np.allclose(found, known[: len(found)], rtol=1e-4)


def test_masses_on_the_platform_of_a_module_of_legs(tmp_path: Path):
    """Written with its legs: as those of the same module in a file of its own."""
    tripod = Path("examples/tricept.yaml").read_text(encoding="utf-8")
    masses = "platform_masses: [{name: plate, mass: 20 kg, centre: [0, 0, 0.05]}]\n"
    (tmp_path / "tripod.yaml").write_text(tripod + masses, encoding="utf-8")
    head = """
  - name: head
    chain:
      - {type: revolute, name: a, axis: x, role: actuated, stiffness: 1e6 N m/rad}
      - {type: rigid, name: tool, to: [0, 0, -0.2], mass: 2 kg}
"""
    first = "robostiff: 1\nname: both\nsource: chosen\n"
    path, module = tmp_path / "both.yaml", "modules:\n  - name: tripod\n"
    path.write_text(f"{first}{module}    robot: tripod.yaml\n{head}", encoding="utf-8")
    known = rs.modes(rs.load(path)).frequencies
    start, home, legs = (tripod.index(f"\n{key}:") for key in ("parameters", "home", "legs"))
    own = tripod[home : tripod.index("\n", home + 1)] + tripod[legs:] + masses
    module += "".join(f"    {line}\n" for line in own.splitlines())
    path.write_text(first + tripod[start:home] + "\n" + module + head, encoding="utf-8")
    assert np.allclose(rs.modes(rs.load(path)).frequencies, known, rtol=1e-9)
    path.write_text(path.read_text().replace("legs:", "chain:"), encoding="utf-8")
    with pytest.raises(rs.FileError):
        rs.load(path)
