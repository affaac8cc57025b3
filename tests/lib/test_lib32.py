# SPDX-License-Identifier: MIT
"""Lib.h over the whole int32 domain, against exact arithmetic, for every LIB_TRIG_FRAC that is special."""
from fractions import Fraction

import oracle
import pytest
from host_build import TRIG_FRACS
from hypothesis import given
from hypothesis import strategies as st
from make_tables import sine_of_turn
from oracle import INT32_MAX, INT32_MIN

# Uniform values are nearly all huge: mix in all magnitudes, and the corners.
I32 = st.one_of(
    st.integers(INT32_MIN, INT32_MAX),
    st.builds(lambda bits, x: x >> bits, st.integers(0, 31), st.integers(INT32_MIN, INT32_MAX)),
    st.sampled_from([INT32_MIN, INT32_MIN + 1, -1, 0, 1, INT32_MAX - 1, INT32_MAX]),
)
CORNERS = (INT32_MIN, INT32_MIN + 1, -32769, -32768, -1, 0, 1, 32767, 32768, INT32_MAX - 1, INT32_MAX)
each_frac = pytest.mark.parametrize("frac", TRIG_FRACS)
TOLERANCE_CLARKE, TOLERANCE_INVCLARKE = Fraction(57, 100), Fraction(56, 100)


def near(actual, exact, tolerance):
    """Within the tolerance, or saturated where the exact value does not fit."""
    return abs(actual - max(Fraction(INT32_MIN), min(Fraction(INT32_MAX), exact))) <= tolerance


@given(ia=I32, ib=I32, ic=I32)
def test_clarke(lib, ia, ib, ic):
    ialpha, ibeta = lib.api("Clarke_Lib_Do", ia, ib, ic)
    assert ialpha == ia
    assert near(ibeta, oracle.over_sqrt3(ia + 2 * ib), TOLERANCE_CLARKE)


@given(valpha=I32, vbeta=I32)
def test_invclarke(lib, valpha, vbeta):
    va, vb, vc = lib.api("InvClarke_Lib_Do", valpha, vbeta)
    exact_b = -Fraction(valpha, 2) + oracle.half_sqrt3(vbeta)
    exact_c = -Fraction(valpha, 2) - oracle.half_sqrt3(vbeta)
    assert va == valpha
    assert near(vb, exact_b, TOLERANCE_INVCLARKE)
    assert near(vc, exact_c, TOLERANCE_INVCLARKE)
    if INT32_MIN < vb < INT32_MAX and INT32_MIN < vc < INT32_MAX:
        assert va + vb + vc == 0


@each_frac
@given(fields=st.tuples(I32, I32, I32, I32))
def test_park_and_inverse_are_correctly_rounded(library_for, frac, fields):
    lib = library_for(frac)
    assert lib.api("Park_Lib_Do", *fields) == oracle.park(*fields, frac)
    assert lib.api("InvPark_Lib_Do", *fields) == oracle.invpark(*fields, frac)


@each_frac
def test_the_sum_that_needs_65_bits(library_for, frac):
    """2^62 + 2^62: the only sum of two products that does not fit."""
    lib = library_for(frac)
    assert lib.api("Park_Lib_Do", *[INT32_MIN] * 4) == (INT32_MAX, 0)
    assert lib.api("InvPark_Lib_Do", *[INT32_MIN] * 4) == (0, INT32_MAX)
    # and the differences next to it, whose high words look alike
    assert lib.api("Park_Lib_Do", INT32_MIN, INT32_MAX, INT32_MIN, INT32_MIN)[1] == INT32_MIN
    assert lib.api("InvPark_Lib_Do", INT32_MAX, INT32_MIN, INT32_MIN, INT32_MIN)[0] == INT32_MIN


@pytest.mark.parametrize("frac", (1, 15, 31))
def test_ties_go_up(library_for, frac):
    lib = library_for(frac)
    half = 1 << (frac - 1)
    for x, rounded in ((-3, -1), (-1, 0), (1, 1), (3, 2)):
        assert lib.api("Park_Lib_Do", x, 0, half, 0) == (rounded, 0)
        assert lib.api("InvPark_Lib_Do", x, 0, half, 0) == (rounded, 0)


def test_tie_of_invclarke_cancels(lib):
    assert lib.api("InvClarke_Lib_Do", 1, 0) == (1, 0, -1)
    assert lib.api("InvClarke_Lib_Do", -1, 0) == (-1, 1, 0)


