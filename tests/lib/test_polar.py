# SPDX-License-Identifier: MIT
"""Angle and length of a vector, and SinCos_Lib_Do: error bounds swept, part by part where the whole domain is too large."""
import subprocess
from fractions import Fraction
from itertools import product
from math import atan2, isqrt, pi

import numpy as np
import oracle
import pytest
from hypothesis import given
from hypothesis import strategies as st
from host_build import HERE, LIBRARY, TRIG_FRACS, build_dir, compile_host
from make_tables import sine_of_turn

INT32 = st.integers(oracle.INT32_MIN, oracle.INT32_MAX)
Q15 = st.integers(-65535, 65535)
CORNERS = (oracle.INT32_MIN, oracle.INT32_MIN + 1, -65536, -32768, -1, 0, 1, 2, 32767, 65535, 65536, oracle.INT32_MAX)
TURN = 65536 / (2 * pi)  # 1/65536 turn per radian
ANGLE_Q15, ANGLE_ANY = 0.21, 0.53
STEPS = np.arange(1 << 19)
SINCOS_ERROR = 0.35  # LSB of Q15, before the last rounding
ENDS = (0, 4095)         # both functions ignore 12 bits


def angle_error(angle, y, x):
    return np.abs((angle - np.arctan2(y, x) * TURN + 32768) % 65536 - 32768)


def test_angle_bound_by_parts(lib):
    """The reciprocal's relative error e moves the angle by less than e/2 rad, and what 16 bits of the smaller coordinate
    leave out by less than 2^-15 rad; the arctangent's own error comes on top. Both tables over all they can tell apart."""
    reciprocal = lib.polar_reciprocal((1 << 31) + (STEPS << 12))
    relative = max(np.abs(reciprocal / 65536 * ((1 << 31) + (STEPS << 12) + end) / 2**31 - 1).max() for end in ENDS)
    angle = lib.polar_arctangent(STEPS << 12) / 65536
    own = max(np.abs(angle - np.arctan(((STEPS << 12) + end) / 2**31) * TURN).max() for end in ENDS)
    assert ANGLE_Q15 - 0.01 <= relative / 2 * TURN + own <= ANGLE_Q15
    assert relative / 2 * TURN + own + TURN / 2**15 <= ANGLE_ANY
    beyond = (1 << 31) + np.arange(0, 1 << 17, 64)  # a ratio of 1 and its error
    assert relative * 2**31 < 1 << 17
    assert np.abs(lib.polar_arctangent(beyond) / 65536 - np.arctan(beyond / 2**31) * TURN).max() <= own


def check_angles(lib, y, x, bound):
    fine, rounded = lib.atan2(y, x)
    assert angle_error(fine / 65536, y, x).max() <= bound
    assert angle_error(rounded, y, x).max() <= bound + 0.5
    assert np.all(rounded <= 65535)


def test_angles_of_short_vectors(lib):
    """All vectors within +-600 but (0, 0)."""
    y, x = (values.ravel() for values in np.meshgrid(np.arange(-600, 601), np.arange(-600, 601)))
    some = (x != 0) | (y != 0)
    check_angles(lib, y[some], x[some], ANGLE_Q15)


def test_angles_of_random_vectors(lib):
    rng = np.random.default_rng(1)
    check_angles(lib, *rng.integers(-65535, 65536, (2, 2000000)), ANGLE_Q15)
    wide = rng.integers(oracle.INT32_MIN, oracle.INT32_MAX + 1, (2, 2000000))
    shifted = wide >> rng.integers(0, 31, wide.shape)
    some = (shifted != 0).any(axis=0)
    check_angles(lib, *shifted[:, some], ANGLE_ANY)


def test_angles_of_corners(lib):
    for y, x in product(CORNERS, repeat=2):
        if (y, x) != (0, 0):
            assert angle_error(int(lib.atan2(y, x)[0][0]) / 65536, y, x) <= ANGLE_ANY


