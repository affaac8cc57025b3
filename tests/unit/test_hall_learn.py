# SPDX-License-Identifier: MIT
"""`learn hall`: the table from a rotor that follows a field, with friction, hysteresis and any wiring; or none."""
import itertools

import pytest

from rigs.hall_rotor import IDEAL, LOOP_COUNTS, MISPLACED, TURN, parameters, wrapped
from rigs.motor_numbers import compute, shipped

SAMPLES, LONGEST_MS = 20, 9000
RESULTS = "RUNNING", "DONE", "BLOCKED", "UNCLEAR", "LOAD"


class Bench:
    """The rotor stands where the field is, less what friction takes, plus what a load does; in turns."""
    def __init__(self, c, state_of, lag=0.02, load=0.0, hysteresis=0.006, blocked=False):
        self.c, self.state_of = c, state_of
        self.lag, self.load, self.hysteresis, self.blocked = lag, load, hysteresis, blocked
        self.learn, self.loop, self.regs = c.hall_learn(), c.current_loop(), c.encoder_regs()
        _, _, self.tuning = compute(c, {**shipped("hoverboard_350w"), "angle_source": 2})
        c.current_loop_init(self.loop)
        c.hall_learn_begin(self.learn)
        self.regs.LATCH_TIME = TURN - 1000
        self.place, self.currents, self.field = None, [], 0.0

    def _sample(self):
        """The latch is of this sample; the loop's angle is of the next one."""
        way = self.loop.field_speed_q32 / TURN
        self.field += way
        self.loop.field_angle_q32 = round((self.field + way) * TURN) % TURN
        self.regs.LATCH_TIME = (self.regs.LATCH_TIME + LOOP_COUNTS) % TURN
        direction = 1 if way > 0 else -1 if way < 0 else 0
        rotor = (0.0 if self.blocked else self.field) + self.load - direction * (self.lag + self.hysteresis)
        edges = (-1e9, *(k + e for k in range(-2, 9) for e in MISPLACED.edges))
        place = max(n for n, edge in enumerate(edges) if edge <= rotor)
        if place != self.place:
            self.place = place
            self.regs.HALL_TIME = self.regs.LATCH_TIME
            self.regs.HALL = self.state_of((place - 1) % 6)

    def run(self):
        for ms in range(LONGEST_MS):
            for _ in range(SAMPLES):
                self._sample()
            result = self.c.hall_learn_step(self.learn, self.loop, self.regs, self.tuning)
            self.currents.append(self.loop.i_d_ref_q15)
            if result:
                return RESULTS[result]
        return "RUNNING"

    def told(self):
        p = parameters(self.c)
        self.c.hall_table_to_params(self.learn.found, p)
        return p, [getattr(p, f"hall_edge_{n + 1}_cdeg") for n in range(6)]


def wired(order=(0, 1, 2), inverted=0):
    """States by sector, of wires exchanged and inverted."""
    states = [sum((state >> switch & 1) << wire for wire, switch in enumerate(order)) ^ inverted for state in IDEAL]
    return states


@pytest.mark.parametrize("order, inverted", [*((order, 0) for order in itertools.permutations(range(3))),
                                             ((0, 1, 2), 7), ((1, 0, 2), 4)])
def test_any_wiring_is_learned(c, order, inverted):
    states = wired(order, inverted)
    bench = Bench(c, states.__getitem__)
    assert bench.run() == "DONE"
    p, edges = bench.told()
    assert c.hall_table_of(p, c.hall_table()) == c.ERROR_NONE
    first = states.index(bench.learn.found.state[0])
    assert list(bench.learn.found.state) == states[first:] + states[:first]
    wanted = [MISPLACED.edges[(first + n) % 6] for n in range(6)]
    assert max(abs(wrapped(round((edge / 36000 - true) * TURN))) for edge, true in zip(edges, wanted)) < 0.3


def test_friction_and_hysteresis_cancel_and_the_current_ends_as_told(c):
    for lag, hysteresis in ((0.0, 0.0), (0.03, 0.02)):
        bench = Bench(c, IDEAL.__getitem__, lag=lag, hysteresis=hysteresis)
        assert bench.run() == "DONE", (lag, hysteresis)
        _, edges = bench.told()
        assert max(abs(wrapped(round((edge / 36000 - true) * TURN))) for edge, true in zip(edges, MISPLACED.edges)) < 0.3
    assert bench.currents[-1] == bench.tuning.field.i_align_q15
    assert max(b - a for a, b in zip(bench.currents, bench.currents[1:])) <= bench.currents[-1] / 60


@pytest.mark.parametrize("wire, level", ((0, 1), (1, 0), (2, 1)))
def test_a_wire_that_is_broken_is_no_table(c, wire, level):
    stuck = [state | 1 << wire if level else state & ~(1 << wire) for state in IDEAL]
    bench = Bench(c, stuck.__getitem__)
    assert bench.run() == "UNCLEAR" and c.hall_learn_states(bench.learn) == 4


def test_a_rotor_that_stands_is_said_to(c):
    bench = Bench(c, IDEAL.__getitem__, blocked=True, lag=0, hysteresis=0)
    assert bench.run() == "BLOCKED" and c.hall_learn_states(bench.learn) == 0


@pytest.mark.parametrize("lag, result", ((0.055, "DONE"), (0.066, "LOAD"), (0.1, "LOAD")))
def test_a_rotor_that_lags_too_far_is_refused(c, lag, result):
    """45 degrees between forward and back."""
    bench = Bench(c, IDEAL.__getitem__, lag=lag, hysteresis=0)
    assert bench.run() == result
    assert result == "DONE" or abs(bench.learn.detail_deg) == pytest.approx(720 * lag, abs=2)


def test_an_edge_that_wanders_is_no_table(c):
    """By 30 degrees from turn to turn: a rotor that sticks and slips."""
    bench = Bench(c, IDEAL.__getitem__)
    slow = bench._sample

    def sticking():
        bench.load = 0.08 * (int(bench.field) % 2)
        slow()
    bench._sample = sticking
    assert bench.run() == "UNCLEAR"
