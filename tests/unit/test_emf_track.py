# SPDX-License-Identifier: MIT
"""What follows the EMF of a rotor that turns: against a straight line by numpy, with noise, and where a rotor slows down."""
import random

import numpy as np
import pytest

TURN = 2**32
NOISE_DEG = 10.0


def signed(x):
    return (int(x) + TURN // 2) % TURN - TURN // 2


def track(c, angles, every, speed):
    t = c.emf_track()
    c.emf_track_begin(t, 1000, round(angles[0]) % TURN, round(speed))
    for n, angle in enumerate(angles[1:], 1):
        c.emf_track_add(t, (1000 + n * every) % TURN, round(angle) % TURN)
    return t


@pytest.mark.parametrize("hz", (500, 60, -500, -3))
def test_it_is_the_straight_line_of_least_squares(c, hz):
    """Ten looks of 10 degrees of noise, the speed at first 10 % off; by sums over all looks, and not by a filter."""
    draw, every, speed = random.Random(hz), 20, hz / 20000 * TURN
    angles = [0.3 * TURN + speed * every * n + draw.gauss(0, NOISE_DEG / 360) * TURN for n in range(10)]
    t = track(c, angles, every, speed * 1.001)
    slope, start = np.polyfit(np.arange(10) * every, angles, 1)
    told = emf_angle(t, 1000 + 9 * every)
    assert abs(signed(told - round(start + slope * 9 * every))) < TURN * 1.5 / 360
    assert abs(t.speed_q32 - slope) * every < TURN * 0.5 / 360


def emf_angle(t, at):
    return (t.angle_q32 + t.speed_q32 * (at - t.at)) % TURN


def test_good_looks_are_counted_in_a_row(c):
    t = track(c, [0.0] * 8, 20, 0)
    assert (t.looks, t.good) == (8, 7)
    c.emf_track_add(t, t.at + 20, round(TURN * 25 / 360))
    assert t.good == 0, "25 degrees from where it was expected"


def test_a_rotor_that_slows_down_is_followed(c):
    """From 200 Hz by 1000 Hz a second: at the end within 5 degrees and 7 Hz, where a line through all would be 30 Hz off."""
    every, ms = 20, np.arange(60)
    angles = (0.2 * ms - 0.5e-3 * ms**2) * TURN
    t = track(c, angles, every, 0.2 / every * TURN)
    assert abs(signed(t.angle_q32 - round(angles[-1]))) < TURN * 5 / 360
    assert t.speed_q32 * 20000 / TURN == pytest.approx(200 - 59, abs=7)


@pytest.mark.parametrize("turn_a_look", (0.02, 0.3, 0.45, -0.2, -0.45))
def test_from_nothing_the_second_look_tells_the_speed(c, turn_a_look):
    """Any angle to begin with, also across zero: the third look is where it is expected."""
    for first in (0.0, 0.9, 0.99):
        t = c.emf_track()
        for n in range(5):
            c.emf_track_add_any(t, (2**32 - 30 + 20 * n) % 2**32, round((first + turn_a_look * n) * TURN) % TURN)
            if n >= 1:
                assert abs(t.speed_q32 * 20 - turn_a_look * TURN) < TURN / 1000 and t.looks == n + 1
        assert t.good == 3
