# SPDX-License-Identifier: MIT
"""The constant tables of lib/trig.c and lib/polar.c, from their formulas, in integers only.

`make_tables.py ARRAY` prints the values that stand in the source; test_tables.py compares.
"""
import sys
from fractions import Fraction
from itertools import product
from math import ceil, floor, isqrt

import numpy as np

WORK_BITS = 128


def _pi_scaled():
    """pi * 2^WORK_BITS by Machin's formula, 16 guard bits."""
    one = 1 << (WORK_BITS + 16)

    def arctan_inverse(n):
        term, total, k = one // n, 0, 0
        while term:
            total += (-1) ** k * (term // (2 * k + 1))
            term //= n * n
            k += 1
        return total

    return 4 * (4 * arctan_inverse(5) - arctan_inverse(239)) >> 16


PI = Fraction(_pi_scaled(), 1 << WORK_BITS)


def sine_of_turn(turn):
    """sin(2 pi turn) of a Fraction, good to 100 bits; exactly odd, and exact at the quadrants."""
    turn %= 1
    if turn >= Fraction(1, 2):
        return -sine_of_turn(turn - Fraction(1, 2))
    turn = min(turn, Fraction(1, 2) - turn)
    if turn == Fraction(1, 4):
        return Fraction(1)
    x = int(2 * PI * turn * (1 << WORK_BITS))
    square = x * x >> WORK_BITS
    term = total = x
    k = 2
    while abs(term) > 1:
        term = -(term * square >> WORK_BITS) // (k * (k + 1))
        total += term
        k += 2
    return Fraction(total, 1 << WORK_BITS)


def round_half_up(x):
    return floor(x + Fraction(1, 2))


# Chords of the sine, in eighths of a Q15 LSB, and error in units of 2^-32 LSB
FINE = 1 << 32
STEPS = np.arange(65)


def _chords(index, exact):
    """{(first, last rounded value): (largest error, value at the start, slope)}: the best of each kind.

    exact   32768 sin at the 65 angles of 16 bits on this chord
    No angle may come out as a tie, and the vector (cos, sin) may nowhere be longer than 32768.75: rounding lengthens it by
    up to (cos + sin) / 2, so a chord may stand out by 0.75 / (cos + sin) - 0.5.
    """
    diagonal = max(sine_of_turn(Fraction(i, 1024)) + sine_of_turn(Fraction(i + 256, 1024)) for i in (index, index + 1))
    outside_max = floor((Fraction(3, 4) / diagonal - Fraction(1, 2)) * FINE)
    start_near, slope_near = int(exact[0] * 8 // FINE), int((exact[64] - exact[0]) * 8 // FINE)
    best = {}
    for start, slope in product(range(start_near - 3, start_near + 4), range(slope_near - 3, slope_near + 5)):
        if index == 0 and start != 0 or index == 255 and start + slope != 8 * 32768:
            continue
        sums = 64 * start + STEPS * slope
        rounded = (sums + 256) // 512
        if np.any(sums % 512 == 256) or (sums * (FINE // 512) - exact).max() > outside_max:
            continue
        kind = (int(rounded[0]), int(rounded[64]))
        found = (int(np.abs(rounded * FINE - exact).max()), int(np.abs(sums * (FINE // 512) - exact).max()), start, slope)
        best[kind] = min(found, best.get(kind, found))
    return {kind: (error, start, slope) for kind, (error, _, start, slope) in best.items()}


def _quarter_of_chords():
    """[(start, slope)] of the 256 chords of the first quadrant: neighbours round to the same value where they meet, and
    the largest error is as small as that allows."""
    exact = np.array([round_half_up(32768 * FINE * sine_of_turn(Fraction(i, 65536))) for i in range(16385)])
    best = {0: (0, ())}  # by the rounded value at which the chords so far end
    for index in range(256):
        longer = {}
        for (first, last), (error, start, slope) in sorted(_chords(index, exact[64 * index:64 * index + 65]).items()):
            if first in best:
                found = (max(best[first][0], error), (best[first][1], start, slope))
                if last not in longer or found[0] < longer[last][0]:
                    longer[last] = found
        best = longer
    chords, way = [], best[32768][1]
    while way:
        way, start, slope = way
        chords.insert(0, (start, slope))
    return chords


def trig_table():
    """Packed chords of a turn and a quarter: value, with half an LSB for rounding, times 4096, plus slope."""
    quarter = _quarter_of_chords()
    half = quarter + [(start + slope, -slope) for start, slope in reversed(quarter)]
    turn = half + [(-start, -slope) for start, slope in half]
    return [(start + 4) * 4096 + slope for start, slope in turn + turn[:256]]


def packed(starts, bias=0):
    """Words of chords between neighbouring values: the first with its bias, times 4096, plus the size of the step."""
    return [(start + bias) * 4096 + abs(end - start) for start, end in zip(starts, starts[1:])]


def reciprocal_table():
    """2^19 / m, m = 1...2 in 128 chords, and half of 8 for rounding."""
    return packed([round_half_up(Fraction(1 << 26, i)) for i in range(128, 257)], 4)


def arctangent_of(x):
    """atan(x) / 2 pi of a Fraction 0...2, good to 90 bits: the half-angle formula twice, then the series."""
    halvings = 4
    for _ in range(halvings):
        root = Fraction(isqrt(floor((1 + x * x) * (1 << 240))), 1 << 120)
        x = Fraction(floor(x / (1 + root) * (1 << 120)), 1 << 120)
    square, term, total = x * x, x, Fraction(0)
    for k in range(30):
        total += term / (2 * k + 1)
        term = -Fraction(floor(term * square * (1 << 120)), 1 << 120)
    return total * (1 << halvings) / (2 * PI)


def arctangent_table():
    """16 * 65536 atan(i/128) / 2 pi, a quarter of a unit high: the chords lie below the curve by up to 0.8."""
    return packed([0] + [round_half_up((1 << 20) * arctangent_of(Fraction(i, 128)) + Fraction(1, 4)) for i in range(1, 130)])


def root_table():
    """
    2 * 2^15 sqrt(i/64), i = 64...256, less 65537 and held to 16 bits; raised by as much as the chord before lies below the
    curve at most, 2 * 2^12 / (32 i^1.5), and then rounded up.
    """
    def root(i):
        return Fraction(isqrt(i << 80), 1 << 40)

    before = [64, *range(64, 256)]
    raised = [8192 * root(i) + 256 / (at * root(at)) for i, at in zip(range(64, 257), before)]
    return [min(ceil(twice) - 65537, 65535) for twice in raised]


# name of the array: (file in lib/, values)
TABLES = {
    "trig_chords": ("trig.c", trig_table),
    "polar_reciprocals": ("polar.c", reciprocal_table),
    "polar_arctangents": ("polar.c", arctangent_table),
    "polar_roots": ("polar.c", root_table),
}

if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1] not in TABLES:
        sys.exit("mssfoc: usage: make_tables.py " + "|".join(TABLES))
    print(", ".join(str(value) for value in TABLES[sys.argv[1]][1]()))
