# SPDX-License-Identifier: MIT
"""Overmodulation: what reaches the motor is the fundamental that was asked for, whatever the PWM rate."""
import math
import os
import re
import subprocess

import numpy as np
import pytest

from rigs.firmware import HERE, ROOT
from rigs.motor_numbers import compute, shipped

SIX = 2 / math.pi
RATES = (8000, 10000, 16000, 20000, 40000)


def fundamental(length, angles=7200):
    """Of a vector whose duties are cut at both ends of the period, by Fourier's integral; in shares of the bus."""
    turn = (np.arange(angles) + 0.5) * 2 * np.pi / angles
    phases = length * np.cos(turn - np.array([[0], [2], [4]]) * np.pi / 3)
    cut = np.clip(phases - (phases.max(0) + phases.min(0)) / 2, -0.5, 0.5)
    return 2 * float(np.mean(cut[0] * np.cos(turn)))


def length_for(wanted):
    low, high = 0.5, 2.0
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if fundamental(middle, 1800) < wanted else (low, middle)
    return high


def test_the_table_is_the_inverse_of_what_cutting_leaves():
    text = (ROOT / "firmware/control/current_loop_step.h").read_text()
    table = [int(word) for word in re.findall(r"\d+", re.search(r"overmodulation_gain_q12\[.*?\] = \{(.*?)\}", text, re.S)[1])]
    assert len(table) == 33
    for n, gain_q12 in enumerate(table):
        wanted = math.sqrt(1 / 3 + (SIX**2 - 1 / 3) * n / 32)
        if n == 0:
            assert gain_q12 == 4096  # where the linear range ends
        else:
            assert gain_q12 == pytest.approx(4096 * length_for(wanted) / wanted, rel=2e-3, abs=1.5), n


@pytest.fixture(scope="module", params=RATES)
def sweep(request, tmp_path_factory):
    """Rows of (asked for, got, angle, 5th, 7th, counts off the circle's modulator); all but the last two in six-step's."""
    target = tmp_path_factory.mktemp("sweep") / "overmodulation_sweep"
    sources = [ROOT / "lib/trig.c", ROOT / "lib/polar.c"]
    command = [os.environ.get("HOSTCC") or "cc", "-std=gnu11", "-O2", "-Wall", "-Werror", f"-DCONFIG_PWM_HZ={request.param}",
               f"-I{HERE / 'host'}", f"-I{ROOT}", str(HERE / "overmodulation_sweep.c"), *map(str, sources), "-lm", "-o",
               str(target)]
    subprocess.run(command, check=True)
    output = subprocess.run([target], check=True, capture_output=True, text=True).stdout
    return request.param, [[float(word) for word in line.split()] for line in output.splitlines()]


def test_what_is_asked_for_is_what_there_is(sweep):
    """Up to 98.5 % of six-step's, without a turn; but for what is shorter than dead times and pulse, and half of that is."""
    hz, rows = sweep
    shortest = 2.02e-6 * hz  # of a period: two dead times and a pulse
    assert len(rows) == 200
    for asked, got, angle, *_ in rows:
        assert abs(angle) < 0.004
        assert abs(got - asked) < (0.004 + shortest / 2 if 0.7 < asked < 0.96 else 0.006) or asked > 0.985, asked
    assert max(row[1] for row in rows) > 0.99
    assert all(-0.001 < after[1] - before[1] < 0.006 + shortest / 2 for before, after in zip(rows, rows[1:]))


def test_within_the_circle_it_is_the_other_modulator(sweep):
    _, rows = sweep
    assert max(row[5] for row in rows) <= 1
    linear = [row for row in rows if row[0] < 0.7]
    assert max(max(row[3], row[4]) for row in linear) < 0.001


def test_near_six_step_its_harmonics_are_six_steps(sweep):
    """A fifth and a seventh."""
    last = sweep[1][-1]
    assert last[3] == pytest.approx(1 / 5, abs=0.035) and last[4] == pytest.approx(1 / 7, abs=0.035)


def test_shunts_do_not_see_a_phase_that_stays_high(c):
    beyond = {**shipped(), "overmodulation": 50}
    assert compute(c, {**beyond, "low_side_shunts": 1})[0] == "ERROR_OVERMODULATION_OF_SHUNTS"
    assert compute(c, {**beyond, "low_side_shunts": 0})[0] == "ERROR_NONE"
