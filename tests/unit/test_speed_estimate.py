# SPDX-License-Identifier: MIT
"""The speed estimate against exact edge times: 100 to 10 000 lines, 1 rpm to full speed, edges that are not evenly spaced."""
import math
import random

import pytest

from rigs.motor_numbers import compute, shipped

CLOCK_HZ, SLOW_S = 100_000_000, 1e-3
EVEN, ODD = (0.0, 0.0, 0.0, 0.0), (-0.08, -0.04, 0.08, 0.12)  # edges from their places, in counts: 2 % asymmetry, 1 % phase
LINES = (100, 1000, 10000)


class Encoder:
    """At position(t) in counts, monotone; the counter reads 0 where it stands at first."""

    def __init__(self, c, counts, places=EVEN):
        self.regs, self.counts, self.places = c.encoder_regs(), counts, places
        self.clock0 = 0xFFFF0000  # the clock wraps soon after the start
        self.edge_s = 0.0

    def edge(self, n):
        return n + self.places[n % 4]

    def count_at(self, position):
        n = math.floor(position)
        return n - 1 if position < self.edge(n) else (n + 1 if position >= self.edge(n + 1) else n)

    def show(self, t_s, position, edge_s=None):
        """`edge_s` is when the last edge came."""
        self.edge_s = edge_s if edge_s is not None else self.edge_s
        self.regs.LATCHED = self.count_at(position) % self.counts
        self.regs.EDGE_TIME = (self.clock0 + round(self.edge_s * CLOCK_HZ)) % 2**32
        self.regs.LATCH_TIME = (self.clock0 + round(t_s * CLOCK_HZ)) % 2**32


class Shaft:
    """Turns at speeds set one after the other; knows when the last edge passed."""

    def __init__(self, c, lines, places=EVEN, start=0.37):
        values = {**shipped(), "encoder_counts": 4 * lines}
        self.c, self.counts = c, 4 * lines
        self.tuning = compute(c, values)[2]
        self.encoder, self.estimate = Encoder(c, self.counts, places), c.speed_estimate()
        c.speed_estimate_reset(self.estimate)
        self.t_s, self.position, self.start, self.counted = 0.0, start, start, 0.0
        self.count = self.encoder.count_at(start)

    def step(self, rpm):
        """A slow period at a speed; the estimate in rpm."""
        rate = rpm / 60 * self.counts
        before, after = self.position, self.position + rate * SLOW_S
        count = self.encoder.count_at(after)
        edge_s = None
        if count != self.count:
            edge = self.encoder.edge(count if count > self.count else count + 1)
            edge_s = self.t_s + (edge - before) / rate
        self.t_s += SLOW_S
        self.position, self.count = after, count
        self.encoder.show(self.t_s, after, edge_s)
        self.c.speed_estimate_step(self.estimate, self.encoder.regs, self.tuning)
        self.counted += self.estimate.travel_q15
        return self.estimate.speed_rpm_q15 / 32768

    def run(self, rpm, seconds):
        return [self.step(rpm) for _ in range(round(seconds / SLOW_S))]

    def counted_counts(self):
        return self.counted / 32768 / 60000 * self.counts


def seconds_of(lines, rpm, edges):
    return max(1.0, edges / (rpm / 60 * 4 * lines))


@pytest.mark.parametrize("lines", LINES)
@pytest.mark.parametrize("rpm", [1, 7.3, 33, 290, 1499, 6000, 25000])
def test_steady_speed(c, lines, rpm):
    """Right to 2/256 of a count with even edges, to 6/256 with uneven ones, once a few hundred have passed; and all that is
    turned is counted."""
    sign = 1 if round(rpm) % 2 else -1
    counts = max(1, rpm / 60 * 4 * lines * SLOW_S)  # between two readings of the speed
    for places, parts in ((EVEN, 2), (ODD, 6)):
        shaft = Shaft(c, lines, places)
        if counts > 256:  # edges are learned at less
            shaft.run(sign * rpm * 7.3 / counts, 2.0)
        shaft.run(sign * rpm, seconds_of(lines, rpm, 700) + 4 * (rpm == 1499))
        speeds = shaft.run(sign * rpm, seconds_of(lines, rpm, 20))
        assert max(abs(speed - sign * rpm) for speed in speeds) <= (parts / 256 / counts + 5e-5) * rpm + 1e-4
        assert abs(shaft.counted_counts() - (shaft.position - shaft.start)) < 1.2 + 1e-5 * abs(shaft.position)


@pytest.mark.parametrize("lines", LINES)
def test_whole_turns_are_told(c, lines):
    """What it says to have moved adds up to the way: half a turn a step, changed by less than a quarter of one."""
    draw = random.Random(lines)
    shaft, rpm, moved = Shaft(c, lines), 0.0, 0
    shaft.step(0)
    for _ in range(3000):
        rpm = max(-30000.0, min(30000.0, rpm + draw.uniform(-13500, 13500)))
        shaft.step(rpm)
        moved += shaft.estimate.moved
        assert moved == shaft.count - shaft.encoder.count_at(shaft.start)