@pytest.mark.parametrize("name,count", (("Clarke_Lib_Do", 3), ("InvClarke_Lib_Do", 2), ("Park_Lib_Do", 4),
                                        ("InvPark_Lib_Do", 4)))
@given(data=st.data())
def test_input_and_output_may_overlap(lib, name, count, data):
    """At every distance, output before, on or behind the input."""
    fields = data.draw(st.tuples(*[I32] * count))
    alone = lib.api(name, *fields)
    for offset in range(-2, 5):
        assert lib.api(name, *fields, output_offset=offset) == alone


@given(x=I32, y=I32, turn=st.integers(0, 2**32 - 1))
@pytest.mark.parametrize("frac", (15, 30))
def test_round_trip(library_for, frac, x, y, turn):
    """Park and back: the error is that of two roundings and of the length of (cos, sin)."""
    lib = library_for(frac)
    x, y = x >> 2, y >> 2
    angle = Fraction(turn, 2**32)
    cosine, sine = (oracle.round_half_up(sine_of_turn(a) * (1 << frac)) for a in (angle + Fraction(1, 4), angle))
    d, q = lib.api("Park_Lib_Do", x, y, cosine, sine)
    back = lib.api("InvPark_Lib_Do", d, q, cosine, sine)
    gain = Fraction(cosine * cosine + sine * sine, 1 << 2 * frac)
    for was, now in zip((x, y), back):
        assert abs(now - gain * was) <= Fraction(3, 2)  # 1/2 (|cos| + |sin|) + 1/2


@given(ia=I32, ib=I32)
def test_clarke_round_trip(lib, ia, ib):
    ia, ib = ia >> 2, ib >> 2
    ialpha, ibeta = lib.api("Clarke_Lib_Do", ia, ib, 0)
    va, vb, vc = lib.api("InvClarke_Lib_Do", ialpha, ibeta)
    assert va == ia and abs(vb - ib) <= 1 and abs(vc + ia + ib) <= 1


@given(a=st.tuples(I32, I32), b=st.tuples(I32, I32), trig=st.tuples(I32, I32))
def test_linear_within_rounding(lib, a, b, trig):
    """f(a) + f(b) = f(a + b) as far as roundings allow, where nothing saturates."""
    a, b = ([x >> 3 for x in v] for v in (a, b))
    trig = [max(-32768, min(32768, x)) for x in trig]
    both = [x + y for x, y in zip(a, b)]
    for name in ("Park_Lib_Do", "InvPark_Lib_Do"):
        parts = (lib.api(name, *v, *trig) for v in (a, b))
        assert all(abs(p + q - s) <= 1 for p, q, s in zip(*parts, lib.api(name, *both, *trig)))


@given(fields=st.tuples(I32, I32, I32, I32))
def test_quarter_turn_symmetry(lib, fields):
    """Turning the vector and the frame by a quarter changes nothing: (x, y, c, s) -> (-y, x, -s, c)."""
    x, y, c, s = (max(-INT32_MAX, value) for value in fields)
    assert lib.api("Park_Lib_Do", x, y, c, s) == lib.api("Park_Lib_Do", -y, x, -s, c)


@given(low=I32, high=I32, other=I32)
def test_monotone(lib, low, high, other):
    low, high = sorted((low, high))
    assert lib.api("Clarke_Lib_Do", other, low, 0)[1] <= lib.api("Clarke_Lib_Do", other, high, 0)[1]
    assert lib.api("Clarke_Lib_Do", low, other, 0)[1] <= lib.api("Clarke_Lib_Do", high, other, 0)[1]
    falling, rising = (lib.api("InvClarke_Lib_Do", other, beta) for beta in (low, high))
    assert falling[1] <= rising[1] and falling[2] >= rising[2]


def test_clarke_corners(lib):
    for ia in CORNERS:
        for ib in CORNERS:
            exact = oracle.over_sqrt3(ia + 2 * ib)
            assert near(lib.api("Clarke_Lib_Do", ia, ib, 7)[1], exact, TOLERANCE_CLARKE)
    assert lib.api("Clarke_Lib_Do", INT32_MAX, INT32_MAX, 0)[1] == INT32_MAX
    assert lib.api("Clarke_Lib_Do", INT32_MIN, INT32_MIN, 0)[1] == INT32_MIN
    assert lib.api("InvClarke_Lib_Do", INT32_MIN, INT32_MAX) == (INT32_MIN, INT32_MAX, -786033569)
