# SPDX-License-Identifier: MIT
"""A vector turned by a small angle: rounding, range, direction, length."""
from fractions import Fraction
from math import ceil, floor

import numpy as np
import pytest
from binding import constant
from hypothesis import given
from hypothesis import strategies as st

ONE, FAR = 32768, 65535
TURN_MAX = constant("advance.h", "ADVANCE_MAX_Q15")
TURNS = (-TURN_MAX, -6554, -1715, -1, 0, 1, 1715, 6554, TURN_MAX)  # 6554: 0.2, 11.5 degrees; 1715: 3 degrees
EDGE = np.arange(-FAR, FAR + 1, 15)
SIDE = np.full(EDGE.shape, FAR)
# the rim of the square of allowed vectors: where a linear map is largest
RIM = np.array([np.concatenate([EDGE, EDGE, SIDE, -SIDE]), np.concatenate([SIDE, -SIDE, EDGE, EDGE])])
COMPONENTS = st.one_of(st.integers(-FAR, FAR), st.integers(-3, 3), st.sampled_from([-FAR, FAR]))


@given(x=COMPONENTS, y=COMPONENTS, turn=st.one_of(st.integers(-TURN_MAX, TURN_MAX), st.sampled_from(TURNS)))
def test_two_shears_exactly(lib, x, y, turn):
    t = Fraction(turn, ONE)
    sheared = ceil(x - t * y)
    assert [int(v[0]) for v in lib.advance(x, y, turn)] == [sheared, floor(y + t * sheared)]


@pytest.mark.parametrize("turn", TURNS)
def test_range(lib, turn):
    """No more than 1.6 times the larger component, and 1; no product leaves 32 bits."""
    small = np.array(np.meshgrid(np.arange(-40, 41), np.arange(-40, 41))).reshape(2, -1)
    for v in (RIM, small):
        out = np.array(lib.advance(*v, turn))
        assert np.all(np.abs(out).max(axis=0) <= 1.6 * np.abs(v).max(axis=0) + 1)
        assert np.all(np.abs(turn * v[1]) < 2**31) and np.all(np.abs(turn * out[0]) < 2**31)


CIRCLE = 2 * np.pi * np.arange(0, 1, 1 / 4096)
RADIUS = 60000


def turned(lib, turn):
    """Angles and lengths before and after, of vectors all around."""
    v = np.rint(RADIUS * np.array([np.cos(CIRCLE), np.sin(CIRCLE)])).astype(int)
    out = np.array(lib.advance(*v, turn))
    before, after = v[0] + 1j * v[1], out[0] + 1j * out[1]
    return np.angle(after / before), np.abs(after) / np.abs(before)


@pytest.mark.parametrize("turn", [turn for turn in TURNS if abs(turn) > 1])
def test_one_turn(lib, turn):
    """From x to y for a positive turn; length and direction off by up to t^2/2, and nearly that much somewhere."""
    t = turn / ONE
    exact = 2 * np.arcsin(t / 2)
    angle, length = turned(lib, turn)
    assert np.all(np.sign(angle) == np.sign(turn))
    rounding, higher = 3 / RADIUS, abs(t) ** 3 / 6
    off = t * t / 2 + higher + rounding
    assert np.abs(length - 1).max() < off and np.abs(angle - exact).max() < off
    assert np.abs(length - 1).max() > t * t / 2 - higher - rounding
    assert abs(angle.mean() - exact) < abs(t) ** 3 / 4 + rounding


def test_the_headers_figures(lib):
    """6 degrees: 0.6 % and 0.3 degrees; 11.5 degrees: 2 % and 1.2 degrees, t being the angle in radians."""
    for degrees, percent, direction in ((6.0, 0.6, 0.33), (11.5, 2.1, 1.25)):
        angle, length = turned(lib, round(np.radians(degrees) * ONE))
        assert 0.8 * percent < 100 * np.abs(length - 1).max() < percent
        assert 0.8 * direction < np.degrees(np.abs(angle - np.radians(degrees)).max()) < direction
