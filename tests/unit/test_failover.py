# SPDX-License-Identifier: MIT
"""Carrying on without the encoder: when, by which angle, and what else it comes to."""
import pytest

from rigs.carrying import ADC_CURRENT, CAUSES, ENCODER_BIT, Carrying, observer_leads
from rigs.motor import CLOCKS, slip

FALL_BACK = {"ENCODER_COUNTS": "QUICK_STOP"}  # of the others the class knows none but off


@pytest.fixture(params=(1, 2), ids=("once", "twice"))
def motor(c, request):
    """Whatever is reported comes once, or in two steps."""
    def made(*args, **params):
        m = Carrying(c, *args, **params)
        m.times = request.param
        return m
    return made


@pytest.mark.parametrize("rpm", (3000, -3000))
@pytest.mark.parametrize("cause", CAUSES[1:])
def test_at_speed_the_observer_leads_a_millisecond_later_with_a_warning(motor, cause, rpm):
    m = motor(rpm)
    m.report(cause)
    assert m.axis.loop.source == m.c.LOOP_OBSERVER and m.axis.loop.field_follows == 0, "the frame turns by itself until then"
    m.slow_step()
    assert observer_leads(m) and m.state == "OPERATION_ENABLED" and m.fault == "NONE" and m.fabric.gate.CONTROL == 1
    assert m.warned(cause) and m.axis.failover.cause == m.c.enums["fault"]["FAULT_" + cause]
    assert m.axis.loop.pll.speed_q32 == pytest.approx(m.hz / 20000 * 2**32, rel=0.01)
    assert m.axis.speed.target_rpm_q16 == rpm << 16 and m.axis.speed.ref_rpm_q16 == rpm << 16


@pytest.mark.parametrize("cause", CAUSES[1:])
def test_below_the_observers_reach_it_is_a_stop_where_there_is_one_or_off(motor, cause):
    m = motor(100)
    m.report(cause)
    m.slow_step()
    assert m.fault == cause and not m.warned(cause) and m.axis.loop.source == m.c.LOOP_ENCODER
    assert m.state == FALL_BACK.get(cause, "FAULT_REACTION") and m.fabric.gate.CONTROL == (cause in FALL_BACK)


