# SPDX-License-Identifier: MIT
"""Measurements on signals whose answer is known."""
import math

import numpy as np
import pytest

from launcher import LauncherError, signals

DT = 50e-6


def first_order(tau_s, length_s=0.05, start=1.0, final=5.0):
    t = np.arange(0, length_s, DT)
    return t, start + (final - start) * (1 - np.exp(-t / tau_s)), start, final


@pytest.mark.parametrize("tau_s", [0.4e-3, 1e-3, 3e-3])
def test_first_order_rise_and_bandwidth(tau_s):
    rise, overshoot = signals.step_response(*first_order(tau_s))
    assert rise == pytest.approx(tau_s * math.log(9), rel=0.01)
    assert overshoot < 0.01
    assert signals.bandwidth_from_step(*first_order(tau_s)) == pytest.approx(1 / (2 * math.pi * tau_s), rel=0.05)


@pytest.mark.parametrize("damping", [0.3, 0.5, 0.7])
def test_second_order_overshoot_and_bandwidth(damping):
    t = np.arange(0, 0.1, DT)
    wn = 2 * math.pi * 500
    wd = wn * math.sqrt(1 - damping ** 2)
    y = 1 - np.exp(-damping * wn * t) * (np.cos(wd * t) + damping * wn / wd * np.sin(wd * t))
    overshoot = signals.step_response(t, -2 * y, 0.0, -2.0)[1]
    assert overshoot == pytest.approx(100 * math.exp(-math.pi * damping / math.sqrt(1 - damping ** 2)), rel=0.02)
    ratio = math.sqrt(1 - 2 * damping ** 2 + math.sqrt((1 - 2 * damping ** 2) ** 2 + 1))
    assert signals.bandwidth_from_step(t, y, 0.0, 1.0) == pytest.approx(500 * ratio, rel=0.05)


def test_a_step_that_never_arrives_has_no_rise_time():
    t = np.arange(0, 0.01, DT)
    assert signals.step_response(t, 0.5 * np.ones_like(t), 0.0, 1.0)[0] is None
    with pytest.raises(LauncherError):
        signals.step_response(t, t, 1.0, 1.0)


@pytest.mark.parametrize("shares", [{5: 0.03, 7: 0.04}, {2: 0.05}, {40: 0.02}, {}])
@pytest.mark.parametrize("frequency_hz", [33.3, 100.0, -87.0])
def test_thd_of_known_harmonics(shares, frequency_hz):
    t = np.arange(0, 0.25, DT)
    angle = 2 * math.pi * frequency_hz * t + 0.7
    y = 7.1 * (np.sin(angle) + sum(share * np.sin(order * angle + order) for order, share in shares.items()))
    expected = 100 * math.sqrt(sum(share ** 2 for share in shares.values()))
    assert signals.thd_percent(y, angle) == pytest.approx(expected, rel=0.03, abs=0.02)


def test_thd_does_not_care_about_a_change_of_speed():
    t = np.arange(0, 0.25, DT)
    angle = 2 * math.pi * (100 * t + 40 * t ** 2)
    assert signals.thd_percent(np.sin(angle) + 0.03 * np.sin(5 * angle), angle) == pytest.approx(3.0, rel=0.05)


def test_thd_needs_a_whole_period():
    angle = np.linspace(0, 6, 100)
    with pytest.raises(LauncherError, match="less than one electrical period"):
        signals.thd_percent(np.sin(angle), angle)


def test_settling_time():
    t = np.arange(0, 1, 0.001)
    error = np.exp(-t / 0.1)
    assert signals.settling_time(t, error, 0.01) == pytest.approx(0.1 * math.log(100), abs=0.002)
    assert signals.settling_time(t, error * 0, 0.01) == 0.0
    assert signals.settling_time(t, error + 1, 0.01) is None
    assert signals.settling_time(t, np.where(t == 0.5, 1.0, 0.0), 0.1) == pytest.approx(0.501, abs=0.0015)
