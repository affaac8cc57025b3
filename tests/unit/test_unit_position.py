# SPDX-License-Identifier: MIT
"""The position loop: its margin against the closed loop in complex numbers, its units against rationals, its step by hand."""
import cmath
import ctypes
import math
import random
from fractions import Fraction

import pytest
from launcher.data import MOTORS, available

from rigs.motor_numbers import compute, shipped, struct

PI = Fraction(314159265358979323846264338328, 10**29)


def margin_deg(p, position_bw_hz):
    """Of w_p / s T, T the closed speed loop of margins.h: at the first frequency where that is 1."""
    w, delay = 2 * math.pi * p["speed_bw_hz"], (1.175 + (p["torque_mean_ms"] - 1) / 2) * 1e-3

    def opened(hz):
        s = 2j * math.pi * hz
        speed = w / s * (1 + w / (4 * s)) * cmath.exp(-s * delay) * cmath.exp(-1j * math.atan(hz / p["current_bw_hz"]))
        return 2 * math.pi * position_bw_hz / s * speed / (1 + speed)
    hz = position_bw_hz / 4
    while abs(opened(hz)) > 1:
        hz *= 1.0005
    return 180 + math.degrees(cmath.phase(opened(hz)))


@pytest.mark.parametrize("speed_bw_hz, current_bw_hz, mean_ms",
                         [(60, 1000, 1), (30, 1000, 3), (8, 1000, 1), (2, 300, 1), (36, 1000, 3)])
