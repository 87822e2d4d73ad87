"""Formulas against SymPy as an expert writes it: seconds of the processor, and operations.

The expert closes the legs and finds the wrenches that they transmit by hand, takes polynomial rings
where these are faster than expressions, and writes no more than the problem needs. robostiff reads
a model, closes its legs, finds the wrenches, and compares the formula with numbers at random
parameters and poses before it returns: what the expert's figures leave out. Both matrices are
compared in numbers before they are timed.

    python benchmarks/expert.py                            all problems, two minutes
    python benchmarks/expert.py --compare 3-rrr gsb        both matrices of some of them in numbers
    python benchmarks/expert.py --table docs/derivations.md    and the table there
"""

import argparse
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import starmap
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp
from derivations import JOINTS, K0, fraction_free_recursion, ring_fractions, upper
from sympy.core.cache import clear_cache

import robostiff as rs
from robostiff import DisagreementError
from robostiff.analytic import derive_chain
from robostiff.analytic.exact.definition import Definition, operations_of
from robostiff.analytic.exact.exact_points import values_of

BEGINNING, END = "<!-- table of the expert -->", "<!-- end of the expert's table -->"
ROUNDS = 5
# Of one route after another: the first run finds caches as the other route left them.
RUNS = 4
AGREED = 1e-10  # of both matrices in numbers
DATA = Path(__file__).parent.parent / "tests" / "analytic" / "data"
R, r, h, k = sp.symbols("R r h k", positive=True)
PHI, PSI = (0, 120, 120, 240, 240, 360), (60, 60, 180, 180, 300, 300)  # eq. (28), degrees
PLANAR_LEG = """
robostiff: 1
name: planar-leg
source: a driven crank and a rod, both slender beams
planar: true
parameters: {l1: 300 mm, l2: 400 mm, E: 70 GPa, A: 8 cm^2, I: 3 cm^4, k: 2e4 N m/rad}
materials: {alloy: {E: E, poisson_ratio: 0.3}}
sections: {bar: {properties: {A: A, Iy: I, Iz: I, J: 2*I}}}
legs:
  - name: leg
    chain:
      - {type: revolute, name: motor, axis: z, role: actuated, stiffness: k, home: 0.4 rad}
      - {type: beam, name: crank, to: [l1, 0, 0], y_axis: y, material: alloy, section: bar}
      - {type: revolute, name: elbow, axis: z, role: passive, home: 0.9 rad}
      - {type: beam, name: rod, to: [l2, 0, 0], y_axis: y, material: alloy, section: bar}
      - {type: revolute, name: tip, axis: z, role: passive}
"""

Found = tuple[list[Any], list[Definition]]  # upper triangle, and what its names stand for


def platform_in_expressions() -> Found:
    """The sum of w w^T, multiplied out and factored."""
    K: Any = sp.zeros(6)
    for phi, psi in zip(map(sp.rad, PHI), map(sp.rad, PSI), strict=True):
        b = sp.Matrix([r * sp.cos(psi), r * sp.sin(psi), 0])
        d = b - sp.Matrix([R * sp.cos(phi), R * sp.sin(phi), -h])
        w = sp.Matrix([*d, *b.cross(d)])
        K += w * w.T
    length = R**2 - R * r + h**2 + r**2
    return upper((K.applyfunc(sp.expand) * k / length).applyfunc(sp.factor)), []


def platform_in_a_ring() -> Found:
    """The same over QQ(sqrt(3))[R, r, h]."""
    ring = sp.QQ.algebraic_field(sp.sqrt(3))[R, r, h]
    read = ring.from_sympy
    radius, top, height = read(R), read(r), read(h)
    K = {(i, j): ring.zero for i in range(6) for j in range(i, 6)}
    for phi, psi in zip(map(sp.rad, PHI), map(sp.rad, PSI), strict=True):
        bx, by = top * read(sp.cos(psi)), top * read(sp.sin(psi))
        dx, dy = bx - radius * read(sp.cos(phi)), by - radius * read(sp.sin(phi))
        w = (dx, dy, height, by * height, -bx * height, bx * dy - by * dx)
        for i, j in K:
            K[i, j] += w[i] * w[j]
    length = R**2 - R * r + h**2 + r**2
    return [k / length * sp.factor(ring.to_sympy(x)) for x in K.values()], []


