# SPDX-License-Identifier: MIT
"""Parts of the modulator beyond the circle: a vector becomes longer and does not turn, a compare near an end goes to it."""
import math
from fractions import Fraction

import pytest


def gain(c, square):
    """By the table: at equal steps of the square between vbus / sqrt(3) and six-step's, straight lines in between."""
    place = min(max(Fraction(square - c.host_overmodulation_from.value, c.host_overmodulation_squares.value), 0), 1) * 32
    table, n = c.host_overmodulation_gain_q12, min(int(place), 31)
    return float(table[n] + (table[n + 1] - table[n]) * (place - n)) / 4096


@pytest.mark.parametrize("degrees", (0, 30, 45, 90, 135, 180, 225, 270, 300, 315))
@pytest.mark.parametrize("share", (0.1, 0.5, 0.906, 0.92, 0.95, 0.97, 0.985, 0.999))
def test_stage_overmodulate_makes_a_vector_longer_whatever_its_direction(c, degrees, share):
    """Of six-step's length; the result is in quarters."""
    length = c.host_six_steps.value * share
    d, q = (round(length * f(math.radians(degrees))) for f in (math.cos, math.sin))
    longer = c.host_overmodulate_longer(d, q)
    times = gain(c, d * d + q * q)
    assert longer.d == pytest.approx(d * times / 4, rel=0.004, abs=1.5)
    assert longer.q == pytest.approx(q * times / 4, rel=0.004, abs=1.5)
    assert times == 1 if share < 0.91 else times > 1


def test_stage_overmodulate_compares_stay_at_an_end_or_are_off_it_by_a_pulse(c):
    """In counts of a half period: what lies between an end and the shortest pulse goes to the nearer of both."""
    half, edge = c.host_half_counts.value, c.host_overmodulate_edge.value
    for counts in range(-50, half + 51):
        got = c.host_overmodulate_phase((counts << 17) + 5, 0)
        near, far = edge // 2, half - edge // 2
        expected = 0 if counts < near else half if counts > far else min(max(counts, edge), half - edge)
        assert got == expected, counts
    assert half == 2500 and edge == 100 + 1


@pytest.mark.parametrize("share_q7", (-128, -64, 0, 64, 128))
def test_stage_overmodulate_gives_back_what_dead_time_takes(c, share_q7):
    """All of it at a share of 1.0: half a dead time in each half period."""
    got = c.host_overmodulate_phase(1000 << 17, share_q7)
    assert got - 1000 == pytest.approx(100 / 2 * share_q7 / 128, abs=1)
