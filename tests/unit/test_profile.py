# SPDX-License-Identifier: MIT
"""The profile: its limits and its end under a million random targets, its time against the optimum; places by a count."""
import math
import os
import random
import subprocess
from pathlib import Path

import pytest

from rigs.firmware import ROOT

HERE = Path(__file__).resolve().parent
RETARGETS = 1_000_000
WINDOW_MOST = 250


@pytest.fixture(scope="module")
def harness(tmp_path_factory):
    program = tmp_path_factory.mktemp("profile") / "harness"
    command = [os.environ.get("HOSTCC") or "cc", "-std=gnu11", "-O2", "-fsanitize=undefined", "-fno-sanitize-recover=all",
               "-Wall", "-Wextra", "-Werror", f"-I{ROOT}", HERE / "profile_harness.c",
               ROOT / "firmware/control/profile.c", "-o", program]
    subprocess.run(list(map(str, command)), check=True)
    return lambda *words: subprocess.run([program, *map(str, words)], capture_output=True, text=True)


def test_a_million_targets_on_the_way_keep_the_limits_and_the_last_one_is_reached_to_the_unit(harness):
    result = harness("random", 1, RETARGETS)
    assert result.returncode == 0, result.stdout + result.stderr
    assert int(result.stdout) >= RETARGETS


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


def moved(harness, distance, v, a, window):
    result = harness("move", v, a, window, distance)
    assert result.returncode == 0, result.stdout
    steps, end = map(int, result.stdout.split())
    assert end == distance
    return steps


# speed, acceleration, window in units and steps: as of 4000 rpm at 5000 rpm/s and 50 ms, of 60 at 600, without jerk's limit
LIMITS = [(4194304, 5242, 50), (4194304, 41943, 100), (4194304, 200000, 8), (3000000, 90000, 1)]


@pytest.mark.parametrize("v, a, window", LIMITS)
def test_from_where_the_acceleration_is_reached_the_time_is_the_optimum(harness, v, a, window):
    """But for a few steps: speeds are those of whole steps, and the window holds one more than itself."""
    for distance in (2 * a * window * window, 5 * a * window * window, v * v // a, 2 * v * v // a, 40 * v * v // a):
        if distance >= 2 * a * window * window:
            best = optimum(distance, v, a, window)
            assert best - 2 < moved(harness, distance, v, a, window) < 1.005 * best + 5, distance


@pytest.mark.parametrize("v, a, window", LIMITS)
def test_a_short_way_takes_two_windows_at_least_and_never_more_than_that_beyond_the_optimum(harness, v, a, window):
    for distance in (1, 7, 1000, a, a * window // 3, a * window * window // 8, a * window * window // 2):
        best = optimum(distance, v, a, window)
        assert best - 2 < moved(harness, distance, v, a, window) < best + 2.2 * window + 5, distance


def test_the_position_of_a_count_is_the_nearest(c):
    """Less than half a turn from here, whichever turn this is."""
    draw = random.Random(5)
    for turn in (64, 400, 4001, 65536):
        for _ in range(1000):
            position, way = draw.randrange(-10**12, 10**12), draw.randint(-((turn - 1) // 2), (turn - 1) // 2)
            assert c.turns_at(c.turns(position, position % turn), (position + way) % turn, turn) == position + way
