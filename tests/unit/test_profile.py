# SPDX-License-Identifier: MIT
"""The profile: its limits and its end under random targets, its time against the optimum; places by a count."""
import math
import random

import pytest

LIVES, STEPS, JERK_MOST_MS = 60, 2000, 250
PATIENCE = 400_000


class Course:
    """A profile under its limits, held to them by N times the mean in each step: nothing is rounded there."""

    def __init__(self, c, v, a, window, position=0, speed=0):
        self.c, self.profile, self.limits = c, c.profile(), c.tuning_profile()
        self.limits.v_max, self.limits.a_max, self.limits.window, self.limits.window_q30 = v, a, window, 2**30 // window
        c.profile_begin(self.profile, self.limits, position, speed)
        self.a, self.n, self.v_limit = a, window, max(abs(speed), v)
        self.sum, self.change = self.profile.sum, 0

    def step(self):
        p = self.profile
        self.c.profile_step(p, self.limits)
        change, p_sum = p.sum - self.sum, p.sum
        assert abs(p_sum) <= self.n * self.v_limit and abs(change) <= self.n * self.a
        assert abs(change - self.change) <= self.a + 1, "a step without a push may add one unit to a change"
        assert 0 <= p.carry < self.n and p.steps * self.a == p.level
        self.sum, self.change = p_sum, change

    def go(self, target):
        """The steps until it stands there."""
        p = self.profile
        p.target = target
        for steps in range(1, PATIENCE):
            self.step()
            if p.position == target and p.corner_speed == p.sum == 0:
                return steps
        raise AssertionError(f"no end: {p.target - p.position} are left")


def test_targets_on_the_way_keep_the_limits_and_the_last_one_is_reached_to_the_unit(c):
    draw = random.Random(1)
    for _ in range(LIVES):
        a = draw.randint(1, 1 << draw.randint(1, 21))
        v = draw.randint(a, 1 << 22)
        fastest = min(1000 * a, 1 << 22)  # it can stop within a test's patience
        course = Course(c, v, a, draw.randint(1, draw.randint(1, JERK_MOST_MS)), draw.randint(-10**6, 10**6),
                        draw.randint(-fastest, fastest))
        reach, often = 1 << draw.randint(1, 36), draw.randint(1, 400)
        for _ in range(STEPS):
            if draw.randrange(often) == 0:
                course.profile.target = course.profile.position + draw.randint(-reach, reach)
            course.step()
        most = min(1000 * v, 4_000_000 * a)  # within a test's patience, too
        course.go(course.profile.position + draw.randint(-most, most))


def optimum(distance, v, a, window):
    """The time of seven segments from rest to rest, with jerk a / window: the peak speed by bisection."""
    jerk = a / window

    def ramp_time(speed):
        return speed / a + window if speed >= a * window else 2 * math.sqrt(speed / jerk)

    if v * ramp_time(v) <= distance:
        return 2 * ramp_time(v) + (distance - v * ramp_time(v)) / v
    low, high = 0.0, float(v)
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if middle * ramp_time(middle) < distance else (low, middle)
    return 2 * ramp_time(high)


def moved(c, distance, v, a, window):
    return Course(c, v, a, window).go(distance)


# speed, acceleration, window in units and steps: as of 4000 rpm at 5000 rpm/s and 50 ms, of 60 at 600, without jerk's limit
LIMITS = [(4194304, 5242, 50), (4194304, 41943, 100), (4194304, 200000, 8), (3000000, 90000, 1)]


@pytest.mark.parametrize("v, a, window", LIMITS)
def test_from_where_the_acceleration_is_reached_the_time_is_the_optimum(c, v, a, window):
    """But for a few steps: speeds are those of whole steps, and the window holds one more than itself."""
    for distance in (2 * a * window * window, 5 * a * window * window, v * v // a, 2 * v * v // a, 40 * v * v // a):
        if distance >= 2 * a * window * window:
            best = optimum(distance, v, a, window)
            assert best - 2 < moved(c, distance, v, a, window) < 1.005 * best + 5, distance


@pytest.mark.parametrize("v, a, window", LIMITS)
def test_a_short_way_takes_two_windows_at_least_and_never_more_than_that_beyond_the_optimum(c, v, a, window):
    for distance in (1, 7, 1000, a, a * window // 3, a * window * window // 8, a * window * window // 2):
        best = optimum(distance, v, a, window)
        assert best - 2 < moved(c, distance, v, a, window) < best + 2.2 * window + 5, distance


def test_the_position_of_a_count_is_the_nearest(c):
    """Less than half a turn from here, whichever turn this is."""
    draw = random.Random(5)
    for turn in (64, 400, 4001, 65536):
        for _ in range(1000):
            position, way = draw.randrange(-10**12, 10**12), draw.randint(-((turn - 1) // 2), (turn - 1) // 2)
            assert c.turns_at(c.turns(counts=position, count=position % turn), (position + way) % turn, turn) == position + way
