# SPDX-License-Identifier: MIT
"""The tracking observer: its recursion, lock and truth at constant speed, lags, and its stated bandwidth."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

TURN = 2**32
FLOOR, SLOW = 256, 32    # units by which rounding down may keep angle and speed behind
U32 = st.integers(0, TURN - 1)


def wrapped(difference):
    """A difference of angles as a signed fraction of a turn."""
    return ((np.asarray(difference) + 0.5) % 1.0) - 0.5


def as_i32(value):
    return (value + 2**31) % TURN - 2**31


def quantise(turns):
    """Angles in turns as u32."""
    return np.floor(turns * TURN).astype(np.int64) % TURN


def run(lib, pll, turns):
    """Per sample: prediction for it less the truth, in turns; and the speed after it, in turns a sample."""
    start = pll.angle_q32
    angles, speeds = lib.pll_steps(pll, quantise(turns))
    predicted = np.concatenate([[start], angles[:-1]]) / TURN
    return wrapped(predicted - turns), speeds / TURN


@given(angle=U32, speed=st.integers(-2**31, 2**31 - 1), measured=U32)
def test_one_sample_anywhere(lib, angle, speed, measured):
    """The header's three lines in integers that do not end, then wrapped."""
    pll = lib.pll(angle)
    assert pll.angle_q32 == angle and pll.speed_q32 == 0  # what pll_reset() leaves of any state
    pll.speed_q32 = speed
    error = as_i32(measured - angle)
    expected_speed = as_i32(speed + error // 256)
    angles, speeds = lib.pll_steps(pll, measured)
    assert int(speeds[0]) == expected_speed
    assert int(angles[0]) == (angle + error // 8 + expected_speed) % TURN


@pytest.mark.parametrize("speed", (0.0, 1e-6, 0.00123456, 0.02, -0.02, 0.1, -0.15, 0.15))
def test_locks_and_is_true_at_constant_speed(lib, speed):
    """The truth itself is rounded down to the unit, and its speed uneven by as much: 2 units more of tolerance."""
    turns = 0.37 + speed * np.arange(12000)
    error, estimate = run(lib, lib.pll(), turns)
    error, behind = error[6000:] * TURN, (speed - estimate[6000:]) * TURN
    assert error.max() < 2 and error.min() > -FLOOR - 2
    assert behind.min() > -2 and behind.max() < SLOW + 2


@pytest.mark.parametrize("acceleration", (1e-5, -1e-5, 1e-6, 3e-5))
def test_lags_at_constant_acceleration(lib, acceleration):
    """256 accelerations of angle, 31.5 of speed at the instant of the sample."""
    n = np.arange(4000)
    start = -acceleration * 2000
    turns = 0.1 + start * n + acceleration * n * n / 2
    error, estimate = run(lib, lib.pll(), turns)
    tail = slice(1500, None)
    assert np.abs(error[tail] / acceleration + 256).max() < 256 * 1e-3 + 2.0**-22 / abs(acceleration)
    lag = (start + acceleration * n - estimate) / acceleration
    assert np.abs(lag[tail] - 31.5).max() < 31.5 * 1e-3 + 1e-9 / abs(acceleration)


def test_bandwidth(lib):
    """The -3 dB point by measurement: a small sine at the stated frequency comes out 3 dB smaller, a lower one does not."""
    n = np.arange(60000)
    for cycles, decibel in ((0.0266, -3.0), (0.0253, -2.7), (0.0005, 0.0)):
        turns = 0.3 + 0.05 * np.sin(2 * np.pi * cycles * n)
        angles, _ = lib.pll_steps(lib.pll(), quantise(turns))
        tail = angles[20000:] / TURN - 0.3
        gain = 2 * abs(np.mean(tail * np.exp(-2j * np.pi * cycles * n[20000:]))) / 0.05
        assert 20 * np.log10(gain) == pytest.approx(decibel, abs=0.05)
