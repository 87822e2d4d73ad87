"""Programs as machine code of several poses an operation, written for LLVM, compiled by llvmlite.

Sines, cosines, arc functions and the hyperbolic tangent are written out, too, so that no function
is called for single numbers. They are right to two units in the last place on any processor.
"""

from __future__ import annotations

import ctypes
import math
import platform
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, TypeAlias

import numpy as np

from robostiff.record import Operation, Program

#: Numbers at poses: an array (rows, N), or rows (N,) each at a place of its own.
Rows: TypeAlias = np.ndarray | Sequence[np.ndarray]

# pi/2 in three parts, for angles up to the largest; beyond, no rounding of an angle makes sense.
_HALF_TURN_PARTS = (1.5707963267948966, 6.123233995736766e-17, -1.4973849048591833e-33)
_LARGEST_ANGLE = 1e9
# Coefficients, highest power first. Sine and cosine from -pi/4 to pi/4, arc tangent, exponential
# and hyperbolic tangent: S. Moshier, Cephes; arc sine up to 1/2: Sun Microsystems, fdlibm.
_SINE = (
    *(1.58962301576546568060e-10, -2.50507477628578072866e-8, 2.75573136213857245213e-6),
    *(-1.98412698295895385996e-4, 8.33333333332211858878e-3, -1.66666666666666307295e-1),
)
_COSINE = (
    *(-1.13585365213876817300e-11, 2.08757008419747316778e-9, -2.75573141792967388112e-7),
    *(2.48015872888517045348e-5, -1.38888888888730564116e-3, 4.16666666666665929218e-2),
)
_ARC_SINE = (
    (
        *(3.47933107596021167570e-5, 7.91534994289814532176e-4, -4.00555345006794114027e-2),
        *(2.01212532134862925881e-1, -3.25565818622400915405e-1, 1.66666666666666657415e-1),
        0.0,
    ),
    (
        *(7.70381505559019352791e-2, -6.88283971605453293030e-1, 2.02094576023350569471),
        *(-2.40339491173441421878, 1.0),
    ),
)
_ARC_TANGENT = (
    (
        *(-8.750608600031904122785e-1, -1.615753718733365076637e1, -7.500855792314704667340e1),
        *(-1.228866684490136173410e2, -6.485021904942025371773e1, 0.0),
    ),
    (
        *(1.0, 2.485846490142306297962e1, 1.650270098316988542046e2, 4.328810604912902668951e2),
        *(4.853903996359136964868e2, 1.945506571482613964425e2),
    ),
)
_EXPONENTIAL = (
    (1.26177193074810590878e-4, 3.02994407707441961300e-2, 9.99999999999999999910e-1),
    (
        *(3.00198505138664455042e-6, 2.52448340349684104192e-3),
        *(2.27265548208155028766e-1, 2.00000000000000000009),
    ),
)
_LOGARITHM_OF_2 = (6.93145751953125e-1, 1.42860682030941723212e-6)
_HYPERBOLIC_TANGENT = (
    (-9.64399179425052238628e-1, -9.92877231001918586564e1, -1.61468768441708447952e3, 0.0),
    (1.0, 1.12811678491632931402e2, 2.23548839060100448583e3, 4.84406305325125486048e3),
)
# Added to a number up to 2^51, this leaves its nearest whole number in the last bits.
_WHOLE = 6755399441055744.0
_WIDTH_OF_ESTIMATES = 8  # AVX-512 estimates reciprocals and roots of doubles


@dataclass(frozen=True)
class Processor:
    """What code is compiled for."""

    name: str  # as LLVM calls it
    features: str
    width: int  # how many poses an operation takes


@cache
def this_processor() -> Processor | None:
    """The processor at hand, or None where no machine code is made.

    That is where llvmlite is not installed, or the processor multiplies and adds in two steps. The
    width is eight on processors that lose no speed by that. The first processors with AVX-512
    slow down when they use it; those with its later parts do not.
    """
    try:
        import llvmlite.binding as llvm
    except ImportError:
        return None
    features = llvm.get_host_cpu_features()
    if platform.machine().lower() in ("arm64", "aarch64"):
        width = 2
    elif not features.get("fma", False):
        return None
    else:
        width = 8 if features.get("avx512vbmi2", False) else 4
    return Processor(llvm.get_host_cpu_name(), features.flatten(), width)


