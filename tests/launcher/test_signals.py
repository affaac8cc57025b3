# SPDX-License-Identifier: MIT
"""Measurements on signals whose answer is known."""
import cmath
import math
from types import SimpleNamespace

import numpy as np
import pytest

from launcher import LauncherError, signals
from launcher.kinds_weakening import KINDS

DT = 50e-6


def first_order(tau_s, length_s=0.05, start=1.0, final=5.0):
    t = np.arange(0, length_s, DT)
    return t, start + (final - start) * (1 - np.exp(-t / tau_s)), start, final


@pytest.mark.parametrize("tau_s", [0.4e-3, 1e-3, 3e-3])
def test_first_order_rise(tau_s):
    rise, overshoot = signals.step_response(*first_order(tau_s))
    assert rise == pytest.approx(tau_s * math.log(9), rel=0.01)
    assert overshoot < 0.01


@pytest.mark.parametrize("damping", [0.3, 0.5, 0.7])
def test_second_order_overshoot(damping):
    t = np.arange(0, 0.1, DT)
    wn = 2 * math.pi * 500
    wd = wn * math.sqrt(1 - damping ** 2)
    y = 1 - np.exp(-damping * wn * t) * (np.cos(wd * t) + damping * wn / wd * np.sin(wd * t))
    overshoot = signals.step_response(t, -2 * y, 0.0, -2.0)[1]
    assert overshoot == pytest.approx(100 * math.exp(-math.pi * damping / math.sqrt(1 - damping ** 2)), rel=0.02)


def test_a_step_that_never_arrives_has_no_rise_time():
    t = np.arange(0, 0.01, DT)
    assert signals.step_response(t, 0.5 * np.ones_like(t), 0.0, 1.0)[0] is None
    with pytest.raises(LauncherError):
        signals.step_response(t, t, 1.0, 1.0)


def test_settling_time():
    t = np.arange(0, 1, 0.001)
    error = np.exp(-t / 0.1)
    assert signals.settling_time(t, error, 0.01) == pytest.approx(0.1 * math.log(100), abs=0.002)
    assert signals.settling_time(t, error * 0, 0.01) == 0.0
    assert signals.settling_time(t, error + 1, 0.01) is None
    assert signals.settling_time(t, np.where(t == 0.5, 1.0, 0.0), 0.1) == pytest.approx(0.501, abs=0.0015)


@pytest.mark.parametrize("from_s, to_s, periods", [
    (1.55, 1.55 + 3 * DT, 3), (2.1, 2.1 + 3 * DT + 1e-16, 3), (1.55, 1.55 + 3.0000000000018887 * DT, 3),
    (1.55, 1.55 + 2.1 * DT, 3), (1.55, 1.55 + 0.5 * DT, 1), (1.55, 1.55, 0), (1.55, 1.5, 0)])
def test_periods_are_whole_and_rounded_up(from_s, to_s, periods):
    found = signals.whole_periods(from_s, to_s, DT)
    assert isinstance(found, int) and found == periods


# ---- distortion ----------------------------------------------------------------------------------------------------

def wave(angle, shares, size=7.1, dc=0.0):
    """A fundamental and shares of it at other orders, whole or not."""
    return dc + size * (np.sin(angle) + sum(share * np.sin(order * angle + order) for order, share in shares.items()))


@pytest.mark.parametrize("shares", [{5: 0.03, 7: 0.04}, {2: 0.05}, {40: 0.02}, {7.3: 0.03}, {0.62: 0.02, 5: 0.02}, {}])
@pytest.mark.parametrize("frequency_hz", [33.3, 100.0, -87.0])
def test_distortion_is_all_that_is_not_fundamental(shares, frequency_hz):
    angle = 2 * math.pi * frequency_hz * np.arange(0, 0.6, DT) + 0.7
    expected = 100 * math.sqrt(sum(share ** 2 for share in shares.values()))
    assert signals.distortion_percent(wave(angle, shares, dc=0.5), angle) == pytest.approx(expected, rel=0.03, abs=1e-6)


@pytest.mark.parametrize("common", [0.0, 5.0])
def test_the_fundamental_is_of_the_voltage_that_the_windings_see(common):
    """By what six steps give, 2 / pi of the bus; what all phases have in common is none of it."""
    angle = 2 * math.pi * 50 * np.arange(0, 0.05, DT)
    window = {f"v_{phase}_V": 12 + 8 * np.cos(angle - k * 2 * math.pi / 3 + 0.3) + common * np.cos(angle)
              for k, phase in enumerate("abc")} | {"vbus_V": np.full(len(angle), 24.0)}
    run = SimpleNamespace(trace=SimpleNamespace(between=lambda *_: window), electrical_angle=lambda _: angle)
    assert KINDS["fundamental"].function(run, 0, 0.05) == pytest.approx(100 * 8 / (2 / math.pi * 24), rel=1e-3)


