# SPDX-License-Identifier: MIT
"""What the observer tells the speed loop: the speed, and for how long it has not been known."""
import math

import pytest

from rigs.drive import World
from rigs.motor_numbers import compute, shipped

# 2 / a of a double pole at a, in samples times track: which is 2 a by the sample's rate, in turns with 17 more bits
SETTLES = 2 * 2 * 2**17 / (2 * math.pi)


@pytest.fixture
def seen(c):
    """The estimate behind a look at the observer."""
    w = World(c)
    w.axis.params.angle_source = 1
    w.axis.tuning = compute(c, {**shipped(), "angle_source": 1})[2]
    w.axis.loop.source = c.LOOP_OBSERVER

    def look(track, speed_q32=5_000_000, live=True):
        w.axis.loop.status_max, w.axis.loop.flux.track, w.axis.loop.pll.speed_q32 = 1 if live else 2**32 - 1, track, speed_q32
        estimate = w.axis.speed.estimate
        estimate.moved, estimate.beyond_q15, estimate.lost = 7, 8, False
        c.rotor_take_speed(w.axis)
        return estimate
    return look


@pytest.mark.parametrize("track", (1, 2, 3, 100, 4096))
@pytest.mark.parametrize("live", (True, False))
def test_rotor_the_slower_it_is_tracked_the_older_its_speed(seen, track, live):
    assert seen(track, live=live).interval_clocks == pytest.approx(SETTLES * 5000 / track, rel=1e-4)


@pytest.mark.parametrize("track", (0, -1))
def test_rotor_that_is_not_tracked_yet_counts_as_tracked_quickly(seen, track):
    """Nobody has set a gain: it is no division by nothing."""
    assert seen(track).interval_clocks == seen(4096).interval_clocks


@pytest.mark.parametrize("speed_q32", (5_000_000, -5_000_000, 0))
def test_rotor_speed_is_the_observers_while_the_loop_works(seen, speed_q32):
    rpm = speed_q32 / 2**32 * 20000 * 60 / 4
    for live, expected in ((True, rpm), (False, 0)):
        estimate = seen(100, speed_q32, live)
        assert estimate.speed_rpm_q15 / 32768 == pytest.approx(expected, rel=1e-4, abs=1e-3)
        assert estimate.travel_q15 == estimate.speed_rpm_q15
        assert (estimate.moved, estimate.beyond_q15, estimate.lost) == (0, 0, True), "no encoder: none of its counts"
