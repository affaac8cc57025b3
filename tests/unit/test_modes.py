# SPDX-License-Identifier: MIT
"""Modes: every request in every state, from every mode, with and without a fault; no transition bumps; homing; set-points."""
import itertools
import random

import pytest

from rigs.commanding import OWNERS, Commanding
from rigs.drive import STATES
from rigs.operating import MODES, REQUESTS, Drive

TORQUE_MODES = ("TORQUE", "CYCLIC_TORQUE")


@pytest.mark.parametrize("mode", ("SPEED", "TORQUE", "CYCLIC_SPEED", "CYCLIC_TORQUE"))
def test_without_an_encoder_there_is_no_position(c, mode):
    w = Drive(c, mode)
    w.axis.tuning.angle_source = 1
    before = bytes(w.axis)
    for name in ("position", "cyclic_position", "home"):
        assert w.request(name) == c.ERROR_NEEDS_ENCODER and bytes(w.axis) == before, name
    assert w.learn() == c.ERROR_NEEDS_ENCODER and bytes(w.axis) == before


@pytest.mark.parametrize("source, error", ((0, "NONE"), (1, "NEEDS_SENSOR"), (2, "NONE")))
def test_without_a_sensor_there_is_no_cyclic_mode(c, source, error):
    w = Drive(c, "SPEED")
    w.axis.tuning.angle_source = source
    before = bytes(w.axis)
    for name in ("cyclic_speed", "cyclic_current"):
        assert w.request(name) == getattr(c, f"ERROR_{error}") and (error == "NONE" or bytes(w.axis) == before), name
    assert w.request("speed") == w.request("current") == c.ERROR_NONE


@pytest.mark.parametrize("who", OWNERS)
@pytest.mark.parametrize("typed, mode", (("csv 100", 9), ("cst 0.1", 10)))
def test_without_a_sensor_each_line_says_what_would_work(c, who, typed, mode):
    w = Commanding(c).started(who).operate()
    w.axis.tuning.angle_source = 1
    if who == "CONSOLE":
        assert not w.line(typed) and "an encoder or Hall switches" in w.refused and "'speed'" in w.refused
    else:
        assert w.write(who, 1, 0x6060, mode, 1) and w.refusal(who) == (c.ERROR_NEEDS_SENSOR, 0)
    assert w.axis.mode == c.AXIS_MODE_SPEED and not w.axis.set_point.waits


def test_the_observer_is_told_no_step_that_another_mode_made(c):
    """It is sped up by what the ramp moves: not by the 2000 rpm that the motor gained in control of torque."""
    w = Drive(c, "TORQUE")
    w.axis.tuning.angle_source = 1
    w.axis.loop.field_follows = 1
    for rpm_q16, speed in ((1000 << 16, w.axis.sensorless), (3000 << 16, w.axis.speed)):
        speed.ref_rpm_q16 = rpm_q16
    w.axis.speed.estimate.speed_rpm_q15 = 3000 << 15
    c.modes_enter(w.axis, c.AXIS_MODE_SPEED)
    w.axis.speed.target_rpm_q16 = w.axis.speed.ref_rpm_q16
    before = w.axis.loop.pll.speed_q32
    c.sensorless_after_control(w.axis)
    assert w.axis.loop.pll.speed_q32 == before and w.axis.sensorless.ref_rpm_q16 == 3000 << 16


@pytest.mark.parametrize("state, mode, request_name, fault", itertools.product(STATES, MODES, REQUESTS, (False, True)))
def test_every_request(c, state, mode, request_name, fault):
    """In operation it brings its mode about; else it is refused, and nothing has changed, to the byte. A fault ends all."""
    w = Drive(c, mode)
    w.put(state)
    before = bytes(w.axis)
    error = w.request(request_name)
    if state != "OPERATION_ENABLED":
        assert error == c.ERROR_NOT_OPERATING and bytes(w.axis) == before
        return
    if request_name == "cyclic_position":
        assert error == c.ERROR_BEYOND_CYCLE and bytes(w.axis) == before, "10 is far from where it is"
        c.drive_set_zero(w.axis)
        error = w.request(request_name)
        assert mode != "HOMING" or error == c.ERROR_BEYOND_CYCLE, "nobody sets a zero while homing looks for one"
        if mode == "HOMING":
            return
    assert error == c.ERROR_NONE and w.mode == REQUESTS[request_name][0]
    if fault:
        c.fault_raise(w.axis, c.FAULT_STALL)
        assert w.fabric.gate.CONTROL == 0 and w.step(3) == "FAULT"
        assert (w.axis.loop.i_d_ref_q15, w.axis.loop.i_q_ref_q15, w.axis.torque.torque_q15) == (0, 0, 0)
        assert w.request(request_name) == c.ERROR_NOT_OPERATING
    else:
        assert w.step() == "OPERATION_ENABLED"


