# SPDX-License-Identifier: MIT
"""Supervision against a motor in formulas: turning without error nothing is found, with one error the fault of its name."""
import math

import pytest

from rigs.motor import BASE_HZ, Motor, slip


@pytest.mark.parametrize("inertia_gmm2", (500, 8000, 100000))
def test_below_what_speed_a_still_encoder_may_be_a_shaft_at_rest(c, motor, inertia_gmm2):
    """What the largest current stops within 4 ms, and a twentieth of the largest speed."""
    seen = motor(inertia_gmm2=inertia_gmm2)
    p, watch = seen.p, seen.axis.supervision.encoder
    torque_nm = 1.5 * p.pole_pairs * p.flux_uwb * 1e-6 * p.i_max_ma * 1e-3
    in_4_ms_rpm = 0.004 * torque_nm / (inertia_gmm2 * 1e-9) * 60 / math.tau
    rpm = max(in_4_ms_rpm, p.speed_max_rpm / 20)
    w_q15 = min(rpm * seen.axis.tuning.overspeed_w_q15 / p.overspeed_rpm, 32767)
    assert watch.dead_w_q15 == pytest.approx(w_q15, rel=0.03, abs=2)


@pytest.mark.parametrize("rpm", (4000, -4000, 1500, 400, -30, 0))
@pytest.mark.parametrize("i_a", (0.0, 7.1, -10.0))
@pytest.mark.parametrize("told", ({}, {"resistance_mohm": 720}, {"resistance_mohm": 180}, {"flux_uwb": 12790},
                                  {"flux_uwb": 3197}, {"ld_uh": 400, "lq_uh": 400}, {"ld_uh": 100, "lq_uh": 100}))
def test_a_good_motor_runs_on_whatever_the_drive_was_told(motor, rpm, i_a, told):
    m = motor(rpm, i_a, **told)
    m.step(700)
    assert m.fault == "NONE" and m.axis.supervision.encoder.suspect_ms == 0 and not any(m.axis.reports.warned)


@pytest.mark.parametrize("degrees", (30, -30, 60, 90, -120, 180))
@pytest.mark.parametrize("rpm, i_a", ((4000, 7.1), (-4000, -7.1), (2000, 2.0), (400, 7.1), (-400, 0.3)))
def test_a_slip_is_found_within_four_milliseconds_at_any_speed(motor, degrees, rpm, i_a):
    m = motor(rpm, i_a)
    m.step(600)
    assert m.until_fault(4, slip(degrees)) and m.fault == "ENCODER_SLIP"
    assert m.fabric.gate.CONTROL == 0
    found = m.axis.faults.detail[0]
    assert min(abs(found - degrees), abs(abs(found) - abs(degrees))) <= 2


def test_a_jump_where_the_emf_cannot_tell_is_believed_at_once(motor):
    m = motor(200, 7.1).step(50)
    assert m.until_fault(2, slip(60)) and m.fault == "ENCODER_SLIP"


def test_a_shaft_that_rings_on_its_coupling_has_not_lost_counts(motor):
    """The swing grows by a seventh each millisecond, and fades; the observer follows a millisecond late."""
    m = motor(0, 0.0, flux_uwb=600)
    m.psi = 600e-6  # at these speeds the EMF tells nothing
    m.step(20)
    begun, surprises = m.axis.time_ms, []

    def swings(world):
        ms = world.axis.time_ms - begun
        size_rpm = min(800, 50 * 1.15 ** ms, 50 * 1.15 ** (150 - ms))
        world.shown_rpm, world.rpm = world.rpm, size_rpm * math.sin(math.tau * 0.45 * ms)
        surprises.append(abs(world.rpm - world.shown_rpm) / 60000 * world.p.pole_pairs * 360)

    assert m.until_fault(200, swings) is None and max(surprises) > 30, "more than what is a jump at other times"
    m.rpm = m.shown_rpm = 0
    m.step(20)
    assert m.until_fault(2, slip(30)) and m.fault == "ENCODER_SLIP", "and then a jump is one again"


