# SPDX-License-Identifier: MIT
"""A current sensor whose zero moves while the motor turns, against the motor in formulas; what only looks like it."""
import math

import pytest

from rigs.motor import Motor


def sensors(offset_q15=0, gain=1.0, seen=7, turning=lambda _: None):
    """One of them is off so. The current loop takes away what of it is a vector: a third of a zero stays, in each phase."""
    def see(m, see=Motor.see):
        turning(m)
        see(m)
        adc = m.fabric.adc
        adc.IB = round(adc.IB * gain)
        adc.IA, adc.IB, adc.IC = (value + offset_q15 // 3 for value in (adc.IA, adc.IB, adc.IC))
        adc.VALID = seen
    return see


@pytest.mark.parametrize("rpm, most_ms", ((2000, 300), (-2000, 300), (150, 700), (-40, 2100)))
@pytest.mark.parametrize("offset_q15", (1100, -3277))
def test_a_current_sensor_whose_zero_moves_is_named(motor, monkeypatch, rpm, most_ms, offset_q15):
    m = motor(rpm, 3.0)
    m.step(100)
    monkeypatch.setattr(Motor, "see", sensors(offset_q15))
    found_ms = m.until_fault(2 * most_ms)
    assert m.fault == "CURRENT_OFFSET" and 120 < found_ms <= 2 * most_ms
    told = m.axis.faults.detail[0] / m.p.i_range_ma * math.copysign(1, offset_q15)
    assert 1024 / 32768 < told < abs(offset_q15) / 32768 + 1e-3


@pytest.mark.parametrize("rpm", (2000, 150, -40, 0))
@pytest.mark.parametrize("wrong", ({"offset_q15": 950}, {"gain": 1.12}, {"gain": 0.88}, {"offset_q15": 3277, "seen": 5}))
def test_what_is_no_moved_zero_is_not_named_so(motor, monkeypatch, rpm, wrong):
    m = motor(rpm, 10.0)
    monkeypatch.setattr(Motor, "see", sensors(**wrong))
    m.step(3000)
    assert m.fault != "CURRENT_OFFSET"


def stands_then_turns(m):
    m.rpm = 0 if m.axis.time_ms % 4000 < 2000 else 750  # 50 Hz


def rocks(m):
    m.rpm = 60 * math.sin(m.axis.time_ms / 20)  # by some ten degrees, electrical


def turns_as_often_as_it_is_looked_at(m):
    m.rpm = 15030 if m.p.pole_pairs == 4 else 0  # 1002 Hz


@pytest.mark.parametrize("turning", (stands_then_turns, rocks, turns_as_often_as_it_is_looked_at))
@pytest.mark.parametrize("gain", (1.12, 0.88))
@pytest.mark.parametrize("counts", (100.0, 350.0, 600.0, 850.0))
def test_however_it_turns_a_gain_is_no_zero(c, motor, monkeypatch, turning, gain, counts):
    """By this watch alone: others may have something to say of such a shaft."""
    m = motor(0, 10.0)
    m.counts = counts
    monkeypatch.setattr(Motor, "see", sensors(gain=gain, turning=turning))
    for _ in range(6000):
        m.axis.time_ms += 1
        m.counts += m.rpm / 60000 * m.p.encoder_counts
        m.look()
        c.zero_watch_step(m.axis.supervision.zeros, m.axis)
        assert m.axis.reports.count == 0
