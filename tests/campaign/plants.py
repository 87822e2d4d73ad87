"""Defects that are planted one at a time, and what the campaign says of them.

Each replaces something of the library by something wrong. Machines are drawn in the order of their
numbers, until one is complained of; without the defect nothing is said of the same machine.
"""
# pyright: reportPrivateUsage=false

from __future__ import annotations

import itertools
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

import robostiff as rs
from robostiff.elasticity import beam as beam_module
from robostiff.elastostatics import Tolerance, parallel_block, tolerance
from robostiff.io.units import unit as units_of_words
from robostiff.spatial import transport
from tests.campaign import (
    coupled_joints,
    descriptions,
    loaded_cables,
    loaded_networks,
    loads,
    mechanisms,
    placed,
    posed,
    posed_ways,
    ways,
)
from tests.campaign.answers import Complaint
from tests.campaign.reread_answers import compared, drawn, is_right

SEED = 2026
Judged = Callable[[int], list[Complaint]]


class Patch:
    """Replacements that are undone."""

    def __init__(self) -> None:
        self._before: list[tuple[Any, str, Any]] = []
        self._functions: list[tuple[Any, Any]] = []

    def set(self, owner: Any, name: str, value: Any) -> None:
        """An attribute of a class, an object or a module."""
        self._before.append((owner, name, vars(owner)[name]))
        _set(owner, name, value)

    def function(self, module: Any, name: str, changed: Callable[[Any], Any]) -> None:
        """A function of a module, wherever else it was imported, by what is made of it."""
        old = getattr(module, name)
        new = changed(old)
        self._functions.append((old, new))
        _exchange(old, new)

    def method(self, owner: type, name: str, changed: Callable[[Any], Any]) -> None:
        """A method or property of a class."""
        old = vars(owner)[name]
        if isinstance(old, property):
            self.set(owner, name, property(changed(old.fget)))
        elif isinstance(old, classmethod | staticmethod):
            self.set(owner, name, type(old)(changed(old.__func__)))
        else:
            self.set(owner, name, changed(old))

    def undo(self) -> None:
        """As it was, in modules too that were imported in between."""
        for old, new in self._functions:
            _exchange(new, old)
        for owner, name, value in reversed(self._before):
            _set(owner, name, value)


def _modules() -> list[Any]:
    return [module for name, module in sys.modules.items() if name.startswith("robostiff")]


def _exchange(old: Any, new: Any) -> None:
    for module in _modules():
        for own, value in list(vars(module).items()):
            if value is old:
                setattr(module, own, new)


def _set(owner: Any, name: str, value: Any) -> None:
    if isinstance(owner, Tolerance):
        object.__setattr__(owner, name, value)
    else:
        setattr(owner, name, value)


@dataclass(frozen=True)
class Plant:
    """A defect: where it is, what it does, and which machines are drawn until it is found."""

    name: str
    plant: Callable[[Patch], None]
    machines: str
    most: int = 60  # machines


# -- machines, by number ------------------------------------------------------------------------


def _frozen(number: int) -> list[Complaint]:
    rng = np.random.default_rng([SEED, number])
    names = list(placed.KINDS)
    snapshot = placed.random_snapshot(rng, names[number % len(names)])
    return ways.judged(snapshot, [SEED, number, 1])[0].complaints


def _posed(*kinds: str, only: tuple[str, ...] = ()) -> Judged:
    def judged(number: int) -> list[Complaint]:
        rng = np.random.default_rng([SEED, number])
        robot = posed.random_posed(rng, kinds[number % len(kinds)])
        if robot is None:
            return []
        chosen = frozenset(only) or None
        return posed_ways.judged_posed(robot, [SEED, number, 1], chosen)[0]

    return judged


def _by(judge: Callable[[np.random.Generator], list[Complaint]]) -> Judged:
    return lambda number: judge(np.random.default_rng([SEED, number]))