@pytest.mark.parametrize("sign", (1, -1))
def test_full_current_and_no_motion_for_half_a_second(motor, sign):
    m = motor(0, 10.6 * sign)
    m.axis.speed.speed_ref_rpm_q4 = 100 * 16 * sign
    m.at_limit = True
    assert 495 <= m.until_fault(520) <= 505 and m.fault == "STALL"


@pytest.mark.parametrize("sign", (1, -1))
@pytest.mark.parametrize("end_rpm, fault", ((0, "STALL"), (-600, "SPEED_DEVIATION")))
def test_what_stops_the_shaft_at_once_and_holds_it_is_an_end_stop(motor, sign, end_rpm, fault):
    """And what turns it round is a load, either way."""
    m = motor(1000 * sign, 10.6 * sign).step(200)
    m.at_limit = True

    def stopped(world):
        world.rpm = sign * max(sign * world.rpm - 200, end_rpm)

    assert m.until_fault(400, stopped) and m.fault == fault


@pytest.mark.parametrize("sign", (1, -1))
@pytest.mark.parametrize("turned_deg, verdict", ((0, "AGREES"), (180, "REVERSED")))
def test_the_voltage_that_moves_a_current_is_no_reversed_rotor(motor, turned_deg, verdict, sign):
    """L di/dt, larger than the EMF and against it, for as long as the current moves; then a reversed rotor shows again."""
    m = motor(2000 * sign, 9.0 * sign, resistance_mohm=50, lq_uh=2000, ld_uh=2000)
    m.r, m.lq = 0.05, 2e-3
    emf, fell_v = m.c.emf(), m.lq * 4.0 / 1e-3
    m.c.emf_reset(emf, m.axis.tuning)

    def look():
        m.see()
        w_q15 = round(m.hz / BASE_HZ * 32768)
        m.c.emf_step(emf, m.axis.loop, m.axis.tuning, w_q15, w_q15)
        return m.c.emf_judge(emf, sign < 0)

    look()
    assert fell_v > 1.4 * 2 * math.pi * abs(m.hz) * m.psi
    m.extra_v = -fell_v * sign
    for _ in range(4):
        m.i_a -= 4.0 * sign
        assert look() == m.c.EMF_AGREES
    assert emf.filtered.q_q15 * sign < -emf.uncertain_q15, "without it this would be called reversed"
    m.extra_v = 0.0
    slip(turned_deg)(m)
    assert [look() for _ in range(4)][-1] == getattr(m.c, f"EMF_{verdict}")


@pytest.mark.parametrize("sign", (1, -1))
def test_a_shaft_that_is_turned_by_somebody_else_is_no_slip(motor, sign):
    """It jumps to another speed, and the EMF goes along."""
    m = motor(1500 * sign, 0.0)
    m.step(50)
    m.rpm = 3500 * sign
    m.axis.speed.speed_ref_rpm_q4 = 3500 * 16 * sign
    assert m.until_fault(1) is None and m.axis.supervision.encoder.suspect_ms > 0, "it did jump"
    assert m.step(6).axis.supervision.encoder.suspect_ms == 1, "eight milliseconds in all"
    m.step(30)
    assert m.fault == "NONE"


@pytest.mark.parametrize("turn", range(4))
@pytest.mark.parametrize("rpm, i_a, within_ms, at_limit", (
    (4000, 3.0, 3, False), (4000, 10.0, 3, False), (-4000, 10.0, 3, False), (400, 3.0, 5, False), (400, 3.0, 6, True),
    (-400, -3.0, 6, True)))
def test_a_frozen_encoder_is_dead(motor, rpm, i_a, within_ms, at_limit, turn):
    """With the current at its limit the speed seems to be lost first, or not, as the turns of supervision fall."""
    m = motor(rpm, i_a)
    m.at_limit = at_limit
    m.step(48 + turn)
    shown = [rpm]

    def freeze(world):
        shown[0] *= 0.3  # as the observer's speed runs out
        world.frozen, world.shown_rpm = True, shown[0]

    assert m.until_fault(within_ms, freeze) and m.fault == "ENCODER_DEAD"


