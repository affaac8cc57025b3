# SPDX-License-Identifier: MIT
"""Lib.h over the whole int32 domain, against exact arithmetic, for every LIB_TRIG_FRAC that is special."""
from fractions import Fraction

import oracle
import pytest
from host_build import TRIG_FRACS
from hypothesis import given
from hypothesis import strategies as st
from oracle import INT32_MAX, INT32_MIN

# Uniform values are nearly all huge: mix in all magnitudes, and the corners.
I32 = st.one_of(
    st.integers(INT32_MIN, INT32_MAX),
    st.builds(lambda bits, x: x >> bits, st.integers(0, 31), st.integers(INT32_MIN, INT32_MAX)),
    st.sampled_from([INT32_MIN, INT32_MIN + 1, -1, 0, 1, INT32_MAX - 1, INT32_MAX]),
)
CORNERS = (INT32_MIN, INT32_MIN + 1, -32769, -32768, -1, 0, 1, 32767, 32768, INT32_MAX - 1, INT32_MAX)
each_frac = pytest.mark.parametrize("frac", TRIG_FRACS)
TOLERANCE_CLARKE, TOLERANCE_INVCLARKE = Fraction(583, 1000), Fraction(621, 1000)  # as in Lib.h


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


def test_clarke_of_17_bits_is_correctly_rounded_for_even_ia(lib):
    """Every sum there is of an even ia and ib."""
    for half in range(-3 << 15, (3 << 15) + 1):
        ib = max(-65536, min(65536, half))
        exact = oracle.rounded_over_sqrt3(2 * half)
        assert lib.api("Clarke_Lib_Do", 2 * (half - ib), ib, 0)[1] == exact


def test_invclarke_of_17_bits_is_correctly_rounded(lib):
    """b depends on vbeta and, but for whole steps, on the lowest bit of valpha: all of both."""
    for vbeta in range(-65536, 65537):
        for valpha in (0, 1):
            _, vb, vc = lib.api("InvClarke_Lib_Do", valpha, vbeta)
            assert vb == oracle.rounded_phase_b(valpha, vbeta) and vc == -valpha - vb


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


@pytest.mark.parametrize("name,count", (("Clarke_Lib_Do", 3), ("InvClarke_Lib_Do", 2), ("Park_Lib_Do", 4),
                                        ("InvPark_Lib_Do", 4)))
@given(data=st.data())
def test_input_and_output_may_overlap(lib, name, count, data):
    """At every distance, output before, on or behind the input."""
    fields = data.draw(st.tuples(*[I32] * count))
    alone = lib.api(name, *fields)
    for offset in range(-2, 5):
        assert lib.api(name, *fields, output_offset=offset) == alone


@given(low=I32, high=I32, other=I32)
def test_monotone(lib, low, high, other):
    low, high = sorted((low, high))
    assert lib.api("Clarke_Lib_Do", other, low, 0)[1] <= lib.api("Clarke_Lib_Do", other, high, 0)[1]
    assert lib.api("Clarke_Lib_Do", low, other, 0)[1] <= lib.api("Clarke_Lib_Do", high, other, 0)[1]
    falling, rising = (lib.api("InvClarke_Lib_Do", other, beta) for beta in (low, high))
    assert falling[1] <= rising[1] and falling[2] >= rising[2]


@each_frac
def test_park_saturates_where_the_exact_value_begins_not_to_fit(library_for, frac):
    """One below, at and above the first value that rounds to 2^31, and likewise below: (2^31 - 1/2) 2^frac."""
    lib = library_for(frac)
    first = (1 << 31 + frac) - (1 << frac - 1)
    x = INT32_MAX
    cosine, rest = divmod(first, x)
    if cosine > INT32_MAX:  # LIB_TRIG_FRAC 31: a second product is needed
        cosine, rest = INT32_MAX, first - x * INT32_MAX
    sine = -(-rest // INT32_MAX) or 1
    y, rest = divmod(rest, sine)
    assert lib.api("Park_Lib_Do", x, y + 1, cosine, sine)[0] == INT32_MAX
    for off in (-1, 0, 1):
        for vector in ((x, y + off), (-x, -y - off)):
            assert lib.api("Park_Lib_Do", *vector, cosine, sine) == oracle.park(*vector, cosine, sine, frac)
            mirrored = vector[0], -vector[1]
            assert lib.api("InvPark_Lib_Do", *mirrored, cosine, sine) == oracle.invpark(*mirrored, cosine, sine, frac)


def test_clarke_corners(lib):
    for ia in CORNERS:
        for ib in CORNERS:
            exact = oracle.over_sqrt3(ia + 2 * ib)
            assert near(lib.api("Clarke_Lib_Do", ia, ib, 7)[1], exact, TOLERANCE_CLARKE)
    assert lib.api("Clarke_Lib_Do", INT32_MAX, INT32_MAX, 0)[1] == INT32_MAX
    assert lib.api("Clarke_Lib_Do", INT32_MIN, INT32_MIN, 0)[1] == INT32_MIN
    assert lib.api("InvClarke_Lib_Do", INT32_MIN, INT32_MAX) == (INT32_MIN, INT32_MAX, -786033569)
