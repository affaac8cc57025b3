# SPDX-License-Identifier: MIT
"""What the slow loop prepares for the current loop, against exact fractions: volts over ohms, henries, webers and the bus."""
import ctypes
import random
from fractions import Fraction

import pytest

from rigs.motor_numbers import FULL, PI, PWM_HZ, compute, shipped

KI_MAX, KP_MAX, TURN_MAX = 21845, 16384, 11900
LIVE = 1


@pytest.fixture
def loop(c):
    """A loop that works, of the initial motor on 24 V."""
    loop, fabric, tuning = c.current_loop(), c.fabric(), compute(c, shipped())[2]
    c.current_loop_init(loop)
    c.current_loop_tune(loop, tuning)
    fabric.adc.VBUS = 13670
    c.current_loop_on(loop, fabric, tuning)
    return loop, fabric, tuning


def near(got, exact, off=1):
    assert abs(got - exact) <= off, (got, float(exact))


def test_before_the_first_use(c):
    loop = c.current_loop()
    c.current_loop_init(loop)
    assert loop.status_max == 2**32 - 1 and loop.sine and loop.source == c.LOOP_ENCODER and not loop.handlers
    assert (loop.kp_d_q9, loop.kp_q_q9, loop.ki_q15, loop.i_d_ref_q15, loop.i_q_ref_q15) == (0, 0, 0, 0, 0)


