"""Programs at one pose, on floats: step by step, and as a function of Python where that pays."""

from __future__ import annotations

import math
import operator
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

from robostiff.record import Operation, Program

# All of two arguments. What has no value raises.
_FUNCTIONS: dict[Operation, Callable[[float, float], float]] = {
    Operation.ADD: operator.add,
    Operation.SUBTRACT: operator.sub,
    Operation.MULTIPLY: operator.mul,
    Operation.NEGATE: lambda a, _: -a,
    Operation.RECIPROCAL: lambda a, _: 1.0 / a,
    Operation.SQUARE_ROOT: lambda a, _: math.sqrt(a),
    Operation.SINE: lambda a, _: math.sin(a),
    Operation.COSINE: lambda a, _: math.cos(a),
    Operation.ARC_COSINE: lambda a, _: math.acos(a),
    Operation.ARC_TANGENT: math.atan2,
    Operation.HYPERBOLIC_TANGENT: lambda a, _: math.tanh(a),
    Operation.LEAST: lambda a, b: a if a < b else b if b <= a else math.nan,
    Operation.GREATER: lambda a, b: float(a > b),
}
#: How operations of {a} and {b} are written in most languages, and inputs by their place {i}.
EXPRESSIONS = {
    Operation.ADD: "{a} + {b}",
    Operation.SUBTRACT: "{a} - {b}",
    Operation.MULTIPLY: "{a} * {b}",
    Operation.NEGATE: "-{a}",
    Operation.RECIPROCAL: "1.0 / {a}",
    Operation.SQUARE_ROOT: "sqrt({a})",
    Operation.SINE: "sin({a})",
    Operation.COSINE: "cos({a})",
    Operation.ARC_COSINE: "acos({a})",
    Operation.ARC_TANGENT: "atan2({a}, {b})",
    Operation.HYPERBOLIC_TANGENT: "tanh({a})",
}
_EXPRESSIONS = {
    **EXPRESSIONS,
    Operation.INPUT: "x[{i}]",
    Operation.LEAST: "{a} if {a} < {b} else {b} if {b} <= {a} else nan",
    Operation.GREATER: "float({a} > {b})",
}
# Calls after which a function is worth what it takes to compile: it takes a quarter of the time.
_OFTEN = 200
_DEEPEST = 10  # expressions inside one another


@dataclass
class OnePose:
    """Runs a program at one pose at a time."""

    program: Program
    calls: int = 0  # so far

    def results(self, inputs: list[float]) -> list[float] | None:
        """Results; None where some number has no value, as out of reach."""
        self.calls += 1
        try:
            if self.calls > _OFTEN:
                return self._function(inputs)
            numbers, instructions = self._steps
            known = numbers.copy()
            known[: len(inputs)] = inputs
            for i, function, a, b in instructions:
                known[i] = function(known[a], known[b])
        except (ValueError, ArithmeticError):
            return None
        return [known[k] for k in self.program.outputs]

    @cached_property
    def _steps(self) -> tuple[list[float], list[tuple[int, Callable[..., float], int, int]]]:
        """Numbers at their places among the steps, and what computes all others."""
        steps = self.program.steps
        numbers = [0.0] * len(steps.a)
        for i, number in steps.numbers.items():
            numbers[i] = number
        instructions = [
            (i, _FUNCTIONS[operation], a, a if b < 0 else b)
            for i, (operation, a, b) in enumerate(steps)
            if a >= 0
        ]
        return numbers, instructions

    @cached_property
    def _function(self) -> Callable[[list[float]], list[float]]:
        lines, results = written_steps(self.program, _EXPRESSIONS, _DEEPEST)
        body = [*(f"{name} = {value}" for name, value in lines), f"return [{', '.join(results)}]"]
        known = {**vars(math), "__builtins__": {"float": float}}
        # Its words are those of the table, numbers, and names made here.
        exec(compile("def f(x):\n " + "\n ".join(body), "<program>", "exec"), known)  # noqa: S102
        return known["f"]


def written_steps(
    program: Program, expressions: Mapping[Operation, str], deepest: int = 0
) -> tuple[list[tuple[str, str]], list[str]]:
    """Expressions of the steps of a program by their names, in order, and those of its results.

    Parameters
    ----------
    program : Program
    expressions : mapping of Operation to str
        As `EXPRESSIONS`.
    deepest : int
        A step of one use stands where it is used, so many inside one another; otherwise each step
        has a name.
    """
    uses = Counter(program.outputs)
    for operation, *places in program.steps:
        template = expressions.get(operation, "")
        for key, k in zip(("{a}", "{b}"), places, strict=True):
            uses[k] += template.count(key)
    lines, known, depths = [], [], []
    for i, (operation, a, b) in enumerate(program.steps):
        depth = 0
        if operation is Operation.NUMBER:
            number = program.steps.numbers[i]
            known.append(f"({number!r})" if number < 0 else repr(number))
        else:
            arguments = {key: k for key, k in (("a", a), ("b", b)) if k >= 0}
            texts = {key: known[k] for key, k in arguments.items()}
            value = expressions[operation].format(i=i, **texts)
            depth = 1 + max((depths[k] for k in arguments.values()), default=0)
            if uses[i] == 1 and depth <= deepest:
                known.append(f"({value})")
            else:
                lines.append((f"v{i}", value))
                known.append(f"v{i}")
                depth = 0
        depths.append(depth)
    return lines, [known[k] for k in program.outputs]
