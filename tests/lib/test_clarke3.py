# SPDX-License-Identifier: MIT
"""The other forms of the Clarke transform, Q15 and 32 bits wide: error bounds, zero sequence, agreement with each other."""
from fractions import Fraction
from itertools import product

import numpy as np
import oracle
import pytest
from hypothesis import given
from hypothesis import strategies as st

LIMIT = 32768
INT32 = st.integers(oracle.INT32_MIN, oracle.INT32_MAX)
CORNERS = (oracle.INT32_MIN, oracle.INT32_MIN + 1, -65537, -2, -1, 0, 1, 2, 3, 65536, oracle.INT32_MAX - 1, oracle.INT32_MAX)
SQRT3 = np.sqrt(3)


def with_sum(sums):
    """Three values within +-LIMIT for each sum within +-3 LIMIT."""
    a = np.clip(sums, -LIMIT, LIMIT)
    b = np.clip(sums - a, -LIMIT, LIMIT)
    return a, b, sums - a - b


def test_alpha_over_all_sums(lib):
    sums = np.arange(-3 * LIMIT, 3 * LIMIT + 1)
    a, b, c = with_sum(sums)
    assert np.abs(c).max() <= LIMIT
    alpha, _ = lib.clarke3(a, b, c)
    assert np.abs(3 * alpha - (3 * a - sums)).max() == 1  # of thirds: correctly rounded
    assert np.all(alpha[sums == 0] == a[sums == 0])


def test_beta_over_all_differences(lib):
    difference = np.arange(-2 * LIMIT, 2 * LIMIT + 1)
    b = difference // 2
    for a in (-LIMIT, 0, LIMIT):
        _, beta = lib.clarke3(a, b, b - difference)
        error = np.abs(beta - difference / SQRT3).max()
        assert 0.522 < error <= 0.523


def test_extremes_of_q15(lib):
    """All corners of the range, where a sum or product would overflow first."""
    for a, b, c in product((-LIMIT, LIMIT, 0), repeat=3):
        alpha, beta = (int(x[0]) for x in lib.clarke3(a, b, c))
        assert abs(alpha - Fraction(2 * a - b - c, 3)) <= Fraction(1, 3)
        assert abs(beta - oracle.over_sqrt3(b - c)) <= Fraction(523, 1000)


def test_two_sensor_forms_everywhere(lib):
    sums = np.arange(-3 * LIMIT, 3 * LIMIT + 1)
    c = np.clip(sums // 2, -LIMIT, LIMIT)
    alpha, beta = lib.clarke_ca(c, sums - 2 * c)
    assert np.array_equal(alpha, sums - 2 * c)
    assert 0.533 < np.abs(beta + sums / SQRT3).max() <= 0.534
    difference = np.arange(-2 * LIMIT, 2 * LIMIT + 1)
    b = difference // 2
    alpha, beta = lib.clarke_bc(b, b - difference)
    assert np.array_equal(alpha, difference - 2 * b)
    assert np.abs(beta - difference / SQRT3).max() <= 0.523


def check_wide(lib, name, fields, exact_alpha, sum_of_beta, **overlap):
    alpha, beta = lib.api(name, *fields, **overlap)
    assert alpha == oracle.saturate(oracle.round_half_up(exact_alpha))
    bound = Fraction(51, 100)
    exact = oracle.over_sqrt3(sum_of_beta)
    assert exact - bound <= beta <= exact + bound or beta == oracle.saturate(oracle.round_half_up(exact))


def check_all_forms(lib, a, b, c, **overlap):
    check_wide(lib, "Clarke3_Lib_Do", (a, b, c), Fraction(2 * a - b - c, 3), b - c, **overlap)
    check_wide(lib, "ClarkeBC_Lib_Do", (a, b, c), -b - c, b - c, **overlap)
    check_wide(lib, "ClarkeCA_Lib_Do", (a, b, c), a, -(a + 2 * c), **overlap)


def test_wide_corners(lib):
    for fields in product(CORNERS, repeat=3):
        check_all_forms(lib, *fields)


@given(a=INT32, b=INT32, c=INT32, overlap=st.sampled_from((None, -2, -1, 0, 1, 2)))
def test_wide(lib, a, b, c, overlap):
    check_all_forms(lib, a, b, c, output_offset=overlap)


@given(a=INT32, b=INT32, c=INT32, other=INT32)
def test_the_unused_field_has_no_effect(lib, a, b, c, other):
    assert lib.api("ClarkeBC_Lib_Do", a, b, c) == lib.api("ClarkeBC_Lib_Do", other, b, c)
    assert lib.api("ClarkeCA_Lib_Do", a, b, c) == lib.api("ClarkeCA_Lib_Do", a, other, c)


@pytest.mark.parametrize("sums", [range(-3 * 2**31, -3 * 2**31 + 4000), range(-4000, 4000),
                                  range(3 * 2**31 - 4003, 3 * 2**31 - 2)])
def test_third_where_it_turns(lib, sums):
    """Every sum near the ends of the range and about 0: alpha is correctly rounded."""
    for total in sums:
        a = max(oracle.INT32_MIN, min(oracle.INT32_MAX, total))
        b = max(oracle.INT32_MIN, min(oracle.INT32_MAX, total - a))
        fields = (a, b, total - a - b)
        expected = oracle.saturate(oracle.round_half_up(Fraction(3 * a - total, 3)))
        assert lib.api("Clarke3_Lib_Do", *fields)[0] == expected