def platform_anywhere() -> Found:
    """At a general pose, with names for common subexpressions."""
    x, y, z, alpha, beta, gamma = sp.symbols("x y z alpha beta gamma", real=True)
    Q: Any = sp.rot_ccw_axis3(gamma) * sp.rot_ccw_axis2(beta) * sp.rot_ccw_axis1(alpha)
    K: Any = sp.zeros(6)
    for phi, psi in zip(map(sp.rad, PHI), map(sp.rad, PSI), strict=True):
        b = Q * sp.Matrix([r * sp.cos(psi), r * sp.sin(psi), 0])
        d = sp.Matrix([x, y, z]) + b - sp.Matrix([R * sp.cos(phi), R * sp.sin(phi), 0])
        w = sp.Matrix([*d, *b.cross(d)])
        K += w * w.T * (k / d.dot(d))
    names, entries = sp.cse(upper6(K))
    return list(entries), [Definition(*name) for name in names]


def upper6(K: Any) -> list[Any]:
    return [K[i, j] for i in range(K.rows) for j in range(i, K.rows)]


def planar_leg() -> Found:
    """w is the force along the rod; c its compliance, from that of the chain about its tip."""
    l1, l2, E, A, inertia = sp.symbols("l1 l2 E A I", positive=True)
    q1, q2 = sp.symbols("q1 q2", real=True)
    a, b = q1, q1 + q2
    along = sp.Matrix([sp.cos(a), sp.sin(a)])
    across = sp.Matrix([-sp.sin(a), sp.cos(a)])
    u = sp.Matrix([sp.cos(b), sp.sin(b)])
    # What the springs feel of a force at the elbow; the rod feels it as traction alone.
    bending = l1**2 / k + l1**3 / (3 * E * inertia)
    fx: Any = sp.trigsimp(u.dot(along))
    fy: Any = sp.trigsimp(u.dot(across))
    c = fx**2 * l1 / (E * A) + fy**2 * bending + l2 / (E * A)
    w = sp.Matrix([*u, 0])
    return upper6(w * w.T / c1), [Definition(c1, c)]


def summed(
    legs: list[tuple[Any, Any]], turn: Any = None, rows: Sequence[int] = range(6)
) -> list[Any]:
    """K = sum of w w^T / c, multiplied out and factored; of an angle, sin^2 is 1 - cos^2."""
    K: Any = sum((w * w.T / c for w, c in legs), sp.zeros(6))
    below = [1 / c for c in dict.fromkeys(c for _, c in legs)]

    def short(entry: Any) -> Any:
        entry = sp.expand(entry, trig=turn is not None)
        if turn is not None:
            entry = sp.expand(entry.subs(sp.sin(turn) ** 2, 1 - sp.cos(turn) ** 2))
        return sp.collect(entry, below, sp.factor)

    return [short(x) for x in upper6(K.extract(list(rows), list(rows)))]


def around(phi: Any) -> tuple[Any, Any]:
    """Radial and tangential unit vector."""
    return sp.Matrix([sp.cos(phi), sp.sin(phi), 0]), sp.Matrix([-sp.sin(phi), sp.cos(phi), 0])


def force(direction: Any, point: Any) -> Any:
    return sp.Matrix([*direction, *point.cross(direction)])


def telescope(cylinder: Any, L: Any, rigidity: str) -> Any:
    """Compliance of the two tubes of a strut, one inside the other."""
    first, second = sp.symbols(f"{rigidity}_1 {rigidity}_2", positive=True)
    return cylinder / first + (L - cylinder) / second


THIRDS = [sp.Integer(i) * 2 * sp.pi / 3 for i in range(3)]
UP = sp.Matrix([0, 0, 1])
L, c1, c2, q, cylinder = sp.symbols("L c1 c2 q cylinder", positive=True)
EA, EI, GJ = sp.symbols("EA EI GJ", positive=True)
LEG = (R - r) ** 2 + h**2


