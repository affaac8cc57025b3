# SPDX-License-Identifier: MIT
"""Exact results in integers and fractions, against which the library is held."""
from fractions import Fraction
from math import floor, isqrt

INT32_MIN, INT32_MAX = -2**31, 2**31 - 1


def saturate(x):
    return max(INT32_MIN, min(INT32_MAX, x))


def round_half_up(x):
    return floor(Fraction(x) + Fraction(1, 2))


def floor_sqrt3_times(n):
    """floor(sqrt(3) n) for any integer n."""
    return isqrt(3 * n * n) if n >= 0 else -isqrt(3 * n * n) - (1 if n else 0)


def over_sqrt3(n, bits=64):
    """n / sqrt(3), rounded down to `bits` fraction bits, as a Fraction."""
    magnitude = isqrt((n * n << 2 * bits) // 3)
    return Fraction(magnitude if n >= 0 else -magnitude - 1, 1 << bits) if n else Fraction(0)


def half_sqrt3(n, bits=64):
    """sqrt(3)/2 n, rounded down to `bits` fraction bits, as a Fraction."""
    return Fraction(floor_sqrt3_times(n << bits), 2 << bits)


def rounded_over_sqrt3(n):
    """n / sqrt(3) rounded to nearest, exactly; no ties but 0."""
    # floor(n/sqrt3 + 1/2) = floor((floor(2n/sqrt3) + 1) / 2)
    twice = isqrt(4 * n * n // 3)
    if n < 0:
        twice = -twice - (0 if 3 * twice * twice == 4 * n * n else 1)
    return (twice + 1) >> 1


def rounded_phase_b(alpha, beta):
    """(-alpha + sqrt(3) beta) / 2 rounded to nearest, a tie up, exactly."""
    return (floor_sqrt3_times(beta) - alpha + 1) >> 1


def park(x, y, cosine, sine, frac):
    """Correctly rounded and saturated."""
    one = 1 << frac
    return (saturate(round_half_up(Fraction(x * cosine + y * sine, one))),
            saturate(round_half_up(Fraction(y * cosine - x * sine, one))))


def invpark(x, y, cosine, sine, frac):
    one = 1 << frac
    return (saturate(round_half_up(Fraction(x * cosine - y * sine, one))),
            saturate(round_half_up(Fraction(y * cosine + x * sine, one))))
