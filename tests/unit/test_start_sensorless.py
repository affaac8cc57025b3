# SPDX-License-Identifier: MIT
"""Starts without an encoder, step by step: what is refused, with which numbers, and who may go on all the same."""
import cmath
import math
import random

import pytest

from rigs.drive import World
from rigs.motor_numbers import compute, shipped
from rigs.searching import Searching, enough, regulating
from rigs.winding import BUS_STEPS

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


@pytest.mark.parametrize("source, follows", ((0, False), (1, True), (2, False)))
def test_the_current_loops_settings_are_followed_by_who_has_no_sensor(c, source, follows):
    def world():
        w = World(c).put("OPERATION_ENABLED")
        w.axis.tuning = compute(c, {**shipped(), "angle_source": source})[2]
        w.axis.loop.flux.margin_q8, w.axis.loop.source = 2000, c.LOOP_OBSERVER
        return w
    asked, followed, untouched = world(), world(), world()
    c.start_source_after(asked.axis)
    c.sensorless_follow(followed.axis)
    assert bytes(asked.axis.loop) == bytes((followed if follows else untouched).axis.loop)
    assert bytes(followed.axis.loop) != bytes(untouched.axis.loop)


def sweeping(w, radian):
    """At the sweep's last millisecond; the response by radian is half of this, its mean over eight angles 4/8 of it."""
    s = w.axis.injection
    s.angle, s.ms, s.sum_re, s.sum_im = 7, 6, 4 * radian, 0
    return w


@pytest.mark.parametrize("radian, percent", ((0, 0), (57, 99), (100, 174), (200, 349), (229, 400)))
def test_start_sensorless_says_how_much_the_current_tells_of_a_degree(c, starting, radian, percent):
    """In whole bits and hundredths of them: a 57th of what it tells of a radian. First the wiring is looked at once more."""
    w = sweeping(starting(True, SWEEP), radian)
    assert not c.start_sensorless_step(w.axis) and w.axis.faults.cause == c.FAULT_NONE
    assert w.axis.start.phase == c.START_WIRING and w.axis.loop.source == c.LOOP_OBSERVER
    c.start_sensorless_wired(w.axis)
    assert w.axis.faults.cause == c.FAULT_SALIENCY
    whole, hundredths = w.axis.faults.detail
    assert 0 <= hundredths < 100 and 100 * whole + hundredths == pytest.approx(percent, abs=1)


def test_start_sensorless_goes_on_where_the_current_tells_enough(c, starting):
    w = sweeping(starting(True, SWEEP), 232)
    assert not c.start_sensorless_step(w.axis) and w.axis.faults.cause == c.FAULT_NONE
    assert w.axis.injection.step == 1 and w.axis.start.phase == c.START_INJECTION
    assert c.start_sensorless_holds_voltage(w.axis), "it locks, and short windings brake"


def test_start_sensorless_forgets_the_refusal_with_the_next_start(c, starting):
    w = sweeping(starting(True, SWEEP), 100)
    c.start_sensorless_step(w.axis)
    c.start_begin(w.axis)
    c.start_sensorless_wired(w.axis)
    assert w.axis.faults.cause == c.FAULT_NONE and w.axis.start.phase == c.START_FIELD


def at_the_last_try(w):
    s = w.axis.injection
    s.tries, s.ms, s.i_q15 = 2, 4 * 24, 8192
    return w


def search_ends(c, w):
    """Pushes that turn nothing, each twice as long as the one before, come after the last try."""
    phase = w.axis.start.phase
    for _ in range(6000):
        if c.start_sensorless_step(w.axis) or w.axis.faults.cause or w.axis.start.phase != phase:
            return w.axis.start.phase != phase or w.axis.faults.cause != c.FAULT_NONE
    return False


def test_start_sensorless_says_how_long_it_pushed_a_rotor_that_does_not_move(c, starting):
    w = at_the_last_try(starting(True, POLARITY))
    assert search_ends(c, w) and w.axis.faults.cause == c.FAULT_POLARITY
    assert list(w.axis.faults.detail) == [256, 0]


