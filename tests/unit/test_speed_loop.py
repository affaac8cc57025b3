# SPDX-License-Identifier: MIT
"""The speed loop's step against a model in whole numbers of its own, and what the model cannot say: that it is a PI at all."""
import random
from types import SimpleNamespace

import pytest

from rigs.motor_numbers import compute, shipped

FULL_GAIN_CLOCKS, ONE_Q29 = 150000, 1 << 29


def clamp(x, low, high):
    return max(low, min(high, x))


class Model:
    """Torque wanted of a speed, by the equations: units as in the header, floor where bits go."""

    def __init__(self, tuning):
        self.t, self.kp, self.ki, self.integral = tuning, tuning.speed_kp_q16, tuning.speed_ki_q16, 0
        self.error_max = clamp(((1 << 43) - 1) // self.kp, 1, 2**31 - 1)
        self.ref = self.target = 0
        self.at_limit, self.slow = False, False

    def answer(self, error, gain):
        return clamp(error, -self.error_max, self.error_max) * gain >> 13

    def step(self, now, slope, low, high):
        move = clamp(self.target - self.ref, -slope, slope)
        ahead_q4 = (self.ref >> 12) - now.rpm_q4
        behind = ahead_q4 > 0 if move > 0 else ahead_q4 < 0
        if not (self.at_limit and behind):
            self.ref += move
        ref_q15, ki = self.ref >> 1, self.ki
        error = ref_q15 - now.rpm_q15
        if now.interval > FULL_GAIN_CLOCKS:
            share = (FULL_GAIN_CLOCKS << 14) // now.interval
            scaled = self.ki * share * share >> 28
            ki = max(scaled, min(self.t.speed_ki_min_q16, self.ki)) if self.ref else scaled
            error = error * share >> 14
        if self.slow:
            error, ki = error >> 2, ki >> 4
        answer = self.answer(error, self.kp)
        wanted = self.integral + answer + clamp(self.t.speed_accel_q8 * move >> 10, -ONE_Q29, ONE_Q29)
        growth_of = (ref_q15 - now.travel_q15, ki)
        self.at_limit = not low << 14 <= wanted <= high << 14
        growth = self.answer(*growth_of)
        if not self.at_limit or (growth > 0) != (wanted > 0):
            self.integral = clamp(self.integral + growth, low << 14, high << 14)
        return wanted >> 14


def made(c, **params):
    tuning = compute(c, {**shipped(), **params})[2]
    speed = c.speed_loop()
    c.speed_loop_init(speed)
    c.speed_loop_tune(speed, tuning)
    return speed, tuning


def show(speed, now):
    speed.estimate.speed_rpm_q15, speed.estimate.travel_q15 = now.rpm_q15, now.travel_q15
    speed.estimate.interval_clocks, speed.speed_rpm_q4 = now.interval, now.rpm_q4


def seen(rpm, travel=None, interval=1000):
    rpm_q15 = round(rpm * 32768)
    return SimpleNamespace(rpm_q15=rpm_q15, rpm_q4=rpm_q15 >> 11, interval=interval,
                           travel_q15=rpm_q15 if travel is None else round(travel * 32768))


@pytest.mark.parametrize("spread, interval", ((2, 1000), (30, 1000), (400, 1000), (5, 400000), (100, 3000000), (4, None)))
def test_each_step_is_the_models(c, spread, interval):
    draw = random.Random(spread)
    for _ in range(12):
        speed, tuning = made(c, speed_bw_hz=draw.choice((5, 20, 60)))
        c.speed_loop_allow_less(speed, False)
        model = Model(tuning)
        rpm = 0.0
        for n in range(150):
            if n % 40 == 0:
                target = draw.choice((0, 1, -3, 500, -1500, 4000)) * 65536
                slope = draw.choice((tuning.ramp_q16, 4 * tuning.ramp_q16, 65536 * 100))
                low, high = -draw.choice((0, 300, 14805)), draw.choice((0, 300, 14805))
                speed.torque_is_slow = model.slow = draw.random() < 0.2
            speed.target_rpm_q16 = model.target = target
            rpm = clamp(model.ref / 65536 + draw.uniform(-spread, spread), -5000, 5000)
            now = seen(rpm, rpm + draw.uniform(-1, 1), interval or draw.choice((1000, 149999, 150000, 150001, 900000)))
            show(speed, now)
            wanted = c.speed_loop_step(speed, tuning, slope, c.interval(low=low, high=high))
            assert wanted == model.step(now, slope, low, high), n
            assert (speed.integral_q29, speed.ref_rpm_q16, speed.at_limit) == (model.integral, model.ref, model.at_limit), n
            assert (speed.kp_q16, speed.ki_q16) == (model.kp, model.ki), n
            assert speed.speed_ref_rpm_q4 == model.ref >> 12


def test_the_gains_in_amperes_per_rpm(c):
    """A step of the error answers with Kp at once, and grows with Ki each millisecond."""
    speed, tuning = made(c, speed_bw_hz=20)
    show(speed, seen(-2))
    limits = c.interval(low=-14805, high=14805)
    kp, ki = tuning.speed_kp_q16 * 32 / 65536, tuning.speed_ki_q16 * 32 / 65536  # of 2 rpm in Q4
    for n in range(20):
        assert abs(c.speed_loop_step(speed, tuning, 1000, limits) - (kp + n * ki)) <= 1
    assert speed.integral_q29 > 0


@pytest.mark.parametrize("mean_ms", [1, 2, 3, 4])
def test_the_wish_is_the_mean_of_the_last(c, mean_ms):
    """Of each wish as it would be without; from the torque of the reset on."""
    draw = random.Random(mean_ms)
    alone, smooth = made(c)[0], made(c)[0]
    tuning = made(c)[1]
    limits, wished = c.interval(low=-14805, high=14805), [1000] * 4
    c.speed_loop_reset(alone, 1000)
    c.speed_loop_reset(smooth, 1000)
    for n in range(60):
        now = seen(draw.uniform(-30, 30))
        show(alone, now)
        show(smooth, now)
        tuning.torque_mean_ms = 1
        wished.append(c.speed_loop_step(alone, tuning, 1000, limits))
        tuning.torque_mean_ms = mean_ms
        asked = c.speed_loop_step(smooth, tuning, 1000, limits)
        assert asked == int(sum(wished[-mean_ms:]) / mean_ms), n
        assert smooth.integral_q29 == alone.integral_q29
    assert max(wished) - min(wished) > 1000


def test_reset_takes_up_what_is(c):
    speed, _ = made(c)
    show(speed, seen(1234.5))
    speed.at_limit = speed.torque_is_slow = True
    c.speed_loop_reset(speed, -1000)
    assert not speed.torque_is_slow, "identify and the modes begin anew"
    assert speed.ref_rpm_q16 == speed.target_rpm_q16 == 1234.5 * 65536
    assert speed.speed_ref_rpm_q4 == 1234.5 * 16 and speed.integral_q29 == -1000 << 14 and not speed.at_limit


def test_the_smallest_gain_leaves_no_error_beyond_reach(c):
    speed, tuning = made(c)
    tuning.speed_kp_q16 = 1
    c.speed_loop_tune(speed, tuning)
    assert speed.error_max_q15 == 2**31 - 1
    tuning.speed_kp_q16 = 2**31 - 1
    c.speed_loop_tune(speed, tuning)
    assert speed.error_max_q15 == ((1 << 43) - 1) // (2**31 - 1)


@pytest.mark.parametrize("way", (1, -1))
@pytest.mark.parametrize("beyond", (1.0, 1.5, 40.0))
def test_the_feed_forward_is_no_more_than_the_range(c, way, beyond):
    """An acceleration of the range's whole torque, and more."""
    speed, tuning = made(c)
    speed.kp_q16 = speed.ki_q16 = 0
    slope_q16 = 1 << 21
    tuning.speed_accel_q8 = round(beyond * 2**39 / slope_q16)
    speed.target_rpm_q16 = way * 30000 * 65536
    assert c.speed_loop_step(speed, tuning, slope_q16, c.interval(low=-32768, high=32768)) == way * 32768
    tuning.speed_accel_q8 //= round(2 * beyond)
    assert c.speed_loop_step(speed, tuning, slope_q16, c.interval(low=-32768, high=32768)) == pytest.approx(
        way * 32768 * beyond / round(2 * beyond), abs=1)


@pytest.mark.parametrize("way", (1, -1))
def test_a_sum_beyond_the_word_keeps_its_direction(c, way):
    """The integral twice the range, the response twice, the feed-forward once: all one way."""
    speed, tuning = made(c, speed_bw_hz=60)
    show(speed, seen(-way * 20000))
    c.speed_loop_reset(speed, way * 65534)
    wanted = c.speed_loop_follow(speed, tuning, way * 20000 * 65536, way * 2**30, c.interval(low=-14805, high=14805))
    assert wanted == (2**31 - 1 if way > 0 else -2**31) >> 14