def test_distortion_does_not_care_about_a_change_of_speed():
    t = np.arange(0, 0.25, DT)
    angle = 2 * math.pi * (100 * t + 40 * t ** 2)
    assert signals.distortion_percent(np.sin(angle) + 0.03 * np.sin(5 * angle), angle) == pytest.approx(3.0, rel=0.05)


@pytest.mark.parametrize("measure", [signals.distortion_percent,
                                     lambda y, angle: signals.distortion_with_ripple_percent(y, y, angle)])
def test_distortion_needs_a_whole_period(measure):
    angle = np.linspace(0, 6, 100)
    with pytest.raises(LauncherError, match="less than one electrical period"):
        measure(np.sin(angle), angle)


@pytest.mark.parametrize("ripple", [0.0, 0.01, 0.05])
@pytest.mark.parametrize("frequency_hz, length_s", [(97.0, 0.25), (410.0, 0.0511), (-33.3, 0.0777), (1000.0, 5.33e-3)])
def test_distortion_with_ripple_counts_what_the_samples_do_not_see(ripple, frequency_hz, length_s):
    """A triangle of the PWM's frequency that is zero at every sample, but for a delay: rms of the ripple = peak / sqrt(3)."""
    fine = 200
    t = np.arange(0, length_s, DT / fine)
    angle = 2 * math.pi * frequency_hz * t + 0.3
    triangle = 2 / math.pi * np.arcsin(np.sin(2 * math.pi * t / DT - 0.1))
    y = wave(angle, {5: 0.02}, dc=0.2) + 7.1 * ripple * triangle
    areas = np.concatenate([[0.0], np.cumsum((y[1:] + y[:-1]) / 2)])
    squares = np.concatenate([[0.0], np.cumsum((y[1:] ** 2 + y[1:] * y[:-1] + y[:-1] ** 2) / 3)])  # of straight lines
    mean, rms = np.diff(areas[::fine], prepend=0) / fine, np.sqrt(np.diff(squares[::fine], prepend=0) / fine)
    expected = 100 * math.sqrt(0.02 ** 2 + 2 * ripple ** 2 / 3)
    found = signals.distortion_with_ripple_percent(mean, rms, angle[::fine])
    assert found == pytest.approx(expected, rel=0.03)


# ---- frequency response --------------------------------------------------------------------------------------------

@pytest.mark.parametrize("hz", [50.0, 777.0, 8000.0])
def test_response_finds_size_and_phase_beside_mean_and_drift(hz):
    t = np.arange(400) * DT + 0.0123
    y = 3.0 + 2.0 * t + 0.5 * np.sin(2 * math.pi * hz * t + 0.9)
    assert signals.response_at(t, y, hz) == pytest.approx(cmath.rect(0.5, 0.9), abs=1e-9)


def loop_of(opened, hz):
    values = np.array([opened(2j * math.pi * f) for f in hz])
    return signals.Loop(hz, values / (1 + values))


def test_integrator_with_delay_has_the_margin_of_its_delay():
    """L = w / s exp(-s T): crossover at w, margin 90 degrees - w T."""
    w, delay_s = 2 * math.pi * 1000, 75e-6
    loop = loop_of(lambda s: w / s * cmath.exp(-s * delay_s), np.geomspace(50, 8000, 60))
    assert loop.crossover_hz() == pytest.approx(1000, rel=0.01)
    assert loop.phase_margin_deg() == pytest.approx(90 - math.degrees(w * delay_s), abs=0.5)
    # the rest from the formula itself, on a grid so fine that nothing needs to be interpolated
    f = np.geomspace(50, 8000, 200001)
    exact = w / (2j * math.pi * f) * np.exp(-2j * math.pi * f * delay_s)
    closed = exact / (1 + exact)
    assert loop.lag_hz() == pytest.approx(f[np.argmax(np.unwrap(np.angle(closed)) < -math.pi / 2)], rel=0.01)
    assert loop.bandwidth_hz() == pytest.approx(f[np.argmax(np.abs(closed) < math.sqrt(0.5))], rel=0.01)
    assert loop.sensitivity_peak() == pytest.approx(np.abs(1 - closed).max(), rel=0.01)


def test_first_order_loop():
    """T = 1 / (1 + s / w): -3 dB at w, 45 degrees there, never 90; the margin of an integrator is 90 degrees."""
    hz = np.geomspace(50, 8000, 14)
    loop = loop_of(lambda s: 2 * math.pi * 900 / s, hz)
    assert loop.bandwidth_hz() == pytest.approx(900, rel=0.02)
    assert loop.lag_hz(45) == pytest.approx(900, rel=0.02) and loop.lag_hz() is None
    assert loop.phase_margin_deg() == pytest.approx(90, abs=0.01) and loop.sensitivity_peak() < 1


def test_a_loop_that_is_never_slow_enough_has_no_bandwidth():
    loop = signals.Loop(np.array([50.0, 500.0, 5000.0]), np.array([0.999, 0.99, 0.9], complex))
    assert loop.bandwidth_hz() is None and loop.lag_hz() is None and loop.crossover_hz() is None
    assert loop.phase_margin_deg() is None
