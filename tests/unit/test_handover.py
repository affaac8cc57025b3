# SPDX-License-Identifier: MIT
"""Another source of the angle while the motor turns: what forbids it, what the look finds, and what has changed afterwards."""
import cmath
import itertools
import math

import pytest

from rigs.carrying import frame_deg
from rigs.hall_motor import HallMotor, open_wire
from rigs.hall_rotor import IDEAL, TURN
from rigs.motor import CLOCKS, LOOPS

ALL_ONES = TURN - 1
ENCODER, OBSERVER, HALL = SOURCES = range(3)
PAIRS = list(itertools.permutations(SOURCES, 2))
PLACE_DEG = 77  # of the encoder's zero
STATUS_ILLEGAL, STATUS_LOST = 2, 4
MOST_MS = 1100


class Turning(HallMotor):
    """By any of the three; `told_deg`: by how much that is wrong."""

    def __init__(self, c, source=ENCODER, rpm=2900, **params):
        self.told_deg, self.slipped_deg = 0.0, 0.0
        super().__init__(c, rpm, **params)
        axis, loop = self.axis, self.axis.loop
        axis.tuning.angle_source = axis.params.angle_source = source
        loop.source = (c.LOOP_ENCODER, c.LOOP_OBSERVER, c.LOOP_HALL)[source]
        loop.field_follows = 0 if source == ENCODER else ALL_ONES
        loop.angle_offset_q32 = self.place_q32 if source == ENCODER else 0
        axis.start.aligned = source == ENCODER
        self.pass_ms()

    @property
    def place_q32(self):
        return round(PLACE_DEG / 360 * TURN)

    def pass_ms(self, count=1):
        """Time passes; the thread looks once in each millisecond."""
        loop, encoder = self.axis.loop, self.fabric.encoder
        for _ in range(count):
            self.axis.time_ms += 1
            self.turns += self.hz / 1000
            encoder.LATCH_TIME = encoder.EDGE_TIME = (encoder.LATCH_TIME + CLOCKS) % TURN
            self.fabric.adc.SEQUENCE += LOOPS
            encoder.HALL = self.wires(IDEAL[int(self.turns * 6 // 1) % 6])
            counts = self.turns + (self.slipped_deg - PLACE_DEG) / 360
            self.counts = counts / self.p.pole_pairs * self.p.encoder_counts
            self.slip = 0
            self.see()
            self.see_wrong_frame()
            self.axis.heartbeat = self.fabric.adc.SEQUENCE
            next_q32 = round((self.turns + self.hz / 20000 + self.told_deg / 360) * TURN)
            loop.pll.angle_q32 = (next_q32 - loop.angle_offset_q32) % TURN
            loop.pll.speed_q32 = round(self.hz / 20000 * TURN)
            self.see_speed()

    def see_speed(self):
        """What the slow loop knows of it."""
        axis, clock = self.axis, self.fabric.encoder.LATCH_TIME
        if self.leads == ENCODER:
            self.c.speed_estimate_step(axis.speed.estimate, self.fabric.encoder, axis.tuning)
        elif self.leads == HALL:
            speed = axis.hall.speed
            for n in range(8):
                axis.hall.clock[n] = clock
            axis.hall.state = self.fabric.encoder.HALL
            speed.clock, speed.lost, speed.pushed_q32, speed.load_q8 = clock, False, 0, 0
            speed.rest_q32 = axis.loop.pll.speed_q32 % 2**64

    def see_wrong_frame(self):
        """What the voltages look like in a frame that is not the rotor's."""
        loop, turn = self.axis.loop, cmath.exp(-1j * math.radians(self.told_deg))
        v = complex(loop.v_d_q15, loop.v_q_q15) * turn
        loop.v_d_q15, loop.v_q_q15 = round(v.real), round(v.imag)

    def change(self, target):
        """The error, and its value; the slow loop has had its turn."""
        outcome = self.c.drive_change_source(self.axis, target)
        if outcome.error == 0:
            for _ in range(MOST_MS):
                self.pass_ms()
                if not self.c.drive_prepare(self.axis):
                    break
                if self.axis.request:
                    self.slow_step()
                    self.told_deg, self.told_rpm = 0.0, self.axis.speed.estimate.speed_rpm_q15 / 32768
            assert not self.axis.handover.under_way
            outcome = self.axis.handover.outcome
        return self.c.name("error", outcome.error), outcome.value

    @property
    def leads(self):
        loop = self.axis.loop
        return {self.c.LOOP_ENCODER: ENCODER, self.c.LOOP_OBSERVER: OBSERVER, self.c.LOOP_HALL: HALL}[loop.source]

    @property
    def frame_off_deg(self):
        return (frame_deg(self.c, self.axis.loop) - (self.turns + self.hz / 20000) * 360 + 180) % 360 - 180


@pytest.fixture
def motor(c):
    return lambda *args, **params: Turning(c, *args, **params)


@pytest.mark.parametrize("rpm", (2900, -2900, 1870))
@pytest.mark.parametrize("times", (1, 2))
@pytest.mark.parametrize("source, target", PAIRS)
def test_each_takes_over_from_each_at_the_same_angle_and_speed(motor, source, target, times, rpm):
    """The second time, too, after the way back."""
    m = motor(source, rpm)
    m.axis.loop.inject.track = 7  # of a tone that has led before
    assert [m.change(to) for to in (target, source, target)[-2 * times + 1:]] == [("NONE", 0)] * (2 * times - 1)
    assert target != OBSERVER or m.axis.loop.inject.track == 0
    loop, axis = m.axis.loop, m.axis
    assert m.leads == target == axis.tuning.angle_source and axis.params.angle_source == source
    assert loop.field_follows == (0 if target == ENCODER else ALL_ONES) and loop.field_angle_q32 == loop.field_speed_q32 == 0
    assert abs(m.frame_off_deg) < 2.5 and loop.pll.speed_q32 == pytest.approx(m.hz / 20000 * TURN, rel=0.01)
    assert axis.start.aligned == (target == ENCODER) and (loop.angle_offset_q32 == 0) == (target != ENCODER)
    assert m.state == "OPERATION_ENABLED" and m.fault == "NONE" and m.fabric.gate.CONTROL == 1
    assert axis.speed.target_rpm_q16 == axis.speed.ref_rpm_q16 == rpm << 16 and not any(axis.reports.warned)


@pytest.mark.parametrize("source", SOURCES)
def test_the_same_again_is_nothing(motor, source):
    m = motor(source)
    assert m.change(source) == ("NONE", 0) and m.leads == source and not m.axis.handover.under_way


# ---- refused ----


@pytest.mark.parametrize("source, target", PAIRS)
@pytest.mark.parametrize("told_deg, allowed", ((-12, True), (12, True), (-30, False), (30, False), (180, False)))
def test_angles_that_differ_are_refused_beyond_15_degrees(motor, source, target, told_deg, allowed):
    m = motor(source)
    m.axis.handover.offset_known, m.axis.handover.offset_q32 = source != ENCODER, m.place_q32
    m.told_deg = told_deg
    error, value = m.change(target)
    assert (error == "NONE") == allowed == (m.leads == target)
    if not allowed:
        assert error == "SOURCE_APART" and (abs(value - abs(told_deg)) <= 8 or abs(told_deg) == 180 and value > 60)
        assert m.leads == source


@pytest.mark.parametrize("target, source", ((HALL, ENCODER), (ENCODER, OBSERVER), (OBSERVER, HALL)))
def test_what_is_to_be_seen_over_a_turn_takes_a_turn_within_a_second(motor, source, target):
    m = motor(source, 14)  # 0.93 Hz electrical
    m.axis.tuning.r_q12 = 0
    m.axis.loop.vbus_q15 = 300 if target == OBSERVER else m.axis.loop.vbus_q15  # or the margin would forbid it at once
    error, value = m.change(target)
    if target == OBSERVER and error == "SOURCE_MARGIN":
        return
    assert (error, value) == ("SOURCE_SLOW", 60 // m.p.pole_pairs + 1) and m.leads == source


@pytest.mark.parametrize("source", (ENCODER, HALL))
@pytest.mark.parametrize("i_q15", (0, 8000))
def test_the_observer_takes_its_margin_and_says_how_quick_that_is(motor, source, i_q15):
    m = motor(source, 100)
    m.axis.loop.i_q_ref_q15 = i_q15
    error, rpm = m.change(OBSERVER)
    assert error == "SOURCE_MARGIN" and 100 < rpm < 2000 and m.leads == source
    quick = motor(source, rpm)
    quick.axis.loop.i_q_ref_q15 = i_q15
    assert quick.c.handover_forbidden(quick.axis, OBSERVER).error == quick.c.ERROR_NONE
    slow = motor(source, round(rpm * 0.97) - 2)
    slow.axis.loop.i_q_ref_q15 = i_q15
    assert slow.c.handover_forbidden(slow.axis, OBSERVER).error == slow.c.ERROR_SOURCE_MARGIN


def state(name):
    return lambda m: setattr(m.axis, "state", m.c.enums["axis_state"]["AXIS_" + name])


def mode(name):
    return lambda m: setattr(m.axis, "mode", m.c.enums["axis_mode"]["AXIS_MODE_" + name])


def broken_table(m):
    m.axis.params.hall_states = 123456


def exchanged(m):
    shown = dict(zip(IDEAL, IDEAL[1:] + IDEAL[:1]))
    m.wires = lambda state: shown[state]


REFUSED = [
    ("off", PAIRS, state("SWITCH_ON_DISABLED"), "NOT_OPERATING"), ("stopping", PAIRS, state("QUICK_STOP"), "NOT_OPERATING"),
    ("fault", PAIRS, state("FAULT"), "NOT_OPERATING"),
    ("cyclic speed", PAIRS, mode("CYCLIC_SPEED"), "SOURCE_MODE"), ("position", PAIRS, mode("POSITION"), "SOURCE_MODE"),
    ("homing", PAIRS, mode("HOMING"), "SOURCE_MODE"), ("learning", PAIRS, mode("LEARNING"), "SOURCE_MODE"),
    ("weakened", [(0, 1), (0, 2)], lambda m: setattr(m.axis.tuning, "weakens", True), "SOURCE_WEAKENS"),
    ("reluctant", [(0, 1), (2, 1)], lambda m: setattr(m.axis.tuning, "reluctant", True), "SOURCE_RELUCTANT"),
    ("a field", [(1, 0), (1, 2)], lambda m: setattr(m.axis.loop, "field_follows", 0), "SOURCE_FIELD"),
    ("wire open", [(0, 2), (1, 2)], lambda m: setattr(m, "wires", open_wire("B")), "SOURCE_HALL"),
    ("table", [(0, 2), (1, 2)], broken_table, "HALL_STATES"),
    ("exchanged", [(0, 2), (1, 2)], exchanged, "SOURCE_APART"),
]


@pytest.mark.parametrize("why, source, target, happens, error", [
    (why, *pair, happens, error) for why, pairs, happens, error in REFUSED for pair in pairs])
def test_refused_with_its_reason_and_nothing_has_changed(motor, why, source, target, happens, error):
    m = motor(source)
    happens(m)
    loop = m.axis.loop
    before = loop.source, loop.field_follows, loop.angle_offset_q32, m.axis.tuning.angle_source, m.axis.start.aligned
    found, _ = m.change(target)
    assert found == error, why
    after = loop.source, loop.field_follows, loop.angle_offset_q32, m.axis.tuning.angle_source, m.axis.start.aligned
    assert before == after and m.axis.request == 0 and m.fault == "NONE"


def test_one_at_a_time_and_a_fault_or_off_ends_it(motor):
    m = motor(ENCODER)
    assert m.c.drive_change_source(m.axis, OBSERVER).error == 0 and m.axis.handover.under_way
    assert m.c.drive_change_source(m.axis, HALL).error == m.c.ERROR_BUSY
    m.pass_ms()
    assert m.c.drive_prepare(m.axis)
    m.axis.state = m.c.AXIS_QUICK_STOP
    assert not m.c.drive_prepare(m.axis) and m.axis.handover.outcome.error == m.c.ERROR_NOT_OPERATING and m.leads == ENCODER


def test_without_a_slow_loop_it_gives_up(motor):
    m = motor(ENCODER)
    assert m.c.drive_change_source(m.axis, OBSERVER).error == 0
    polls = 1
    while m.c.drive_prepare(m.axis):
        polls += 1
    assert 10_000 < polls < 1_000_000 and m.axis.handover.outcome.error == m.c.ERROR_BUSY and m.leads == ENCODER


@pytest.mark.parametrize("happens, error", (
    (lambda m: m.c.fault_raise(m.axis, m.c.FAULT_OVERVOLTAGE), "NOT_OPERATING"),
    (lambda m: setattr(m.axis.loop.pll, "speed_q32", 1000), "SOURCE_MARGIN")), ids=("fault", "margin"))
def test_what_comes_between_the_request_and_the_slow_loop_leaves_the_source(motor, happens, error):
    m = motor(ENCODER)
    assert m.c.drive_change_source(m.axis, OBSERVER).error == 0
    while not m.axis.request:
        m.pass_ms()
        assert m.c.drive_prepare(m.axis)
    happens(m)
    m.slow_step()
    assert not m.c.drive_prepare(m.axis) and not m.axis.handover.under_way and m.leads == ENCODER
    assert m.c.name("error", m.axis.handover.outcome.error) == error


# ---- the encoder's place ----


@pytest.mark.parametrize("source", (OBSERVER, HALL))
def test_an_encoder_whose_place_is_not_known_gets_it_from_the_angle(motor, source):
    m = motor(source)
    assert m.change(ENCODER) == ("NONE", 0)
    off = (m.axis.loop.angle_offset_q32 - m.place_q32 + TURN // 2) % TURN - TURN // 2
    assert abs(off) * 360 / TURN < 2


def test_the_place_that_was_known_is_kept_while_others_lead_and_not_found_anew(motor):
    m = motor(ENCODER)
    assert m.change(OBSERVER)[0] == "NONE" and m.axis.handover.offset_known
    m.told_deg = 10
    assert m.change(ENCODER)[0] == "NONE"
    assert m.axis.loop.angle_offset_q32 == m.place_q32 and abs(m.frame_off_deg) < 1


def test_a_slip_meanwhile_is_seen_against_the_observer(motor):
    m = motor(ENCODER)
    assert m.change(OBSERVER)[0] == "NONE"
    m.slipped_deg = 40
    error, degrees = m.change(ENCODER)
    assert error == "SOURCE_APART" and 38 <= degrees <= 43 and m.leads == OBSERVER


@pytest.mark.parametrize("pole_pairs_told", (3, 5))
def test_counts_that_do_not_keep_their_distance_are_no_encoder_of_this_motor(motor, pole_pairs_told):
    m = motor(HALL)
    m.axis.loop.encoder_scale_q32 = m.axis.loop.encoder_scale_q32 * pole_pairs_told // m.p.pole_pairs
    assert m.change(ENCODER)[0] == "SOURCE_APART" and m.leads == HALL


@pytest.mark.parametrize("status", (STATUS_ILLEGAL, STATUS_LOST))
def test_an_illegal_signal_of_long_ago_costs_the_place_and_one_of_now_is_refused(motor, status):
    m = motor(ENCODER)
    assert m.change(OBSERVER)[0] == "NONE" and m.axis.handover.offset_known
    m.fabric.encoder.STATUS = status
    assert m.c.drive_change_source(m.axis, ENCODER).error == m.c.ERROR_NONE and m.fabric.encoder.STATUS == 0
    assert not m.axis.handover.offset_known
    m.fabric.encoder.STATUS = status
    for _ in range(MOST_MS):
        m.pass_ms()
        if not m.c.drive_prepare(m.axis):
            break
    assert m.axis.handover.outcome.error == m.c.ERROR_SOURCE_ENCODER and m.leads == OBSERVER and m.axis.request == 0


def test_an_encoder_that_has_failed_has_lost_its_place(motor):
    m = motor(ENCODER)
    m.axis.reactions.choice[m.c.FAULT_ENCODER_DEAD] = m.c.REACTION_CARRY
    m.axis.handover.offset_known = True
    m.report("ENCODER_DEAD")
    m.slow_step()
    assert m.axis.tuning.angle_source == OBSERVER and not m.axis.handover.offset_known
    assert m.axis.failover.cause == m.c.FAULT_ENCODER_DEAD
    assert m.change(ENCODER)[0] == "NONE" and m.axis.failover.cause == m.c.FAULT_NONE


def test_the_position_is_no_longer_homed_behind_others_that_do_not_count(motor):
    m = motor(ENCODER)
    m.axis.motion.homed = True
    assert m.change(HALL)[0] == "NONE" and m.change(ENCODER)[0] == "NONE"
    assert not m.axis.motion.homed and m.axis.speed.estimate.count == m.fabric.encoder.LATCHED
    assert m.told_rpm == pytest.approx(2900, rel=0.03) and not m.axis.speed.estimate.lost


# ---- without a bump ----


@pytest.mark.parametrize("source, target, coasts_deg", (
    *((*pair, None) for pair in PAIRS),
    *((source, OBSERVER, turn) for source in (ENCODER, HALL) for turn in (0, 50, -120, 180))))
def test_what_the_motor_gets_is_the_same_in_the_new_frame_of_each(c, source, target, coasts_deg):
    """Handed over, or left to turn by itself from so much further on."""
    loop = c.current_loop()
    c.current_loop_init(loop)
    loops = (c.LOOP_ENCODER, c.LOOP_OBSERVER, c.LOOP_HALL)
    loop.source, loop.field_follows = loops[source], 0 if source == ENCODER else ALL_ONES
    loop.angle_offset_q32, loop.pll.angle_q32 = (1 << 29 if source == ENCODER else 0), 12345678
    loop.integral_d_q9, loop.integral_q_q9, loop.i_d_ref_q15, loop.i_q_ref_q15 = -300_000, 2_000_000, -1000, 5000
    loop.i_d_q15, loop.i_q_q15, loop.v_d_steps, loop.v_q_steps = -900, 4800, -500, 4000
    loop.feedforward_d_steps, loop.feedforward_q_steps = 77, 3000

    def in_stator():
        turned = cmath.exp(1j * math.radians(frame_deg(c, loop)))
        return [turned * complex(getattr(loop, d), getattr(loop, q)) for d, q in (
            ("integral_d_q9", "integral_q_q9"), ("i_d_ref_q15", "i_q_ref_q15"), ("i_d_q15", "i_q_q15"),
            ("v_d_steps", "v_q_steps"), ("feedforward_d_steps", "feedforward_q_steps"))]

    before, rotor = in_stator(), c.pll(angle_q32=987654321, speed_q32=1234567)
    offset, angle_deg = 1 << 30 if target == ENCODER else 0, frame_deg(c, loop)
    if coasts_deg is None:
        c.current_loop_hand_over(loop, loops[target], rotor, offset)
        assert frame_deg(c, loop) == pytest.approx((987654321 + offset) * 360 / TURN % 360, abs=1e-6)
    else:
        c.current_loop_coast(loop, round(coasts_deg / 360 * TURN) % TURN, 1234567)
        assert (frame_deg(c, loop) - angle_deg - coasts_deg + 180) % 360 == pytest.approx(180, abs=0.01)
        assert loop.field_speed_q32 == 1234567
    for was, now in zip(before, in_stator()):
        assert abs(now - was) <= 0.001 * abs(was) + 2
    assert loop.source == loops[target] and loop.pll.speed_q32 == 1234567 and (
        loop.angle_offset_q32 == offset or coasts_deg is not None)


@pytest.mark.parametrize("source, target, sign", ((ENCODER, HALL, 1), (HALL, ENCODER, -1), (HALL, OBSERVER, 0)))
def test_what_is_known_of_the_torque_is_remembered_where_nobody_knows_it(motor, source, target, sign):
    m = motor(source)
    m.axis.tuning.friction_q15 = 500
    m.axis.speed.integral_q29 = 3000 << 14
    m.axis.handover.target = target
    m.axis.handover.offset_q32 = m.place_q32
    wake = m.c.drive_change_source(m.axis, target)
    assert wake.error == 0
    m.c.handover_take(m.axis)
    assert m.axis.handover.outcome.error == 0 and m.axis.speed.integral_q29 == (3000 + sign * 500) << 14


def test_the_observer_is_calm_for_two_turns_and_then_as_quick_as_its_margin_allows(motor):
    m = motor(ENCODER)
    assert m.change(OBSERVER)[0] == "NONE"
    loop, tracks = m.axis.loop, []
    for _ in range(round(2.2 / m.hz * 1000)):
        m.c.observer_follow(loop, m.axis.tuning, m.c.OBSERVER_LEADS)
        tracks.append(loop.flux.track)
    at_once = m.axis.loop.flux
    assert tracks[0] < 0.4 * tracks[-1] and all(a <= b + 1 for a, b in itertools.pairwise(tracks))
    assert at_once.slow_down_q24 == 0


def test_hall_switches_keep_the_speed_that_they_were_told_until_a_turn_of_edges(motor):
    """Switches out of place: a single sector would say something else."""
    m = motor(ENCODER, 1870)
    assert m.change(HALL)[0] == "NONE"
    speed = m.axis.hall.speed
    assert speed.preset and speed.direction == 1 and speed.intervals == 0 and not speed.lost
    assert speed.speed_q32 == pytest.approx(m.hz / 20000 * TURN, rel=0.01)
