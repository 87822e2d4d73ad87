"""Optima and tolerances of the parameters of a robot."""

from __future__ import annotations

from robostiff.design.optimum import Ending, Optimum
from robostiff.design.tolerances import Tolerances
from robostiff.markup import Block, Facts, Number, Page, Table

_QUANTILES = (0.05, 0.5, 0.95, 0.99)


def optimum_page(found: Optimum) -> Page:
    """The values of the variables, the objective before and after, and the limits that hold."""
    rows = [(name, Number(value)) for name, value in found.values.items()]
    facts = (
        ("ended", f"{found.ending.value} after {found.steps} steps"),
        ("at limits", ", ".join(found.at_limits)),
    )
    advice = () if found.ending is Ending.OPTIMUM else (found.ending.advice,)
    blocks: list[Block] = [
        Table(("variable", "value [SI]"), rows),
        Table(
            ("objective", ""),
            [("at the start", Number(found.at_start)), ("found", Number(found.objective))],
        ),
        Facts(tuple(own for own in facts if own[1])),
    ]
    return Page(found.robot.name, ", best values of its parameters", None, blocks, advice)


def tolerances_page(found: Tolerances) -> Page:
    """Nominal value and quantiles of each output at the first pose, and what they come from."""
    blocks: list[Block] = []
    for name, nominal in found.nominal.items():
        rows = [("nominal", Number(float(nominal[0])), "")]
        for q in _QUANTILES:
            value, error = (float(own[0]) for own in found.quantile(name, q))
            rows.append((f"{100 * q:g} % below", Number(value), f"± {error:.2g}"))
        blocks.append(Table((name, "[SI]", ""), rows))
        shares = [(own, f"{share:.1%}") for own, share in found.shares(name).items()]
        blocks.append(Table(("parameter", "share of the variance"), shares))
    count = len(next(iter(found.samples.values())))
    advice = ()
    if found.answered < 1:
        advice = (f"{1 - found.answered:.2%} of the robots have no answer and are left out",)
    return Page(f"{count} robots", ", whose parameters are spread", None, blocks, advice)
