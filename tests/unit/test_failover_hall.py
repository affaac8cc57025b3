# SPDX-License-Identifier: MIT
"""Carrying on without the Hall switches: by which angle, from where on, and what else it comes to."""
import pytest

from rigs.carrying import ADC_CURRENT, observer_leads
from rigs.hall_motor import HallMotor, intact, open_wire
from rigs.hall_rotor import IDEAL, TURN

NEAR_DEG = 3


@pytest.fixture(params=(1, 2), ids=("once", "twice"))
def motor(c, request):
    """Whatever is reported comes once, or in two steps."""
    def made(*args, **params):
        m = HallMotor(c, *args, **params)
        m.times = request.param
        return m
    return made


@pytest.mark.parametrize("rpm", (3000, -3000, 1500))
def test_switches_that_tell_the_truth_are_in_no_doubt_and_the_sound_rotor_is_theirs(motor, rpm):
    m = motor(rpm)
    for _ in range(40):
        m.step()
        sound = m.axis.hall_watch.sound
        assert m.axis.hall_watch.suspect_ms == 0 and m.fault == "NONE"
        assert abs((sound.angle_q32 / TURN - m.turns + 0.5) % 1 - 0.5) * 360 < NEAR_DEG
        assert sound.speed_q32 == pytest.approx(m.hz / 20000 * TURN, rel=0.01)


@pytest.mark.parametrize("rpm", (3000, -3000, 1500))
@pytest.mark.parametrize("wire", "ABC")
@pytest.mark.parametrize("after", range(0, 21, 2))
def test_wherever_a_wire_breaks_the_frame_is_put_where_the_rotor_is(motor, wire, rpm, after):
    m = motor(rpm)
    m.step(after)
    m.wires = open_wire(wire)
    m.until_carried(30)
    assert m.axis.failover.pending in (m.c.FAULT_HALL_INVALID, m.c.FAULT_HALL_SEQUENCE) and m.fault == "NONE"
    assert m.axis.loop.source == m.c.LOOP_OBSERVER and m.axis.loop.field_follows == 0 and m.fabric.gate.CONTROL == 1
    assert abs(m.degrees_off) < 21, "an edge that is 15 degrees out of place may be one of a rotor that is"


def test_a_sector_that_is_skipped_is_carried_on_from_as_well(motor):
    m = motor()
    m.wires = lambda state: IDEAL[(IDEAL.index(state) + 2) % 6]
    m.until_carried(30)
    assert m.axis.failover.pending == m.c.FAULT_HALL_SEQUENCE and abs(m.degrees_off) < NEAR_DEG


WIRE_B = {3000: "HALL_INVALID", -3000: "HALL_SEQUENCE"}  # by where the rotor stands


def carried(m):
    m.wires = open_wire("B")
    m.until_carried(30)
    m.slow_step()
    return m


@pytest.mark.parametrize("rpm", (3000, -3000))
def test_a_millisecond_later_the_observer_leads_with_a_warning(motor, rpm):
    m = carried(motor(rpm))
    assert observer_leads(m) and m.warned(WIRE_B[rpm]) and m.state == "OPERATION_ENABLED" and m.fault == "NONE"
    assert m.axis.tuning.speed_ki_min_q16 == 0
    assert m.axis.loop.pll.speed_q32 == pytest.approx(m.hz / 20000 * TURN, rel=0.02)
    assert m.axis.speed.target_rpm_q16 == rpm << 16 and m.axis.speed.speed_rpm_q4 == pytest.approx(16 * rpm, rel=0.02)


def test_the_speed_loop_remembers_the_torque_from_before_the_doubt(motor):
    m = motor()
    m.axis.speed.integral_q29 = 12345 << 14
    m.step()
    m.wires = lambda state: IDEAL[(IDEAL.index(state) + 1) % 6]  # an edge that nobody could have expected
    m.step()
    assert m.axis.hall_watch.suspect_ms == 1
    m.axis.speed.integral_q29 = -1
    m.step()
    assert m.axis.hall_watch.suspect_ms == 2
    assert m.c.hall_watch_torque_q29(m.axis) == 12345 << 14
    m.wires = intact
    m.step(6)
    assert m.c.hall_watch_torque_q29(m.axis) == -1 and m.axis.hall_watch.suspect_ms == 0


def test_while_the_frame_turns_by_itself_its_speed_is_the_rotors_and_nothing_else_is_found(motor):
    m = motor()
    m.wires = open_wire("B")
    m.until_carried(30)
    m.c.rotor_take_speed(m.axis)
    assert m.axis.speed.speed_rpm_q4 == pytest.approx(16 * 3000, rel=0.02)
    m.axis.supervision.speed.stalled_ms = 10**6
    m.c.supervision_step(m.axis)
    m.c.reaction_step(m.axis)
    assert m.fault == "NONE"