@pytest.mark.parametrize("prepare, step", ((lambda w: sweeping(w, 100), SWEEP), (at_the_last_try, POLARITY)))
def test_start_sensorless_of_a_motor_that_a_field_can_hold_does_without(c, starting, prepare, step):
    w = prepare(starting(False, step))
    assert search_ends(c, w) and w.axis.faults.cause == c.FAULT_NONE
    assert w.axis.start.phase == c.START_FIELD and w.axis.loop.source == c.LOOP_OBSERVER and w.axis.loop.inject.track == 0
    assert c.start_sensorless_holds_voltage(w.axis)


@pytest.mark.parametrize("phase, holds", (("FIELD", True), ("INJECTION", False), ("CATCH", False), ("FOLLOW", False)))
def test_start_sensorless_holds_voltages_on_a_field_alone(c, starting, phase, holds):
    w = starting(True, SWEEP)
    w.axis.start.phase = getattr(c, f"START_{phase}")
    assert bool(c.start_sensorless_holds_voltage(w.axis)) == holds


# ---- a rotor that may turn ----

class Catching(Searching):
    """Its search is part of a start: a look is a step of that, and says whether operation may begin."""

    def look(self, current=0j):
        self.show(current)
        self.fabric.gate.STATUS = self.fabric.gate.CONTROL & 1
        return bool(self.c.start_sensorless_step(self.axis))


@pytest.fixture
def catching(c):
    def world(phase, reluctant=False):
        w = Catching(c)
        w.axis.tuning.reluctant, w.axis.start.phase = reluctant, getattr(c, f"START_{phase}")
        return w
    return world


def turning(w, degrees_a_ms):
    """Eleven pulses that show a rotor which turns by so much a millisecond, electrical."""
    return [w.look(cmath.rect(enough(w) * 1.5, math.radians(50 + degrees_a_ms * ms))) for ms in range(11)]


@pytest.mark.parametrize("degrees_a_ms", (2, -2))
def test_start_sensorless_of_a_rotor_that_turns_goes_straight_to_operation(c, catching, degrees_a_ms):
    w = catching("CATCH")
    assert turning(w, degrees_a_ms) == [False] * 10 + [True] and w.axis.faults.cause == c.FAULT_NONE
    assert w.axis.speed.speed_rpm_q4 / 16 == pytest.approx(degrees_a_ms * 1000 / 360 / 4 * 60, rel=0.1)


@pytest.mark.parametrize("degrees_a_ms", (2, -2))
def test_start_sensorless_of_a_reluctant_rotor_that_turns_is_refused(c, catching, degrees_a_ms):
    """With the counts by which it turns while the sensors' zeros are measured."""
    w = catching("CATCH", reluctant=True)
    assert not any(turning(w, degrees_a_ms)) and w.axis.faults.cause == c.FAULT_ROTOR_TURNING
    counts, turn = w.axis.faults.detail
    exact = abs(w.axis.speed.speed_rpm_q4) / 16 / 60 * 0.128 * 4000
    assert turn == 4000 and counts == pytest.approx(exact, abs=2) and counts > 5


@pytest.mark.parametrize("phase", ("CATCH", "CHECK_TURNING"))
def test_start_sensorless_of_a_rotor_that_stands(c, catching, phase):
    """Then its wiring is tried; or it was what the wiring was doubted for."""
    w = catching(phase)
    w.axis.start.suspected, w.axis.start.wiring.phase = c.FAULT_OPEN_PHASE, 2
    regulating(w, 0, 0)
    for ms in range(1, 34):
        assert w.axis.start.phase == getattr(c, f"START_{phase}") and w.axis.faults.cause == c.FAULT_NONE, ms
        assert not w.look()
    if phase == "CATCH":
        assert w.axis.start.phase == c.START_WIRING and w.axis.faults.cause == c.FAULT_NONE
    else:
        assert w.axis.faults.cause == c.FAULT_OPEN_PHASE and list(w.axis.faults.detail) == [2, 0]