@pytest.mark.parametrize("sign", (1, -1))
def test_in_doubt_no_other_fault_is_believed(motor, sign):
    """A slip of half a turn makes the observer's speed beyond any limit for some milliseconds."""
    m = motor(4000 * sign, 7.1 * sign)
    m.step(600)
    m.shown_rpm = 7500 * sign
    assert m.until_fault(4, slip(180)) and m.fault == "ENCODER_SLIP"


def pulse(m, at):
    m.fabric.encoder.INDEX = at % m.p.encoder_counts


@pytest.mark.parametrize("sign", (1, -1))
@pytest.mark.parametrize("off, found", ((0, False), (2, False), (-2, False), (3, True), (-40, True)))
def test_the_index_comes_after_whole_turns(motor, off, found, sign):
    m = motor(1500 * sign, 1.0 * sign)
    for at in (1000, 1000 + off):
        m.step(40)
        pulse(m, at)
    m.step(4)
    assert (m.fault == "ENCODER_COUNTS") == found
    assert not found or m.axis.faults.detail[1] == m.p.encoder_counts + sign * off


def test_a_pulse_has_a_place_for_each_direction_and_does_not_wander(motor):
    m = motor(1500, 1.0)
    m.step(8)
    pulse(m, 1000)
    m.step(8)
    m.rpm = m.shown_rpm = -1500
    m.axis.speed.speed_ref_rpm_q4 = -1500 * 16
    m.axis.supervision.encoder.speed_q32 *= -1
    m.step(8)
    pulse(m, 1040)
    m.step(8)
    assert m.fault == "NONE", "the pulse is 40 counts wide"
    for at in (1042, 1044, 1046):
        pulse(m, at)
        m.step(8)
    assert m.fault == "ENCODER_COUNTS", "two counts each time add up"


@pytest.mark.parametrize("phase", (0, 1, 2))
@pytest.mark.parametrize("rpm, i_a, within_ms", ((4000, 7.1, 20), (400, 7.1, 40), (1500, -2.0, 40), (-60, -3.5, 200)))
def test_an_open_phase_has_its_name(motor, phase, rpm, i_a, within_ms):
    m = motor(rpm, i_a)
    m.step(100)
    m.open_phase = phase
    assert m.until_fault(within_ms) and m.fault == "OPEN_PHASE" and m.axis.faults.detail[0] == phase + 1


@pytest.mark.parametrize("sign", (1, -1))
def test_an_open_phase_is_found_although_the_others_carry_nothing_when_most_is_asked_of_it(motor, sign):
    """At 125 Hz electrical a look comes each quarter of a turn: either A is asked for nearly all, or B and C are."""
    m = motor(1875 * sign, 7.1 * sign)
    m.counts += sign * 10 / 360 / m.p.pole_pairs * m.p.encoder_counts
    m.step(100)
    m.open_phase = 0
    assert m.until_fault(12) and m.fault == "OPEN_PHASE" and m.axis.faults.detail[0] == 1


@pytest.mark.parametrize("sign", (1, -1))
@pytest.mark.parametrize("share", (0.05, 0.2))
def test_a_motor_that_gets_a_share_of_what_is_asked_has_no_open_phase_for_30_ms(motor, share, sign):
    """The voltage is short, and the currents are what it leaves: a quarter of a turn late, too."""
    m = motor(2000 * sign, 7.1 * sign)
    m.step(100)
    m.carried = share
    assert not m.until_fault(30)


@pytest.mark.parametrize("always, found", ((False, "NONE"), (True, "OPEN_PHASE")))
def test_what_a_start_carries_at_a_small_voltage_counts_though_what_is_missing_there_does_not(motor, c, always, found):
    """Dead time may hide what is missing at few volts. A reversal has more of them, and its current crosses zero."""
    m = motor(300, 4.0).step(200)
    m.axis.state, m.axis.loop.kp_d_q9 = c.AXIS_SWITCHED_ON, 1
    for look in range(200):
        reverses = look % 20 == 0
        m.open_phase = 0 if reverses or always else None
        m.counts += 2 * m.rpm / 60000 * m.p.encoder_counts
        m.see()
        m.axis.loop.v_q_q15, m.axis.loop.v_d_q15 = m.axis.loop.vbus_q15 // (2 if reverses else 40), 0
        m.axis.loop.v_turn_q15 = 0
        c.phase_watch_step(m.axis)
        c.reaction_step(m.axis)
    assert m.fault == found