@pytest.mark.parametrize("way", (1, -1))
def test_a_dead_encoder_was_at_its_last_edge_half_a_count_before_the_middle(c, motor, way):
    m, seed = motor(3000), c.rotor_seed()
    encoder, scale = m.fabric.encoder, m.axis.loop.encoder_scale_q32
    encoder.LATCHED, encoder.EDGE_TIME, m.axis.loop.angle_offset_q32 = 1234, 987654, 0xF0000000
    m.axis.supervision.encoder.speed_moving_q32 = way * 5_000_000
    for seed_of in (c.encoder_watch_seed, c.encoder_watch_seed_at_sample):
        seed_of(m.axis, c.FAULT_ENCODER_DEAD, seed)
        expected = (1234 * scale + 0xF0000000 - way * (scale // 2)) % 2**32
        assert (seed.angle_q32, seed.clock, seed.speed_q32) == (expected, 987654, way * 5_000_000)


FORBIDDEN = {
    "position": lambda m: setattr(m.axis, "mode", m.c.AXIS_MODE_POSITION),
    "cyclic speed": lambda m: setattr(m.axis, "mode", m.c.AXIS_MODE_CYCLIC_SPEED),
    "homing": lambda m: setattr(m.axis, "mode", m.c.AXIS_MODE_HOMING),
    "stopping": lambda m: setattr(m.axis, "state", m.c.AXIS_QUICK_STOP),
    "weakened field": lambda m: setattr(m.axis.tuning, "weakens", True),
    "no observer": lambda m: setattr(m.axis.tuning.observer, "usable", False),
    "not chosen": lambda m: m.axis.reactions.choice.__setitem__(m.c.FAULT_ENCODER_SLIP, m.c.REACTION_OFF),
}


@pytest.mark.parametrize("why", FORBIDDEN)
def test_where_it_may_not_carry_on_nothing_has_changed_but_the_fault(motor, why):
    m = motor()
    FORBIDDEN[why](m)
    m.report("ENCODER_SLIP")
    assert m.fault == "ENCODER_SLIP" and m.fabric.gate.CONTROL == 0 and m.axis.loop.source == m.c.LOOP_ENCODER


def test_of_torque_control_the_observer_leads_as_well(motor):
    m = motor()
    m.axis.mode, m.axis.torque_command_q15 = m.c.AXIS_MODE_TORQUE, 2000
    m.report("ENCODER_DEAD")
    m.slow_step()
    assert observer_leads(m) and m.axis.loop.i_q_ref_q15 == 2000


# ---- the angle ----


def step_until_carried(m, happens, most):
    """Steps in each of which the encoder suffers that, until the drive goes on without."""
    for _ in range(most):
        m.step(1, happens)
        if m.axis.failover.pending:
            break


@pytest.mark.parametrize("rpm", (3000, -3000, 1500))
@pytest.mark.parametrize("degrees", (30, -90, 120, 180))
def test_after_a_slip_the_frame_is_where_it_was_before(motor, degrees, rpm):
    m = motor(rpm)
    jump = slip(degrees)
    step_until_carried(m, jump, 4)
    assert m.axis.failover.pending == m.c.FAULT_ENCODER_SLIP and abs(m.degrees_off) < 3


@pytest.mark.parametrize("rpm", (3000, -3000))
def test_of_counts_that_stand_the_last_edge_tells(motor, rpm):
    """Within half a count, that is within which a rotor may be, and the half of the drive's period in which its edge came."""
    m = motor(rpm)

    def freeze(world):
        world.frozen = True

    step_until_carried(m, freeze, 20)
    assert m.axis.failover.pending == m.c.FAULT_ENCODER_DEAD and abs(m.degrees_off) < 5


@pytest.mark.parametrize("rpm", (3000, -3000))
def test_of_counts_lost_one_by_one_the_emf_tells(motor, rpm):
    m = motor(rpm, 2.0 if rpm > 0 else -2.0)

    def lose(world):
        world.slip -= 1

    step_until_carried(m, lose, 400)
    lost_deg = -m.slip * 360 * m.p.pole_pairs / m.p.encoder_counts
    assert m.axis.failover.pending == m.c.FAULT_ENCODER_SLIP and lost_deg > 11 and abs(m.degrees_off) < 6


@pytest.mark.parametrize("reluctant, off_deg", ((False, 0), (True, -30)))
def test_an_index_elsewhere_is_wrong_where_the_emf_agrees_with_the_count_unless_it_cannot_tell(motor, reluctant, off_deg):
    m = motor()
    m.axis.tuning.reluctant = reluctant
    m.axis.supervision.encoder.index_drift = round(30 / 360 / m.p.pole_pairs * m.p.encoder_counts)
    m.report("ENCODER_COUNTS")
    assert m.degrees_off == pytest.approx(off_deg, abs=2)


# ---- found in the interrupt ----


def test_lines_that_are_lost_are_left_at_once_and_the_bridge_stays_on(motor):
    m = motor()
    m.sample_fault(gate=ENCODER_BIT)
    assert m.axis.failover.pending == m.c.FAULT_ENCODER and m.fabric.gate.CONTROL == 1 and abs(m.degrees_off) < 1
    m.sample_fault(gate=ENCODER_BIT)
    assert m.fault == "NONE", "the encoder counts for nothing from then on"
    m.slow_step()
    assert observer_leads(m) and m.warned("ENCODER") and m.state == "OPERATION_ENABLED"


def test_lines_that_are_lost_below_the_reach_are_the_fault_a_millisecond_later(motor):
    m = motor(100)
    m.sample_fault(gate=ENCODER_BIT)
    m.slow_step()
    assert m.fault == "ENCODER" and m.fabric.gate.CONTROL == 0 and m.state == "FAULT_REACTION"


def tripped(m, amperes=0.0):
    """A slip of which the slow loop does not know yet, and the current that comes of it; then so much is left."""
    slip(90)(m)
    m.counts += m.rpm / 60000 * m.p.encoder_counts / 2
    m.fabric.encoder.LATCH_TIME += CLOCKS // 2
    m.see()
    m.sample_fault(adc=ADC_CURRENT)
    m.fabric.adc.IA = m.ampere(amperes)
    m.fabric.adc.IB = m.fabric.adc.IC = -m.fabric.adc.IA // 2
    return m


def test_a_slip_that_trips_the_current_opens_the_gates_again_once_it_has_faded(motor):
    m = tripped(motor(), 8.0)
    assert m.fabric.gate.CONTROL == 0 and m.fault == "NONE" and m.axis.failover.pending == m.c.FAULT_ENCODER_SLIP
    m.slow_step()
    assert m.fabric.gate.CONTROL == 0 and m.fault == "NONE"
    m.fabric.adc.IA = m.fabric.adc.IB = m.fabric.adc.IC = 0
    m.slow_step()
    assert m.fabric.gate.CONTROL == 1 and observer_leads(m) and m.warned("ENCODER_SLIP") and m.state == "OPERATION_ENABLED"


@pytest.mark.parametrize("phase", range(3))
@pytest.mark.parametrize("sign", (1, -1))
@pytest.mark.parametrize("faded", (False, True))
def test_a_current_that_does_not_fade_is_not_the_encoders_to_carry_on_from(motor, phase, sign, faded):
    """An eighth of i_max in any phase, either way, is too much; a step less is not."""
    m = tripped(motor())
    currents = [-sign * (m.axis.tuning.i_max_q15 // 16)] * 3
    currents[phase] = sign * (m.axis.tuning.i_max_q15 // 8 - faded)
    m.fabric.adc.IA, m.fabric.adc.IB, m.fabric.adc.IC = currents
    for _ in range(4):
        m.slow_step()
    assert m.fault == ("NONE" if faded else "ENCODER_SLIP") and m.fabric.gate.CONTROL == faded == m.warned("ENCODER_SLIP")


def test_off_comes_before_what_waits(motor):
    m = tripped(motor())
    m.axis.request = m.c.AXIS_REQUEST_OFF
    m.axis.state = m.c.AXIS_QUICK_STOP
    m.slow_step()
    assert m.fabric.gate.CONTROL == 0 and m.axis.failover.pending == 0 and m.state == "SWITCH_ON_DISABLED"


def test_off_in_operation_does_not_open_the_gates_once_more(motor):
    """The bridge waits for the current to fade, and would go on without the encoder in this very step."""
    m = tripped(motor())
    source = m.axis.tuning.angle_source
    for _ in range(3):
        m.axis.request = m.c.AXIS_REQUEST_OFF
        m.slow_step()
        assert (m.axis.failover.cause, m.axis.failover.pending, m.axis.tuning.angle_source) == (0, 0, source)
        assert m.fabric.gate.CONTROL == 0 and m.state == "SWITCH_ON_DISABLED"


def test_a_trip_in_the_millisecond_of_the_take_over_is_carried_on_from_with_the_gates_off(motor):
    m = motor()
    m.report("ENCODER_SLIP")
    m.sample_fault(adc=ADC_CURRENT)
    assert m.fabric.gate.CONTROL == 0 and m.fault == "NONE"
    m.fabric.adc.IA = m.fabric.adc.IB = m.fabric.adc.IC = 0
    m.slow_step()
    assert m.fabric.gate.CONTROL == 1 and observer_leads(m) and m.warned("ENCODER_SLIP") and m.fault == "NONE"
    m.sample_fault(adc=ADC_CURRENT)
    assert m.fault == "OVERCURRENT" and m.fabric.gate.CONTROL == 0


# ---- and later ----


def carried(m):
    m.report("ENCODER_DEAD")
    m.slow_step()
    assert observer_leads(m)
    return m


@pytest.mark.parametrize("lost", ("LOCK_LOST", "OUT_OF_STEP"))
def test_a_rotor_that_the_observer_loses_is_the_encoders_fault_and_not_tried_again(motor, lost):
    m = carried(motor(retry_count=5, retry_delay_ms=10))
    m.report(lost)
    for _ in range(60):
        m.c.drive_retry(m.axis)
        m.slow_step()
    assert m.fault == "ENCODER_DEAD" and m.state == "FAULT"


def test_another_fault_keeps_its_name_and_is_not_tried_again_by_the_encoder(motor):
    m = carried(motor(retry_count=5, retry_delay_ms=10))
    m.c.fault_raise(m.axis, m.c.FAULT_UNDERVOLTAGE)
    for _ in range(60):
        m.c.drive_retry(m.axis)
        m.slow_step()
    assert m.fault == "UNDERVOLTAGE" and m.state == "FAULT"


def test_a_reluctant_rotor_does_not_hang_on_a_field_and_is_given_up(motor):
    m = carried(motor())
    m.axis.tuning.reluctant = True
    m.axis.sensorless.weak_ms, m.axis.loop.flux.margin_q8 = 100, 0
    m.c.sensorless_after_control(m.axis)
    m.c.reaction_step(m.axis)
    assert m.fault == "ENCODER_DEAD" and m.fabric.gate.CONTROL == 0


@pytest.mark.parametrize("margin, rho, leaves", ((2.9, 0.0, True), (3.1, 0.0, False), (5.9, 0.28, True), (5.9, -0.28, True),
                                                 (5.9, 0.26, False), (6.1, 0.28, False)))
def test_the_field_takes_over_from_an_observer_that_sees_little_or_whose_flux_is_off(motor, margin, rho, leaves):
    """Within 8 ms: 2 before the flux, off by 0.3, would count as lost."""
    m = carried(motor())
    m.axis.sensorless.extra_q15 = 0
    for _ in range(8):
        assert m.axis.loop.field_follows != 0
        m.axis.loop.flux.margin_q8, m.axis.loop.flux.rho_q15 = round(margin * 256), round(rho * 32768)
        m.c.sensorless_after_control(m.axis)
    assert (m.axis.loop.field_follows == 0) == leaves and m.fault == "NONE"


def test_on_begins_with_the_encoder_and_an_alignment(motor):
    m = carried(motor())
    assert not m.axis.start.aligned
    m.axis.request = m.c.AXIS_REQUEST_OFF
    for _ in range(2):
        m.slow_step()
    assert m.c.switch_on_at_once(m.axis).error == m.c.ERROR_NONE
    m.slow_step()
    assert m.axis.tuning.angle_source == m.c.PARAM_ANGLE_ENCODER and not m.axis.start.aligned
    assert m.axis.failover.cause == m.c.FAULT_NONE and not m.warned("ENCODER_DEAD")
