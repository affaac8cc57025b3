# SPDX-License-Identifier: MIT
"""A drive with Hall switches, one millisecond at a time: its start, what it is told of the speed, what it watches, and what
`learn hall` may do when."""
import functools
import math

import pytest

from rigs import starting
from rigs.drive import World
from rigs.hall_rotor import IDEAL
from rigs.motor_numbers import FULL
from rigs.starting import WIRING, sample, show_wiring

ALL_ONES, TURN = 2**32 - 1, 2**32
BAD = (0, 7)


@pytest.fixture(params=(1, 2), ids=("first", "second"))
def switched_on(request):
    """The first start, or that behind one that was broken off."""
    return functools.partial(starting.switched_on, starts=request.param)


def leads(w):
    loop = w.axis.loop
    return (loop.source == w.c.LOOP_HALL and loop.field_follows == ALL_ONES and loop.field_speed_q32 == 0 and
            loop.field_angle_q32 == 0 and w.fabric.gate.CONTROL == 1 and loop.kp_d_q9 > 0)


@pytest.mark.parametrize("sector", range(6))
def test_on_goes_straight_into_operation_from_the_sectors_middle(c, sector, switched_on):
    w = switched_on(c, (IDEAL[sector],))
    assert leads(w) and w.axis.start.phase == c.START_HALL
    assert abs(w.axis.loop.pll.angle_q32 - round((sector + 0.5) / 6 * TURN)) < 10
    assert w.step() == "OPERATION_ENABLED" and w.axis.loop.angle_offset_q32 == 0
    assert w.fabric.encoder.FILTER >> 8 == 20 and w.fault == "NONE"


def test_only_the_first_on_looks_at_the_wiring(c, switched_on):
    """A voltage is held along a field that is prescribed, as in any other start."""
    w = switched_on(c, wired=False)
    assert w.axis.start.phase == WIRING and w.axis.loop.source == c.LOOP_HALL and w.axis.loop.field_follows == 0
    assert w.axis.loop.kp_d_q9 == w.axis.loop.ki_q15 == 0
    c.start_hall_wired(w.axis)
    assert w.axis.start.wired and leads(w) and w.step() == "OPERATION_ENABLED"
    w.axis.params.angle_source = 0
    assert c.drive_switch_off(w.axis).error == c.ERROR_NONE and w.step() == "SWITCH_ON_DISABLED"
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
    w.step()
    assert not w.axis.start.wired, "another source: begins anew"


def test_second_samples_are_looked_at_even_so(c, switched_on):
    w = switched_on(c)
    w.axis.start.recheck_wiring = True
    w.axis.start.phase = c.START_CALIBRATE
    c.start_hall(w.axis)
    assert w.axis.start.phase == WIRING


def test_a_rotor_that_turns_is_caught_without_a_look_at_the_wiring(c, switched_on):
    assert leads(switched_on(c, (5, 1, 3), wired=False)) and leads(switched_on(c, (3, 1, 5), wired=False))
    assert not leads(switched_on(c, (5, 1), wired=False)), "one edge may be a rotor that shakes"


@pytest.mark.parametrize("state", BAD)
def test_without_a_state_that_there_is_it_does_not_start(c, state, switched_on):
    w = switched_on(c, (state,))
    assert w.fault == "HALL_INVALID" and w.axis.faults.detail[0] == state and w.fabric.gate.CONTROL == 0


@pytest.mark.parametrize("fault", ("OPEN_PHASE", "SENSOR_SIGN", "SENSORS_EXCHANGED"))
@pytest.mark.parametrize("turned, named", ((2, None), (3, "LOAD_TOO_HIGH"), (-3, "LOAD_TOO_HIGH")))
def test_what_the_wiring_looks_like_on_a_driven_rotor_is_the_loads(c, fault, turned, named, switched_on):
    """A third of a turn: test currents do not do that."""
    w = switched_on(c, wired=False)
    w.axis.hall.count = turned % TURN
    w.axis.start.wiring.along, w.axis.start.wiring.ms = 3, 1000
    w.axis.start.wiring.slow = True
    show_wiring(w.axis.start.wiring, *{"OPEN_PHASE": (0,), "SENSOR_SIGN": (-9999,),
                                "SENSORS_EXCHANGED": (9999, ((1, 1), (2, 1), (0, 1)))}[fault])
    c.start_step(w.axis)
    assert w.fault == (named or fault)


# ---- operation ----

@pytest.fixture
def running(c, switched_on):
    w = switched_on(c)
    w.step(3)
    assert w.state == "OPERATION_ENABLED" and w.fault == "NONE"
    return w