def platform_with_tubes() -> Found:
    """(28) with legs as long as their tubes, of steel."""
    outer, inner = sp.symbols("D d", positive=True)
    legs = []
    for phi, psi in zip(map(sp.rad, PHI), map(sp.rad, PSI), strict=True):
        a, b = R * around(phi)[0], r * around(psi)[0]
        legs.append((force((b - a + h * UP) / L, b), c1))
    length = sp.sqrt(R**2 - R * r + h**2 + r**2)
    steel = 52_500_000_000 * sp.pi * (outer**2 - inner**2)
    return summed(legs), [
        Definition(L, length),
        Definition(EA, steel),
        Definition(c1, 1 / k + L / EA),
    ]


def hexapod() -> Found:
    alpha, screw, joint = sp.symbols("alpha k_screw k_joint", positive=True)
    legs = []
    for i in THIRDS:
        for sign in (1, -1):
            a = R * around(i + sign * alpha)[0]
            b = r * around(i + sign * (sp.pi / 3 - alpha))[0]
            legs.append((force((b - a + h * UP) / L, b), c1))
    length = sp.sqrt(R**2 + r**2 + h**2 - 2 * R * r * sp.cos(sp.pi / 3 - 2 * alpha))
    c = 2 / joint + 1 / screw + telescope(cylinder, L, "EA")
    return summed(legs, alpha), [Definition(L, length), Definition(c1, c)]


def three_rps() -> Found:
    """A force along each leg, and one across its plane."""
    legs = []
    for radial, tangent in map(around, THIRDS):
        legs += [(force(tangent, r * radial), c1)]
        legs += [(force(((r - R) * radial + h * UP) / L, r * radial), c2)]
    I1, I2 = sp.symbols("EI_1 EI_2", positive=True)
    bent = (L**3 - (L - cylinder) ** 3) / (3 * I1) + (L - cylinder) ** 3 / (3 * I2)
    along = 1 / k + telescope(cylinder, L, "EA")
    return summed(legs), [Definition(L, sp.sqrt(LEG)), Definition(c1, bent), Definition(c2, along)]


def three_prs() -> Found:
    """The same on vertical rails; q is the rise of a rod of length L."""
    legs = []
    for radial, tangent in map(around, THIRDS):
        legs += [(force(tangent, r * radial), c1)]
        legs += [(force(((r - R) * radial + q * UP) / L, r * radial), c2)]
    rise = sp.sqrt(L**2 - (R - r) ** 2)
    across, along = L**3 / (3 * EI), (q / L) ** 2 / k + L / EA
    return summed(legs), [Definition(q, rise), Definition(c1, across), Definition(c2, along)]


def three_upu() -> Found:
    """A force along each leg; a couple in its plane with the outer axes, across these."""
    tau, C = sp.symbols("turned C", positive=True)
    s = (R - r) * sp.sin(tau) / L
    legs = []
    for phi in THIRDS:
        radial, u = around(phi)[0], ((r - R) * around(phi)[0] + h * UP) / L
        axis = around(phi + tau)[1]
        legs += [(force(u, r * radial), c1)]
        legs += [(sp.Matrix([0, 0, 0, *((u - s * axis) / C)]), c2)]
    turned = C**2 * telescope(cylinder, L, "GJ") + s**2 * telescope(cylinder, L, "EI")
    along = 1 / k + telescope(cylinder, L, "EA")
    names = [Definition(L, sp.sqrt(LEG)), Definition(C, sp.sqrt(1 - s**2))]
    return summed(legs, tau), [*names, Definition(c1, along), Definition(c2, turned)]


def three_puu() -> Found:
    """A force along each rod, and a couple about it; q is the drop of a rod of length L."""
    legs = []
    for phi in THIRDS:
        radial = around(phi + sp.pi / 12)[0]
        u = ((r - R) * radial - q * UP) / L
        legs += [(force(u, r * radial), c1), (sp.Matrix([0, 0, 0, *u]), c2)]
    rise = sp.sqrt(L**2 - (R - r) ** 2)
    along = (q / L) ** 2 / k + L / EA
    return summed(legs), [Definition(q, rise), Definition(c1, along), Definition(c2, L / GJ)]


