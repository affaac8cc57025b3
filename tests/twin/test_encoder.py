# SPDX-License-Identifier: MIT
"""Slot 2, ENC, against docs/fabric.md: random motion against a counter that takes edge by edge, and by hand; the disc before
it, and what a receiver miscounts; Hall switches; when an edge came."""
import math
import os
import random

import numpy as np
import pytest

from twin.bench import CLOCK_PS, ENC, GATE, MOTOR, SENSORS, Plant, c, near, ps

TURN, COUNTS, LINES = 2 * math.pi, 4000, 1000
EDGE_RAD = TURN / COUNTS
FAR_AWAY = (1000, 1000, 4000)


# ---- the counter ----

class Counter:
    """As the page describes it, edge by edge."""
    def __init__(self):
        self.edge = self.position = self.index = 0
        self.counts, self.enabled, self.reverse, self.seen = 4096, False, False, False

    def moves(self, jump, pulse):
        first, last, turn = pulse

        def is_high():
            return (self.edge - first) % turn <= last - first
        for _ in range(abs(jump)):
            was = is_high()
            self.edge += 1 if jump > 0 else -1
            if self.enabled:
                self.position = (self.position + (-1 if (jump > 0) == self.reverse else 1)) % self.counts
                if is_high() and not was:
                    self.index, self.seen = self.position, True


@pytest.mark.parametrize("pulse", [(13, 13, 40), (13, 20, 40), (35, 44, 40)])
def test_against_counting_edge_by_edge(pulse):
    e, counter, draw, indices = c.encoder(), Counter(), random.Random(1), 0
    c.encoder_reset(e, 0)
    for _ in range(3000):
        chance = draw.randrange(8)
        if chance < 2:
            counter.enabled, counter.reverse = counter.enabled ^ (chance == 0), counter.reverse ^ (chance == 1)
            c.encoder_write(e, 0x00, counter.enabled | counter.reverse << 1)
        elif chance == 2:
            counter.counts, counter.position = draw.randint(4, 100), 0
            c.encoder_write(e, 0x04, counter.counts)
        elif chance == 3:
            counter.seen = False
            c.encoder_write(e, 0x14, 1)
        before = counter.index
        counter.moves(draw.randint(-120, 120), pulse)
        c.encoder_follow(e, counter.edge, c.index_pulse(*pulse))
        indices += counter.index != before
        assert [c.encoder_read(e, at) for at in (0x04, 0x08, 0x10, 0x14)] == [
            counter.counts, counter.position, counter.index, counter.seen]
    assert indices > 200


def test_registers():
    p = Plant(motor={"initial_angle_rad": 1.0}).to_trigger()
    assert p.read(ENC.COUNTS) == 4096 and p.read(ENC.POSITION) == 0, "wherever the rotor stands"
    p.write(ENC.COUNTS, 4000)
    p.write(ENC.CONTROL, -1)
    assert p.read(ENC.CONTROL) == 3
    p.write(ENC.CONTROL, 1)
    c.motor_spin(p.motor, EDGE_RAD / 1e-6)
    p.run(41e-6)  # the trigger was 1 us after the start
    assert p.read(ENC.POSITION) == near(41, 1) and p.read(ENC.LATCHED) == near(1, 1)
    p.run(50e-6)
    assert p.read(ENC.LATCHED) == near(51, 1)
    p.write(ENC.CONTROL, 3)
    p.run(100e-6)
    assert p.read(ENC.POSITION) == near(4000 - 9, 1), "REVERSE counts down, through 0 to COUNTS-1"
    p.write(ENC.POSITION, 5)
    assert p.read(ENC.POSITION) == near(4000 - 9, 1)
    p.write(ENC.COUNTS, 8000)
    assert p.read(ENC.POSITION) == 0, "writing COUNTS zeroes POSITION"
    c.plant_reset_fabric(p.p)
    assert p.read(ENC.COUNTS) == 4096


def spinning(speed_rad_s, **sensors):
    p = Plant(sensors=sensors)
    p.write(GATE.CONTROL, 0)
    p.write(ENC.COUNTS, COUNTS)
    p.write(ENC.CONTROL, 1)
    c.motor_spin(p.motor, speed_rad_s)
    return p