def show(w, *states):
    for state in states:
        sample(w, state)
    w.step()


@pytest.mark.parametrize("states, fault", (
    ((1, 3, 2, 6), "NONE"), ((1, 5, 4), "NONE"), ((1, 7, 1), "NONE"), ((1, 7, 7), "HALL_INVALID"), ((0, 0, 1), "HALL_INVALID"),
    ((1, 2), "HALL_SEQUENCE"), ((1, 6), "HALL_SEQUENCE"), ((1, 4), "HALL_SEQUENCE"), ((7, 7, 6), "HALL_INVALID")))
def test_states_that_there_are_not_and_sectors_that_are_skipped(running, states, fault):
    show(running, *states)
    assert running.fault == fault and running.fabric.gate.CONTROL == (fault == "NONE")
    assert fault == "NONE" or running.axis.faults.detail[0] == states[-1]


def test_single_samples_do_not_add_up_over_milliseconds(running):
    for _ in range(20):
        show(running, 1, 7, 1)
    assert running.fault == "NONE"


def test_what_was_before_the_start_does_not_count(c, switched_on):
    w = switched_on(c, (7, 7, 0, 1, 2, 6))
    assert w.step() == "OPERATION_ENABLED" and w.step() == "OPERATION_ENABLED" and w.fault == "NONE"


@pytest.mark.parametrize("name", ("HALL_INVALID", "HALL_SEQUENCE"))
def test_such_faults_switch_off_unless_it_is_to_carry_on_and_may_be_tried_again(c, name):
    kind = c.fault_class(c.enums["fault"]["FAULT_" + name]).contents
    assert (kind.allowed, kind.initial, kind.retry) == (1 | 1 << c.REACTION_CARRY, c.REACTION_OFF, True)


def test_the_rotor_is_known_and_nothing_of_an_observer_meddles(running):
    w = running
    w.axis.loop.flux.margin_q8, w.axis.loop.flux.rho_q15 = 0, 32767
    w.step(50)
    assert leads(w) and w.fault == "NONE" and w.axis.sensorless.weak_ms == w.axis.lock_watch.lost_ms == 0


@pytest.mark.parametrize("clocks, told", ((400, 100), (400000, 100000), (3200000, 800000), (3200004, 800000), (2**28, 800000)))
def test_the_speed_loop_is_told_of_a_quarter_of_the_time_and_8_ms_at_most(running, clocks, told):
    w = running
    w.axis.hall.speed.clocks, w.axis.hall.speed.lost = clocks, True
    w.fabric.encoder.LATCH_TIME = w.fabric.encoder.HALL_TIME
    w.step()
    assert w.axis.hall.speed.clocks == clocks and w.axis.speed.estimate.interval_clocks == told


@pytest.mark.parametrize("age, overdue", ((0, 0), (12, 0), (13, 1), (39, 1), (40, 0), (200, 0)))
def test_a_speed_is_not_lost_while_the_next_edges_may_say_why_one_is_missing(c, running, age, overdue):
    """From one and a quarter of the time between two edges until four of them."""
    w = running
    w.axis.hall.speed.sector_clocks, w.axis.hall.speed.age_clocks = 10, age
    w.axis.supervision.speed.deviation_q4, w.axis.supervision.speed.far_ms = -1, 100
    c.speed_watch_step(w.axis)
    c.reaction_step(w.axis)
    assert w.fault == ("NONE" if overdue else "SPEED_DEVIATION")


@pytest.mark.parametrize("rpm", (200, -200))
def test_a_rotor_that_turns_may_be_switched_on(c, rpm):
    """By Hall switches and observer, whatever has told its speed until now; either way."""
    for before in (0, 1, 2):
        for source, error in ((2, c.ERROR_NONE), (1, c.ERROR_NONE), (0, c.ERROR_TURNING)):
            w, told = World(c), c.tuning()
            w.axis.loop.vbus_q15, w.axis.speed.speed_rpm_q4 = 13670, rpm * 16
            w.axis.tuning.angle_source, w.axis.params.angle_source = before, before
            told.v_min_q15, told.v_max_q15 = w.axis.tuning.v_min_q15, w.axis.tuning.v_max_q15
            told.angle_source = source
            assert c.drive_measured_forbids_on(w.axis, told).error == error


def test_positions_take_an_encoder(c, running):
    assert c.drive_command_position(running.axis, 100, False).error == c.ERROR_NEEDS_ENCODER


# ---- learning ----