def three_rrr() -> Found:
    """w is the force along a rod; the angles of its triangle with the crank are by cosines."""
    l1, l2, d, x, y = sp.symbols("l1 l2 d x y", positive=True)
    legs = []
    for phi in THIRDS:
        radial, tangent = around(phi - sp.pi / 6)
        legs.append((force(y * tangent - x * radial, r * radial), c1))
    toward = (d**2 + l2**2 - l1**2) / (2 * d * l2)
    cosine = (d**2 - l1**2 - l2**2) / (2 * l1 * l2)
    bending = l1**2 / k + l1**3 / (3 * EI)
    c = cosine**2 * l1 / EA + (1 - cosine**2) * bending + l2 / EA
    names = [Definition(d, R - r), Definition(x, toward), Definition(y, sp.sqrt(1 - x**2))]
    return summed(legs, rows=(0, 1, 5)), [*names, Definition(c1, c)]


def chain_by_the_expert(n: int) -> Callable[[], Found]:
    columns = list(JOINTS.values())[:n]
    return lambda: (ring_fractions(fraction_free_recursion(columns)), [])


def derived(robot: Any, pose: Any) -> Found:
    derivation = rs.derive(robot, pose=pose)
    named = derivation.named or derivation
    return upper6(named.K), list(named.definitions)


def chain(n: int) -> Callable[[], Found]:
    joints: Any = dict(list(JOINTS.items())[:n])
    return lambda: (upper(derive_chain(K0, joints).K), [])


@dataclass(frozen=True)
class Problem:
    name: str
    ours: Callable[[], Found]
    experts: tuple[Callable[[], Found], ...]
    nominal: Mapping[str, float] = field(default_factory=dict)  # of the symbols
    alike: Mapping[str, str] = field(default_factory=dict)  # expert's symbols in our names


def problems() -> list[Problem]:
    stewart = rs.load("gough-stewart-b", symbols=rs.ALL_PARAMETERS)
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "planar-leg.yaml"
        page.write_text(PLANAR_LEG, encoding="utf-8")
        leg = rs.load(page, symbols=rs.ALL_PARAMETERS)
    routes = (platform_in_expressions, platform_in_a_ring)
    found = [
        Problem(
            "platform (28) at home", lambda: derived(stewart, rs.AtHome()), routes, stewart.nominal
        ),
        Problem(
            "platform (28) at a general pose",
            lambda: derived(stewart, rs.AtSymbols()),
            (platform_anywhere,),
            stewart.nominal,
        ),
        Problem(
            "planar leg R-beam-R-beam-R",
            lambda: derived(leg, rs.AtSymbols()),
            (planar_leg,),
            leg.nominal,
        ),
    ]
    rod = {"L": "l", "EA": "EA_1", "EI": "EI_z_1", "GJ": "GJ_1"}
    bar = {"EA": "EA_1", "EI": "EI_z_1"}
    at_home: list[tuple[str, Callable[[], Found], Mapping[str, str]]] = [
        (str(DATA / "gsb-drive.yaml"), platform_with_tubes, {}),
        ("hexapod", hexapod, {}),
        ("3-prs", three_prs, rod),
        ("3-rps", three_rps, {"EI_1": "EI_z_1", "EI_2": "EI_2"}),
        ("3-upu", three_upu, {}),
        ("3-puu", three_puu, rod),
        ("3-rrr", three_rrr, bar),
    ]
    for name, expert, alike in at_home:
        robot = rs.load(name, symbols=rs.ALL_PARAMETERS)
        ours = partial(derived, robot, rs.AtHome())
        title = f"{Path(name).stem} at home"
        found.append(Problem(title, ours, (expert,), robot.nominal, alike))
    for n in range(1, 6):
        name = f"chain of 21 symbols, {n} joint{'s' * (n > 1)}"
        found.append(Problem(name, chain(n), (chain_by_the_expert(n),)))
    return found


