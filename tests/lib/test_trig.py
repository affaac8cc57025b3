# SPDX-License-Identifier: MIT
"""Sine and cosine at every angle there is."""
from fractions import Fraction

import numpy as np
import pytest
from make_tables import sine_of_turn

ANGLES = np.arange(65536)
STEP_Q32 = 1 << 10  # angles within one step give the same result
ERROR_MAX_LSB = 0.83
ERROR_MAX_FINE_LSB = 0.85


@pytest.fixture(scope="module")
def swept(lib):
    return lib.cossin(ANGLES << 16)


@pytest.fixture(scope="module")
def fine(lib):
    """Every result there is: one angle of each step."""
    return lib.cossin(np.arange(1 << 22) * STEP_Q32)


def test_error_bound_over_all_angles(swept):
    """Against double precision, which is good to 1e-11 LSB here."""
    cosine, sine = swept
    theta = ANGLES * (2 * np.pi / 65536)
    error = max(np.abs(sine - 32768 * np.sin(theta)).max(), np.abs(cosine - 32768 * np.cos(theta)).max())
    assert ERROR_MAX_LSB - 0.01 <= error <= ERROR_MAX_LSB


def test_error_bound_between_the_angles_of_16_bits(fine):
    """At both ends of each step: the exact functions bend too little within one to matter."""
    cosine, sine = fine
    error = 0.0
    for end in (0, STEP_Q32 - 1):
        theta = (np.arange(1 << 22) * STEP_Q32 + end) * (2 * np.pi / 2**32)
        error = max(error, np.abs(sine - 32768 * np.sin(theta)).max(), np.abs(cosine - 32768 * np.cos(theta)).max())
    assert ERROR_MAX_FINE_LSB - 0.01 <= error <= ERROR_MAX_FINE_LSB


def test_against_exact_sine(swept):
    """And against exact arithmetic, which trusts no library."""
    for angle in range(0, 65536, 97):
        assert abs(swept[1][angle] - 32768 * sine_of_turn(Fraction(angle, 65536))) <= ERROR_MAX_LSB


def test_quadrants_are_exact(swept):
    cosine, sine = swept
    assert [(cosine[a], sine[a]) for a in (0, 16384, 32768, 49152)] == [(32768, 0), (0, 32768), (-32768, 0), (0, -32768)]


def test_length(fine):
    """What the Park transform's proof against overflow needs: at most 32768.75."""
    cosine, sine = fine
    assert 16 * int((cosine**2 + sine**2).max()) <= (4 * 32768 + 3) ** 2
    assert np.abs(cosine).max() == 32768 and np.abs(sine).max() == 32768


def test_symmetry_to_the_bit(swept):
    cosine, sine = swept
    mirrored = -ANGLES % 65536
    assert np.array_equal(cosine, cosine[mirrored])
    assert np.array_equal(sine, -sine[mirrored])
    assert np.array_equal(sine[(ANGLES + 16384) % 65536], cosine)
    assert np.array_equal(sine[(32768 - ANGLES) % 65536], sine)


def test_monotone_in_each_quadrant(fine):
    sine = fine[1]
    quarter = 1 << 20
    assert np.all(np.diff(np.concatenate([sine[3 * quarter:], sine[:quarter + 1]])) >= 0)
    assert np.all(np.diff(sine[quarter:3 * quarter + 1]) <= 0)


def test_lower_bits_have_no_effect(lib, fine):
    for low in (1, 0x155, STEP_Q32 - 1):
        cosine, sine = lib.cossin(np.arange(0, 1 << 22, 13) * STEP_Q32 + low)
        assert np.array_equal(cosine, fine[0][::13]) and np.array_equal(sine, fine[1][::13])
