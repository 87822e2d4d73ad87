"""Programs in the language of LLVM: loops over poses, several poses an operation.

Sines, cosines, arc functions and the hyperbolic tangent are written out, too, so that no function
is called for single numbers. They are right to two units in the last place on any processor.
"""

from __future__ import annotations

import math
import struct
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from robostiff.record import Operation, Program

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
_WIDTH_OF_ESTIMATES = 8  # AVX-512 estimates reciprocals of roots of doubles
# Vectors of poses on which all parts work in turn, and bytes of what parts hand on at most: as many
# as a small first-level cache has.
_MOST_VECTORS, _ROOM = 4, 2**15
#: Operations beyond which machine code is made quickly. Its parts are functions then, so many each:
#: what is not kept in registers has a place of its own on the stack.
LONG, _PARTS_A_FUNCTION = 6000, 10


def text_of(program: Program, width: int, length: int | None) -> str:
    """A program as a loop over poses; or in parts of so many steps, each over a few vectors.

    In a loop that is short against what a processor looks ahead, it does not wait for the roots and
    quotients of one vector. What the parts hand on to one another stays in the cache.
    """
    parts = _parts(program, length or len(program.steps.a))
    last = {j: k for k, part in enumerate(parts) for i in part for j in _sources(program, i)}
    places, free, rooms, ends = dict[int, int](), list[int](), 0, [list[int]() for _ in parts]
    for k, part in enumerate(parts):
        free += ends[k - 1]
        for i in part:
            if last.get(i, k) > k:
                rooms += not free
                places[i] = free.pop() if free else rooms - 1
                ends[last[i]].append(places[i])
    poses = width * min(_MOST_VECTORS, max(1, _ROOM // (8 * width * max(rooms, 1))))
    places = {i: place * poses for i, place in places.items()}
    loops, others = [""] * len(parts), len(parts) - 1
    together = _PARTS_A_FUNCTION if program.operations > LONG else len(parts)
    for k, part in enumerate(parts):
        lines = _Lines(width, k)
        # Stores, which are the last, would wait for memory that is not in the cache by then.
        is_first = part and (k < others or not others)
        soon = range(k, len(program.outputs), others or 1) if is_first else range(0)
        body = "\n  ".join(_lines(program, part, soon, places, lines))
        before = f"part{k - 1}" if k % together else "poses"
        # Frozen, so that LLVM does not try to count up one address by the other, which takes as
        # long as all that it does beside.
        after = f"part{k + 1}" if (k + 1) % together and k < others else "done"
        loops[k] = f"""part{k}:
  %turn{k} = phi i64 [%first, %{before}], [%next{k}, %part{k}]
  %same{k} = add i64 %turn{k}, 0
  %pose{k} = freeze i64 %same{k}
  %here{k} = getelementptr double, ptr %room_of_first, i64 %pose{k}
  {body}
  %next{k} = add i64 %turn{k}, {width}
  %more{k} = icmp slt i64 %next{k}, %last
  br i1 %more{k}, label %part{k}, label %{after}
"""
    addresses = "\n  ".join(
        f"%{kind}_place{k} = getelementptr ptr, ptr %{kind}s, i64 {k}\n"
        f"  %{kind}{k} = load ptr, ptr %{kind}_place{k}"
        for kind, names in (("input", program.inputs), ("output", program.outputs))
        for k in range(len(names))
    )
    vector, bits = f"<{width} x double>", 64 * width
    functions = (("fma", 3), ("rint", 1), ("sqrt", 1), ("fabs", 1), ("copysign", 2))
    declared = "\n".join(
        f"declare {vector} @llvm.{name}.v{width}f64({', '.join([vector] * count)})"
        for name, count in functions
    )
    if width == _WIDTH_OF_ESTIMATES:
        declared += f"\ndeclare {vector} @llvm.x86.avx512.rsqrt14.pd.512({vector}, {vector}, i8)"
    turn = f"  br label %part0\n{''.join(loops)}"
    if together < len(parts):
        given, turn = "ptr %inputs, ptr %outputs, ptr %room_of_first, i64 %first, i64 %last", ""
        for k in range(0, len(parts), together):
            turn += f"  call void @parts{k}({given})\n"
            declared += f"""
define internal void @parts{k}({given.replace("ptr", "ptr noalias")}) #0 {{
  {addresses}
  br label %poses
poses:
  br label %part{k}
{"".join(loops[k : k + together])}done:
  ret void
}}"""
        addresses, turn = "", f"{turn}  br label %done\n"
    return f"""{declared}
declare void @llvm.prefetch.p0(ptr, i32, i32, i32)
define void @program(ptr noalias %inputs, ptr noalias %outputs, i64 %start, i64 %stop) #0 {{
entry:
  {addresses}
  %room = alloca double, i64 {max(rooms, 1) * poses}, align {8 * width}
  br label %poses
poses:
  %first = phi i64 [%start, %entry], [%next, %done]
  %next = add i64 %first, {poses}
  %are_few = icmp slt i64 %stop, %next
  %last = select i1 %are_few, i64 %stop, i64 %next
  %back = sub i64 0, %first
  %room_of_first = getelementptr double, ptr %room, i64 %back
{turn}done:
  %more = icmp slt i64 %next, %stop
  br i1 %more, label %poses, label %end
end:
  ret void
}}
attributes #0 = {{ nounwind "prefer-vector-width"="{bits}" "min-legal-vector-width"="{bits}" }}
"""


def _parts(program: Program, length: int) -> list[list[int]]:
    """Steps of each part, of about that length, cut where few values are handed on.

    A root and its reciprocal stand together, and so do sine and cosine of an angle, as they have
    operations in common.
    """
    steps = program.steps
    order = [i for i, a in enumerate(steps.a) if a >= 0]
    partner, angles = dict[int, int](), dict[int, int]()
    roots = {i for i in order if steps.operations[i] is Operation.SQUARE_ROOT}
    for i in order:
        operation, a = steps.operations[i], steps.a[i]
        if operation in (Operation.SINE, Operation.COSINE) and angles.setdefault(a, i) != i:
            partner[angles[a]] = i
        if operation is Operation.RECIPROCAL and a in roots:
            partner[a] = i
    second = set(partner.values())
    order = [j for i in order if i not in second for j in (i, partner.get(i, -1)) if j >= 0]
    last = {j: at for at, i in enumerate(order) for j in _sources(program, i)}
    crossing = np.zeros(len(order) + 1, dtype=int)  # values, from before a place to those behind it
    for at, i in enumerate(order):
        crossing[at + 1 : last.get(i, 0) + 1] += 1
    count, reach = max(1, round(len(order) / length)), length // 4
    starts = [k * len(order) // count - reach for k in range(1, count)]
    cuts = [start + int(np.argmin(crossing[start : start + 2 * reach])) for start in starts]
    return [order[a:b] for a, b in pairwise([0, *cuts, len(order)])]


def _sources(program: Program, i: int) -> list[int]:
    """Other steps that step `i` reads, inputs and numbers aside."""
    places = program.steps.a
    a, b = places[i], program.steps.b[i]
    return [j for j in ((a,) if a == b else (a, b)) if j >= 0 and places[j] >= 0]


def _lines(
    program: Program, part: list[int], soon: range, places: dict[int, int], lines: _Lines
) -> list[str]:
    """A part, which finds at their places in the room what others hand on.

    In its first two thirds it begins to bring rows into the cache that are written soon.
    """
    steps, known = program.steps, dict[int, str]()
    results, fetched = defaultdict[int, list[int]](list), defaultdict[int, list[int]](list)
    for row, i in enumerate(program.outputs):
        results[i].append(row)
    for k, row in enumerate(soon):
        fetched[part[2 * k * len(part) // (3 * len(soon))]].append(row)

    def value(j: int) -> str:
        if j in known:
            return known[j]
        if j in steps.numbers:
            known[j] = lines.number(steps.numbers[j])
        elif j < len(program.inputs):
            known[j] = lines.load(lines.row("input", j), 8)
        else:
            known[j] = lines.load(lines.place(places[j]), 8 * lines.width)
        return known[j]

    for i in part:
        for row in fetched[i]:
            lines.fetch(row)
        arguments = [value(j) for j in (steps.a[i], steps.b[i]) if j >= 0]
        known[i] = lines.result(steps.operations[i], arguments)
        if i in places:
            lines.store(known[i], lines.place(places[i]), 8 * lines.width)
        for row in results[i]:
            lines.store(known[i], lines.row("output", row), 8)
    if lines.part == 0:
        for i, rows in results.items():
            for row in rows if steps.a[i] < 0 else ():
                lines.store(value(i), lines.row("output", row), 8)
    return lines.lines


@dataclass
class _Lines:
    """Lines of one part of a program; a method adds what computes a value, and returns its name."""

    width: int
    part: int
    lines: list[str] = field(default_factory=list)
    # Bits of values that are 1 or 0, reciprocals of roots, sine and cosine of angles
    masks: dict[str, str] = field(default_factory=dict)
    inverses: dict[str, str] = field(default_factory=dict)
    turns: dict[str, tuple[str, str]] = field(default_factory=dict)

    @property
    def vector(self) -> str:
        return f"<{self.width} x double>"

    @property
    def integers(self) -> str:
        return f"<{self.width} x i64>"

    def new(self, text: str) -> str:
        name = f"%v{self.part}_{len(self.lines)}"
        self.lines.append(f"{name} = {text}")
        return name

    def row(self, kind: str, k: int) -> str:
        """Address of the present poses in row `k` of the inputs or outputs."""
        return self.new(f"getelementptr double, ptr %{kind}{k}, i64 %pose{self.part}")

    def place(self, k: int) -> str:
        """Address of the present poses at a place of the room."""
        return self.new(f"getelementptr double, ptr %here{self.part}, i64 {k}")

    def load(self, address: str, aligned: int) -> str:
        return self.new(f"load {self.vector}, ptr {address}, align {aligned}")

    def store(self, value: str, address: str, aligned: int) -> None:
        self.lines.append(f"store {self.vector} {value}, ptr {address}, align {aligned}")

    def fetch(self, k: int) -> None:
        """Begin to bring a row of the outputs into the cache."""
        address = self.row("output", k)
        self.lines.append(f"call void @llvm.prefetch.p0(ptr {address}, i32 1, i32 3, i32 1)")

    def result(self, operation: Operation, arguments: list[str]) -> str:
        """What an operation gives."""
        if operation not in (Operation.SINE, Operation.COSINE):
            return _OPERATIONS[operation](self, *arguments)
        (angle,) = arguments
        if angle not in self.turns:
            self.turns[angle] = self.sine_and_cosine(angle)
        return self.turns[angle][operation is Operation.COSINE]

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
        """That of a root is known; the processor divides beside its other operations."""
        return self.inverses.get(x) or self.over(self.number(1.0), x)

    def negative(self, a: str) -> str:
        return self.new(f"fneg {self.vector} {a}")

    def root(self, x: str) -> str:
        """Root and reciprocal by a series from an estimate, where the processor has one.

        With the estimate y of 14 bits and ``e = 1 - x y^2``, which is below 2^-12, they are ``x y``
        and y times ``1 + e/2 + 3/8 e^2 + 5/16 e^3``: what follows is below rounding.
        """
        if self.width != _WIDTH_OF_ESTIMATES:
            return self._call("sqrt", x)
        rest = f"{self.vector} zeroinitializer, i8 -1"
        function = f"@llvm.x86.avx512.rsqrt14.pd.512({self.vector} {x}, {rest})"
        inverse = self.new(f"call {self.vector} {function}")
        root = self.times(x, inverse)
        rest = self._times_plus(self.negative(root), inverse, self.number(1.0))
        series = self._polynomial((5 / 16, 3 / 8, 1 / 2), rest)
        is_other = self.compare("une", x, self.number(0.0))
        root, inverse = (
            self.select(is_other, self._times_plus(self.times(near, rest), series, near), at_zero)
            for near, at_zero in ((root, x), (inverse, inverse))
        )
        self.inverses[root] = inverse
        return root

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
        sine = self._times_plus(self.times(rest, square), self._polynomial(_SINE, square), rest)
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
        across, along = self._call("fabs", y), self._call("fabs", x)
        is_steep = self.compare("ogt", across, along)
        longer, shorter = (
            self.select(is_steep, *pair) for pair in ((across, along), (along, across))
        )
        is_origin = self.compare("oeq", longer, self.number(0.0))
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