def best(routes: Sequence[Callable[[], Found]]) -> list[tuple[float, int]]:
    """Least seconds of the processor, SymPy's cache being empty, and operations; run in turn."""
    least, found = [float("inf")] * len(routes), [route() for route in routes]
    for i, route in [*enumerate(routes)] * ROUNDS:
        for _ in range(RUNS):
            clear_cache()
            start = time.process_time()
            route()
            least[i] = min(least[i], time.process_time() - start)
    return list(zip(least, starmap(length, found), strict=True))


def length(entries: list[Any], names: list[Definition]) -> int:
    """Operations of all different entries and names."""
    different: list[Any] = []
    for x in entries:
        if x not in different and -x not in different:
            different.append(x)
    return operations_of([*different, *(d.expression for d in names)], ())


def difference(problem: Problem) -> float:
    """Of our K and the expert's at random values of the symbols, as a part of the diagonal."""
    entries, names = problem.ours()
    random = np.random.default_rng(11)
    values = {name: x * (1 + 0.05 * random.uniform(-1, 1)) for name, x in problem.nominal.items()}
    defined = {d.symbol for d in names}
    given: set[Any] = {
        s for x in (*entries, *(d.expression for d in names)) for s in x.free_symbols
    }
    for s in sorted(given - defined, key=str):
        values.setdefault(s.name, 0.5 + random.uniform())
    own = {s: values[s.name] for s in given - defined}
    ours = np.array(values_of(entries, own, names))
    rows, columns = np.triu_indices(3 if len(ours) == 6 else 6)
    diagonal = np.abs(ours[rows == columns])
    scale = np.sqrt(np.where(diagonal > 0, diagonal, np.max(diagonal)))
    sizes = scale[rows] * scale[columns]
    for d, value in zip(names, values_of([d.symbol for d in names], own, names), strict=True):
        values[d.symbol.name] = value
    largest = 0.0
    for expert in problem.experts:
        theirs, their_names = expert()
        formulas = (*theirs, *(d.expression for d in their_names))
        needed: set[Any] = set().union(*(x.free_symbols for x in formulas))
        needed -= {d.symbol for d in their_names}
        at = {s: values[problem.alike.get(s.name, s.name)] for s in needed}
        found = np.array(values_of(theirs, at, their_names))
        largest = max(largest, float(np.max(np.abs(found - ours) / sizes)))
    return largest


def main() -> None:
    parser = argparse.ArgumentParser(description="Formulas against SymPy as an expert writes it.")
    parser.add_argument("problems", nargs="*", help="parts of names; all problems when left out")
    parser.add_argument("--compare", action="store_true", help="only compare both in numbers")
    parser.add_argument("--table", type=Path, help="page in which the table is replaced")
    options = parser.parse_args()
    wanted = options.problems or [""]
    chosen = [p for p in problems() if any(part in p.name for part in wanted)]
    rows = ["| problem | robostiff s | operations | expert s | operations | expert/robostiff |"]
    rows.append("|---|---|---|---|---|---|")
    for problem in chosen:
        apart = difference(problem)
        if apart > AGREED:
            raise DisagreementError("our K and the expert's", f"by {apart:.1e}", problem.name)
        if options.compare:
            print(f"{problem.name}: {apart:.1e}")
            continue
        (ours, operations), *others = best((problem.ours, *problem.experts))
        theirs, their_operations = min(others)
        numbers = f"{ours:.3f} | {operations} | {theirs:.3f} | {their_operations}"
        rows.append(f"| {problem.name} | {numbers} | {theirs / ours:.2g} |")
        print(rows[-1], flush=True)
    if options.table is not None:
        before, mark, rest = options.table.read_text(encoding="utf-8").partition(BEGINNING)
        _, end, after = rest.partition(END)
        if not (mark and end):
            raise ValueError(f"{options.table} has no place for the table: {BEGINNING}")
        table = "\n".join(rows)
        options.table.write_text(f"{before}{mark}\n\n{table}\n\n{end}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