def test_the_voltage_of_a_suspected_phase_is_no_emf(motor):
    """Counts lost one by one turn the EMF: the encoder's fault, unless a phase may be what turned it."""
    def lose(m):
        m.slip += 3

    def lose_while_a_phase_is_suspected(m):
        lose(m)
        m.axis.supervision.phases.missing_q15[0] = 3 * m.axis.supervision.phases.min_q15

    m = motor(2000, 0.5).step(100)
    assert m.until_fault(40, lose) and m.fault == "ENCODER_SLIP"
    m = motor(2000, 0.5).step(100)
    assert m.until_fault(40, lose_while_a_phase_is_suspected) is None


def test_little_current_says_nothing_of_the_phases(motor):
    m = motor(1500, 0.5)
    m.open_phase = 0
    m.step(200)
    assert m.fault == "NONE"


def test_an_over_current_is_the_encoders_or_the_phases_where_it_follows_from_them(motor, c):
    def sampled(m):
        m.fabric.gate.STATUS, m.fabric.adc.STATUS = 0x81, 1 << 4
        c.drive_sample_fault(m.axis)
        return m.fault

    m = motor(3000, 5.0).step(20)
    assert sampled(m) == "OVERCURRENT"
    m = motor(3000, 5.0).step(20)
    m.fabric.encoder.LATCHED = (m.fabric.encoder.LATCHED + 500) % 4000
    assert sampled(m) == "ENCODER_SLIP"
    m = motor(3000, 7.0).step(20)
    m.open_phase = 1
    for _ in range(40):
        m.step()
        if m.axis.supervision.phases.missing_q15[1] > 2 * m.axis.supervision.phases.min_q15:
            break
    assert m.fault == "NONE" and sampled(m) == "OPEN_PHASE" and m.axis.faults.detail[0] == 2


@pytest.mark.parametrize("sign", (1, -1))
def test_the_speed_leaves_its_reference(motor, sign):
    """Four fifths of a fifth of speed_max are near enough for ever; beyond a fifth it takes some milliseconds."""
    m = motor(1000 * sign, 2.0 * sign)
    m.axis.speed.speed_ref_rpm_q4 = 1790 * 16 * sign
    m.step(100)
    assert m.fault == "NONE"
    m.axis.speed.speed_ref_rpm_q4 = 1810 * 16 * sign
    assert 3 <= m.until_fault(8) and m.fault == "SPEED_DEVIATION" and abs(m.axis.faults.detail[0] - 810 * sign) <= 1


@pytest.mark.parametrize("sign", (1, -1))
def test_a_reference_that_runs_ahead_is_no_load(motor, sign):
    """30 rpm a millisecond beyond what the largest current does, to seven eighths of what is watched, and back."""
    m = motor(500 * sign, 10.6 * sign)
    m.at_limit = True

    def ahead(world):
        world.rpm += 2 * sign
        world.axis.speed.speed_ref_rpm_q4 = round((world.rpm + sign * min(700, 30 * (world.axis.time_ms - begun))) * 16)

    begun = m.axis.time_ms
    assert m.until_fault(60, ahead) is None


@pytest.mark.parametrize("sign", (1, -1))
@pytest.mark.parametrize("warm, name", ((True, "OVERTEMPERATURE"), (False, "INVERTER_OVERLOAD")))
def test_a_speed_that_is_lost_for_heat_is_named_after_the_heat(motor, warm, name, sign):
    """Half of i_max is left; with all of it the load was the stronger one."""
    for share, said in ((32768, "SPEED_DEVIATION"), (16384, name)):
        m = motor(1000 * sign, 2.0 * sign)
        m.at_limit, m.axis.thermal.factor_q15 = True, share
        m.axis.thermal.winding_q4 = m.axis.thermal.max_q4 - (80 if warm else 800)
        m.axis.speed.speed_ref_rpm_q4 = 1900 * 16 * sign
        m.step(8)
        assert m.fault == said


