"""Loops over arrays that NumPy is slow at: random numbers by their places, counts by digits.

Both are machine code where its compiler is installed, else NumPy; no bit depends on which.
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

import numpy as np

from robostiff.compiled.codes import functions_of, room_for, this_processor

# Steps and factors of SplitMix64.
_STEP, _FACTORS = 0x9E3779B97F4A7C15, (0xBF58476D1CE4E5B9, 0x94D049BB133111EB)
_SHIFTS = (30, 27, 31)
_UNIT = 2.0**-53  # as LLVM writes it: 0x3CA0000000000000
#: Numbers of 32 bits are counted by their first 16 bits (a page), and there by six more.
PAGES, PLACES = 2**16, 2**6


def uniform_rows(
    keys: np.ndarray, first: int, count: int, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Uniformly distributed numbers, of which each depends on its key and its place alone.

    Parameters
    ----------
    keys : (n,) array of uint64
        One a row.
    first, count : int
        Which places of the rows.
    low, high : (n,) arrays
        Limits.

    Returns
    -------
    (n, count) array

    References
    ----------
    G. L. Steele, D. Lea, C. H. Flood: Fast splittable pseudorandom number generators. OOPSLA 2014.
    """
    out, functions = room_for(len(keys), count), _machine_code()
    starts = (keys + np.uint64((first + 1) * _STEP % 2**64)).tolist()
    if functions is not None:
        for row, start, a, b in zip(out, starts, low.tolist(), high.tolist(), strict=True):
            functions["fill"](row.ctypes.data, count, start, a, b - a)
        return out
    steps = np.arange(count, dtype=np.uint64) * np.uint64(_STEP)
    other = np.empty_like(steps)
    for row, start, a, b in zip(out, starts, low.tolist(), high.tolist(), strict=True):
        z = steps + np.uint64(start)
        for shift, factor in zip(_SHIFTS, (*_FACTORS, 1), strict=True):
            z ^= np.right_shift(z, np.uint64(shift), out=other)
            z *= np.uint64(factor)
        np.multiply(z >> np.uint64(11), _UNIT, out=row)
        row[...] = row * (b - a) + a
    return out


def count_by_digits(values: np.ndarray, pages: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Count numbers by their sign, exponent and first thirteen binary digits.

    Parameters
    ----------
    values : (N,) array of float32, side by side in memory
    pages : (PAGES,) array of uint32
        Row of `counts` for the first 16 bits of a number.
    counts : (rows, PLACES) array of int64
        Counts are added to it.

    Returns
    -------
    (M,) array
        Places of the numbers whose row is 0.
    """
    if (functions := _machine_code()) is not None:
        places = np.empty(len(values) + 1, dtype=np.int64)  # at last, how many there are
        arrays = (array.ctypes.data for array in (pages, counts, places))
        functions["count"](values.ctypes.data, len(values), *arrays)
        return places[: places[-1]]
    bits = values.view(np.uint32)
    rows = pages[bits >> 16]
    np.add.at(counts, (rows, bits >> 10 & (PLACES - 1)), 1)
    return np.flatnonzero(rows == 0)


@cache
def _machine_code() -> dict[str, Any] | None:
    processor = this_processor()
    if processor is None:
        return None
    pointer, count, number = ctypes.c_void_p, ctypes.c_int64, ctypes.c_double
    kinds = {
        "fill": (pointer, count, ctypes.c_uint64, number, number),
        "count": (pointer, count, pointer, pointer, pointer),
    }
    return functions_of(_text(processor.width), processor, kinds)


def _text(width: int) -> str:
    """Both in the language of LLVM; random numbers fill rows up to a whole number of vectors."""
    whole, real = f"<{width} x i64>", f"<{width} x double>"
    ahead = ", ".join(f"i64 {k * _STEP % 2**64}" for k in range(width))
    lines, z = [], "%state"
    for k, (shift, factor) in enumerate(zip(_SHIFTS, (*_FACTORS, 1), strict=True)):
        lines += [
            f"%shifted{k} = lshr {whole} {z}, splat (i64 {shift})",
            f"%mixed{k} = xor {whole} {z}, %shifted{k}",
            f"%z{k} = mul {whole} %mixed{k}, splat (i64 {factor})",
        ]
        z = f"%z{k}"
    mixing = "\n  ".join(lines)
    return f"""
define void @fill(ptr %out, i64 %count, i64 %start, double %low, double %range) {{
entry:
  %one = insertelement {whole} poison, i64 %start, i64 0
  %all = shufflevector {whole} %one, {whole} poison, <{width} x i32> zeroinitializer
  %first = add {whole} %all, <{ahead}>
  %one_low = insertelement {real} poison, double %low, i64 0
  %lows = shufflevector {real} %one_low, {real} poison, <{width} x i32> zeroinitializer
  %one_range = insertelement {real} poison, double %range, i64 0
  %ranges = shufflevector {real} %one_range, {real} poison, <{width} x i32> zeroinitializer
  br label %places
places:
  %place = phi i64 [0, %entry], [%next, %places]
  %state = phi {whole} [%first, %entry], [%following, %places]
  {mixing}
  %digits = lshr {whole} {z}, splat (i64 11)
  %float = uitofp {whole} %digits to {real}
  %unit = fmul {real} %float, splat (double 0x3CA0000000000000)
  %part = fmul {real} %unit, %ranges
  %value = fadd {real} %part, %lows
  %to = getelementptr double, ptr %out, i64 %place
  store {real} %value, ptr %to, align 8
  %following = add {whole} %state, splat (i64 {width * _STEP % 2**64})
  %next = add i64 %place, {width}
  %more = icmp slt i64 %next, %count
  br i1 %more, label %places, label %done
done:
  ret void
}}
define void @count(ptr %values, i64 %count, ptr %pages, ptr %counts, ptr %places) {{
entry:
  br label %numbers
numbers:
  %k = phi i64 [0, %entry], [%next, %numbers]
  %left = phi i64 [0, %entry], [%left_next, %numbers]
  %from = getelementptr i32, ptr %values, i64 %k
  %bits = load i32, ptr %from, align 4
  %above = lshr i32 %bits, 16
  %page_number = zext i32 %above to i64
  %page_place = getelementptr i32, ptr %pages, i64 %page_number
  %page = load i32, ptr %page_place, align 4
  %row = shl i32 %page, 6
  %below = lshr i32 %bits, 10
  %digits = and i32 %below, {PLACES - 1}
  %where = or i32 %row, %digits
  %place = zext i32 %where to i64
  %own = getelementptr i64, ptr %counts, i64 %place
  %before = load i64, ptr %own, align 8
  %after = add i64 %before, 1
  store i64 %after, ptr %own, align 8
  %left_place = getelementptr i64, ptr %places, i64 %left
  store i64 %k, ptr %left_place, align 8
  %is_left = icmp eq i32 %page, 0
  %one_left = zext i1 %is_left to i64
  %left_next = add i64 %left, %one_left
  %next = add i64 %k, 1
  %more = icmp slt i64 %next, %count
  br i1 %more, label %numbers, label %done
done:
  %last = getelementptr i64, ptr %places, i64 %count
  store i64 %left_next, ptr %last, align 8
  ret void
}}
"""
