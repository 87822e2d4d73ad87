"""Machines of modules in series, at home: a formula of each module by itself, and their sum.

Legs of a module close by themselves, as those of any robot do, so that no joint coordinate of the
machine is left unknown.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from robostiff.analysis import stiffness
from robostiff.analytic.derivation import RobotDerivation
from robostiff.analytic.exact.definition import Condition, Definition, Unwritten
from robostiff.analytic.exact.exact_points import values_of
from robostiff.analytic.legs import bare_leg
from robostiff.analytic.placement.agreement import AGREED, SPREADS, check_value
from robostiff.analytic.placement.named_springs import NamedSprings
from robostiff.analytic.placement.robot_placement import AT_HOME, PlacedRobot
from robostiff.analytic.series_form import arm_in_vectors
from robostiff.analytic.vectors.forms import VectorForm
from robostiff.analytic.vectors.walk import UnusualPartError
from robostiff.errors import InputError
from robostiff.frozen import are_equal
from robostiff.kinematics.hybrid_machine import closed_at_home, modules_of
from robostiff.model import with_entries

_SEED = 75


def machine_formula(
    placed: PlacedRobot, derive: Callable[..., RobotDerivation]
) -> RobotDerivation | None:
    """The stiffness of a machine at home, K = C^-1, to which each module adds its compliance.

    None of robots that are no such machines, and where a module is rigid, or leaves motions free.

    `derive`: of a robot, with definitions whose names it takes over.

    Raises
    ------
    DisagreementError
        When it differs from the numerical form at random parameters.
    """
    form = _form(placed, derive)
    if form is None:
        return None
    robot, leg, result = placed.robot, placed.legs[0].leg, None
    random, values = np.random.default_rng(_SEED), dict(robot.nominal)
    for spread in SPREADS:
        drawn = random.uniform(-spread, spread, len(values)).tolist()
        each = zip(robot.nominal.items(), drawn, strict=True)
        values = {name: x + part * (abs(x) or 1.0) for (name, x), part in each}
        with suppress(InputError):
            result = stiffness(closed_at_home(robot.substituted(values)))
            break
    if result is None or not result.answered:
        return None
    at = {placed.symbols[name]: x for name, x in values.items()}
    where = f"{robot.name!r} {AT_HOME}"
    check_value(form.K, form.definitions, at, result.K, AGREED, where, placed.length)

    def conditions() -> Iterator[Condition]:
        """Those of robots, of which legs are named as those of the machine are."""
        for name, *_, module in form.modules:
            for c in module.conditions if isinstance(module, RobotDerivation) else ():
                leg = f"{name}/{c.leg}" * bool(c.leg)
                words = c.words.replace(f"leg {c.leg!r}", f"leg {leg!r}")
                yield replace(c, leg=leg, words=words)

    written = Unwritten(cache(lambda: tuple(conditions())))
    about: Any = {"name": robot.name, "conditions": written, "meanings": placed.meanings}
    return RobotDerivation(
        **about,
        K0=form.K,
        stages=(),
        K=form.K,
        definitions=form.definitions,
        legs=(bare_leg(leg),),
        where=AT_HOME,
        at_vector_level=Unwritten(lambda: replace(form, **about)),
        general_rank=int(result.rank),
    )


def _form(placed: PlacedRobot, derive: Callable[..., RobotDerivation]) -> VectorForm | None:
    """An arm in which robots stand."""
    robot, springs = placed.robot, placed.springs
    if not (robot.is_serial and placed.symbols) or robot.platform is not None:
        return None
    if any(joint.is_passive for joint in placed.legs[0].leg.without_blocks.freedoms):
        return None
    # The same names of springs in all modules: given symbols of these.
    named = NamedSprings(robot, placed.symbols.keys() - {d.symbol.name for d in springs})
    twin = with_entries(robot, lambda x: x, named.parts(lambda x: x))
    at = {placed.symbols[name]: value for name, value in robot.nominal.items()}
    symbols = [d.symbol for d in springs]
    values = map(float, values_of(symbols, at, springs))
    nominal = dict(zip((s.name for s in symbols), values, strict=True)) | dict(robot.nominal)
    robots, known = dict[str, Any](), list[Definition]()
    modules = [x.robot for x in modules_of(replace(twin, nominal=nominal)) if x.robot is not None]
    try:
        for module in modules:
            same = next(
                x for x in modules if are_equal((x.legs, x.home), (module.legs, module.home))
            )
            found = robots.get(same.name) or derive(module, known=known)
            if found.general_rank != robot.space.size or found.following:
                return None
            robots[module.name] = found
            known += [d for d in found.as_printed[1] if d not in known]
        return arm_in_vectors(placed.knowing(known), robots) if robots else None
    except (UnusualPartError, InputError):
        return None