def test_the_margin_and_its_limit(c, speed_bw_hz, current_bw_hz, mean_ms):
    p = {**shipped(), "encoder_counts": 40000, "speed_bw_hz": speed_bw_hz, "current_bw_hz": current_bw_hz,
         "torque_mean_ms": mean_ms}
    for hz in range(1, max(2, speed_bw_hz // 2)):
        got = c.margin_of_position_u16(hz, struct(c, p)) * 360 / 65536
        assert got == pytest.approx(margin_deg(p, hz), abs=0.3), hz
    limit = c.margin_position_bw_hz(struct(c, p))
    assert limit == 0 or margin_deg(p, limit) > 59.7
    assert margin_deg(p, limit + 1) < 60.3
    if limit > 0:
        assert compute(c, {**p, "position_bw_hz": limit})[0] == "ERROR_NONE"
    assert compute(c, {**p, "position_bw_hz": limit + 1})[:2] == ("ERROR_POSITION_MARGIN", limit)
    assert compute(c, {**p, "position_bw_hz": 0})[0] == "ERROR_NONE", "a fifth of the speed loop's always works"


def test_each_unit_and_gain_is_what_it_says(c):
    draw = random.Random(8)
    for _ in range(300):
        p = {**shipped(draw.choice(available(MOTORS))), "encoder_counts": draw.choice([400, 4000, 40000, 65536]),
             "profile_rpm_s": draw.choice([0, 37, 5000, 900000]), "profile_speed_pm": draw.randint(1, 1000),
             "profile_jerk_ms": draw.randint(1, 250), "following_mturn": draw.randint(1, 10**6),
             "home_pct": draw.randint(1, 100)}
        error, _, t = compute(c, p)
        if error != "ERROR_NONE":
            continue
        unit = Fraction(1, p["encoder_counts"] << t.profile.shift)  # turns
        full = Fraction(p["speed_max_rpm"], 60000) / unit
        assert full <= 2**22 and (full > 2**21 or t.profile.shift == 24)
        v = Fraction(p["speed_max_rpm"] * p["profile_speed_pm"], 60000 * 1000) / unit
        a = Fraction(p["profile_rpm_s"] or p["ramp_rpm_s"], 60000 * 1000) / unit
        assert abs(t.profile.v_max - max(v, 1)) <= 1 and abs(t.profile.a_max - min(max(a, 1), t.profile.v_max)) <= 1
        assert (t.profile.window, t.profile.window_q30) == (p["profile_jerk_ms"], 2**30 // p["profile_jerk_ms"])
        rpm_q16 = 60000 * unit * 65536
        assert abs(Fraction(t.rpm_per_unit_q20, 2**20) / rpm_q16 - 1) < Fraction(1, 10**5)
        gain = rpm_q16 * 2 * PI * Fraction(p["speed_bw_hz"], 5) / 1000
        assert abs(Fraction(t.position_gain_q21, 2**21) / gain - 1) < Fraction(1, 1000)
        assert t.following_units == p["following_mturn"] * (p["encoder_counts"] << t.profile.shift) // 1000
        assert t.home_i_q15 == t.i_max_q15 * p["home_pct"] // 100


@pytest.fixture
def loop(c):
    """A position loop of the initial parameters with a speed loop that has been still for long, and edges in each step."""
    tuning = compute(c, shipped())[2]
    speed, turns, position = c.speed_loop(), c.turns(), c.position_loop()
    c.speed_loop_init(speed)
    c.speed_loop_tune(speed, tuning)
    speed.estimate.interval_clocks = 1000
    return tuning, speed, turns, position


def step(c, loop, next_ref, limits=(-20000, 20000)):
    tuning, speed, turns, position = loop
    return c.position_step(position, next_ref, speed, turns, tuning, c.interval(low=limits[0], high=limits[1]))


def middle(loop, counts):
    shift = loop[0].profile.shift
    return (counts << shift) + (1 << shift >> 1)


def test_within_a_count_of_its_place_a_shaft_at_rest_is_left_alone(c, loop):
    _, speed, turns, position = loop
    for off in (-1, 0, 1):
        c.position_begin(position, middle(loop, 1000 + off), 0)
        turns.counts = 1000
        assert step(c, loop, middle(loop, 1000 + off)) == 0 and speed.ref_rpm_q16 == 0
        assert position.error_counts == off


@pytest.mark.parametrize("off", (2, -2, 40, -1000))
def test_beyond_the_answer_is_the_bandwidths(c, loop, off):
    """2 pi 12 Hz times the error, of which a count does not count, nor what is beyond following_mturn, 400 counts."""
    tuning, speed, turns, position = loop
    c.position_begin(position, middle(loop, off), 0)
    step(c, loop, middle(loop, off))
    counts_s = 2 * math.pi * 12 * min(abs(off) - 1, 400) * math.copysign(1, off)
    assert speed.ref_rpm_q16 / 65536 == pytest.approx(counts_s / 4000 * 60, rel=2e-3)


def test_on_the_way_speed_and_acceleration_are_fed_forward(c, loop):
    """At its place, at 600 rpm: the reference is that; the torque is what 100 rpm more in a millisecond take."""
    tuning, speed, turns, position = loop
    units = round(600 / 60000 * 4000 * 2**tuning.profile.shift)
    ref = 5 << tuning.profile.shift
    turns.counts = 5
    c.position_begin(position, ref, units)
    speed.estimate.speed_rpm_q15 = speed.estimate.travel_q15 = 600 << 15
    torque = step(c, loop, ref + units + units // 6)
    assert speed.ref_rpm_q16 / 65536 == pytest.approx(600, abs=0.01)
    assert torque == pytest.approx((tuning.speed_accel_q8 * 100 * 65536 >> 10) / 2**14, rel=0.01)
    assert position.ref_speed == units + units // 6


def test_the_answer_ends_at_speed_max(c, loop):
    tuning, speed, turns, position = loop
    tuning.following_units = 1 << 62
    for sign in (1, -1):
        c.position_begin(position, sign * middle(loop, 10**9), 0)
        step(c, loop, sign * middle(loop, 10**9))
        assert speed.ref_rpm_q16 == sign * tuning.speed_max_rpm_q4 << 12


def test_a_following_error_counts_from_its_window_on_and_after_four_steps(c, loop):
    tuning, speed, turns, position = loop
    position.error = tuning.following_units
    assert not any(c.position_is_lost(position, tuning) for _ in range(20))
    for sign in (1, -1):
        position.far_ms, position.error = 0, sign * (tuning.following_units + 1)
        assert [c.position_is_lost(position, tuning) for _ in range(5)] == [False, False, False, True, True]


def test_within_its_count_the_shaft_is_where_edges_and_time_say(c, loop):
    tuning, speed, turns, _ = loop
    shift, e = tuning.profile.shift, speed.estimate
    turns.counts = -3
    count_way = 60000 * 32768 / 4000
    for backwards, beyond, part in ((0, 0.25, 0.25), (1, -0.25, 0.75), (0, 7.0, 1.0), (1, -9.0, 0.0)):
        e.backwards, e.beyond_q15 = backwards, round(beyond * count_way)
        assert c.position_of_shaft(turns, e, tuning, True) / 2**shift == pytest.approx(-3 + part, abs=1e-3)
        assert c.position_of_shaft(turns, e, tuning, False) == middle(loop, -3)


@pytest.mark.parametrize("sign", (1, -1))
def test_only_errors_without_a_break_add_up_to_a_following_error(c, sign):
    loop, tuning = c.position_loop(), c.tuning()
    tuning.following_units = 100
    for error in (101, 100) * 500:
        loop.error = error * sign
        assert not c.position_is_lost(loop, tuning)
    loop.error = 101 * sign
    assert [c.position_is_lost(loop, tuning) for _ in range(5)] == [False, False, False, True, True]


@pytest.mark.parametrize("sign", (1, -1))
def test_a_shaft_that_moves_at_the_current_limit_is_at_no_block(c, sign):
    homing, turns, view = c.homing(), c.turns(), c.homing_view()
    view.turns, view.turn, view.farthest, view.at_limit = ctypes.pointer(turns), 4000, 10**6, True
    c.homing_begin(homing, c.HOMING_BLOCK, turns)
    for _ in range(1000):
        turns.counts += 2 * sign
        assert c.homing_step(homing, view) == c.HOMING_SEARCHES
    results = []
    for n in range(200):
        turns.counts += sign * (-1) ** n  # it yields by a count
        results.append(c.homing_step(homing, view))
    assert results.index(c.HOMING_FOUND) in range(97, 103)