def _files(number: int) -> list[Complaint]:
    with tempfile.TemporaryDirectory() as folder:
        path = drawn(("arms", "platforms")[number % 2], 20261123, number, Path(folder))
        try:
            answers = list(compared(path, np.random.default_rng([20261123, number])))
        except (rs.FileError, rs.NoAnswerError):
            return []
    wrong = [own for own in answers if not is_right(own)]
    return [Complaint("second reader", "another answer", str(own)) for own in wrong[:1]]


MACHINES: dict[str, Judged] = {
    "robots frozen at a pose": _frozen,
    "legs and arms": _posed("one leg", "several legs", "arm"),
    "shipped robots by kernel": _posed("shipped", only=("kernel in NumPy",)),
    "shipped robots by kernel with parameters": _posed("shipped", only=("kernel with parameters",)),
    "maps": _posed("several legs", "shipped", only=("map",)),
    "formulas": _posed("shipped", "structure", only=("formula with values",)),
    "linkages": lambda n: mechanisms.judged_mechanism(np.random.default_rng([SEED, n]), "linkage")[
        0
    ],
    "robots under loads": _by(loads.loaded_robot),
    "frames under loads": _by(loaded_networks.loaded_network),
    "loads on beams": _by(loaded_networks.response),
    "columns": _by(loaded_networks.column),
    "cables": _by(loaded_cables.cable_robot),
    "descriptions": _by(descriptions.described),
    "coupled joints": _by(coupled_joints.judged_robot),
    "files read twice": _files,
}


# -- defects ------------------------------------------------------------------------------------


def _screw_cross(patch: Patch) -> None:
    from robostiff.spatial import Screw

    def changed(twist: Any) -> Any:
        def wrong(self: Any, at: np.ndarray) -> np.ndarray:
            t = twist(self, at)
            if self.pitch is None or t.dtype == object:
                return t
            along = self.pitch * t[..., 3:]
            return np.concatenate([2 * along - t[..., :3], t[..., 3:]], axis=-1)

        return wrong

    patch.method(Screw, "twist", changed)


def _transport(patch: Patch) -> None:
    def changed(of: Any) -> Any:
        def wrong(v: np.ndarray) -> np.ndarray:
            return of(-v)

        return wrong

    patch.function(transport, "twist_transport", changed)


def _sections_exchanged(patch: Patch) -> None:
    def changed(of: Any) -> Any:
        return lambda L, E, G, A, Iy, Iz, *rest: of(L, E, G, A, Iz, Iy, *rest)

    patch.function(beam_module, "cantilever_compliance", changed)


def _no_shear(patch: Patch) -> None:
    patch.method(rs.Timoshenko, "shear_factors", lambda _: lambda self, section: (None, None))


def _wide_tolerance(patch: Patch) -> None:
    first = tolerance.DEFAULT_TOLERANCE.independence
    patch.set(tolerance.DEFAULT_TOLERANCE, "independence", 100 * first)


def _any_branch(patch: Patch) -> None:
    from robostiff.kinematics.closure.assembly_mode import AssemblyMode

    def never(_: Any) -> Any:
        return lambda self, x, *rest: np.zeros(len(x), dtype=bool)

    for name in ("_crosses", "_is_nearly_singular", "_is_long"):
        patch.method(AssemblyMode, name, never)


def _coupling_sign(patch: Patch) -> None:
    from robostiff.kinematics import frames
    from robostiff.model import CoupledFreedom

    def turned(e: Any) -> Any:
        if not isinstance(e, CoupledFreedom):
            return e
        moves = tuple((n, f if n == e.joint else -f, screw) for n, f, screw in e.moves)
        return replace(e, moves=moves)

    def changed(of: Any) -> Any:
        return lambda *given, **how: [turned(e) for e in of(*given, **how)]

    patch.function(frames, "coupled", changed)


def _gravity_sign(patch: Patch) -> None:
    from robostiff.statics.loading import given_loads

    patch.function(given_loads, "acting_gravity", lambda of: lambda *given: -of(*given))