def test_uneven_edges_before_they_are_learned(c):
    """Why it learns: without, 100 lines at 290 rpm would be read 10 % off."""
    shaft = Shaft(c, 100, ODD)
    first = shaft.run(290, 0.02)
    assert 0.05 < max(abs(speed / 290 - 1) for speed in first[5:]) < 0.25
    shaft.run(290, 0.6)
    assert [place / 65536 for place in shaft.estimate.edge_offset_q16] == pytest.approx(
        [place - sum(ODD) / 4 for place in ODD], abs=0.012)


@pytest.mark.parametrize("lines", LINES)
@pytest.mark.parametrize("from_rpm, to_rpm", [(100, 200), (1000, 10), (30, -30), (-2000, 500), (0, 50)])
def test_a_step_has_settled_with_the_third_edge(c, lines, from_rpm, to_rpm):
    """To what the change has moved edges from their places, 1/128 of a count."""
    shaft = Shaft(c, lines)
    shaft.run(from_rpm, 0.5)
    edge_s = 60 / (abs(to_rpm) * 4 * lines)
    shaft.run(to_rpm, 3 * edge_s + 2 * SLOW_S)
    for speed in shaft.run(to_rpm, 0.1):
        assert speed == pytest.approx(to_rpm, rel=0.012)


@pytest.mark.parametrize("lines", LINES)
def test_a_shaft_that_stops(c, lines):
    """Without edges it turns by less than a count in that time; at rest the estimate goes to zero and stays there."""
    shaft = Shaft(c, lines, ODD)
    shaft.run(500, 0.3)
    since_s = shaft.t_s - shaft.encoder.edge_s
    for _ in range(2000):
        since_s += SLOW_S
        speed = shaft.step(0)
        assert 0 <= speed <= 1.13 * 60 / (shaft.counts * since_s)
    assert all(speed == 0 for speed in shaft.run(0, 3)[1500:])


def test_a_shaft_that_swings_over_an_edge_does_not_turn(c):
    """Up and down over one edge every 2 ms: no speed, no way."""
    encoder, estimate = Encoder(c, 400), c.speed_estimate()
    tuning = compute(c, {**shipped(), "encoder_counts": 400})[2]
    c.speed_estimate_reset(estimate)
    for n in range(300):
        up = n // 2 % 2
        encoder.show(n * SLOW_S, 4.1 if up else 3.9, (n // 2 * 2 - 0.5) * SLOW_S)
        c.speed_estimate_step(estimate, encoder.regs, tuning)
        if n > 4:
            assert (estimate.speed_rpm_q15, estimate.travel_q15) == (0, 0)


def test_an_edge_after_the_clock_has_gone_round(c):
    """43 s at rest: the clock shows an edge 10 ms after the last. It is the first edge of all that counts no speed."""
    shaft = Shaft(c, 1000)
    shaft.run(20, 0.5)
    for _ in range(3500):  # the estimate gives up after 2.7 s
        shaft.step(0)
    shaft.t_s += 2**32 / CLOCK_HZ - 3.5 + 0.01
    assert max(abs(speed) for speed in shaft.run(0.0001, 0.005)) == 0
    speeds = shaft.run(20, 0.3)
    assert max(abs(speed) for speed in speeds) < 20.1 and speeds[-1] == pytest.approx(20, rel=1e-3)


def test_readings_of_two_triggers_are_not_mixed(c):
    """read_encoder() reads again while LATCH_TIME moves; what it takes belongs together."""
    shaft = Shaft(c, 1000)
    shaft.run(300, 0.1)
    assert shaft.estimate.count == shaft.encoder.regs.LATCHED
    assert shaft.estimate.clock == shaft.encoder.regs.EDGE_TIME


@pytest.mark.parametrize("rpm", [16000, 29000, 32000])
def test_more_than_half_a_turn_in_a_step(c, rpm):
    shaft = Shaft(c, 500)
    for slower in range(0, rpm, 400):
        shaft.step(slower)
    assert shaft.run(rpm, 0.2)[-1] == pytest.approx(rpm, rel=1e-4)
    for slower in range(rpm, -rpm, -400):
        shaft.step(slower)
    assert shaft.run(-rpm, 0.2)[-1] == pytest.approx(-rpm, rel=1e-4)


def test_speed_estimate_of_somebody_else_is_no_encoders(c):
    """All that edges have told is gone, and the first of them that comes back counts no speed."""
    shaft = Shaft(c, 1000)
    shaft.run(300, 0.1)
    c.speed_estimate_take(shaft.estimate, 7 << 15, 9 << 15, 1234)
    e = shaft.estimate
    assert (e.speed_rpm_q15, e.travel_q15, e.interval_clocks, e.moved, e.beyond_q15, e.lost) == (
        7 << 15, 9 << 15, 1234, 0, 0, True)
    for _ in range(5):
        shaft.step(0)
    assert shaft.estimate.lost, "no edge has come"
    shaft.run(300, 0.01)
    assert not shaft.estimate.lost
    c.speed_estimate_reset(e)
    assert e.lost and e.speed_rpm_q15 == e.moved == e.travel_q15 == 0 and e.interval_clocks > 10**8