@pytest.mark.parametrize("half_ms, found", ((1, False), (2, False), (60, True)))
def test_a_speed_that_swings_about_its_reference_is_not_lost(motor, half_ms, found):
    """Nor one of which every second look is on the same side."""
    m = motor(1000, 2.0)

    def sways(world):
        side = 1 if world.axis.time_ms // half_ms % 2 else -1
        world.axis.speed.speed_ref_rpm_q4 = round((world.rpm + 900 * side) * 16)

    m.until_fault(100, sways)
    assert (m.fault == "SPEED_DEVIATION") == found


@pytest.mark.parametrize("sign", (1, -1))
def test_a_load_that_is_the_stronger_one_is_found_before_a_fifth(motor, sign):
    m = motor(2000 * sign, 10.6 * sign)
    m.at_limit = True

    def drag(world):
        world.rpm -= 20 * sign

    assert m.until_fault(60, drag) and m.fault == "SPEED_DEVIATION"
    assert 400 < 2000 - m.rpm * sign < 800


@pytest.mark.parametrize("sign", (1, -1))
def test_heavy_acceleration_is_none(motor, c, sign):
    """The reference waits for the rotor while the current is at its limit, and goes on with it."""
    speed, tuning = c.speed_loop(), motor().axis.tuning
    c.speed_loop_init(speed)
    speed.target_rpm_q16 = 3000 * 65536 * sign
    limits = c.interval(low=-1000, high=1000)
    rpm = 0.0
    for _ in range(400):
        speed.speed_rpm_q4 = round(rpm * 16)
        c.speed_loop_step(speed, tuning, 50 * 65536, limits)
        assert speed.at_limit and abs(speed.speed_ref_rpm_q4 / 16 - rpm) < 120
        rpm += 5 * sign  # a tenth of the ramp


@pytest.mark.parametrize("sign", (1, -1))
def test_the_voltage_is_short_for_a_tenth_of_a_second(motor, c, sign):
    m = motor(3000 * sign, 4.0 * sign)
    see = m.see

    def limited(world):
        world.axis.loop.radius_q15 = 4000

    def see_short():
        see()
        m.axis.loop.i_q_ref_q15 += sign * m.axis.tuning.i_max_q15 // 5
    m.see = see_short
    m.step(90, limited)
    assert not c.fault_warned(m.axis.reports, c.FAULT_VOLTAGE_LIMIT)
    m.step(20, limited)
    assert c.fault_warned(m.axis.reports, c.FAULT_VOLTAGE_LIMIT) and m.fault == "NONE"