def test_index():
    p = spinning(500, index_angle_rad=1.0)  # at edge 636 of 4000
    p.run(0.9 / 500)
    assert p.read(ENC.STATUS) == 0
    p.run(0.2 / 500)
    assert p.read(ENC.STATUS) == 1 and p.read(ENC.INDEX) == 636
    p.run(3 * TURN / 500)
    assert p.read(ENC.INDEX) == 636, "three turns later too"
    p.write(ENC.STATUS, 1)
    assert p.read(ENC.STATUS) == 0


def test_a_wide_index_rises_at_its_first_edge_either_way():
    p = spinning(500, index_angle_rad=1.0, encoder_index_counts=8)
    p.run(1.2 / 500)
    assert p.read(ENC.INDEX) == 636
    c.motor_spin(p.motor, -500)
    p.run(0.4 / 500)
    assert p.read(ENC.INDEX) == 643


def follow(e, edges, pulse=FAR_AWAY):
    c.encoder_follow(e, edges, c.index_pulse(*pulse))
    return c.encoder_read(e, 0x08)


@pytest.fixture
def e():
    encoder = c.encoder()
    c.encoder_reset(encoder, 0)
    c.encoder_write(encoder, 0x00, 1)
    return encoder


def test_cable(e):
    def status(write=None):
        if write is not None:
            c.encoder_write(e, 0x14, write)
        return c.encoder_read(e, 0x14)
    c.encoder_illegal(e)
    assert [status(), status(4), status(2)] == [2, 2, 0], "ILLEGAL stays until written"
    c.encoder_cut(e, True)
    assert status(7) == 4 and c.encoder_faulty(e) and follow(e, 10) == 0, "while it lasts, and nothing counts"
    c.encoder_cut(e, False)
    assert [status(), status(4)] == [4, 0] and not c.encoder_faulty(e)
    c.encoder_freeze(e, True)
    assert follow(e, 30) == 0
    c.encoder_freeze(e, False)
    assert follow(e, 35) == 5, "what was missed stays missed"
    c.encoder_slip(e, -7)
    assert c.encoder_read(e, 0x08) == 4094


def test_a_and_b_exchanged(e):
    c.encoder_reverse(e, True)
    assert follow(e, 9, (5, 5, 4000)) == 4096 - 9 and c.encoder_read(e, 0x10) == 4096 - 5, "the index is found where it is"
    c.encoder_write(e, 0x00, 3)
    assert follow(e, 11) == 4096 - 7, "which REVERSE puts right"
    c.encoder_reset(e, 11)
    c.encoder_write(e, 0x00, 1)
    assert follow(e, 12) == 4095, "and a reset does not"


@pytest.mark.parametrize("written, counts", [(1, 4), (4, 4), (65536, 65536), (100000, 65536)])
def test_counts_range(e, written, counts):
    c.encoder_write(e, 0x04, written)
    assert c.encoder_read(e, 0x04) == counts


# ---- the disc ----

def disc(**changes):
    d = c.disc()
    c.disc_init(d, c.sensor_params(**{**SENSORS, **changes}), 11)
    return d


def test_ideal_disc():
    d = disc()
    angles = {0: 0, 3 * math.pi + 1e-9: 6000, -1e-9: -1, -TURN + 1e-9: -4000}
    assert [c.disc_edges(d, rad) for rad in angles] == [*angles.values()]
    assert disc(index_angle_rad=math.pi / 2 + 1e-9).index.first == 1000
    index = disc(index_angle_rad=-math.pi / 2 + 1e-9, encoder_index_counts=3).index
    assert (index.first, index.last, index.turn) == (3000, 3002, 4000), "before 0 is within the turn"


