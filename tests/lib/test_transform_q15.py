# SPDX-License-Identifier: MIT
"""The hot path's transforms: within their bounds, Park exactly rounded and equal to Lib.h, and inside 32 bits."""
from fractions import Fraction

import numpy as np
import oracle
from hypothesis import given
from hypothesis import strategies as st

LIMIT = 32768  # |phase current| of clarke_q15()
FULL = 65534   # |vector| of invclarke_q15()


def assert_within(errors, bound):
    """The bound holds and is the bound, not more than is needed."""
    assert bound - 0.001 <= np.abs(errors).max() <= bound


def test_clarke_everywhere(lib):
    """Every a + 2 b there is, with one a and b each. The worst sum again in exact arithmetic."""
    sums = np.arange(-3 * LIMIT, 3 * LIMIT + 1)
    b = np.clip(sums // 2, -LIMIT, LIMIT)
    a = sums - 2 * b
    assert np.abs(a).max() <= LIMIT
    alpha, beta = lib.clarke(a, b)
    errors = beta - sums / np.sqrt(3)
    assert np.array_equal(alpha, a)
    assert_within(errors, 0.534)
    worst = int(np.abs(errors).argmax())
    assert abs(int(beta[worst]) - oracle.over_sqrt3(int(sums[worst]))) <= Fraction(534, 1000)


def test_invclarke_everywhere(lib):
    """b and c depend on beta and, through rounding, on alpha's lowest bit: all of both."""
    beta = np.arange(-FULL, FULL + 1)
    for alpha in (0, 1):
        a, b, c = lib.invclarke(alpha, beta)
        assert np.all(a == alpha)
        assert_within(b - (-alpha + np.sqrt(3) * beta) / 2, 0.534)
        assert_within(c - (-alpha - np.sqrt(3) * beta) / 2, 0.534)
        assert np.all(a + b + c == 0)


def test_nothing_overflows(lib):
    """The bound in the header, over all phase currents and all angles: |vector| |(cos, sin)| + half an LSB < 2^31.

    The Clarke vector's length is largest on the border of the square of currents, where it is convex in each."""
    side = np.arange(-32767, 32768)
    longest = 0
    for edge in (-32767, 32767):
        for a, b in ((side, edge), (edge, side)):
            alpha, beta = lib.clarke(a, b)
            longest = max(longest, int((alpha**2 + beta**2).max()))
    cosine, sine = lib.cossin(np.arange(1 << 22) << 10)
    unit = int((cosine**2 + sine**2).max())
    assert longest * unit < (2**31 - 16384) ** 2
    assert longest > 65533**2  # the bound is used, not given away


@given(i=st.tuples(st.integers(-32767, 32767), st.integers(-32767, 32767)), angle=st.integers(0, 2**32 - 1))
def test_park_equals_lib_and_exact(lib, i, angle):
    alpha, beta = (int(x[0]) for x in lib.clarke(*i))
    cosine, sine = (int(x[0]) for x in lib.cossin(angle))
    d, q = (int(x[0]) for x in lib.park(alpha, beta, cosine, sine))
    assert (d, q) == oracle.park(alpha, beta, cosine, sine, 15) == lib.api("Park_Lib_Do", alpha, beta, cosine, sine)
    back = tuple(int(x[0]) for x in lib.invpark(d, q, cosine, sine))
    assert back == oracle.invpark(d, q, cosine, sine, 15) == lib.api("InvPark_Lib_Do", d, q, cosine, sine)
    # two roundings, and (cos, sin) up to 1 LSB too long or short, twice
    assert max(abs(back[0] - alpha), abs(back[1] - beta)) <= 1.5 + 2 * 65534 / 32768


def test_saturation_to_16_bits(lib):
    x = np.concatenate([np.arange(-70000, 70000, 3), [-2**31, 2**31 - 1, 2**30, 2**30 - 1, -1, 0, 32767, 32768, -32768,
                                                      -32769], np.arange(-2**31, 2**31, 99999989)])
    assert np.array_equal(lib.sat16(x), np.clip(x, -32768, 32767))
