# SPDX-License-Identifier: MIT
"""The hot path's transforms: exactly rounded, equal to Lib.h, and inside 32 bits."""
import numpy as np
import oracle
import pytest
from hypothesis import given
from hypothesis import strategies as st

LIMIT = 32768  # |phase current| of clarke_q15()
FULL = 65534   # |vector| of invclarke_q15()


@pytest.fixture(scope="module")
def all_sums():
    """Every a + 2 b there is, with one a and b each, and 1/sqrt(3) of it correctly rounded."""
    sums = np.arange(-3 * LIMIT, 3 * LIMIT + 1)
    b = np.clip(sums // 2, -LIMIT, LIMIT)
    return sums - 2 * b, b, np.array([oracle.rounded_over_sqrt3(int(s)) for s in sums])


def test_clarke_is_correctly_rounded_everywhere(lib, all_sums):
    a, b, expected = all_sums
    assert np.abs(a).max() <= LIMIT
    alpha, beta = lib.clarke(a, b)
    assert np.array_equal(alpha, a)
    assert np.array_equal(beta, expected)


def test_clarke_equals_lib(lib, all_sums):
    """All sums through Lib.h too: a sample of them one by one, since the API takes one struct at a time."""
    a, b, expected = (values[::7] for values in all_sums)
    near_ties = [35113, -35113, 2521, -2521, 181, -181, 13, -13]  # (2x)^2 - 3 m^2 = 1: x/sqrt(3) next to m/2
    cases = [*zip(a, b, expected), *((x & 1, x >> 1, oracle.rounded_over_sqrt3(x)) for x in near_ties)]
    for ia, ib, ibeta in cases:
        assert lib.api("Clarke_Lib_Do", int(ia), int(ib), 0) == (ia, ibeta)


def test_invclarke_is_correctly_rounded_everywhere(lib):
    """b depends on beta and, through rounding, on alpha's lowest bit: all of both."""
    beta = np.arange(-FULL, FULL + 1)
    for alpha in (0, 1):
        a, b, c = lib.invclarke(alpha, beta)
        assert np.all(a == alpha)
        assert np.array_equal(b, [oracle.rounded_phase_b(alpha, int(x)) for x in beta])
        assert np.all(a + b + c == 0)


@given(alpha=st.integers(-FULL, FULL), beta=st.integers(-FULL, FULL))
def test_invclarke_equals_lib(lib, alpha, beta):
    if alpha * alpha + beta * beta <= FULL * FULL:
        assert tuple(x[0] for x in lib.invclarke(alpha, beta)) == lib.api("InvClarke_Lib_Do", alpha, beta)


def test_nothing_overflows(lib):
    """The bound in the header, over all phase currents and all angles: |vector| |(cos, sin)| + half an LSB < 2^31.

    The Clarke vector's length is largest on the border of the square of currents, where it is convex in each."""
    side = np.arange(-32767, 32768)
    longest = 0
    for edge in (-32767, 32767):
        for a, b in ((side, edge), (edge, side)):
            alpha, beta = lib.clarke(a, b)
            longest = max(longest, int((alpha**2 + beta**2).max()))
    cosine, sine = lib.cossin(np.arange(65536))
    unit = int((cosine**2 + sine**2).max())
    assert longest * unit < (2**31 - 16384) ** 2
    assert longest > 65533**2  # the bound is used, not given away


@given(i=st.tuples(st.integers(-32767, 32767), st.integers(-32767, 32767)), angle=st.integers(0, 65535))
def test_park_equals_lib_and_exact(lib, i, angle):
    alpha, beta = (int(x[0]) for x in lib.clarke(*i))
    cosine, sine = (int(x[0]) for x in lib.cossin(angle))
    d, q = (int(x[0]) for x in lib.park(alpha, beta, cosine, sine))
    assert (d, q) == oracle.park(alpha, beta, cosine, sine, 15) == lib.api("Park_Lib_Do", alpha, beta, cosine, sine)
    back = tuple(int(x[0]) for x in lib.invpark(d, q, cosine, sine))
    assert back == oracle.invpark(d, q, cosine, sine, 15) == lib.api("InvPark_Lib_Do", d, q, cosine, sine)
    # two roundings, and (cos, sin) up to 1 LSB too long or short, twice
    assert max(abs(back[0] - alpha), abs(back[1] - beta)) <= 1.5 + 2 * 65534 / 32768


def test_rotation_by_quarters_is_exact(lib):
    x, y = np.array([1234, -65533, 0, 7]), np.array([-4321, 0, 65533, 9])
    for angle, turned in ((0, (x, y)), (16384, (y, -x)), (32768, (-x, -y)), (49152, (-y, x))):
        cosine, sine = lib.cossin(angle)
        assert all(np.array_equal(got, want) for got, want in zip(lib.park(x, y, cosine, sine), turned))


def test_a_turning_vector_stands_still_in_its_frame(lib):
    """Three balanced currents over a whole turn: d is the amplitude, q is zero, within the roundings."""
    angle = np.arange(0, 65536, 5)
    amplitude = 30000
    theta = angle * (2 * np.pi / 65536)
    a, b = (np.rint(amplitude * np.cos(theta - shift)).astype(int) for shift in (0, 2 * np.pi / 3))
    d, q = lib.park(*lib.clarke(a, b), *lib.cossin(angle))
    assert np.abs(d - amplitude).max() <= 3 and np.abs(q).max() <= 3


def test_elementary_saturations(lib):
    x = np.concatenate([np.arange(-70000, 70000, 3), [-2**31, 2**31 - 1, 2**30, 2**30 - 1, -1, 0, 32767, 32768, -32768,
                                                      -32769], np.arange(-2**31, 2**31, 99999989)])
    sat16, unsigned = lib.elementary(x)
    assert np.array_equal(sat16, np.clip(x, -32768, 32767))
    assert np.array_equal(unsigned, np.clip(x >> 15, 0, 32767))
