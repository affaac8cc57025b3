# SPDX-License-Identifier: MIT
"""Starts without an encoder, step by step: what is refused, with which numbers, and who may go on all the same."""
import pytest

from unit.test_state_machine import World
from unit.test_tuning import compute, shipped

SWEEP, POLARITY = 0, 2  # enum start_step of injection_start.c


@pytest.fixture
def starting(c):
    """A start by injection, in a step of it; of a motor that a field can hold, or of one that it cannot."""
    def world(reluctant, step):
        w = World(c).put("SWITCHED_ON")
        w.axis.tuning = compute(c, {**shipped(), "angle_source": 1})[2]
        w.axis.tuning.reluctant = reluctant
        w.axis.loop.source, w.axis.start.phase, w.axis.injection.step = c.LOOP_INJECTION, c.START_INJECTION, step
        return w
    return world


def sweeping(w, radian):
    """At the sweep's last millisecond; the response by radian is half of this, its mean over eight angles 4/8 of it."""
    s = w.axis.injection
    s.angle, s.ms, s.sum_re, s.sum_im = 7, 6, 4 * radian, 0
    return w


@pytest.mark.parametrize("radian, percent", ((0, 0), (57, 99), (100, 174), (200, 349), (229, 400)))
def test_start_sensorless_says_how_much_the_current_tells_of_a_degree(c, starting, radian, percent):
    """In whole bits and hundredths of them: a 57th of what it tells of a radian."""
    w = sweeping(starting(True, SWEEP), radian)
    assert not c.start_sensorless_step(w.axis) and w.axis.faults.cause == c.FAULT_SALIENCY
    whole, hundredths = w.axis.faults.detail
    assert 0 <= hundredths < 100 and 100 * whole + hundredths == pytest.approx(percent, abs=1)


def test_start_sensorless_goes_on_where_the_current_tells_enough(c, starting):
    w = sweeping(starting(True, SWEEP), 232)
    assert not c.start_sensorless_step(w.axis) and w.axis.faults.cause == c.FAULT_NONE
    assert w.axis.injection.step == 1 and w.axis.start.phase == c.START_INJECTION
    assert c.start_sensorless_holds_voltage(w.axis), "it locks, and short windings brake"


def at_the_last_try(w):
    s = w.axis.injection
    s.tries, s.ms, s.i_q15 = 2, 4 * 24, 8192
    return w


def test_start_sensorless_says_with_which_current_both_ends_were_alike(c, starting):
    w = at_the_last_try(starting(True, POLARITY))
    assert not c.start_sensorless_step(w.axis) and w.axis.faults.cause == c.FAULT_POLARITY
    assert list(w.axis.faults.detail) == [round(w.axis.params.i_range_ma / 4), 0]


@pytest.mark.parametrize("prepare, step", ((lambda w: sweeping(w, 100), SWEEP), (at_the_last_try, POLARITY)))
def test_start_sensorless_of_a_motor_that_a_field_can_hold_does_without(c, starting, prepare, step):
    w = prepare(starting(False, step))
    assert not c.start_sensorless_step(w.axis) and w.axis.faults.cause == c.FAULT_NONE
    assert w.axis.start.phase == c.START_FIELD and w.axis.loop.source == c.LOOP_OBSERVER and w.axis.loop.inject.track == 0
    assert c.start_sensorless_holds_voltage(w.axis)


@pytest.mark.parametrize("phase, holds", (("FIELD", True), ("INJECTION", False), ("CATCH", False), ("FOLLOW", False)))
def test_start_sensorless_holds_voltages_on_a_field_alone(c, starting, phase, holds):
    w = starting(True, SWEEP)
    w.axis.start.phase = getattr(c, f"START_{phase}")
    assert bool(c.start_sensorless_holds_voltage(w.axis)) == holds
