# SPDX-License-Identifier: MIT
"""The tracking observer: lock, truth at constant speed, reversal, wrap, quantised encoders, and its stated poles."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

TURN = 2**32
FS = 20000.0


def natural_q16(hz):
    return round(2 * np.pi * hz / FS * 65536)


def wrapped(difference):
    """A difference of angles as a signed fraction of a turn."""
    return ((np.asarray(difference) + 0.5) % 1.0) - 0.5


def quantise(turns, counts_per_turn=None):
    """Angles in turns to what an encoder reports, as u32."""
    if counts_per_turn is None:
        return np.floor(turns * TURN).astype(np.int64) % TURN
    return (np.floor(turns * counts_per_turn) * (TURN // counts_per_turn)).astype(np.int64) % TURN


def run(lib, pll, turns, counts=None):
    angles, speeds = lib.pll_steps(pll, quantise(turns, counts))
    return wrapped(angles / TURN - turns), speeds / TURN


SPEEDS = (0.0, 1e-6, 0.00123456, 0.02, -0.02, 0.1)


@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("hz", (100, 200, 390))
def test_locks_and_is_true_at_constant_speed(lib, speed, hz):
    turns = 0.37 + speed * np.arange(12000)
    error, estimate = run(lib, lib.pll(natural_q16(hz)), turns)
    tail = slice(6000, None)
    assert np.abs(error[tail]).max() < 2 * 2.0**-16
    assert abs(error[tail].mean()) < 2.0**-16
    assert abs(estimate[tail].mean() - speed) < 2 * 2.0**-16 / 6000  # what the angle's error can hide


def test_rests_at_standstill(lib):
    """After lock on an angle that stands, nothing moves any more: no drift, no limit cycle."""
    for angle in (0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFF8000, 123456789):
        pll = lib.pll(natural_q16(100))
        lib.pll_steps(pll, np.full(40000, angle))
        angles, speeds = lib.pll_steps(pll, np.full(20000, angle))
        assert np.abs(wrapped((angles - angle) / TURN)).max() <= 2.0**-16
        assert np.abs(speeds).max() <= 100  # 2e-8 turns a sample: 0.03 rpm of a 1-pole-pair machine at 20 kHz
        assert abs(speeds.mean()) < 1


def test_wraps_by_itself(lib):
    """Across 0 in both directions, for many turns, from a start at half a turn's distance."""
    for speed in (0.013, -0.013):
        error, _ = run(lib, lib.pll(natural_q16(200), TURN // 2), speed * np.arange(20000))
        assert np.abs(error[5000:]).max() < 2.0**-15


def test_reversal(lib):
    """Speed reversed by a ramp: the estimate follows with the stated lag and settles on the other side."""
    hz, ramp = 200.0, 4000
    speed = np.concatenate([np.full(4000, 0.02), np.linspace(0.02, -0.02, ramp), np.full(4000, -0.02)])
    turns = np.cumsum(speed)
    pll = lib.pll(natural_q16(hz))
    error, estimate = run(lib, pll, turns)
    acceleration = -0.04 / ramp
    kp, ki = pll.kp_q16 / 2**16, pll.ki_q22 / 2**22
    middle = slice(6500, 7500)
    assert error[middle].mean() == pytest.approx(-acceleration * (1 - kp) / ki, rel=0.02)
    halfway = speed[middle] + acceleration / 2  # the speed at the sample; `speed` is the mean since the one before
    assert (estimate[middle] - halfway).mean() == pytest.approx(-acceleration * (kp / ki - 0.5), rel=0.01)
    assert estimate[-2000:].mean() == pytest.approx(-0.02, abs=1e-9)
    assert estimate.min() > -0.0202  # critically damped: no overshoot


@pytest.mark.parametrize("rpm", (1, 7, 60, 333, 1499, -2999))
def test_encoder_steps_give_a_quiet_speed(lib, rpm):
    """4000 counts a revolution, 4 pole pairs, 100 Hz: the mean is exact, the ripple a small part of what differencing gives."""
    counts = 1000  # an electrical turn
    speed = rpm / 60.0 * 4 / FS
    error, estimate = run(lib, lib.pll(natural_q16(100)), 0.1 + speed * np.arange(60000), counts)
    tail = estimate[20000:]
    to_rpm = FS * 60 / 4
    period = max(1, round(1 / abs(speed * counts)))
    whole = tail[:len(tail) // period * period] if period > 100 else tail
    assert whole.mean() * to_rpm == pytest.approx(rpm, abs=0.02 + abs(rpm) * 1e-5)
    one_count_differenced = to_rpm / counts  # 300 rpm: one count in one sample
    assert np.abs(tail - speed).max() * to_rpm < 0.012 * one_count_differenced  # 3.6 rpm
    assert abs(error[20000:].mean() + 0.5 / counts) < 0.1 / counts  # an encoder's floor is half a count behind


@pytest.mark.parametrize("hz", (20, 100, 300))
def test_step_response_has_the_stated_poles(lib, hz):
    """A small step of angle against the linear recursion that the header's polynomial describes."""
    pll = lib.pll(natural_q16(hz))
    kp, ki = pll.kp_q16 / 2**16, pll.ki_q22 / 2**22
    samples, step = 1500, 0.05
    angles, _ = lib.pll_steps(pll, np.full(samples, round(step * TURN)))
    expected = np.zeros(samples)
    angle = speed = 0.0
    for n in range(samples):
        predicted = angle + speed
        miss = 1.0 - predicted
        angle, speed = predicted + kp * miss, speed + ki * miss
        expected[n] = angle
    assert np.abs(angles / TURN - step * expected).max() < 3 * 2.0**-16


def test_bandwidth_formula(lib):
    """The -3 dB point by measurement: a small sine at the stated frequency comes out 3 dB smaller."""
    for hz in (30.0, 100.0):
        bandwidth = 2.48 * hz
        t = np.arange(60000) / FS
        turns = 0.3 + 0.05 * np.sin(2 * np.pi * bandwidth * t)
        angles, _ = lib.pll_steps(lib.pll(natural_q16(hz)), quantise(turns))
        tail = angles[20000:] / TURN - 0.3
        gain = 2 * abs(np.mean(tail * np.exp(-2j * np.pi * bandwidth * t[20000:]))) / 0.05
        assert 20 * np.log10(gain) == pytest.approx(-3.0, abs=0.35)


@given(start=st.integers(0, TURN - 1), target=st.integers(0, TURN - 1), natural=st.integers(400, 8191))
def test_locks_from_any_angle_to_any_angle(lib, start, target, natural):
    pll = lib.pll(natural, start)
    samples = round(14 * 65536 / natural)
    angles, _ = lib.pll_steps(pll, np.full(samples, target))
    assert abs(wrapped((int(angles[-1]) - target) / TURN)) < 2.0**-13


def test_gains_of_the_bandwidth_helper(lib):
    for natural in (0, 1, 206, 2059, 8191):
        pll = lib.pll(natural)
        assert pll.kp_q16 == 2 * natural
        assert abs(pll.ki_q22 / 2**22 - (natural / 65536) ** 2) <= 2.0**-23
        assert pll.ki_q22 <= 65535 and pll.kp_q16 <= 65535
