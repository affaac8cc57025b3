# SPDX-License-Identifier: MIT
"""Hall switches: the table over its whole domain, a sample to the bit, and angle and speed of a rotor that turns."""
import itertools
import math
import random

import numpy as np
import pytest

from rigs.hall_rotor import IDEAL, LOOP_COUNTS, MISPLACED, PER_MS, TURN, Rotor, Switches, parameters, wrapped
from rigs.motor_numbers import compute, shipped

RINGS = [ring for ring in itertools.permutations(range(8), 6)
         if all(bin(ring[n] ^ ring[n - 1]).count("1") == 1 for n in range(6))]


# ---- the table ----

def test_each_ring_of_six_states_is_a_table_and_nothing_else(c):
    """Exchanged and inverted wires, each way round, from each sector on; two switches never change at once."""
    assert len(RINGS) == 192
    table, rings = c.hall_table(), set(RINGS)
    for states in itertools.permutations(range(8), 6):
        error = c.hall_table_of(parameters(c, int("".join(map(str, states)))), table)
        assert error == (c.ERROR_NONE if states in rings else c.ERROR_HALL_STATES), states
        assert error != c.ERROR_NONE or tuple(table.state) == states


@pytest.mark.parametrize("states", (513269, 513265, 511326, 1513264, 51326, 0, 513284))
def test_other_digits_are_no_table(c, states):
    assert c.hall_table_of(parameters(c, states), c.hall_table()) == c.ERROR_HALL_STATES


def test_edges_go_round_one_turn_and_no_sector_is_too_narrow_or_wide(c):
    draw, table = random.Random(3), c.hall_table()
    seen = {True: 0, False: 0}
    for _ in range(4000):
        widths = [draw.randint(2400, 9600) for _ in range(5)]
        first = draw.randrange(36000)
        edges = [(first + sum(widths[:n])) % 36000 for n in range(6)]
        if draw.random() < 0.2:
            draw.shuffle(edges)
        around = [(edges[(n + 1) % 6] - edges[n]) % 36000 for n in range(6)]
        right = sum(around) == 36000 and all(2500 <= width <= 9500 for width in around)
        error = c.hall_table_of(parameters(c, edges=edges), table)
        assert error == (c.ERROR_NONE if right else c.ERROR_HALL_EDGES), edges
        assert [abs(q32 - edge * TURN / 36000) <= 1 for q32, edge in zip(table.edge_q32, edges)] == [True] * 6
        seen[right] += 1
        told = parameters(c)
        c.hall_table_to_params(table, told)
        assert [getattr(told, f"hall_edge_{n + 1}_cdeg") for n in range(6)] == edges and told.hall_states == 513264
    assert min(seen.values()) > 300


def test_an_angle_that_rounds_up_to_a_turn_is_told_as_0(c):
    table, told = c.hall_table(), parameters(c)
    table.edge_q32[0] = TURN - 1
    c.hall_table_to_params(table, told)
    assert told.hall_edge_1_cdeg == 0


def test_a_wrong_table_keeps_only_a_drive_with_hall_switches_from_switching_on(c):
    for wrong, name in (({"hall_states": 513246}, "ERROR_HALL_STATES"), ({"hall_edge_2_cdeg": 1000}, "ERROR_HALL_EDGES")):
        assert compute(c, {**shipped(), "angle_source": 2, **wrong})[0] == name
        assert compute(c, {**shipped(), **wrong})[0] == "ERROR_NONE"


def test_each_move_from_each_state(c):
    """Nothing, a step, a skip, or a state that there is not; then the last one that there is goes on."""
    for states in random.Random(5).sample(RINGS, 20):
        hall = Rotor(c, Switches(states)).hall
        for here, there in itertools.product(range(8), range(8)):
            move = hall.move[here][there]
            if there not in states:
                wanted = (0, here, 1, 0)
            elif here not in states or here == there:
                wanted = (0, there, 0, 0)
            else:
                way = (states.index(there) - states.index(here)) % 6
                wanted = ({1: 1, 5: -1}.get(way, 0), there, 0, int(way not in (1, 5)))
            assert (move.step, move.next, move.invalid, move.skipped) == wanted, (states, here, there)


# ---- a sample ----

