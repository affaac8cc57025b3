# SPDX-License-Identifier: MIT
"""The constant tables of lib/trig.c and lib/limit.c, from their formulas, in integers only.

`python3 make_tables.py trig|limit` prints the table's rows as they stand in the source; test_tables.py compares.
"""
import sys
from fractions import Fraction
from math import isqrt

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


def sine_of_turn(numerator, denominator):
    """sin(2 pi numerator/denominator) as a Fraction, good to 100 bits; exactly odd, and exact at the quadrants."""
    turn = Fraction(numerator, denominator) % 1
    if turn >= Fraction(1, 2):
        return -sine_of_turn(turn.numerator - turn.denominator // 2, turn.denominator) if turn.denominator % 2 == 0 \
            else -sine_of_turn(2 * turn.numerator - turn.denominator, 2 * turn.denominator)
    if turn > Fraction(1, 4):
        turn = Fraction(1, 2) - turn
    if turn == Fraction(1, 4):
        return Fraction(1)
    x = int(2 * PI * turn * (1 << WORK_BITS))
    square = x * x >> WORK_BITS
    term, total, k = x, x, 1
    while term:
        term = -term * square // ((2 * k) * (2 * k + 1)) >> WORK_BITS
        total += term
        k += 1
        if abs(term) <= 1:
            break
    return Fraction(total, 1 << WORK_BITS)


def round_half_up(x):
    return (2 * x + 1).__floor__() // 2 if isinstance(x, Fraction) else x


def trig_table():
    """round(2^24 (1 + (pi/1024)^2/4) sin(2 pi i/1024)), mirrored from the first quadrant so that it is exactly odd."""
    gain = (1 << 24) * (1 + PI * PI / (4 * 1024 * 1024))
    quarter = [round_half_up(gain * sine_of_turn(i, 1024)) for i in range(257)]
    half = quarter + quarter[-2::-1]
    turn = half + [-x for x in half[1:-1]]
    return [turn[i % 1024] for i in range(1281)]


def limit_table():
    """floor(2 * 32768 * (sqrt(i/64) - 1)), i = 64...256, held to 16 bits."""
    return [min(isqrt((65536 * 65536 * i) // 64) - 65536, 65535) for i in range(64, 257)]


def rows(values, width):
    """C initialiser rows that fill 120 columns."""
    per_row = (120 - 4 + 1) // (width + 2)
    for start in range(0, len(values), per_row):
        yield "    " + ", ".join(f"{v:{width}d}" for v in values[start:start + per_row]) + ","


TABLES = {"trig": (trig_table, 9), "limit": (limit_table, 5)}

if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1] not in TABLES:
        sys.exit("mssfoc: usage: make_tables.py trig|limit")
    make, width = TABLES[sys.argv[1]]
    print("\n".join(rows(make(), width)))