def test_in_doubt_for_an_electrical_turn_the_switches_are_believed(motor):
    m = motor()
    m.turns += 0.15  # a shaft that was jerked, if there is such a thing
    ms = 0
    while m.axis.hall_watch.suspect_ms or ms == 0:
        m.step()
        ms += 1
        assert not m.axis.faults.cause
    assert 3 < ms < 8, "at 200 Hz"


def test_a_doubt_that_began_with_a_slow_rotor_ends_with_a_turn_of_a_quick_one(motor):
    m = motor()
    m.axis.hall_watch.sound.speed_q32 = 1000
    m.step()
    assert m.axis.hall_watch.suspect_ms == 1
    m.step(7)
    assert m.axis.hall_watch.suspect_ms == 0
    assert m.axis.hall_watch.sound.speed_q32 == pytest.approx(m.hz / 20000 * TURN, rel=0.01)


FORBIDDEN = {
    "position": lambda m: setattr(m.axis, "mode", m.c.AXIS_MODE_CYCLIC_SPEED),
    "stopping": lambda m: setattr(m.axis, "state", m.c.AXIS_QUICK_STOP),
    "no observer": lambda m: setattr(m.axis.tuning.observer, "usable", False),
    "not chosen": lambda m: m.axis.reactions.choice.__setitem__(m.c.FAULT_HALL_INVALID, m.c.REACTION_OFF),
}


@pytest.mark.parametrize("why", FORBIDDEN)
def test_where_it_may_not_carry_on_it_is_off_with_the_switches_fault(motor, why):
    m = motor()
    FORBIDDEN[why](m)
    m.wires = open_wire("B")
    m.until_carried(30)
    assert m.fault == "HALL_INVALID" and m.fabric.gate.CONTROL == 0 and m.axis.loop.source == m.c.LOOP_HALL


def test_below_the_observers_reach_it_is_off_with_the_switches_fault(motor):
    m = motor(100)
    m.wires = open_wire("B")
    m.until_carried(300)
    assert m.fault == "HALL_INVALID" and m.fabric.gate.CONTROL == 0 and not m.warned("HALL_INVALID")


# ---- an over-current ----


@pytest.mark.parametrize("states, carries", ((1, True), (0, False)))
def test_an_over_current_behind_an_edge_out_of_place_is_carried_on_from_with_the_gates_off(motor, states, carries):
    """And any other is an over-current."""
    m = motor()
    m.wires = lambda state: IDEAL[(IDEAL.index(state) + states) % 6]
    m.samples(3)
    m.sample_fault(adc=ADC_CURRENT)
    assert m.fabric.gate.CONTROL == 0
    if carries:
        assert m.fault == "NONE" and m.axis.failover.pending == m.c.FAULT_HALL_SEQUENCE
        m.fabric.adc.IA = m.fabric.adc.IB = m.fabric.adc.IC = 0
        m.slow_step()
        assert m.fabric.gate.CONTROL == 1 and observer_leads(m) and m.warned("HALL_SEQUENCE")
    else:
        assert m.fault == "OVERCURRENT"


def test_an_over_current_is_one_where_nothing_is_carried_on_from(motor):
    m = motor()
    m.axis.reactions.choice[m.c.FAULT_HALL_SEQUENCE] = m.c.REACTION_OFF
    m.wires = lambda state: IDEAL[(IDEAL.index(state) + 1) % 6]
    m.samples(3)
    m.sample_fault(adc=ADC_CURRENT)
    assert m.fault == "OVERCURRENT" and m.fabric.gate.CONTROL == 0


# ---- and later ----


@pytest.mark.parametrize("lost", ("LOCK_LOST", "OUT_OF_STEP"))
def test_a_rotor_that_the_observer_loses_is_the_switches_fault_and_not_tried_again(motor, lost):
    m = carried(motor(retry_count=5, retry_delay_ms=10))
    m.report(lost)
    for _ in range(60):
        m.c.drive_retry(m.axis)
        m.slow_step()
    assert m.fault == "HALL_INVALID" and m.state == "FAULT"


def test_on_begins_with_the_switches(motor):
    m = carried(motor())
    m.axis.request = m.c.AXIS_REQUEST_OFF
    for _ in range(2):
        m.slow_step()
    assert m.c.switch_on_at_once(m.axis).error == m.c.ERROR_NONE
    m.slow_step()
    assert m.axis.tuning.angle_source == m.c.PARAM_ANGLE_HALL and m.axis.failover.cause == m.c.FAULT_NONE
