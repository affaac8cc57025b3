# SPDX-License-Identifier: MIT
"""The constant tables of lib/trig.c and lib/limit.c, from their formulas, in integers only.

`make_tables.py trig|limit` prints the values that stand in the source; test_tables.py compares.
"""
import sys
from fractions import Fraction
from math import floor, isqrt

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


def trig_table():
    """round((2^24 + 36) sin(2 pi i/1024)), mirrored from the first quadrant so that it is exactly odd."""
    quarter = [round_half_up(((1 << 24) + 36) * sine_of_turn(Fraction(i, 1024))) for i in range(257)]
    half = quarter + quarter[-2::-1]
    turn = half + [-x for x in half[1:-1]]
    return [turn[i % 1024] for i in range(1281)]


def limit_table():
    """floor(2 * 32768 * (sqrt(i/64) - 1)), i = 64...256, held to 16 bits."""
    return [min(isqrt((65536 * 65536 * i) // 64) - 65536, 65535) for i in range(64, 257)]


TABLES = {"trig": trig_table, "limit": limit_table}

if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1] not in TABLES:
        sys.exit("mssfoc: usage: make_tables.py trig|limit")
    print(", ".join(str(value) for value in TABLES[sys.argv[1]]()))