def test_angles_on_the_axes_are_exact(lib):
    assert lib.atan2(0, 0)[0] == 0
    for length in (1, 2, 3, 32767, 65535, 10**6 + 1, 2**31 - 1):
        fine, rounded = lib.atan2([0, length, 0, -length], [length, 0, -length, 0])
        assert list(fine) == [0, 1 << 30, 2 << 30, 3 << 30] and list(rounded) == [0, 16384, 32768, 49152]


@given(y=Q15, x=Q15)
def test_angle_symmetry(lib, y, x):
    """A mirrored vector has the mirrored angle, to the bit."""
    if x and y:
        angle = int(lib.atan2(y, x)[0][0])
        assert int(lib.atan2(-y, x)[0][0]) == -angle % 2**32
        assert int(lib.atan2(y, -x)[0][0]) == (2**31 - angle) % 2**32


def test_root_over_many_squares():
    """In C, as there are so many; over all of them by `make prove`."""
    program = compile_host(build_dir() / "sweep_root", [HERE / "sweep_root.c", *LIBRARY], ["-O2"])
    result = subprocess.run([program, "16"], capture_output=True, text=True, timeout=300)
    assert result.stdout == "root, of all squares one in 16: 0 wrong\n", result.stdout + result.stderr


def test_root_of_squares_of_whole_numbers(lib):
    whole = np.arange(65536)
    assert np.array_equal(lib.polar_root(whole * whole), whole)
    assert np.array_equal(lib.magnitude(whole, 0), whole) and np.array_equal(lib.magnitude(0, -whole), whole)


@given(y=Q15, x=Q15)
def test_magnitude(lib, y, x):
    square = x * x + y * y
    if square < 2**32:
        assert int(lib.magnitude(x, y)[0]) == (isqrt(4 * square) + 1) // 2


def check_polar(lib, x, y, **overlap):
    magnitude, angle = lib.api("Polar_Lib_Do", x, y, **overlap)
    square = x * x + y * y
    assert magnitude == min((isqrt(4 * square) + 1) // 2, oracle.INT32_MAX)
    error = ((angle % 2**32) / 65536 - atan2(y, x) * TURN + 32768) % 65536 - 32768
    assert abs(error) <= ANGLE_ANY if square else angle == 0


def test_polar_corners(lib):
    for fields in product(CORNERS, repeat=2):
        check_polar(lib, *fields)


@given(x=INT32, y=INT32, overlap=st.sampled_from((None, -1, 0, 1)))
def test_polar(lib, x, y, overlap):
    check_polar(lib, x, y, output_offset=overlap)


@given(x=INT32, y=INT32, small=st.integers(0, 31))
def test_polar_of_all_magnitudes(lib, x, y, small):
    check_polar(lib, x >> small, y >> small)


@pytest.mark.parametrize("frac", TRIG_FRACS)
def test_sincos(library_for, frac):
    """Every angle of 16 bits, and as many between."""
    lib = library_for(frac)
    one = 1 << frac
    for offset in (0, 0x5A5A):
        angles = (np.arange(65536) << 16) + offset
        cosine, sine = lib.sincos(angles)
        theta = angles * (2 * np.pi / 2**32)
        error = max(np.abs(cosine - one * np.cos(theta)).max(), np.abs(sine - one * np.sin(theta)).max())
        assert error <= one * SINCOS_ERROR / 32768 + (0.5 if frac < 30 else 1 if frac == 31 else 0)
    assert np.abs(np.array([cosine, sine])).max() <= one
    top = one if frac < 31 else oracle.INT32_MAX
    quadrants = lib.sincos(np.arange(4) << 30)
    assert [list(x) for x in quadrants] == [[top, 0, -one, 0], [0, top, 0, -one]]


def test_sincos_is_the_hot_paths(lib):
    angles = np.arange(0, 2**32, 65536 + 1024 * 7)
    for wide, narrow in zip(lib.sincos(angles), lib.cossin(angles)):
        assert np.array_equal(wide, narrow)


def test_sincos_against_exact(library_for):
    sine = library_for(30).sincos(np.arange(0, 65536, 509) << 16)[1]
    for angle, value in zip(range(0, 65536, 509), sine):
        assert abs(int(value) - (1 << 30) * sine_of_turn(Fraction(angle, 65536))) <= (1 << 15) * SINCOS_ERROR