def swing(half_ms, rpm, i_a):
    def happens(m):
        up = (m.axis.time_ms // half_ms) % 2
        m.axis.speed.speed_ref_rpm_q4 = round((m.rpm + (rpm if up else -rpm)) * 16)
        m.i_a = i_a if up else -i_a
    return happens


def test_a_limit_cycle_first_softens_the_speed_loop_then_is_a_fault(motor, c):
    m = motor(1000, 0.0)
    kp, accel = m.axis.tuning.speed_kp_q16, m.axis.tuning.speed_accel_q8
    own = m.axis.speed.kp_q16, m.axis.speed.ki_q16
    m.step(80, swing(8, 20, 5.0))
    assert c.fault_warned(m.axis.reports, c.FAULT_LIMIT_CYCLE) and m.fault == "NONE"
    assert m.axis.tuning.speed_kp_q16 == pytest.approx(0.7 * kp, rel=0.01)
    assert m.axis.tuning.speed_accel_q8 == pytest.approx(0.7 * accel, rel=0.01)
    assert (m.axis.speed.kp_q16, m.axis.speed.ki_q16) == pytest.approx((0.7 * own[0], 0.7**2 * own[1]), rel=0.01)
    assert m.until_fault(600, swing(8, 20, 5.0)) and m.fault == "LIMIT_CYCLE"
    assert m.axis.tuning.speed_kp_q16 == pytest.approx(0.7**5 * kp, rel=0.02)
    assert m.axis.faults.detail[0] == pytest.approx(62, abs=1)


def test_what_the_speed_loop_has_answered_by_itself_is_not_answered_twice(motor, c):
    """The same swing makes both reduce the gains: half waves begin to count again once the loop has."""
    m = motor(1000, 0.0)
    for _ in range(4):
        m.step(40, swing(8, 20, 5.0))
        m.axis.speed.oscillation.answered += 1
    assert m.axis.reactions.gain_reductions == 0 and not c.fault_warned(m.axis.reports, c.FAULT_LIMIT_CYCLE)
    m.step(80, swing(8, 20, 5.0))
    assert m.axis.reactions.gain_reductions == 1, "if that has not helped"


def test_gains_that_are_reduced_stay_so_across_a_hand_over_and_so_does_their_count(motor, c):
    """Until the next `on`, which takes the tuning anew."""
    m = motor(1000, 0.0)
    m.step(80, swing(8, 20, 5.0))
    kp = m.axis.tuning.speed_kp_q16
    m.axis.reactions.gain_reductions = 5
    c.supervision_begin_again(m.axis)
    assert m.until_fault(130, swing(8, 20, 5.0)) and m.fault == "LIMIT_CYCLE"
    assert m.axis.tuning.speed_kp_q16 == kp and m.axis.reactions.gain_reductions == 5
    c.fault_clear(m.axis)
    c.tuning_compute(m.axis.params, m.axis.switching.tuning)
    m.axis.state, m.axis.request = c.AXIS_SWITCH_ON_DISABLED, c.AXIS_REQUEST_ON
    c.states_step(m.axis)
    assert m.axis.reactions.gain_reductions == 0


@pytest.mark.parametrize("half_ms, i_a", ((8, 2.0), (300, 5.0), (4, 5.0)))
def test_little_current_or_a_slow_or_fast_swing_is_none(motor, half_ms, i_a):
    m = motor(1000, 0.0)
    m.step(2000, swing(half_ms, 20, i_a))
    assert m.fault == "NONE" and not any(m.axis.reports.warned)


@pytest.mark.parametrize("rpm", (3000, -3000))
@pytest.mark.parametrize("late_ms", (0, 1))
@pytest.mark.parametrize("i_a", (4.0, 10.0, -10.0))
@pytest.mark.parametrize("lq_uh", (200, 400))
def test_a_shaft_that_is_stopped_is_no_dead_encoder(motor, rpm, late_ms, i_a, lq_uh):
    """The voltages of the millisecond in which it stops may be those from before; currents react on no rotor at rest."""
    m = motor(rpm, i_a, ld_uh=lq_uh, lq_uh=lq_uh)
    m.lq = lq_uh * 1e-6
    m.step(600)
    m.frozen = True
    m.step(late_ms)
    m.rpm = m.axis.speed.speed_ref_rpm_q4 = 0
    assert (m.until_fault(60), m.fault) == (None, "NONE")


@pytest.mark.parametrize("times", (3.1, 3.3, 3.6, 3.9))
def test_from_three_times_what_may_hide_it_on_a_missing_emf_tells_that_the_shaft_was_stopped(motor, times):
    """Less than to judge an angle by, which takes four times."""
    def world(rpm):
        return motor(rpm, 6.0).step(600)

    def emf(m):
        return m.axis.supervision.encoder.emf

    slow = emf(world(600))
    m = world(round(600 * times * slow.uncertain_q15 / slow.expected_q15))  # what hides it does not depend on the speed
    assert emf(m).expected_q15 / emf(m).uncertain_q15 == pytest.approx(times, rel=0.02)
    m.frozen = True
    m.rpm = m.axis.speed.speed_ref_rpm_q4 = 0
    assert (m.until_fault(60), m.fault) == (None, "NONE")


@pytest.mark.parametrize("i_a, r", ((10.0, 0.36), (10.0, 0.5), (-10.0, 0.2)))
@pytest.mark.parametrize("rpm", (400, 700, -500))
@pytest.mark.parametrize("turns", (False, True))
def test_at_full_current_the_emf_across_it_tells_whether_a_shaft_without_counts_turns(motor, rpm, turns, i_a, r):
    """Along it a wrong resistance would say anything."""
    m = motor(rpm, 0.3)
    m.step(100)
    m.frozen, m.shown_rpm, m.i_a, m.r = True, 0, i_a, r
    m.rpm = rpm if turns else 0
    m.axis.speed.speed_ref_rpm_q4 = 0
    found = m.until_fault(60)
    assert (bool(found), m.fault) == ((True, "ENCODER_DEAD") if turns else (False, "NONE")) and (found or 0) <= 12
    assert m.axis.supervision.encoder.stopped == (not turns) and (turns or not m.c.encoder_watch_may_be_dead(m.axis))


@pytest.mark.parametrize("surprise", [-2**31, -2**31 + 1, 2**31 - 1, -2**30, 2**30, -1, 0, 1])
def test_a_jump_of_any_size_is_doubted_by_its_magnitude(c, surprise):
    """Half an electrical turn exactly is the largest there is."""
    motor = Motor(c)
    watch = motor.axis.supervision.encoder
    motor.axis.speed.estimate.moved, motor.axis.speed.estimate.step_clocks = 0, motor.axis.tuning.loop_counts
    watch.speed_q32 = -surprise
    c.encoder_watch_step(motor.axis, 0)
    assert (watch.suspect_ms != 0) == (abs(surprise) > watch.jump_limit_q32) == (abs(surprise) > 1)


def loses(degrees_each, every_ms):
    """What an encoder does that loses so much every so many milliseconds."""
    counts = round(degrees_each / 360 * 1000)  # of 4000 with 4 pole pairs

    def before(m):
        m.slip += counts if m.axis.time_ms % every_ms == 0 else 0
    return before


@pytest.mark.parametrize("rpm", (2000, -3000))
@pytest.mark.parametrize("told", ({}, {"ld_uh": 400, "lq_uh": 400}, {"ld_uh": 100, "lq_uh": 100}))
def test_counts_lost_one_by_one_under_load_are_a_slip_before_30_degrees(motor, rpm, told):
    """No index comes here. Lq, which is learnt, would take it for its own error: the EMF is held against what it was."""
    m = motor(rpm, 7.1 if rpm > 0 else -7.1, **told)
    m.step(700)
    assert m.fault == "NONE"
    assert m.until_fault(400, loses(0.36, 4)) is not None and m.fault == "ENCODER_SLIP"
    assert 12 < abs(m.slip) * 0.36 < 30 and (told or abs(m.axis.faults.detail[0] + m.slip * 0.36) < 6)


@pytest.mark.parametrize("load_a", ((7.1, 1.0), (7.1, -7.1), (2.0, 8.0), (7.0, 6.0)))
def test_a_load_that_comes_and_goes_is_no_slip(motor, load_a):
    m = motor(3000, load_a[0], ld_uh=400, lq_uh=400)
    for n in range(12):
        m.i_a = load_a[n % 2]
        m.step(150)
    assert m.fault == "NONE" and not any(m.axis.reports.warned)


@pytest.mark.parametrize("pulses, found", (((1000, 1030, 1060), True), ((1000, 970, 940), True), ((1000, 1060, 1000), False),
                                           ((1000, 1030, 1050), False), ((1000, 940, 1060), False), ((1000, 1060, 1061), True)))
def test_two_pulses_off_to_one_side_the_second_by_a_jump_are_a_slip(c, motor, pulses, found):
    """20 degrees of 0.36 each; one pulse may be wrong itself. The index's own fault only warns."""
    m = motor(1500, 1.0)
    m.axis.reactions.choice[c.FAULT_ENCODER_COUNTS] = c.REACTION_WARN
    for at in pulses:
        m.step(8)
        pulse(m, at)
    m.step(8)
    assert m.fault == ("ENCODER_SLIP" if found else "NONE")