def test_start_sensorless_of_a_rotor_that_turned_while_the_wiring_looked_wrong(c, catching):
    w = catching("CHECK_TURNING")
    w.axis.start.suspected = c.FAULT_OPEN_PHASE
    turning(w, 2)
    assert w.axis.faults.cause == c.FAULT_LOAD_TOO_HIGH and w.axis.faults.detail[1] == 0


ALIGN_ALONG = 2  # enum align_step of sensorless.c
VBUS_Q15 = 12000


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("scale", (0.8, 1.0, 1.4))
def test_start_sensorless_measures_the_resistance_finer_than_the_sensors_steps(c, seed, scale):
    """A step of the ADC is a twelfth of the difference of both currents, with noise of 0.8 steps: within 4 % all the same."""
    rng = random.Random(seed)
    w = World(c).put("SWITCHED_ON")
    a, lsb = w.axis, 16
    a.tuning = compute(c, {**shipped(), "angle_source": 1})[2]
    told_q12, observer_q5 = a.tuning.r_q12, a.tuning.observer.r_q5
    a.tuning.field.i_align_q15, a.tuning.field.align_ms = 12 * lsb * 4, 1000
    a.loop.vbus_q15 = VBUS_Q15
    c.sensorless_begin(a)
    a.sensorless.step = ALIGN_ALONG
    for _ in range(2 * 1000 + 1):
        i = a.sensorless.v_q23 / 256 * 4096 / (told_q12 * scale)
        a.loop.i_d_q15 = lsb * round(i / lsb + rng.gauss(0, 0.8))
        if c.sensorless_align(a):
            break
    else:
        pytest.fail("the start does not end")
    assert a.tuning.r_q12 == pytest.approx(told_q12 * scale, rel=0.04)
    assert a.tuning.observer.r_q5 == pytest.approx(observer_q5 * scale, rel=0.04)


@pytest.mark.parametrize("lost, volts", ((None, 0.1), (0, 0.1), (1, 0.1), (2, 0.1), (1, 0.02)))
def test_a_phase_that_carries_nothing_while_a_voltage_pulls_is_open(c, lost, volts):
    """Of a field along 90, 45 and 0 degrees; a current that follows a turned field late is none, nor one that dead time keeps
    from flowing where the voltage, a share of the bus, is next to nothing."""
    w = World(c).put("SWITCHED_ON")
    w.axis.tuning = compute(c, {**shipped(), "angle_source": 1})[2]
    w.axis.loop.source, w.axis.start.phase = c.LOOP_OBSERVER, c.START_FIELD
    c.sensorless_begin(w.axis)
    c.phase_watch_begin(w.axis)
    flows = 0j
    for ms in range(3 * w.axis.tuning.field.align_ms // 2):
        angle = w.axis.loop.field_angle_q32 / 2**32 * math.tau
        flows += (w.axis.tuning.field.i_align_q15 * cmath.exp(1j * angle) - flows) / 20  # L / R of 20 ms
        phases = [round((flows * cmath.exp(-1j * n * math.tau / 3)).real) for n in range(3)]
        if lost is not None:
            phases[lost] = 0
        w.fabric.adc.IA, w.fabric.adc.IB, w.fabric.adc.IC = phases
        w.axis.loop.i_d_q15, w.axis.loop.v_d_steps = round(abs(flows)), round(volts * BUS_STEPS)
        w.step()
        if w.axis.faults.cause:
            break
    lost = None if volts < 1 / 32 else lost
    assert (w.axis.faults.cause == c.FAULT_OPEN_PHASE) == (lost is not None)
    if lost is not None:
        assert w.axis.faults.detail[0] == lost + 1 and w.fabric.gate.CONTROL == 0
    else:
        assert ms == 3 * w.axis.tuning.field.align_ms // 2 - 1