def _no_inertia(patch: Patch) -> None:
    patch.method(rs.Mass, "points", lambda of: lambda self: ((self.value, np.zeros(3)),))


def _force_at_part(patch: Patch) -> None:
    from robostiff.statics.loading import given_loads

    def changed(of: Any) -> Any:
        def wrong(*given: Any) -> Any:
            found = of(*given)
            return {
                name: tuple(replace(own, point=None) for own in forces)
                for name, forces in found.items()
            }

        return wrong

    patch.function(given_loads, "given_forces", changed)


def _no_guard(patch: Patch) -> None:
    from robostiff.analysis import compiled_answer

    def changed(of: Any) -> Any:
        def unguarded(*given: Any) -> Any:
            found = of(*given)
            return replace(found, guarded=np.zeros_like(found.guarded))

        return unguarded

    patch.function(compiled_answer, "decided", changed)


def _pitch_sign(patch: Patch) -> None:
    from robostiff.spatial import Screw

    def changed(of: Any) -> Any:
        return lambda self, q: of(self, q) if self.pitch is None else -of(self, q)

    patch.method(Screw, "advance", changed)


def _spring_axes(patch: Patch) -> None:
    from robostiff.kinematics.frames import ChainWalk

    def changed(of: Any) -> Any:
        return lambda self, name, axes, elasticity: of(self, name, axes.T, elasticity)

    patch.method(ChainWalk, "spring", changed)


def _block_energy(patch: Patch) -> None:
    def changed(of: Any) -> Any:
        def wrong(*given: Any) -> Any:
            found = of(*given)
            return replace(found, modes=found.modes * np.sqrt(2.0))

        return wrong

    patch.function(parallel_block, "block_of", changed)


def _cables_push(patch: Patch) -> None:
    from robostiff.statics.chains.elements import SpringArrays

    def changed(of: Any) -> Any:
        def wrong(self: Any, *where: Any) -> Any:
            return of(replace(self, is_cable=np.zeros_like(self.is_cable)), *where[:-1], 1.0)

        return wrong

    patch.method(SpringArrays, "at", changed)


def _weights_at_ends(patch: Patch) -> None:
    from robostiff.model.mass import PlacedMass

    def changed(of: Any) -> Any:
        def wrong(self: Any, parts: int, end: np.ndarray) -> Any:
            found = of(self, parts, end)
            if self.start is None or parts != 1 or len(found) != 2:
                return found
            return [replace(found[0], point=self.start), replace(found[1], point=end)]

        return wrong

    patch.method(PlacedMass, "lumped", changed)


def _bowing(patch: Patch) -> None:
    from robostiff.statics.chains import beam_bowing

    def changed(of: Any) -> Any:
        def wrong(*given: Any, **how: Any) -> Any:
            found = of(*given, **how)
            return replace(found, s=0.8 * found.s)

        return wrong

    patch.function(beam_bowing, "bending", changed)


def _chunk_offset(patch: Patch) -> None:
    from robostiff.analysis.maps.evaluator import MapEvaluator

    def changed(of: Any) -> Any:
        def wrong(self: Any, poses: np.ndarray, out: Any, **how: Any) -> Any:
            is_right = len(poses) % 4 == 0 and len(poses) > 4000
            return of(self, poses if is_right else np.roll(poses, 1, axis=0), out, **how)

        return wrong

    patch.method(MapEvaluator, "evaluate", changed)


def _unit(patch: Patch) -> None:
    units = dict(units_of_words._UNITS)
    units["mm"] = replace(units["mm"], ratio=Fraction("1.001e-3"))
    patch.function(units_of_words, "_UNITS", lambda _: units)


def _parameter_order(patch: Patch) -> None:
    from robostiff.analysis.kernel_inputs import ParameterValues

    def changed(of: Any) -> Any:
        def wrong(cls: Any, robot: Any, given: Any, count: int) -> Any:
            found = of(cls, robot, given, count)
            return replace(found, rows=found.rows[::-1])

        return wrong

    patch.method(ParameterValues, "of", changed)