@pytest.mark.parametrize("mode, request_name", itertools.product(MODES, ("quick_stop", "switch_off")))
def test_every_mode_is_left_by_a_stop(c, mode, request_name):
    w = Drive(c, mode)
    assert getattr(c, "drive_" + request_name)(w.axis).error == c.ERROR_NONE
    w.step()
    if request_name == "switch_off":
        assert w.state == "SWITCH_ON_DISABLED" and w.fabric.gate.CONTROL == 0
    else:
        assert w.mode == "SPEED" and w.axis.speed.target_rpm_q16 == 0


def go_on(w):
    """Set-points of position that go on as the shaft does."""
    if w.mode == "CYCLIC_POSITION":
        cyclic, loops = w.axis.motion.cyclic, 100 * w.axis.loop.loops_per_slow
        cyclic.distance, cyclic.period, cyclic.left = 100 * w.axis.motion.position.ref_speed, loops, loops
        cyclic.target = cyclic.now + cyclic.distance


@pytest.mark.parametrize("sign", (1, -1))
@pytest.mark.parametrize("before, after", [pair for pair in itertools.product(MODES, MODES) if pair[0] != pair[1]])
def test_no_transition_bumps(c, before, after, sign):
    """The torque of the first step in a mode is that of the last step before, as far as a mode of torque has been told nothing
    else; and the speed's reference goes on."""
    w = Drive(c, before, 300 * sign, 900 * sign)
    go_on(w)
    if before not in TORQUE_MODES:
        for _ in range(3):
            w.axis.motion.turns.counts += 20 * sign  # 300 rpm
            last = w.control()
    else:
        last = w.control()
    rpm = w.axis.speed.ref_rpm_q16 / 65536
    w.axis.torque_command_q15 = w.axis.torque.torque_q15
    c.modes_enter(w.axis, w.mode_code(after))
    go_on(w)
    w.axis.speed.target_rpm_q16 = w.axis.speed.ref_rpm_q16
    w.axis.motion.turns.counts += 20 * sign
    now = w.control()
    assert now == pytest.approx(last, abs=450), "3 % of i_max"
    if after not in TORQUE_MODES:
        assert w.axis.speed.ref_rpm_q16 / 65536 == pytest.approx(rpm, abs=9)


@pytest.mark.parametrize("sign", (1, -1))
@pytest.mark.parametrize("every", (20, 20.006, 19.994, 19.6, 20.4))
@pytest.mark.parametrize("name, to_ref", (
    ("cyclic_position", lambda w: w.axis.motion.position.ref / 2**w.axis.tuning.profile.shift),
    ("cyclic_speed", lambda w: w.axis.speed.ref_rpm_q16 / 65536)))
def test_a_masters_clock_that_is_not_the_drives_does_not_tick(c, every, name, to_ref, sign):
    """Set-points each 20 conversions of another clock: the line is straight within half a step, and a period late."""
    w, loops, rise = Drive(c, rpm=0), 20, sign * (30 if name == "cyclic_position" else 1)
    assert w.axis.loop.loops_per_slow == loops
    c.drive_set_zero(w.axis)
    w.axis.tuning.cyclic_ms = 1
    adc, sent, off = w.fabric.adc, 0, []
    for step in range(1, 1500):
        while sent * every < step * loops:
            adc.SEQUENCE = int(sent * every)
            assert getattr(c, "drive_command_" + name)(w.axis, sent * rise).error == c.ERROR_NONE
            sent += 1
        adc.SEQUENCE = w.axis.heartbeat = step * loops
        c.set_point_take(w.axis)
        w.axis.motion.turns.counts = round(to_ref(w)) if name == "cyclic_position" else 0
        w.control()
        off.append(to_ref(w) - rise * (step * loops - loops) / every)
    most = abs(rise) * (9 + 2 * abs(every - loops)) / loops  # what is less than half of a step is not followed
    assert max(map(abs, off[100:])) < most, (most, min(off[100:]), max(off[100:]))