def expected(hall, loop, regs):
    """What a sample makes of it: (angle, count, state, invalid, skipped)."""
    move = hall.move[hall.state][regs.HALL & 7]
    sector, speed = hall.sector[move.next], loop.pll.speed_q32
    age = (regs.LATCH_TIME - regs.HALL_TIME) % TURN
    if move.step:
        edge = sector.middle_q32 - move.step * sector.half_q32
        angle = edge + (speed >> 15) * ((age * hall.clock_share_q28 % TURN) >> 13)
    else:
        off = (loop.pll.angle_q32 - sector.middle_q32 + TURN // 2) % TURN - TURN // 2
        angle = sector.middle_q32 + max(-sector.half_q32, min(sector.half_q32, off))
    return ((angle + speed) % TURN, (hall.count + move.step) % TURN, move.next, hall.invalid + move.invalid,
            hall.skipped + move.skipped)


def test_a_sample_is_what_is_promised_to_the_bit(c):
    """Undefined behaviour is trapped in this build: no state, time or speed overflows."""
    draw = random.Random(11)
    rotors = [Rotor(c, Switches(states)) for states in draw.sample(RINGS, 6)] + [Rotor(c, MISPLACED)]
    for n in range(20000):
        rotor = draw.choice(rotors)
        hall, loop, regs = rotor.hall, rotor.loop, rotor.regs
        loop.pll.speed_q32 = draw.choice((0, 1, -1, draw.randint(-2**29, 2**29), draw.randint(-2**31, 2**31 - 1)))
        loop.pll.angle_q32 = draw.getrandbits(32)
        regs.HALL = draw.getrandbits(7)
        regs.LATCH_TIME = draw.getrandbits(32)
        regs.HALL_TIME = (regs.LATCH_TIME - draw.choice((0, draw.randrange(LOOP_COUNTS), draw.getrandbits(32)))) % TURN
        wanted = expected(hall, loop, regs)
        c.host_hall_observe(loop, hall, regs)
        assert (loop.pll.angle_q32, hall.count, hall.state, hall.invalid, hall.skipped) == wanted, n
        assert hall.clock[hall.count % 8] == regs.HALL_TIME


# ---- a rotor ----

@pytest.mark.parametrize("hz", (1150, -1150, 700, 150, -150, 40, 10, -5))
@pytest.mark.parametrize("switches", (Switches(), MISPLACED))
def test_angle_and_speed_of_a_rotor_that_turns_evenly(c, hz, switches):
    """As far as the edges are where the table has them, both are right; also where the fabric's clock goes round."""
    rotor = Rotor(c, switches, start=0.07, clock=TURN - 3 * LOOP_COUNTS * PER_MS)
    rotor.turning(hz, 40 + int(6000 / abs(hz)))
    off, speeds = rotor.turning(hz, 100 + int(1000 / abs(hz)))
    assert np.abs(off).max() < 0.6 and np.abs(speeds / hz - 1).max() < 0.004


@pytest.mark.parametrize("hz", (300, 60))
def test_switches_out_of_place_by_five_degrees_cost_as_much_and_no_more(c, hz):
    """Twice as much where edges are far apart: a late edge looks like a load. Over half a turn the speed is right."""
    edges = [(n / 6 + (0.014 if n % 3 == 0 else 0)) for n in range(6)]
    rotor = Rotor(c, Switches(edges=edges), start=0.1, table=Switches())
    rotor.turning(hz, 100)
    off, speeds = rotor.turning(hz, 300)
    assert 4 < np.abs(off).max() < (6.5 if hz == 300 else 10) and speeds.mean() == pytest.approx(hz, rel=0.015)
    assert np.abs(speeds / hz - 1).max() < (0.003 if hz == 300 else 0.15)


@pytest.mark.parametrize("hz", (300, 100, 40, 20))
def test_the_memory_of_the_speed_loop_does_not_step_at_a_switch_that_is_out_of_place(c, hz):
    """While a whole turn tells the speed: 22 % of torque ripple at rated load (lot 119). Slower, it counts the angle. The
    mean is exact: it loses nothing between them."""
    edges = [(n / 6 + (0.014 if n % 3 == 0 else 0)) for n in range(6)]
    rotor = Rotor(c, Switches(edges=edges), start=0.1, table=Switches())
    rotor.turning(hz, 300)
    rotor.turning(hz, 600)
    off = np.abs(np.array(rotor.ways) / hz - 1)
    assert off.max() < 0.003 if hz > 50 else off.max() > 0.1
    assert np.mean(rotor.ways) == pytest.approx(hz, rel=1e-3)


@pytest.mark.parametrize("hz", (60, 300, 1000))
def test_a_rotor_that_turns_at_the_start_is_not_believed_to_be_faster(c, hz):
    """Beyond what the first interval says, which is right: no over-speed comes of it."""
    rotor = Rotor(c, Switches(), start=0.1)
    _, speeds = rotor.turning(hz, 60)
    assert speeds.max() < 1.02 * hz and speeds[-1] == pytest.approx(hz, rel=0.01)


@pytest.mark.parametrize("sector", range(6))
def test_it_begins_in_the_middle_of_the_sector_and_the_first_edge_puts_it_right(c, sector):
    rotor = Rotor(c, MISPLACED, start=MISPLACED.edges[sector] + 0.004)
    edges = (*MISPLACED.edges, 1 + MISPLACED.edges[0])
    middle = (edges[sector] + edges[sector + 1]) / 2
    assert wrapped(rotor.loop.pll.angle_q32) == pytest.approx(wrapped(round(middle * TURN) % TURN), abs=0.02)
    assert rotor.loop.pll.speed_q32 == 0
    off, _ = rotor.run(np.linspace(rotor.turns, edges[sector + 1] + 0.02, 200))
    assert np.abs(off).max() < 40 and np.abs(off[-3:]).max() < 8, "no speed is known yet"


def test_a_rotor_that_stops_is_believed_to_stop_and_to_be_in_the_middle(c):
    rotor = Rotor(c, Switches())
    rotor.turning(20, 400)
    off, speeds = rotor.run(np.full(600 * PER_MS, rotor.turns))
    sector_ms = 1000 / 20 / 6
    assert all(speed <= 1.25 * 1000 / 6 / (n + 1) + 0.2 for n, speed in enumerate(speeds)), "its sector, and a quarter of it"
    assert speeds[int(sector_ms) + 252] == 0 and speeds[-1] == 0 and rotor.loop.pll.speed_q32 == 0
    middle = (int(rotor.turns * 6) + 0.5) / 6
    assert abs(wrapped(rotor.loop.pll.angle_q32 - round(middle * TURN) % TURN)) < 0.5


def test_it_never_leaves_its_sector(c):
    """Whatever the speed is believed to be."""
    rotor = Rotor(c, Switches(), start=0.25)
    rotor.turning(100, 50)
    place = int(rotor.turns * 6) / 6
    rotor.loop.pll.speed_q32 = 2**24
    off, _ = rotor.run(np.full(PER_MS, rotor.turns))
    ahead = off[3:] / 360 + rotor.turns % 1
    assert (ahead > place % 1 - 0.01).all() and (ahead < place % 1 + 1 / 6 + 0.01).all()


def test_a_reversal_is_followed(c):
    """The switches' hysteresis is what it is late by, either way."""
    rotor = Rotor(c, Switches(hysteresis=0.008))
    for hz in (50, -50, 80):
        rotor.turning(hz, 250)
        off, speeds = rotor.turning(hz, 200)
        assert np.abs(speeds / hz - 1).max() < 0.02
        assert np.mean(off) == pytest.approx(-0.008 * 360 * np.sign(hz), abs=0.3)


def per_torque(rotor):
    """Hz a second by an LSB."""
    return (rotor.hall.push_q8 or 2**31) / 256 / TURN * 20000 * 1000


def pushed(rotor, hz_s, load_hz_s, ms, hz=0.0):
    """A course under torque and load, in Hz a second; the torque as the firmware counts it, by the inertia it was told."""
    per_lsb = per_torque(rotor)
    t = np.arange(1, ms * PER_MS + 1) / 20000
    return rotor.run(rotor.turns + hz * t + (hz_s + load_hz_s) * t * t / 2, torque=round(hz_s / per_lsb))


def test_what_torque_makes_of_the_speed_is_known_at_once(c):
    """Between two edges, 8 ms apart: by 20 ms it has changed by 8 Hz, and no more than the first is owed."""
    rotor = Rotor(c, Switches())
    rotor.turning(20, 500)
    _, speeds = pushed(rotor, 400, 0, 40, hz=20)
    true = 20 + 0.4 * np.arange(1, 41)
    assert np.abs(speeds - true).max() < 1.2
    blind = Rotor(c, Switches())
    blind.turning(20, 500)
    blind.hall.push_q8 = 0
    _, late = pushed(blind, 400, 0, 40, hz=20)
    assert np.abs(late - true).max() > 3, "the edges alone tell it later"


@pytest.mark.parametrize("before_deg, load_part, off_deg", ((15, 0, 12), (30, 0, 5), (45, 0, 5), (59, 0, 25),
                                                             (30, 0.5, 25)))
def test_a_rotor_that_torque_takes_from_rest_has_a_speed_at_its_first_edge(c, before_deg, load_part, off_deg):
    """Of what torque and inertia make of the time, less what a load must have taken: the next sector is not lost."""
    rotor = Rotor(c, Switches(), start=1 / 6 - before_deg / 360)
    hz_s = 40.0
    first_ms = int(math.sqrt(2 * before_deg / 360 / (hz_s * (1 - load_part))) * 1000) + 2
    _, speeds = pushed(rotor, hz_s, -load_part * hz_s, first_ms)
    assert rotor.hall.count == 1 and speeds[-1] == pytest.approx(hz_s * (1 - load_part) * first_ms / 1000, rel=0.6)
    hz = hz_s * (1 - load_part) * first_ms / 1000
    next_ms = int((math.sqrt(hz * hz + 2 * hz_s * (1 - load_part) * 0.16) - hz) / (hz_s * (1 - load_part)) * 1000)
    off, _ = pushed(rotor, hz_s, -load_part * hz_s, next_ms, hz=hz)
    assert rotor.hall.count == 1 and np.abs(off).max() < off_deg, "with a speed of 0 it would be 57 degrees"


@pytest.mark.parametrize("way", (1, -1))
def test_a_torque_turns_it_round_before_an_edge_shows_it(c, way):
    """From 10 Hz to the other way within one sector, whichever way a load helps."""
    for load_part in (0, 0.2, -0.2):
        rotor = Rotor(c, Switches())
        rotor.turning(10 * way, 517)  # to just behind an edge
        hz_s = -way * 1000 / (1 - load_part)
        pushed(rotor, hz_s, -hz_s * load_part, 2, hz=10 * way)
        rotor.hall.speed.load_q8 = round(-hz_s * load_part / per_torque(rotor) * rotor.hall.push_q8)
        edges = rotor.hall.count
        _, speeds = pushed(rotor, hz_s, -hz_s * load_part, 15, hz=8 * way)
        assert rotor.hall.count == edges and speeds[-1] == pytest.approx(-7 * way, abs=1.5), load_part


@pytest.mark.parametrize("way", (1, -1))
def test_a_load_that_brakes_does_not_turn_it_round_until_an_edge_shows_it(c, way):
    """Hands, friction: what has stopped a shaft need not drive it. What falls is seen to fall at its second edge."""
    rotor = Rotor(c, Switches())
    rotor.turning(10 * way, 500)
    t = np.arange(1, 25 * PER_MS + 1) / 20000
    rotor.run(rotor.turns + way * (10 * t - 400 * t * t / 2))
    rotor.hall.speed.load_q8 = round(-way * 400 / per_torque(rotor) * rotor.hall.push_q8)
    edges = rotor.hall.count
    _, speeds = rotor.run(np.full(15 * PER_MS, rotor.turns))
    assert rotor.hall.count == edges and (way * speeds > -0.2).all()
    _, speeds = rotor.turning(-10 * way, 80)
    assert speeds[-1] == pytest.approx(-10 * way, rel=0.15)


@pytest.mark.parametrize("way", (1, -1))
def test_a_rotor_that_hardly_turns_may_have_turned_round(c, way):
    """At 0.6 Hz a sector takes longer than what counts as rest: the middle is never wrong by more than half of it."""
    rotor = Rotor(c, Switches())
    rotor.turning(20 * way, 501 if way > 0 else 500)  # to 7 degrees behind an edge
    rotor.turning(0, 1)
    speed = rotor.hall.speed
    speed.rest_q32, speed.pushed_q32, speed.load_q8 = round(0.6 * way / 20000 * TURN) % 2**64, 0, 0
    off, speeds = rotor.run(np.full(240 * PER_MS, rotor.turns))
    assert abs(speeds[0]) == pytest.approx(0.6, rel=0.01) and np.abs(off).max() < 35


def test_a_rotor_that_has_swung_and_rests_has_a_speed_at_its_first_edge(c):
    """As behind a start that has found it: forth and back over an edge, 50 ms apart, and a torque 140 ms later."""
    rotor, hz_s = Rotor(c, Switches(), start=0.13), 400.0
    swing = 0.13 + 0.05 * np.sin(np.pi / 100 * np.arange(1, 101 * PER_MS) / PER_MS)
    rotor.run(np.append(swing, 0.13))
    assert rotor.hall.count == 0 and rotor.hall.speed.intervals == 0
    rotor.turning(0, 115)
    first_ms = int(math.sqrt(2 * (1 / 6 - 0.13) / hz_s) * 1000) + 2
    _, speeds = pushed(rotor, hz_s, 0, first_ms)
    assert rotor.hall.count == 1 and speeds[-1] == pytest.approx(hz_s * first_ms / 1000, rel=0.6)


@pytest.mark.parametrize("hz", (2, -2, 0.7))
def test_a_rotor_that_something_else_moves_is_no_more_than_half_a_sector_away(c, hz):
    """Its first edge tells no speed, and no torque explains one: it may be anywhere in the sector, not where it came in."""
    rotor = Rotor(c, Switches(), start=0.15 if hz > 0 else 0.18)
    edge_ms = int(0.017 / abs(hz) * 1000) + 1
    rotor.turning(hz, edge_ms)
    off, _ = rotor.turning(hz, int(0.16 / abs(hz) * 1000))
    assert np.abs(off).max() < 36, "57 where it stays at the edge"


@pytest.mark.parametrize("heavier, least, most", ((1, 0.05, 0.2), (60, 0, 0.02)))
def test_a_heavy_shaft_is_not_led_by_a_switch_that_is_out_of_place(c, heavier, least, most):
    """Edges 11 ms apart, one axis of the switches 5 degrees off: no load makes such swings of a large inertia."""
    edges = [(n / 6 + (0.014 if n % 3 == 0 else 0)) for n in range(6)]
    inertia = min(2**31 - 1, heavier * shipped("hoverboard_350w")["inertia_gmm2"])
    rotor = Rotor(c, Switches(edges=edges), start=0.1, table=Switches(), inertia_gmm2=inertia, speed_bw_hz=1)
    rotor.turning(15, 3000)
    _, speeds = rotor.turning(15, 1000)
    assert least < np.abs(speeds / 15 - 1).max() < most


def test_a_load_that_the_torque_holds_is_no_acceleration(c):
    """Even speed under torque: the angle is right as without, once the load is known."""
    rotor = Rotor(c, Switches())
    rotor.turning(20, 300)
    assert abs(rotor.hall.speed.load_q8) < 0.05 * 300 / per_torque(rotor) * rotor.hall.push_q8, "none so far"
    pushed(rotor, 300, -300, 1500, hz=20)
    off, speeds = pushed(rotor, 300, -300, 500, hz=20)
    assert np.abs(off).max() < 1.5 and np.abs(speeds / 20 - 1).max() < 0.03
    assert rotor.hall.speed.load_q8 == pytest.approx(-300 / per_torque(rotor) * rotor.hall.push_q8, rel=0.15)


def test_an_edge_that_a_wire_makes_is_no_over_speed(c):
    """Right behind a true one; a quarter more is believed, and what four times the largest torque makes."""
    rotor = Rotor(c, Switches(), start=0.01)
    rotor.turning(100, 100)
    rotor.regs.HALL = IDEAL[(int(rotor.turns * 6) + 1) % 6]
    rotor.regs.HALL_TIME = (rotor.hall.speed.clock + 20000) % TURN
    rotor.regs.LATCH_TIME = (rotor.hall.speed.clock + 21000) % TURN
    c.host_hall_observe(rotor.loop, rotor.hall, rotor.regs)
    rotor.hall.speed.intervals = 2  # as if no longer mean were near enough
    rotor.hall.clock[(rotor.hall.count - 3) % 8] = rotor.hall.clock[(rotor.hall.count - 6) % 8] = rotor.regs.LATCH_TIME
    c.hall_speed_step(rotor.hall, rotor.loop, rotor.regs, rotor.tuning, 0)
    assert rotor.hall.skipped == 0 and rotor.hall.invalid == 0
    assert 100 < rotor.hall.speed.speed_q32 / TURN * 20000 < 135


def test_any_course_traps_nothing(c):
    """Speeds up to an eighth of a turn a sample, edges that chatter, states that there are not: what comes out is in range."""
    draw = random.Random(23)
    rotor = Rotor(c, MISPLACED)
    for _ in range(3000):
        rotor.regs.HALL = draw.choice((*IDEAL, draw.randrange(8)))
        rotor.regs.LATCH_TIME = (rotor.regs.LATCH_TIME + draw.choice((LOOP_COUNTS, draw.getrandbits(32)))) % TURN
        rotor.regs.HALL_TIME = (rotor.regs.LATCH_TIME - draw.choice((0, draw.randrange(5000), draw.getrandbits(30)))) % TURN
        for _ in range(draw.randrange(4)):
            c.host_hall_observe(rotor.loop, rotor.hall, rotor.regs)
        c.hall_speed_step(rotor.hall, rotor.loop, rotor.regs, rotor.tuning, draw.choice((0, 32767, -32768)))
        assert abs(rotor.hall.speed.speed_q32) <= 2**29 and rotor.hall.speed.clocks > 0