def _value_exchanged(patch: Patch) -> None:
    from robostiff.analytic import substitution

    def changed(of: Any) -> Any:
        def wrong(*given: Any) -> Any:
            found = of(*given)
            names = [s for s in found if found[s].is_number]
            values = [found[s] for s in names]
            return found | dict(zip(names, values[1:] + values[:1], strict=True))

        return wrong

    patch.function(substitution, "values_of_symbols", changed)


def _preload_sign(patch: Patch) -> None:
    from robostiff.statics.loading.legs import _Chains

    def changed(of: Any) -> Any:
        return lambda self, preload: of(self, {n: -v for n, v in preload.items()})

    patch.method(_Chains, "push", changed)


def _law_tangent(patch: Patch) -> None:
    patch.method(rs.ForceLaw, "tangent", lambda of: lambda self, q: of(self, 0.0))


PLANTS = (
    Plant("sign of the cross product in `Screw.twist`, eq. (17)", _screw_cross, "coupled joints"),
    Plant("sign of the arm in `twist_transport`, eq. (13)", _transport, "robots frozen at a pose"),
    Plant("Iy and Iz of beams exchanged", _sections_exchanged, "frames under loads"),
    Plant("no shear of Timoshenko beams", _no_shear, "frames under loads"),
    Plant("independence tolerance 1e-7", _wide_tolerance, "robots frozen at a pose", 300),
    Plant("any branch of the closure", _any_branch, "linkages", 300),
    Plant("sign of a joint that follows", _coupling_sign, "coupled joints"),
    Plant("sign of gravity", _gravity_sign, "robots under loads"),
    Plant("masses without inertia", _no_inertia, "robots under loads", 120),
    Plant("forces at the part, not at their point", _force_at_part, "robots under loads"),
    Plant("kernels without margins", _no_guard, "shipped robots by kernel"),
    Plant("sign of the pitch of screws", _pitch_sign, "legs and arms"),
    Plant("axes of springs transposed", _spring_axes, "robots under loads"),
    Plant("twice the energy of parallel blocks", _block_energy, "robots frozen at a pose"),
    Plant("slack cables push", _cables_push, "cables", 400),
    Plant("weights of beams at their ends", _weights_at_ends, "frames under loads"),
    Plant("four fifths of the bowing of beams", _bowing, "columns"),
    Plant("the last chunk of a map begins a pose late", _chunk_offset, "maps"),
    Plant("a millimetre of 1.001 mm", _unit, "files read twice"),
    Plant(
        "parameters of kernels in another order",
        _parameter_order,
        "shipped robots by kernel with parameters",
    ),
    Plant("values of `subs` exchanged", _value_exchanged, "formulas"),
    Plant("sign of preloads", _preload_sign, "robots under loads", 120),
    Plant("tangent of force laws at rest", _law_tangent, "robots under loads", 120),
)


@contextmanager
def planted(plant: Plant) -> Iterator[None]:
    """The library with one defect."""
    patch = Patch()
    try:
        plant.plant(patch)
        _forget()
        yield
    finally:
        patch.undo()
        _forget()


def _forget() -> None:
    """Results that functions of the library keep."""
    for module in _modules():
        for own in list(vars(module).values()):
            if callable(clear := getattr(own, "cache_clear", None)):
                clear()


def found(plant: Plant) -> tuple[int, Complaint] | None:
    """The first machine that is complained of because of a defect, and what is said of it."""
    judged = MACHINES[plant.machines]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for number in itertools.islice(itertools.count(), plant.most):
            with planted(plant):
                complaints = _said(judged, number)
            if complaints:
                before = {own.key for own in _said(judged, number)}
                for own in complaints:
                    if own.key not in before:
                        return number, own
    return None


def _said(judged: Judged, number: int) -> list[Complaint]:
    try:
        return judged(number)
    except Exception as error:  # whatever is raised is a finding
        return [Complaint("raised", type(error).__name__, str(error)[:200])]