@pytest.mark.parametrize("sign", (1, -1))
def test_a_cyclic_speed_begins_where_a_ramp_is_and_not_where_it_goes(c, sign):
    w = Drive(c, rpm=0)
    assert w.command("speed", 3000 * sign) == c.ERROR_NONE
    for _ in range(50):
        w.control()
    reached = w.axis.speed.ref_rpm_q16
    assert 0 < reached * sign < 2000 << 16
    c.modes_enter(w.axis, w.mode_code("CYCLIC_SPEED"))
    w.control()
    assert w.axis.speed.ref_rpm_q16 == pytest.approx(reached, abs=20 << 16)


def test_what_comes_early_or_late_within_a_step_does_not_move_the_reference(c):
    w, loops, rise, sent = Drive(c, rpm=0), 20, 30, 0
    c.drive_set_zero(w.axis)
    w.axis.tuning.cyclic_ms = 1
    draw, seen = random.Random(1), []
    for step in range(1, 400):
        w.fabric.adc.SEQUENCE = (step - 1) * loops + 7 + draw.randrange(7)
        assert c.drive_command_cyclic_position(w.axis, sent * rise).error == c.ERROR_NONE
        sent += 1
        w.fabric.adc.SEQUENCE = w.axis.heartbeat = step * loops
        c.set_point_take(w.axis)
        w.axis.motion.turns.counts = w.axis.motion.position.ref >> w.axis.tuning.profile.shift
        w.control()
        seen.append(w.axis.motion.position.ref / 2**w.axis.tuning.profile.shift)
    assert all(late - early == pytest.approx(rise, abs=0.05) for early, late in zip(seen[40:], seen[41:]))


@pytest.mark.parametrize("sign", (1, -1))
def test_a_cyclic_speed_that_rises_has_the_torque_of_a_ramp(c, sign):
    torques = []
    for name, value in (("speed", 1000 * sign), ("cyclic_speed", 310 * sign)):
        w = Drive(c, rpm=300 * sign, torque_q15=900 * sign)
        w.axis.params.ramp_rpm_s = 1000
        c.tuning_compute(w.axis.params, w.axis.tuning)
        w.axis.heartbeat = w.fabric.adc.SEQUENCE + w.axis.loop.loops_per_slow
        assert w.command(name, value) == c.ERROR_NONE
        torques.append([w.control() for _ in range(8)])
    assert torques[0] == pytest.approx(torques[1], abs=3) and torques[0][0] * sign - 900 > 50