def machine_code_is_available() -> bool:
    """Whether programs can be compiled here."""
    return this_processor() is not None


#: A compiled function: addresses of two tables, which have the addresses of the rows of inputs and
#: of results, the first pose, and the first after the last (they are apart by a multiple of the
#: width).
_Compiled = Callable[[int, int, int, int], None]


def functions_of(
    text: str, processor: Processor, kinds: Mapping[str, tuple[Any, ...]]
) -> dict[str, Any]:
    """Functions that are written in the language of LLVM, by name, with the types they take."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine(
        cpu=processor.name, features=processor.features, opt=2, jit=True
    )
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(text), machine)
    engine.finalize_object()
    found = {}
    for name, kind in kinds.items():
        found[name] = ctypes.CFUNCTYPE(None, *kind)(engine.get_function_address(name))
        found[name].engine = engine  # owns the machine code, and lives as long as its functions
    return found


@dataclass(frozen=True)
class VectorFunction:
    """A program as machine code for one processor."""

    address: _Compiled
    width: int  # how many poses an operation takes

    @staticmethod
    def of(program: Program, processor: Processor) -> VectorFunction:
        """Compile a program."""
        pointer, count = ctypes.c_void_p, ctypes.c_int64
        kinds = {"program": (pointer, pointer, count, count)}
        functions = functions_of(text_of(program, processor.width), processor, kinds)
        return VectorFunction(functions["program"], processor.width)

    def fill(self, inputs: Rows, outputs: Rows, part: slice) -> None:
        """Fill rows of results at a part of the poses, float64, poses side by side in each row."""
        start, stop, width = part.start, part.stop, self.width
        if stop - start >= width:
            tables = _addresses(inputs), _addresses(outputs)
            a, b = (own.ctypes.data for own in tables)
            whole = stop - (stop - start) % width
            self.address(a, b, start, whole)
            if whole < stop:  # the last poses, together with some of those before
                self.address(a, b, stop - width, stop)
        elif start < stop:
            # Fewer poses than an operation takes are filled up by the last one.
            last = np.minimum(np.arange(start, start + width), stop - 1)
            found = np.empty((len(outputs), width))
            self.fill(np.array([row[last] for row in inputs]), found, slice(0, width))
            for row, own in zip(outputs, found, strict=True):
                row[start:stop] = own[: stop - start]


def _addresses(rows: Rows) -> np.ndarray:
    """Where each row begins (rows,)."""
    if isinstance(rows, np.ndarray):
        return rows.ctypes.data + rows.strides[0] * np.arange(len(rows))
    return np.array([row.__array_interface__["data"][0] for row in rows], dtype=np.int64)


def text_of(program: Program, width: int) -> str:
    """A program in the language of LLVM, as a loop over poses, so many an operation."""
    lines = _Lines(width)
    known: list[str] = []
    turned: dict[str, tuple[str, str]] = {}  # sine and cosine of an angle
    for step in program.steps:
        arguments = [known[k] for k in (step.a, step.b) if k is not None]
        if step.operation is Operation.INPUT:
            place = lines.place("input", len(known))
            value = lines.new(f"load {lines.vector}, ptr {place}, align 8")
        elif step.operation is Operation.NUMBER:
            value = lines.number(step.number)
        elif step.operation in (Operation.SINE, Operation.COSINE):
            (angle,) = arguments
            if angle not in turned:
                turned[angle] = lines.sine_and_cosine(angle)
            value = turned[angle][step.operation is Operation.COSINE]
        else:
            value = _OPERATIONS[step.operation](lines, *arguments)
        known.append(value)
    for k, step in enumerate(program.outputs):
        place = lines.place("output", k)
        lines.lines.append(f"store {lines.vector} {known[step]}, ptr {place}, align 8")
    functions = (("fma", 3), ("rint", 1), ("sqrt", 1), ("fabs", 1), ("copysign", 2))
    declared = "\n".join(
        f"declare {lines.vector} @llvm.{name}.v{width}f64({', '.join([lines.vector] * count)})"
        for name, count in functions
    )
    if width == _WIDTH_OF_ESTIMATES:
        given = f"{lines.vector}, {lines.vector}, i8"
        for name in ("rcp14", "rsqrt14"):
            declared += f"\ndeclare {lines.vector} @llvm.x86.avx512.{name}.pd.512({given})"
    rows = [("input", k) for k in range(len(program.inputs))]
    rows += [("output", k) for k in range(len(program.outputs))]
    addresses = "\n  ".join(
        f"%{kind}_place{k} = getelementptr ptr, ptr %{kind}s, i64 {k}\n"
        f"  %{kind}{k} = load ptr, ptr %{kind}_place{k}"
        for kind, k in rows
    )
    body = "\n  ".join(lines.lines)
    parameters = "ptr noalias %inputs, ptr noalias %outputs, i64 %start, i64 %stop"
    bits = 64 * width
    return f"""{declared}
