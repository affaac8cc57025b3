# SPDX-License-Identifier: MIT
"""Sine and cosine at every angle there is."""
from fractions import Fraction

import numpy as np
import pytest
from make_tables import sine_of_turn

ANGLES = np.arange(65536)
ERROR_MAX_LSB = 0.6


@pytest.fixture(scope="module")
def swept(lib):
    return lib.cossin(ANGLES)


def test_error_bound_over_all_angles(swept):
    """Against double precision, which is good to 1e-11 LSB here."""
    cosine, sine = swept
    theta = ANGLES * (2 * np.pi / 65536)
    error = max(np.abs(sine - 32768 * np.sin(theta)).max(), np.abs(cosine - 32768 * np.cos(theta)).max())
    assert 0.5 <= error <= ERROR_MAX_LSB


def test_against_exact_sine(swept):
    """And against exact arithmetic, which trusts no library."""
    for angle in range(0, 65536, 97):
        assert abs(swept[1][angle] - 32768 * sine_of_turn(Fraction(angle, 65536))) <= ERROR_MAX_LSB


def test_quadrants_are_exact(swept):
    cosine, sine = swept
    assert [(cosine[a], sine[a]) for a in (0, 16384, 32768, 49152)] == [(32768, 0), (0, 32768), (-32768, 0), (0, -32768)]
    assert np.abs(cosine).max() == 32768 and np.abs(sine).max() == 32768


def test_symmetry_to_the_bit(swept):
    cosine, sine = swept
    mirrored = -ANGLES % 65536
    assert np.array_equal(cosine, cosine[mirrored])
    assert np.array_equal(sine, -sine[mirrored])
    assert np.array_equal(sine[(ANGLES + 16384) % 65536], cosine)
    assert np.array_equal(sine[(32768 - ANGLES) % 65536], sine)


def test_monotone_in_each_quadrant(swept):
    sine = swept[1]
    rising = np.concatenate([sine[49152:], sine[:16385]])
    assert np.all(np.diff(rising) >= 0)


def test_upper_bits_are_ignored(lib, swept):
    for high in (1 << 16, 0xABCD << 16, 0xFFFF << 16):
        cosine, sine = lib.cossin(ANGLES[::13] + high)
        assert np.array_equal(cosine, swept[0][::13]) and np.array_equal(sine, swept[1][::13])