@pytest.mark.parametrize("sign", (1, -1))
def test_at_full_speed_no_set_point_is_too_far(c, sign):
    """The one before counts, taken or not; one that comes too often is refused before the shaft has to jump."""
    w = Drive(c, rpm=0)
    c.drive_set_zero(w.axis)
    most = sign * (w.axis.params.speed_max_rpm * w.axis.params.encoder_counts * w.axis.tuning.cyclic_ms // 60000)
    assert w.command("cyclic_position", most) == c.ERROR_NONE
    assert c.drive_command_cyclic_position(w.axis, 2 * most + sign).error == c.ERROR_BEYOND_CYCLE
    assert c.drive_command_cyclic_position(w.axis, 2 * most).error == c.ERROR_NONE
    assert c.drive_command_cyclic_position(w.axis, 3 * most).error == c.ERROR_BEYOND_CYCLE


@pytest.mark.parametrize("sign", (1, -1))
def test_a_set_point_is_reached_when_the_next_is_due(c, sign):
    w = Drive(c, rpm=0)
    c.drive_set_zero(w.axis)
    w.axis.heartbeat = w.fabric.adc.SEQUENCE + w.axis.loop.loops_per_slow  # it comes right behind a step
    assert w.command("cyclic_position", 100 * sign) == c.ERROR_NONE
    shift, seen = w.axis.tuning.profile.shift, []
    for _ in range(w.axis.params.cyclic_ms):
        w.control()
        seen.append((w.axis.motion.position.ref >> shift))
    assert seen == [10 * sign * n for n in range(1, 11)]
    assert w.command("cyclic_speed", 200 * sign) == c.ERROR_NONE
    begun = w.axis.speed.ref_rpm_q16
    speeds = [w.control() and w.axis.speed.ref_rpm_q16 for _ in range(w.axis.params.cyclic_ms)]
    assert speeds[-1] == 200 * sign * 65536
    assert all(abs(b - a - (speeds[-1] - begun) / len(speeds)) < 2 for a, b in zip([begun, *speeds], speeds)), "a straight line"
    assert w.command("cyclic_current", 0) == c.ERROR_NONE
    torques = [w.control() for _ in range(w.axis.params.cyclic_ms)]
    assert torques[-1] == 0 and all(abs(b) <= abs(a) for a, b in zip(torques, torques[1:]))


@pytest.mark.parametrize("name, value, error", [
    (name, sign * most, error) for sign in (1, -1) for name, most, error in (
        ("speed", 4001, "BEYOND_SPEED_MAX"), ("cyclic_speed", 4001, "BEYOND_SPEED_MAX"), ("current", 10651, "BEYOND_I_MAX"),
        ("cyclic_current", 10651, "BEYOND_I_MAX"), ("cyclic_position", 2667, "BEYOND_CYCLE"))])
def test_what_is_beyond_a_limit_is_refused_and_the_limit_is_not(c, name, value, error):
    w = Drive(c, rpm=0)
    c.drive_set_zero(w.axis)
    before = bytes(w.axis)
    outcome = getattr(c, "drive_command_" + name)(w.axis, value)
    assert outcome.error == getattr(c, "ERROR_" + error) and bytes(w.axis) == before
    assert error != "BEYOND_CYCLE" or outcome.value == 2666
    assert getattr(c, "drive_command_" + name)(w.axis, value - (1 if value > 0 else -1)).error == c.ERROR_NONE


@pytest.mark.parametrize("sign", (1, -1))
def test_a_way_goes_on_from_the_last_target(c, sign):
    w = Drive(c, rpm=0)
    shift = w.axis.tuning.profile.shift
    here = w.axis.motion.turns.counts
    w.command("position", 50 * sign, True)
    assert w.axis.motion.profile.target >> shift == here + 50 * sign, "the first one from where the shaft is"
    w.command("position", -20 * sign, True)
    assert w.axis.motion.profile.target >> shift == here + 30 * sign
    w.command("position", -20 * sign, False)
    absolute = w.axis.motion.profile.target >> shift
    assert absolute % 2**32 == -20 * sign % 2**32, "and an absolute one is the nearest (test_wraps.py)"


@pytest.mark.parametrize("sign", (1, -1))
def test_a_zero_moves_what_refers_to_it_and_nothing_else(c, sign):
    w = Drive(c, "POSITION", rpm=0)
    w.command("position", 500 * sign, True)
    for _ in range(5):
        w.control()
    motion = w.axis.motion
    left = motion.profile.target - motion.profile.position
    error = motion.position.ref - (motion.turns.counts << w.axis.tuning.profile.shift)
    torque = w.axis.torque.torque_q15
    assert c.drive_set_zero(w.axis).error == c.ERROR_NONE
    assert motion.turns.counts == 0 and not motion.homed and motion.profile.position == motion.position.ref
    assert motion.profile.target - motion.profile.position == left and motion.position.ref == error
    assert w.axis.torque.torque_q15 == torque


def test_positions_survive_off_and_on(c):
    w = Drive(c)
    c.drive_set_zero(w.axis)
    c.drive_switch_off(w.axis)
    for count in (5, 900, 2000, 3100, 100, 1200):
        w.fabric.encoder.LATCHED = count
        w.fabric.encoder.EDGE_TIME += 1
        w.step()
    assert w.state == "SWITCH_ON_DISABLED" and w.axis.motion.turns.counts == 4000 + 1200
    w.axis.speed.speed_rpm_q4 = 0
    w.axis.loop.vbus_q15 = 13670
    w.axis.params.encoder_counts = 4000
    c.switch_on_at_once(w.axis)
    w.step()
    assert w.axis.motion.turns.counts == 5200
    c.drive_switch_off(w.axis)
    w.step(3)
    w.axis.params.encoder_counts = 8000
    w.axis.speed.speed_rpm_q4 = 0
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
    w.step()
    assert w.axis.motion.turns.counts == 0, "another encoder begins anew"


# ---- homing ----

def homing(c, method, rpm=30):
    w = Drive(c, rpm=0, home_rpm=rpm)
    w.c.tuning_compute(w.axis.params, w.axis.tuning)
    w.axis.motion.turns.count = w.axis.speed.estimate.count = 100
    w.fabric.encoder.STATUS = 1  # an index of long ago
    assert w.command("home", method) == c.ERROR_NONE
    assert w.axis.speed.target_rpm_q16 == rpm * 65536
    assert w.fabric.encoder.STATUS == 0, "which does not count"
    return w


@pytest.mark.parametrize("sign", (1, -1))
def test_the_index_becomes_the_zero_and_the_shaft_returns_to_it(c, sign):
    w = homing(c, c.HOMING_INDEX, 30 * sign)
    motion = w.axis.motion
    w.control()
    assert w.mode == "HOMING"
    motion.turns.count, motion.turns.counts = 1200, 51200
    w.fabric.encoder.STATUS, w.fabric.encoder.INDEX = 1, 1150
    w.control()
    assert w.mode == "POSITION" and motion.homed and motion.turns.counts == 50
    assert motion.profile.target >> w.axis.tuning.profile.shift == 0


@pytest.mark.parametrize("sign", (1, -1))
@pytest.mark.parametrize("travel, fails", ((4999, False), (5002, True)))
def test_no_index_within_a_turn_and_a_quarter_is_a_fault(c, travel, fails, sign):
    w = homing(c, c.HOMING_INDEX, 30 * sign)
    w.axis.motion.turns.counts += sign * travel
    w.control()
    assert (w.axis.faults.cause == c.FAULT_HOMING) == fails
    assert not fails or w.axis.faults.detail[0] == sign * travel


@pytest.mark.parametrize("sign", (1, -1))
@pytest.mark.parametrize("method, ms, fault", (("BLOCK", 100, None), ("INDEX", 500, "HOMING")))
def test_a_shaft_that_stands_at_its_limit_is_a_block_or_a_failure(c, method, ms, fault, sign):
    w = homing(c, getattr(c, "HOMING_" + method), 30 * sign)
    motion, begun = w.axis.motion, w.axis.motion.turns.counts
    for n in range(ms - 1):
        w.turn(0)
        w.axis.speed.at_limit = True
        motion.turns.counts = begun + n % 2
        w.control()
        assert w.mode == "HOMING" and w.axis.faults.cause == c.FAULT_NONE, n
    for _ in range(2):
        w.axis.speed.at_limit = True
        w.control()
    if fault:
        assert w.axis.faults.cause == c.FAULT_HOMING
    else:
        w.control()
        assert w.mode == "POSITION" and motion.homed and abs(motion.turns.counts) <= 1
        assert abs(w.axis.torque.torque_q15) < 200, "it no longer pushes"


def test_a_shaft_that_moves_or_has_current_to_spare_is_at_no_block(c):
    for at_limit, way in ((True, 2), (False, 0)):
        w = homing(c, c.HOMING_BLOCK)
        for _ in range(300):
            w.axis.speed.at_limit = at_limit
            w.axis.motion.turns.counts += way
            w.control()
            w.axis.speed.at_limit = False
        assert w.mode == "HOMING"


def test_homing_takes_no_more_current_than_it_may(c):
    w = homing(c, c.HOMING_BLOCK, -30)
    c.modes_limit_torque(w.axis)
    assert w.axis.torque.i_limit_q15 == w.axis.tuning.home_i_q15 < w.axis.tuning.i_max_q15
    assert w.axis.torque.limits.high <= w.axis.tuning.home_i_q15 + 1


@pytest.mark.parametrize("rpm", (0, 4001, -4001))
def test_homing_needs_a_speed_that_there_is(c, rpm):
    w = Drive(c)
    w.axis.params.home_rpm = rpm
    assert w.command("home", c.HOMING_INDEX) == c.ERROR_HOME_SPEED and w.mode == "SPEED"


# ---- learning ----

def known(c, w, q15):
    """A map whose torque is the same everywhere: of order 0."""
    m = w.axis.motion.cogging
    m.count, m.harmonics[0].order, m.harmonics[0].cos_q23 = 1, 0, q15 * 256
    c.cogging_set_fade(m, 60)


@pytest.mark.parametrize("mode", MODES)
def test_what_the_place_asks_for_is_added_before_the_limits_and_to_no_wish_for_torque(c, mode):
    plain, w = Drive(c, mode, rpm=0, torque_q15=0), Drive(c, mode, rpm=0, torque_q15=0)
    known(c, w, 700)
    expected = 0 if mode in TORQUE_MODES else 700
    assert w.control() - plain.control() == pytest.approx(expected, abs=2)
    for low, high in ((-100, 300), (0, 0), (-20000, 0)):
        w.axis.torque.limits.low, w.axis.torque.limits.high, w.axis.time_ms = low, high, 0  # the next step leaves them
        assert low <= w.control() <= high
        assert w.axis.speed.at_limit == (mode not in TORQUE_MODES and high < 700), "the memory must stop, too"


@pytest.mark.parametrize("state", STATES)
def test_learning_begins_in_operation_only(c, state):
    w = Drive(c, rpm=0)
    w.put(state)
    before = bytes(w.axis)
    error = w.learn()
    if state != "OPERATION_ENABLED":
        assert error == c.ERROR_NOT_OPERATING and bytes(w.axis) == before
    else:
        assert error == c.ERROR_NONE and w.mode == "LEARNING"
        assert w.learn() == c.ERROR_LEARNING


def test_learning_turns_forth_and_back_and_ends_at_rest_with_a_map(c):
    w = Drive(c, rpm=0)
    motion = w.axis.motion
    assert w.learn() == c.ERROR_NONE
    targets = []
    for _ in range(20000):
        rpm = w.axis.speed.target_rpm_q16 >> 16 if targets else 0
        targets.append(rpm)
        motion.turns.counts += rpm * 4
        w.axis.speed.estimate.travel_q15 = rpm << 15
        motion.turns.count = w.axis.speed.estimate.count = motion.turns.counts % 4000
        w.control()
        c.drive_learn(w.axis)
        if w.mode != "LEARNING":
            break
    assert w.mode == "SPEED" and w.axis.speed.target_rpm_q16 == 0 and motion.cogging.count > 0
    assert {rpm for rpm in targets} == {0, 10, -10} and targets.count(10) == pytest.approx(4500 / 40, abs=3)


def test_a_learning_that_is_stopped_leaves_the_map_as_it_was(c):
    w = Drive(c, rpm=0)
    known(c, w, 123)
    w.learn()
    w.axis.motion.learn.phase = c.COGGING_BACK
    w.command("speed", 0)
    w.axis.motion.learn.phase = c.COGGING_REVIEW
    c.drive_learn(w.axis)
    assert w.axis.motion.cogging.count == 1 and w.axis.motion.cogging.harmonics[0].cos_q23 == 123 * 256


def test_a_speed_for_learning_beyond_speed_max_is_refused(c):
    w = Drive(c)
    w.axis.params.learn_rpm, w.axis.params.speed_max_rpm = 50, 49
    assert w.learn() == c.ERROR_LEARN_SPEED and w.mode == "SPEED"


@pytest.mark.parametrize("mode", ("SPEED", "CYCLIC_SPEED", "POSITION"))
def test_where_a_flux_limit_decides_the_speed_loop_is_told(c, mode):
    for decides in (True, False):
        w = Drive(c, mode)
        w.axis.torque.flux.decides = decides
        w.control()
        assert w.axis.speed.torque_is_slow == decides