define void @program({parameters}) #0 {{
entry:
  {addresses}
  br label %poses
poses:
  %pose = phi i64 [%start, %entry], [%next, %poses]
  {body}
  %next = add i64 %pose, {width}
  %more = icmp slt i64 %next, %stop
  br i1 %more, label %poses, label %done
done:
  ret void
}}
attributes #0 = {{ nounwind "prefer-vector-width"="{bits}" "min-legal-vector-width"="{bits}" }}
"""


@dataclass
class _Lines:
    """Lines of one pass of the loop; a method adds what computes a value, and returns its name."""

    width: int
    lines: list[str] = field(default_factory=list)
    masks: dict[str, str] = field(default_factory=dict)  # bits of values that are 1 or 0

    @property
    def vector(self) -> str:
        return f"<{self.width} x double>"

    @property
    def integers(self) -> str:
        return f"<{self.width} x i64>"

    def new(self, text: str) -> str:
        name = f"%v{len(self.lines)}"
        self.lines.append(f"{name} = {text}")
        return name

    def place(self, kind: str, k: int) -> str:
        """Address of the present poses in row `k` of the inputs or outputs."""
        return self.new(f"getelementptr double, ptr %{kind}{k}, i64 %pose")

    def number(self, x: float) -> str:
        return f"splat (double 0x{struct.pack('>d', float(x)).hex().upper()})"

    def plus(self, a: str, b: str) -> str:
        return self.new(f"fadd contract {self.vector} {a}, {b}")

    def minus(self, a: str, b: str) -> str:
        return self.new(f"fsub contract {self.vector} {a}, {b}")

    def times(self, a: str, b: str) -> str:
        if a in self.masks and b in self.masks:
            both = f"{self.masks[a]}, {self.masks[b]}"
            return self._one_where(self.new(f"and <{self.width} x i1> {both}"))
        return self.new(f"fmul contract {self.vector} {a}, {b}")

    def over(self, a: str, b: str) -> str:
        return self.new(f"fdiv {self.vector} {a}, {b}")

    def reciprocal(self, x: str) -> str:
        """Two steps of Newton's method from an estimate of 14 bits, where the processor has one."""
        one = self.number(1.0)
        if self.width != _WIDTH_OF_ESTIMATES:
            return self.over(one, x)
        less, value = self.negative(x), self._estimate("rcp14", x)
        start = value
        for _ in range(2):
            value = self._times_plus(value, self._times_plus(less, value, one), value)
        return self.select(self.compare("une", x, self.number(0.0)), value, start)

    def negative(self, a: str) -> str:
        return self.new(f"fneg {self.vector} {a}")

    def root(self, x: str) -> str:
        """Likewise, of the root and half its reciprocal together."""
        if self.width != _WIDTH_OF_ESTIMATES:
            return self._call("sqrt", x)
        estimate = self._estimate("rsqrt14", x)
        root, half = self.times(x, estimate), self.times(self.number(0.5), estimate)
        rest = self._times_plus(self.negative(root), half, self.number(0.5))
        root, half = self._times_plus(root, rest, root), self._times_plus(half, rest, half)
        for _ in range(2):
            root = self._times_plus(self._times_plus(self.negative(root), root, x), half, root)
        return self.select(self.compare("une", x, self.number(0.0)), root, x)

    def least(self, a: str, b: str) -> str:
        """The lower one, or that which is no number."""
        lower = self.select(self.compare("olt", b, a), b, a)
        return self.select(self.compare("uno", b, b), b, lower)

    def greater(self, a: str, b: str) -> str:
        """1 or 0."""
        return self._one_where(self.compare("ogt", a, b))

    def _one_where(self, mask: str) -> str:
        value = self.select(mask, self.number(1.0), self.number(0.0))
        self.masks[value] = mask
        return value

    def _estimate(self, function: str, x: str) -> str:
        rest = f"{self.vector} zeroinitializer, i8 -1"
        return self.new(
            f"call {self.vector} @llvm.x86.avx512.{function}.pd.512({self.vector} {x}, {rest})"
        )

    def compare(self, how: str, a: str, b: str) -> str:
        return self.new(f"fcmp {how} {self.vector} {a}, {b}")

    def select(self, condition: str, a: str, b: str) -> str:
        vector = self.vector
        return self.new(f"select <{self.width} x i1> {condition}, {vector} {a}, {vector} {b}")

    def _call(self, function: str, *arguments: str) -> str:
        given = ", ".join(f"{self.vector} {each}" for each in arguments)
        return self.new(f"call {self.vector} @llvm.{function}.v{self.width}f64({given})")

    def _times_plus(self, a: str, b: str, c: str) -> str:
        return self._call("fma", a, b, c)

    def _polynomial(self, coefficients: Sequence[float], x: str) -> str:
        value = self.number(coefficients[0])
        for coefficient in coefficients[1:]:
            value = self._times_plus(value, x, self.number(coefficient))
        return value

    def _ratio(self, parts: tuple[Sequence[float], Sequence[float]], x: str) -> str:
        above, below = (self._polynomial(part, x) for part in parts)
        return self.over(above, below)

    def _whole(self, x: str) -> str:
        """A whole number as an integer."""
        sum_ = self.new(f"fadd {self.vector} {x}, {self.number(_WHOLE)}")
        return self.new(f"bitcast {self.vector} {sum_} to {self.integers}")

    def _bit(self, x: str, mask: int) -> str:
        bits = self.new(f"and {self.integers} {x}, splat (i64 {mask})")
        return self.new(f"icmp ne {self.integers} {bits}, zeroinitializer")

    def sine_and_cosine(self, x: str) -> tuple[str, str]:
        """Of the part within an eighth of a turn, exchanged and signed by the quadrant."""
        quarters = self._call("rint", self.times(x, self.number(2.0 / math.pi)))
        less = self.negative(quarters)
        rest = x
        for part in _HALF_TURN_PARTS:
            rest = self._times_plus(less, self.number(part), rest)
        known = self.compare("olt", self._call("fabs", x), self.number(_LARGEST_ANGLE))
        rest = self.select(known, rest, self.number(math.nan))
        square = self.times(rest, rest)
        cube = self.times(rest, square)
        sine = self._times_plus(cube, self._polynomial(_SINE, square), rest)
        half = self._times_plus(square, self.number(-0.5), self.number(1.0))
        fourth = self.times(square, square)
        cosine = self._times_plus(fourth, self._polynomial(_COSINE, square), half)
        quadrant = self._whole(quarters)
        after = self.new(f"add {self.integers} {quadrant}, splat (i64 1)")
        is_odd = self._bit(quadrant, 1)
        first, second = self.select(is_odd, cosine, sine), self.select(is_odd, sine, cosine)
        return (
            self.select(self._bit(quadrant, 2), self.negative(first), first),
            self.select(self._bit(after, 2), self.negative(second), second),
        )

    def arc_cosine(self, x: str) -> str:
        """By the arc sine of x up to 1/2, beyond by that of half the angle."""
        size = self._call("fabs", x)
        is_small = self.compare("olt", size, self.number(0.5))
        half = self._times_plus(size, self.number(-0.5), self.number(0.5))
        square = self.select(is_small, self.times(x, x), half)
        root = self.select(is_small, x, self.root(half))
        sine = self._times_plus(root, self._ratio(_ARC_SINE, square), root)
        twice = self.plus(sine, sine)
        is_negative = self.compare("olt", x, self.number(0.0))
        large = self.select(is_negative, self.minus(self.number(math.pi), twice), twice)
        return self.select(is_small, self.minus(self.number(math.pi / 2), sine), large)

    def arc_tangent(self, y: str, x: str) -> str:
        """Angle of (x, y), as ``atan2``."""
        zero = self.number(0.0)
        across, along = self._call("fabs", y), self._call("fabs", x)
        is_steep = self.compare("ogt", across, along)
        longer, shorter = (
            self.select(is_steep, *pair) for pair in ((across, along), (along, across))
        )
        is_origin = self.compare("oeq", longer, zero)
        slope = self.over(shorter, self.select(is_origin, self.number(1.0), longer))
        is_wide = self.compare("ogt", slope, self.number(0.66))
        one = self.number(1.0)
        turned = self.over(self.minus(slope, one), self.plus(slope, one))
        rest = self.select(is_wide, turned, slope)
        square = self.times(rest, rest)
        angle = self._times_plus(rest, self._ratio(_ARC_TANGENT, square), rest)
        eighth = self.plus(angle, self.number(math.pi / 4))
        angle = self.select(is_wide, eighth, angle)
        angle = self.select(is_steep, self.minus(self.number(math.pi / 2), angle), angle)
        bits = self.new(f"bitcast {self.vector} {x} to {self.integers}")
        is_behind = self.new(f"icmp slt {self.integers} {bits}, zeroinitializer")
        angle = self.select(is_behind, self.minus(self.number(math.pi), angle), angle)
        return self._call("copysign", angle, y)

    def hyperbolic_tangent(self, x: str) -> str:
        """By a ratio of polynomials near zero, beyond by the exponential."""
        size = self._call("fabs", x)
        square = self.times(x, x)
        near = self._times_plus(x, self._ratio(_HYPERBOLIC_TANGENT, square), x)
        # From 20 on, nothing is left of one.
        end = self.number(20.0)
        bounded = self.select(self.compare("olt", size, end), size, end)
        twice = self.plus(bounded, bounded)
        power = self._call("rint", self.times(twice, self.number(1.0 / math.log(2.0))))
        rest = twice
        for part in _LOGARITHM_OF_2:
            rest = self._times_plus(power, self.number(-part), rest)
        odd, even = (self._polynomial(part, self.times(rest, rest)) for part in _EXPONENTIAL)
        odd = self.times(rest, odd)
        part = self.over(odd, self.minus(even, odd))
        growth = self._times_plus(part, self.number(2.0), self.number(1.0))
        exponent = self.new(f"shl {self.integers} {self._whole(power)}, splat (i64 52)")
        bits = self.new(f"bitcast {self.vector} {growth} to {self.integers}")
        scaled = self.new(f"add {self.integers} {bits}, {exponent}")
        growth = self.new(f"bitcast {self.integers} {scaled} to {self.vector}")
        one = self.number(1.0)
        far = self.minus(one, self.over(self.number(2.0), self.plus(growth, one)))
        far = self._call("copysign", far, x)
        is_near = self.compare("olt", size, self.number(0.625))
        value = self.select(is_near, near, far)
        return self.select(self.compare("uno", x, x), x, value)


_OPERATIONS: dict[Operation, Callable[..., str]] = {
    Operation.ADD: _Lines.plus,
    Operation.SUBTRACT: _Lines.minus,
    Operation.MULTIPLY: _Lines.times,
    Operation.NEGATE: _Lines.negative,
    Operation.RECIPROCAL: _Lines.reciprocal,
    Operation.SQUARE_ROOT: _Lines.root,
    Operation.ARC_COSINE: _Lines.arc_cosine,
    Operation.ARC_TANGENT: _Lines.arc_tangent,
    Operation.HYPERBOLIC_TANGENT: _Lines.hyperbolic_tangent,
    Operation.LEAST: _Lines.least,
    Operation.GREATER: _Lines.greater,
}