@pytest.mark.parametrize("a, phase", [(0, 0), (0.06, 0), (0, -0.1), (-0.05, 0.12), (0.1, 0.04)])
def test_displaced_edges(a, phase):
    d = disc(encoder_asymmetry=a, encoder_phase=phase)
    line = -2 + 10 * (np.arange(20000) + 0.5) / 20000

    def signal(rises, falls):
        return (line - rises) % 1 < falls - rises
    edges = np.array([c.disc_edges(d, one * TURN / LINES) for one in line])
    a_high, b_high = np.isin(edges % 4, (0, 1)), np.isin(edges % 4, (1, 2))
    assert np.array_equal(a_high, signal(-a, 0.5 + a)) and np.array_equal(b_high, signal(0.25 + phase - a, 0.75 + phase + a))
    assert np.isin(np.diff(edges), (0, 1)).all()
    assert (a_high & b_high).mean() == near(0.25 + 2 * a - phase, 1e-3)


def test_eccentric_disc():
    d = disc(encoder_ecc_rad=0.02, encoder_ecc_phase_rad=0.7)
    theta = TURN * (np.arange(10000) + 0.5) / 10000
    shown = (np.array([c.disc_edges(d, rad) for rad in theta]) + 0.5) * EDGE_RAD - theta
    assert 2 * (shown * np.exp(1j * (theta - 0.7))).mean() == near(0.02j, 3e-5), "once a turn, and nothing across"
    assert np.abs(shown).max() == near(0.02, EDGE_RAD)


def test_counts_do_not_depend_on_the_way():
    """Small steps to and fro, of which most pass no edge, against a fresh disc that has no past."""
    odd = {"encoder_asymmetry": -0.03, "encoder_phase": 0.05, "encoder_ecc_rad": 0.05}
    d, theta, draw = disc(**odd), 1.0, random.Random(2)
    for _ in range(5000):
        theta += draw.uniform(-1, 1) * 10 ** draw.randint(-7, -3)
        assert c.disc_edges(d, theta) == c.disc_edges(disc(**odd), theta)


@pytest.mark.parametrize("lost, extra, step, mean", [
    (0.5, 0, 40, -0.5), (0, 2, 40, 2), (3, 1, 40, -2), (0.5, 0, -40, 0.5), (0, 0, 40, 0)])