def carry(w):
    """The phases carry what is asked of them."""
    loop, adc = w.axis.loop, w.fabric.adc
    angle = loop.field_angle_q32 / TURN * math.tau
    adc.IA, adc.IB, adc.IC = (round(loop.i_d_ref_q15 * math.cos(angle - k * math.tau / 3)) for k in range(3))


def test_a_phase_that_carries_nothing_while_it_learns_is_open(c, switched_on):
    w = switched_on(c, wired=False, learns=True)
    c.start_hall_wired(w.axis)
    while w.axis.start.phase == c.START_ALIGN_HALL and w.fault == "NONE":
        w.step()
        carry(w)
    for _ in range(200):
        w.step()
        carry(w)
    assert w.fault == "NONE"
    for v_d_steps, fault in ((0, "NONE"), (FULL // 20, "NONE"), (FULL // 12, "OPEN_PHASE")):
        w.axis.loop.v_d_steps = v_d_steps  # dead time may hide a 16th of the bus; where no current comes it becomes more
        for _ in range(200):
            w.step()
            carry(w)
            w.fabric.adc.IA = 0
        assert w.fault == fault, v_d_steps
    assert w.axis.faults.detail[0] == 1 and w.fabric.gate.CONTROL == 0


def test_learning_lays_the_rotor_down_turns_the_field_and_ends_off(c, switched_on):
    w = switched_on(c, wired=False, learns=True)
    assert w.axis.start.phase == WIRING and w.axis.start.learns
    c.start_hall_wired(w.axis)
    assert w.axis.start.phase == c.START_ALIGN_HALL and w.axis.loop.field_follows == 0
    assert c.start_tuning(w.axis).contents.kp_d_q12 == 0, "a voltage is held, and brakes"
    while w.axis.start.phase == c.START_ALIGN_HALL and w.fault == "NONE":
        w.step()
        carry(w)
    assert w.axis.start.phase == c.START_LEARN_HALL and c.start_tuning(w.axis).contents.kp_d_q12 > 0
    speeds = set()
    for _ in range(8000):
        w.step()
        carry(w)
        speeds.add(w.axis.loop.field_speed_q32)
    assert max(speeds) == -min(speeds) == TURN * 2 // 20000
    assert w.fault == "HALL_UNKNOWN" and list(w.axis.faults.detail) == [0, 0] and w.fabric.gate.CONTROL == 0


def test_what_it_finds_becomes_parameters_and_then_it_is_off(c, switched_on):
    w = switched_on(c, wired=False, learns=True)
    c.start_hall_wired(w.axis)
    w.axis.start.phase = c.START_LEARN_HALL
    c.hall_learn_begin(w.axis.hall_learn)
    learn = w.axis.hall_learn
    learn.phase, learn.ms, learn.edges = 1, 3999, 48
    for n, state in enumerate(IDEAL):
        for edge in (learn.forward[state], learn.against[state]):
            setattr(edge, "from", IDEAL[n - 1])
            edge.first_q32, edge.count = round((n / 6 + 0.02) * TURN), 4
    assert w.step() == "SWITCH_ON_DISABLED" and w.fabric.gate.CONTROL == 0
    assert w.axis.params.hall_states == 513264 and w.axis.params.hall_edge_1_cdeg == 720
    assert w.axis.params.hall_edge_6_cdeg == 30720 and w.fault == "NONE"


def test_learning_is_for_hall_switches_and_a_drive_that_is_off(c):
    w = World(c)
    w.axis.loop.vbus_q15 = 13670
    assert c.drive_learn_hall(w.axis).error == c.ERROR_NEEDS_HALL
    w.axis.params.angle_source = 2
    w.put("OPERATION_ENABLED")
    assert c.drive_learn_hall(w.axis).error == c.ERROR_ALREADY_ON
    w.put("FAULT")
    assert c.drive_learn_hall(w.axis).error == c.ERROR_FAULT_LATCHED
    w = World(c)
    w.axis.params.angle_source, w.axis.loop.vbus_q15 = 2, 0
    assert c.drive_learn_hall(w.axis).error == c.ERROR_BUS_LOW and w.axis.request == c.AXIS_REQUEST_NONE
    w.axis.loop.vbus_q15, w.axis.params.hall_states = 13670, 123456
    assert c.drive_learn_hall(w.axis).error == c.ERROR_HALL_STATES


def test_an_on_after_it_is_an_on(c, switched_on):
    w = switched_on(c, wired=False, learns=True)
    assert c.drive_switch_off(w.axis).error == c.ERROR_NONE and w.step() == "SWITCH_ON_DISABLED"
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
    assert w.step() == "SWITCHED_ON" and not w.axis.start.learns