def test_the_circle_is_what_v_d_leaves(c):
    """The largest |v_q| beside the farthest v_d of its interval: never outside the circle, and no more than a step inside."""
    loop = c.current_loop()
    c.current_loop_init(loop)
    count = len(loop.circle_steps)
    radius = max(loop.circle_steps) + 1
    width = 32768 // count
    for n, most in enumerate(loop.circle_steps):
        low = (n - count // 2) * width
        farthest = max(abs(low), abs(low + width - 1))
        assert farthest**2 + most**2 <= radius**2 or most == 0, n
        assert farthest >= radius or most >= (radius**2 - farthest**2) ** 0.5 - 6, n


def test_switching_on_sets_the_thresholds_and_clears_what_is_old(c, loop):
    loop, fabric, tuning = loop
    assert (fabric.adc.I_TRIP, fabric.adc.SUM_TRIP, fabric.adc.V_MIN, fabric.adc.V_MAX) == (
        tuning.i_trip_q15, tuning.i_sum_q15, tuning.v_min_q15, tuning.v_max_q15)
    assert fabric.gate.CONTROL == 1 and loop.status_max == LIVE
    loop.i_d_ref_q15, loop.i_q_ref_q15, loop.integral_d_q9, loop.integral_q_q9 = 7, 8, 9, 10
    loop.feedforward_d_steps, loop.feedforward_q_steps = 11, 12
    fabric.adc.STATUS = 2
    c.current_loop_on(loop, fabric, tuning)
    assert fabric.adc.STATUS == 0
    assert (loop.i_d_ref_q15, loop.i_q_ref_q15, loop.integral_d_q9, loop.integral_q_q9) == (0, 0, 0, 0)
    assert (loop.feedforward_d_steps, loop.feedforward_q_steps) == (0, 0) and loop.kp_d_q9 > 0


def test_switching_off(c, loop):
    loop, fabric, tuning = loop
    loop.i_d_ref_q15, loop.i_q_ref_q15, loop.integral_d_q9, loop.integral_q_q9 = 7, 8, 9, 10
    loop.feedforward_d_steps, loop.feedforward_q_steps = 11, 12
    c.current_loop_off(loop, fabric)
    for _ in range(2):
        assert fabric.gate.CONTROL == 0 and loop.status_max == 2**32 - 1
        assert (loop.i_d_ref_q15, loop.i_q_ref_q15, loop.integral_d_q9, loop.integral_q_q9) == (0, 0, 0, 0)
        assert (loop.kp_d_q9, loop.kp_q_q9, loop.ki_q15, loop.feedforward_d_steps, loop.feedforward_q_steps) == (0,) * 5
        c.current_loop_follow(loop, fabric, tuning)  # changes nothing of that


@pytest.mark.parametrize("vbus_q15", (13670, 10300, 20000, 5000))
def test_gains_are_those_of_the_motor_on_this_bus(c, loop, vbus_q15):
    """Kp = w L, Ki Ts = w R Ts; in steps per LSB of current, and kp + ki (lib/pi.h). No bus is taken below v_min."""
    loop, fabric, tuning = loop
    p = {**shipped(), "lq_uh": 350}
    tuning = compute(c, p)[2]
    fabric.adc.VBUS = vbus_q15
    c.current_loop_follow(loop, fabric, tuning)
    bus_v = Fraction(max(vbus_q15, tuning.v_min_q15), 32768) * Fraction(p["v_range_mv"], 1000)
    ampere = Fraction(p["i_range_ma"], 1000) / 32768
    w = 2 * PI * p["current_bw_hz"]
    ki = w * Fraction(p["resistance_mohm"], 1000) / PWM_HZ * ampere / bus_v * FULL * 32768
    near(loop.ki_q15, ki, 3)
    for axis in "dq":
        kp = w * Fraction(p[f"l{axis}_uh"], 10**6) * ampere / bus_v * FULL * 512
        near(getattr(loop, f"kp_{axis}_q9"), kp + ki / 64, 3)


@pytest.mark.parametrize("up", (1, -1))
def test_gains_wait_until_the_bus_has_moved_by_one_in_128(c, loop, up):
    loop, fabric, tuning = loop
    before, gain = fabric.adc.VBUS, loop.kp_d_q9
    fabric.adc.VBUS = before + up * (before // 130)
    c.current_loop_follow(loop, fabric, tuning)
    assert (loop.gains_vbus_q15, loop.kp_d_q9) == (before, gain)
    fabric.adc.VBUS = before + up * (before // 126)
    c.current_loop_follow(loop, fabric, tuning)
    assert loop.gains_vbus_q15 == fabric.adc.VBUS and (gain - loop.kp_d_q9) * up > 0


IRON = {"lq_uh": 350, "lq_rest_uh": 2100, "i_rated_ma": 8000}


@pytest.mark.parametrize("wish_a, flows_a", [(0, 0), (2, 0), (8, 8), (0, 8), (-8, 1), (10, 1)])
def test_where_iron_saturates_qs_gain_is_that_of_the_present_current(c, loop, wish_a, flows_a):
    """1 / L grows with the square of the larger current, from 1 / lq_rest to 1 / lq at the rated one. d's gain stays."""
    loop, fabric, _ = loop
    p = {**shipped(), **IRON}
    tuning = compute(c, p)[2]
    per_a = Fraction(32768 * 1000, p["i_range_ma"])
    loop.i_q_ref_q15, loop.i_q_q15 = round(wish_a * per_a), round(flows_a * per_a)
    c.current_loop_follow(loop, fabric, tuning)
    square = Fraction(max(abs(wish_a), flows_a), 8)**2
    inductance = 1 / (Fraction(1, 2100) + square * (Fraction(1, 350) - Fraction(1, 2100)))
    ampere = Fraction(p["i_range_ma"], 1000) / 32768
    bus_v = Fraction(13670, 32768) * Fraction(p["v_range_mv"], 1000)
    ki, exact = Fraction(loop.ki_q15, 64), 2 * PI * p["current_bw_hz"] * inductance / 10**6 * ampere / bus_v * FULL * 512
    assert loop.kp_q_q9 == pytest.approx(float(exact + ki), rel=0.01)
    before = loop.kp_d_q9
    loop.i_q_ref_q15 = loop.i_q_q15 = 0
    c.current_loop_follow(loop, fabric, tuning)
    assert loop.kp_d_q9 == before and loop.kp_q_q9 == pytest.approx(float(exact * 2100 / inductance + ki), rel=0.01)


def test_a_prescribed_field_has_no_q_axis_of_the_rotor(c, loop):
    """There the rotor's d may lie: with the gain of its q without current the loop would swing."""
    loop, fabric, _ = loop
    tuning = compute(c, {**shipped(), **IRON})[2]
    plain = compute(c, {**shipped(), **IRON, "lq_rest_uh": 0})[2]
    loop.source = c.LOOP_FORCED
    c.current_loop_follow(loop, fabric, plain)
    gain = loop.kp_q_q9
    c.current_loop_follow(loop, fabric, tuning)
    assert loop.kp_q_q9 == gain
    loop.source = c.LOOP_ENCODER
    c.current_loop_follow(loop, fabric, tuning)
    assert loop.kp_q_q9 > 5 * gain


def test_gains_stay_within_what_the_controller_takes(c, loop):
    loop, fabric, tuning = loop
    tuning.kp_d_q12, tuning.kp_q_q12, tuning.ki_q17, tuning.v_min_q15, fabric.adc.VBUS = 32767, 32767, 32767, 4000, 9000
    c.current_loop_follow(loop, fabric, tuning)
    assert (loop.kp_d_q9, loop.kp_q_q9, loop.ki_q15) == (KP_MAX, KP_MAX, KI_MAX)
    for wish in (0, -32768, 32767):
        tuning.iron_rest_q15, tuning.iron_grows_q10, loop.i_q_ref_q15 = 1, 65535, wish
        c.current_loop_follow(loop, fabric, tuning)
        assert 0 < loop.kp_q_q9 <= KP_MAX


def frame(loop, c, hz, forced):
    """The rotor at `hz`, or the field while the rotor does something else."""
    w_q32 = round(hz / PWM_HZ * 2**32)
    loop.source = c.LOOP_FORCED if forced else c.LOOP_ENCODER
    loop.field_speed_q32 = w_q32 if forced else -99999999
    loop.pll.speed_q32 = 88888888 if forced else w_q32


@pytest.mark.parametrize("update, periods", ((0, Fraction(3, 2)), (1, 1), (2, Fraction(1, 2))))
@pytest.mark.parametrize("forced", (False, True))
@pytest.mark.parametrize("hz", (0, 100, -100, 700, -700, 1249, -1249))
def test_the_frame_turns_on_until_the_voltages_act(c, loop, hz, forced, update, periods):
    """By when they act, in radians; limited where the voltages would leave the circle."""
    loop, fabric, tuning = loop
    tuning = compute(c, {**shipped(), "pwm_update": update})[2]
    c.current_loop_tune(loop, tuning)
    frame(loop, c, hz, forced)
    c.current_loop_follow(loop, fabric, tuning)
    exact = periods * hz / PWM_HZ * 2 * PI * 32768
    near(loop.turn_q15, max(-TURN_MAX, min(TURN_MAX, exact)), 2)


@pytest.mark.parametrize("update, periods", ((1, Fraction(3, 4)), (2, Fraction(1, 4))))
@pytest.mark.parametrize("forced", (False, True))
@pytest.mark.parametrize("hz", (0, 700, -700, 1249, -1249))
def test_two_samples_see_the_same_speed_and_act_sooner(c, loop, hz, forced, update, periods):
    """The observer's speed is that of half a period; as w_q15 it is what it was, and so is all that is made of it."""
    loop, fabric, _ = loop
    told = {**shipped(), "pwm_update": update, "low_side_shunts": 0}
    tunings = [compute(c, {**told, "pwm_samples": samples})[2] for samples in (1, 2)]
    seen = []
    for samples, tuning in zip((1, 2), tunings):
        c.current_loop_tune(loop, tuning)
        frame(loop, c, Fraction(hz, samples), forced)
        loop.i_d_ref_q15, loop.i_q_ref_q15, loop.feedforward_d_steps, loop.feedforward_q_steps = -3000, 5000, 0, 0
        c.current_loop_follow(loop, fabric, tuning)
        rpm_q4 = round(Fraction(hz, samples) / PWM_HZ * 2**32) * tuning.rpm_q4_per_w_q32 >> 32
        seen.append((loop.feedforward_d_steps, loop.feedforward_q_steps, rpm_q4))
    near(loop.turn_q15, periods * hz / PWM_HZ * 2 * PI * 32768, 2)
    assert seen[0] == pytest.approx(seen[1], abs=2)
    assert loop.loops_per_slow == 40


def test_voltages_that_had_to_wait_are_counted_from_on_to_on(c, loop):
    loop, fabric, tuning = loop
    for status, count in ((0x03, 0), (0x13, 1), (0x43, 2), (0x73, 3), (0x07, 3), (0x20, 4)):
        fabric.pwm.STATUS = status
        c.current_loop_follow(loop, fabric, tuning)
        assert loop.fell_back == count
    c.current_loop_tune(loop, tuning)
    assert loop.fell_back == 0


@pytest.mark.parametrize("forced", (False, True))
@pytest.mark.parametrize("most_hz, most_i, off, told", (
    (300, 12000, 10, {"ld_uh": 300, "lq_uh": 500, "current_bw_hz": 500}),
    (1000, 30000, 240, {"ld_uh": 15000, "lq_uh": 19000, "current_bw_hz": 50})))
def test_decoupling_in_volts(c, loop, forced, most_hz, most_i, off, told):
    """v_d = -w Lq i_q, v_q = w (Ld i_d + psi), within the bus: added to the integrals as it changes, and once."""
    loop, fabric, _ = loop
    p = {**shipped(), **told}
    error, _, tuning = compute(c, p)
    assert error != "ERROR_DECOUPLING"
    draw = random.Random(2)
    integral_d, integral_q = 1000, -2000
    loop.integral_d_q9, loop.integral_q_q9 = integral_d, integral_q
    for _ in range(200):
        hz = draw.uniform(-most_hz, most_hz)
        i_d, i_q, vbus = draw.randint(-most_i, most_i // 4), draw.randint(-most_i, most_i), draw.randint(11000, 20000)
        frame(loop, c, hz, forced)
        loop.i_d_ref_q15, loop.i_q_ref_q15, fabric.adc.VBUS = i_d, i_q, vbus
        c.current_loop_follow(loop, fabric, tuning)
        ampere, bus_v = p["i_range_ma"] / 1000 / 32768, vbus / 32768 * p["v_range_mv"] / 1000
        w = 2 * float(PI) * hz
        v_d = -w * p["lq_uh"] * 1e-6 * i_q * ampere
        v_q = w * (p["ld_uh"] * 1e-6 * i_d * ampere + p["flux_uwb"] * 1e-6)
        near(loop.feedforward_d_steps, max(-1, min(v_d / bus_v, 1)) * FULL, off)
        near(loop.feedforward_q_steps, max(-1, min(v_q / bus_v, 1)) * FULL, off)
        assert loop.integral_d_q9 == integral_d + loop.feedforward_d_steps * 512
        assert loop.integral_q_q9 == integral_q + loop.feedforward_q_steps * 512


def test_no_feed_forward_beyond_the_bus(c, loop):
    loop, fabric, tuning = loop
    tuning.emf_q12 = 32767
    for hz, sign in ((1200, 1), (-1200, -1)):
        frame(loop, c, hz, False)
        c.current_loop_follow(loop, fabric, tuning)
        near(loop.feedforward_q_steps, sign * FULL)


def test_what_is_published(c, loop):
    loop, fabric, tuning = loop
    fabric.adc.VBUS, loop.v_d_steps, loop.v_q_steps = 14000, -5000, 12345
    c.current_loop_follow(loop, fabric, tuning)
    assert loop.vbus_q15 == 14000
    near(loop.v_d_q15, Fraction(-5000 * 14000, FULL))
    near(loop.v_q_q15, Fraction(12345 * 14000, FULL))
    radius = max(loop.circle_steps)
    near(loop.radius_q15, Fraction(radius * 14000, FULL), 2)


def test_another_handler_only_while_the_bridge_is_off(c, loop):
    loop, fabric, _ = loop
    fabric.gate.STATUS = LIVE
    assert not c.current_loop_select(loop, fabric, c.LOOP_FORCED) and loop.source == c.LOOP_ENCODER
    fabric.gate.STATUS = 0
    assert c.current_loop_select(loop, fabric, c.LOOP_FORCED) and loop.source == c.LOOP_FORCED


@pytest.mark.parametrize("ripple", (0, 100))
def test_the_vector_follows_source_and_ripple(c, loop, ripple):
    """Only the hand-written handler knows no ripple; another one has its place then."""
    loop, fabric, _ = loop
    handlers, vector = c.loop_handlers(), ctypes.c_void_p(1)
    numbers = {source: 16 * (1 + source) for source in range(c.LOOP_SOURCES)}
    for source, number in numbers.items():
        handlers.handler[source] = number
    handlers.rippled = 256
    handlers.vector = ctypes.cast(ctypes.pointer(vector), type(handlers.vector))
    loop.handlers, loop.ripple_q10, fabric.gate.STATUS = ctypes.pointer(handlers), ripple, 0
    for source, number in numbers.items():
        assert c.current_loop_select(loop, fabric, source)
        assert vector.value == (256 if source == c.LOOP_ENCODER and ripple else number)


def test_the_prescribed_field(c, loop):
    loop, _, _ = loop
    c.current_loop_field(loop, 0x12345678, -77)
    assert (loop.field_angle_q32, loop.field_speed_q32) == (0x12345678, -77)


@pytest.mark.parametrize("way", (1, -1))
@pytest.mark.parametrize("on, source, weakens", ((1, "ENCODER", True), (0, "ENCODER", False), (1, "OBSERVER", False)))
def test_current_loop_follow_turns_the_voltages_or_leaves_that_to_the_weakening_handlers(c, loop, way, on, source, weakens):
    """1.5 periods and half an update on: by so much the rotor turns until a voltage acts; those turn it themselves, in Q32."""
    loop, fabric, tuning = loop
    loop.weaken.on, loop.source, loop.weaken.turn_q32 = on, getattr(c, f"LOOP_{source}"), 99
    loop.pll.speed_q32, loop.field_follows = way * 1000 << loop.w_shift, 2**32 - 1
    c.current_loop_follow(loop, fabric, tuning)
    turn = 1000 * loop.turn_per_w_q15 // 32768
    assert turn > 100 and abs(loop.turn_q15 - way * turn) <= 1
    if weakens:
        assert loop.v_turn_q15 == 0
        assert loop.weaken.turn_q32 == (loop.turn_q15 * round(2**17 / 2 / 3.14159265)) % 2**32
    else:
        assert (loop.v_turn_q15, loop.weaken.turn_q32) == (loop.turn_q15, 99)