def test_miscounts(lost, extra, step, mean):
    """The count of a Poisson process scatters by the root of its mean."""
    def miscounted(at_once):
        d = disc(encoder_lost_per_rev=lost, encoder_extra_per_rev=extra)
        return sum(c.disc_miscounts(d, at_once * step) for _ in range(40_000_000 // (40 * at_once)))
    turns = 10_000
    assert miscounted(100) == near(mean * turns, 4 * math.sqrt((lost + extra) * turns))
    assert miscounted(100) == miscounted(1000), "however the way is cut"


def test_miscounts_without_memory():
    """Gaps between two lost edges: exponential, so their deviation is their mean."""
    d = disc(encoder_lost_per_rev=40)
    lost = np.repeat(np.arange(1, 300_001), [-c.disc_miscounts(d, 1) for _ in range(300_000)])
    gaps = np.diff(lost, prepend=0)
    assert gaps.mean() == near(100, 400 / math.sqrt(len(gaps))) and gaps.std() == near(100, 800 / math.sqrt(len(gaps)))


def test_miscounts_in_the_plant():
    p = spinning(TURN * 200, encoder_lost_per_rev=20)
    p.run(50e-3 + 1e-9)  # ten turns
    assert p.read(ENC.POSITION) - COUNTS == near(-200, 4 * math.sqrt(200))
    p.write(ENC.CONTROL, 0)
    before = p.read(ENC.POSITION)
    p.run(20e-3)
    assert p.read(ENC.POSITION) == before, "a counter that is off miscounts nothing"


def test_an_eccentric_disc_in_the_plant():
    p = spinning(TURN * 100, encoder_ecc_rad=0.05)
    for _ in range(200):
        p.run(50e-6)
        theta = p.motor.theta_rad
        error = math.remainder(p.read(ENC.POSITION) * EDGE_RAD - theta - 0.05 * math.sin(theta), TURN)
        assert abs(error + EDGE_RAD / 2) < EDGE_RAD / 2 * 1.01


# ---- when an edge came ----

def at_angle(rad):
    p = Plant(motor={"initial_angle_rad": rad}).to_trigger()
    p.write(ENC.COUNTS, COUNTS)
    p.write(ENC.CONTROL, 1)
    return p


@pytest.mark.parametrize("speed_rad_s, start_rad", [(500, 0.1), (-500, 0.1), (30, 1.0), (-31, 1.0)])
def test_edge_time_at_speed(speed_rad_s, start_rad):
    """LATCH_TIME is the trigger's clock; EDGE_TIME, to a clock, when the last edge before it passed."""
    p = at_angle(start_rad)
    c.motor_spin(p.motor, speed_rad_s)
    start, edges = p.now, 0
    for _ in range(200):
        trigger = p.next_trigger()
        p.to(trigger + ps(10e-6))
        at_rad = start_rad + speed_rad_s * (trigger - start) * 1e-12
        passed_rad = (math.floor if speed_rad_s > 0 else math.ceil)(at_rad / EDGE_RAD) * EDGE_RAD
        passed = trigger - ps((at_rad - passed_rad) / speed_rad_s)
        assert p.read(ENC.LATCH_TIME) == trigger // CLOCK_PS
        if passed > start:
            assert p.read(ENC.EDGE_TIME) == near(passed // CLOCK_PS, 1)
            edges += 1
    assert edges > 20


def test_edge_time_from_rest():
    """A free shaft that a constant torque speeds up: the n-th edge comes after sqrt(2 n edge / a)."""
    p = at_angle(1e-9)
    p.write(GATE.CONTROL, 0)
    p.run(20e-3)  # no current is left
    p.motor.theta_rad, p.motor.speed_rad_s = 1e-9, 0
    c.motor_lock(p.motor, True)
    p.run(1e-6)
    c.motor_release(p.motor)
    p.motor.load_nm = -20e-3
    a, start, base, seen, checked = 20e-3 / MOTOR["inertia_kgm2"], p.now, p.read(ENC.POSITION), p.read(ENC.EDGE_TIME), 0
    for _ in range(400):
        p.to(p.next_trigger() + ps(10e-6))
        clock = p.read(ENC.EDGE_TIME)
        if clock != seen:
            since_s = math.sqrt(2 * ((p.read(ENC.LATCHED) - base) * EDGE_RAD - 1e-9) / a)
            assert clock == near((start + ps(since_s)) // CLOCK_PS, 5)
            checked, seen = checked + 1, clock
    assert checked > 50


def test_what_is_not_counted_is_not_timed():
    p = at_angle(0)
    c.motor_spin(p.motor, 200)
    p.run(1e-3)
    latch = p.read(ENC.LATCH_TIME)
    assert 0 < latch - p.read(ENC.EDGE_TIME) < 100_000
    c.encoder_freeze(p.model.encoder, True)
    p.run(1e-3)
    frozen = p.read(ENC.EDGE_TIME)
    p.run(1e-3)
    assert p.read(ENC.EDGE_TIME) == frozen and p.read(ENC.LATCH_TIME) - latch == 200_000, "but time goes on"
    c.encoder_freeze(p.model.encoder, False)
    p.run(1e-3)
    assert p.read(ENC.EDGE_TIME) - frozen > 100_000
    p.write(ENC.CONTROL, 0)
    p.run(60e-6)
    stopped = p.read(ENC.EDGE_TIME)
    p.run(1e-3)
    p.write(ENC.EDGE_TIME, 1)
    assert p.read(ENC.EDGE_TIME) == stopped, "a counter that is off, and a register that is read-only"


def test_edge_time_is_of_the_trigger():
    p = at_angle(0)
    c.motor_spin(p.motor, 500)  # an edge every 3.1 us
    p.to(p.next_trigger() + 1)
    edge, latched = p.read(ENC.EDGE_TIME), p.read(ENC.LATCHED)
    p.run(30e-6)
    assert p.read(ENC.POSITION) > latched + 5 and p.read(ENC.EDGE_TIME) == edge
    p.run(30e-6)
    assert p.read(ENC.EDGE_TIME) != edge
    c.plant_reset_fabric(p.p)
    assert p.read(ENC.EDGE_TIME) | p.read(ENC.LATCH_TIME) == 0


# ---- Hall switches ----

def hall(**sensors):
    h = c.hall()
    c.hall_init(h, c.sensor_params(**sensors))
    return h


def state(h, electrical_rad):
    """What the wires show after the shaft has come here."""
    c.hall_follow(h, electrical_rad)
    return c.hall_wires(h)


def expected_hall(electrical_rad):
    return sum(((electrical_rad - k * TURN / 3) % TURN < math.pi) << k for k in range(3))


def test_six_states():
    h = hall()
    for n in range(-12, 18):
        assert state(h, (n + 0.5) * math.pi / 3) == (5, 1, 3, 2, 6, 4)[n % 6]


@pytest.mark.parametrize("k, error_rad", enumerate((0.05, -0.12, 0.2)))
def test_hall_placement(k, error_rad):
    h = hall(hall_angle_rad=0.4, hall_error_a_rad=0.05, hall_error_b_rad=-0.12, hall_error_c_rad=0.2)
    rises = 0.4 + k * TURN / 3 + error_rad
    falls = rises + math.pi
    assert [state(h, at) >> k & 1 for at in (rises - 1e-9, rises + 1e-9, falls - 1e-9, falls + 1e-9)] == [0, 1, 1, 0]


@pytest.mark.parametrize("way", [-1, 1])
def test_hall_hysteresis(way):
    """Late by that, whichever way it turns; and the time since an edge counts from where it really was."""
    h, changes = hall(hall_angle_rad=0.4, hall_error_b_rad=0.1, hall_hysteresis_rad=0.05), 0
    state(h, 0.2 - way)
    for rad in 0.2 - way + way * np.arange(0, 9, 5e-4):
        if c.hall_follow(h, rad):
            since = c.hall_since_rad(h, rad, way > 0)
            edge = rad - since - way * 0.05
            assert since * way >= 0 and abs(since) <= 5.01e-4
            assert min(abs(math.remainder(edge - 0.4 - k * TURN / 3 - 0.1 * (k == 1), math.pi)) for k in range(3)) < 1e-9
            changes += 1
    assert 8 <= changes <= 10
    state(h, 0.5)
    assert not c.hall_follow(h, 0.36) and not c.hall_follow(h, 0.44), "there and back within it"


def test_hall_wires():
    h, quarter = hall(), math.pi / 2
    for change, shown in [((c.hall_swap_wires, 0, 1), 2), ((c.hall_swap_wires, 0, 0), 1), ((c.hall_invert_wire, 2, True), 5),
                          ((c.hall_open_wire, 1, True), 7), ((c.hall_open_wire, 1, False), 5),
                          ((c.hall_invert_wire, 2, False), 1)]:
        change[0](h, *change[1:])
        assert state(h, quarter) == shown


@pytest.mark.parametrize("n", range(24))
def test_hall_in_the_row_is_of_the_electrical_angle(n):
    electrical_rad = (n + 0.3) * TURN / 6
    p = Plant(motor={"initial_angle_rad": electrical_rad / 4})
    c.motor_lock(p.motor, True)
    p.run(100e-6)
    assert p.row.hall == expected_hall(electrical_rad) == p.read(ENC.HALL) & 7


def test_hall_is_read_as_it_is_now():
    """No period of the PWM begins that would show it."""
    p = Plant(on=None)
    c.motor_spin(p.motor, 300)
    for _ in range(40):
        p.run(0.7e-3)
        assert p.read(ENC.HALL) >> 4 & 7 == expected_hall(4 * p.motor.theta_rad)


# ---- the lines as a list, for an RTL ----

class Listed:
    """The lines, and what a counter of all four edges makes of them."""
    def __init__(self, turn=400):
        self.l, self.pulse, self.count, self.edges = c.lines(filter=3), c.index_pulse(first=0, last=3, turn=turn), 0, 0

    def turn(self, moved, from_ps, last_ps, miscounted=0, now=0):
        self.edges += moved
        c.lines_turn(self.l, c.shaft_way(moved=moved, edges=self.edges, last_edge_ps=last_ps, miscounted=miscounted, **{
            "from": from_ps}), self.pulse, now)

    def taken(self):
        """[(clock, count, index)]"""
        states, phase = [], {(0, 0): 0, (1, 0): 1, (1, 1): 2, (0, 1): 3}
        while (clock := c.lines_next(self.l)) != 2**63 - 1:
            state = c.lines_take(self.l)
            assert state.clock == clock
            step = (phase[state.a, state.b] - self.count + 1) % 4 - 1
            assert step < 2, "one of the two lines at a time"
            self.count += step
            states.append((clock, self.count, state.index))
        return states


def test_edges_of_a_way_are_spread_over_it():
    lines = Listed()
    lines.turn(5, 1_000_000, 1_100_000)
    lines.turn(-7, 1_100_000, 1_200_001)
    rising = [(102 + 2 * n, n + 1, n + 1 < 4) for n in range(5)]
    assert lines.taken() == rising + [
        (math.ceil(110 + 10.0001 * (n + 1) / 7), 4 - n, 0 <= 4 - n < 4) for n in range(7)]
    lines.turn(2, 0, 10_000, now=500)
    assert [clock for clock, *_ in lines.taken()] == [500, 500], "nothing is listed before now"


@pytest.mark.parametrize("moved, miscounted, counted", [
    (3, 2, 5), (-3, -2, -5), (3, -1, 2), (-3, 1, -2), (3, -2, 1), (3, 0, 3)])
def test_edges_that_the_receiver_doubles_or_loses(moved, miscounted, counted):
    lines = Listed()
    lines.turn(moved, 0, 30_000, miscounted)
    assert lines.taken()[-1][1] == counted


def test_disturbances_of_the_lines():
    lines = Listed()
    c.lines_disturb(lines.l, c.CABLE_SLIP, -2, 100)
    assert [one[:2] for one in lines.taken()] == [(100, -1), (105, -2)], "as far apart as the filter wants it"
    c.lines_disturb(lines.l, c.CABLE_REVERSED, 1, 200)
    lines.turn(2, 0, 2_000_000)
    assert lines.taken()[-1][1] == -4
    c.lines_disturb(lines.l, c.CABLE_SLIP, 2, 210)
    assert lines.taken()[-1][1] == -2, "counts are slipped as they are counted"
    c.lines_disturb(lines.l, c.CABLE_REVERSED, 0, 220)
    c.lines_disturb(lines.l, c.CABLE_FROZEN, 1, 230)
    lines.turn(9, 0, 3_000_000, 2)
    assert lines.taken() == []
    c.lines_disturb(lines.l, c.CABLE_FROZEN, 0, 310)
    c.lines_disturb(lines.l, c.CABLE_CUT, 1, 320)
    c.lines_disturb(lines.l, c.CABLE_CUT, 0, 330)
    assert [(one.clock, one.lost) for one in (c.lines_take(lines.l), c.lines_take(lines.l))] == [(320, True), (330, False)]
    before = lines.l.now.a, lines.l.now.b
    c.lines_disturb(lines.l, c.CABLE_ILLEGAL, 1, 340)
    there, back = c.lines_take(lines.l), c.lines_take(lines.l)
    assert (there.clock, there.a, there.b) == (340, not before[0], not before[1])
    assert (back.clock, back.a, back.b) == (345, *before)
    c.lines_show_hall(lines.l, 5, 3_499_001, 0)
    c.lines_show_hall(lines.l, 4, 3_400_000, 348)
    shown = [c.lines_take(lines.l) for _ in range(2)]
    assert [(one.clock, one.hall) for one in shown] == [(350, 5), (350, 4)], "what is listed later comes no sooner"


def test_the_list_has_room_for_so_many():
    lines = Listed()
    for _ in range(3):
        for n in range(4096):
            c.lines_show_hall(lines.l, n % 8, n * 10_000, 0)
        assert [c.lines_take(lines.l).hall for _ in range(4096)] == [n % 8 for n in range(4096)]
    child = os.fork()
    if child == 0:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        for n in range(4097):
            c.lines_show_hall(lines.l, 0, 0, 0)
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 1
