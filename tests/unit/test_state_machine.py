# SPDX-License-Identifier: MIT
"""The drive's state machine: every state x request x fault, against the table of CiA 402 as docs/design.md gives it."""
import itertools

import pytest

from rigs.drive import LOOPS_PER_MS, STATES


def test_it_stays_off_without_a_request(world):
    assert world().step(50) == "SWITCH_ON_DISABLED"


def test_a_request_to_switch_on_leads_to_switched_on_by_way_of_ready(world, c):
    w = world()
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
    assert w.step() in ("READY", "SWITCHED_ON") and w.step(2) == "SWITCHED_ON"


REQUESTS = ("switch_on", "switch_off", "quick_stop", "clear_fault")


@pytest.mark.parametrize("state, request_name", itertools.product(STATES, REQUESTS))
def test_requests(world, c, state, request_name):
    """Accepted exactly where the state allows it; refused, nothing has changed."""
    w = world(state)
    outcome = getattr(c, "drive_" + request_name)(w.axis)
    bridge_on = ("READY", "SWITCHED_ON", "OPERATION_ENABLED", "QUICK_STOP")
    allowed = {"switch_on": ("SWITCH_ON_DISABLED",), "switch_off": STATES, "quick_stop": bridge_on,
               "clear_fault": ("FAULT",)}[request_name]
    assert (outcome.error == c.ERROR_NONE) == (state in allowed), (state, request_name, outcome.error)
    if outcome.error != c.ERROR_NONE:
        assert w.state == state and w.axis.request == c.AXIS_REQUEST_NONE
    elif request_name == "switch_off" and state not in ("FAULT", "FAULT_REACTION"):
        assert w.step() == "SWITCH_ON_DISABLED" and w.fabric.gate.CONTROL == 0
    elif request_name == "switch_off":
        assert w.step(2) == "FAULT", "off does not forget a fault"
    elif request_name == "quick_stop":
        assert w.step() == "SWITCH_ON_DISABLED" and w.fabric.gate.CONTROL == 0, "at rest it is over at once"
    elif request_name == "clear_fault":
        assert w.step() == "SWITCH_ON_DISABLED" and w.axis.faults.cause == c.FAULT_NONE


@pytest.mark.parametrize("state", STATES)
def test_every_fault_in_every_state_ends_off_and_keeps_the_first_cause(world, c, state):
    for name, cause in c.enums["fault"].items():
        if name in ("FAULT_NONE", "FAULT_COUNT"):
            continue
        w = world(state)
        first = w.axis.faults.cause or cause
        c.fault_raise(w.axis, cause)
        assert w.fabric.gate.CONTROL == 0, f"{name} in {state} leaves the gates on"
        c.fault_raise(w.axis, c.FAULT_STALL)
        assert w.axis.faults.cause == first, f"{name} in {state} does not stay the first cause"
        w.step(3)
        assert w.state == "FAULT" and w.fabric.gate.CONTROL == 0, f"{name} in {state}"
        assert (w.axis.loop.i_d_ref_q15, w.axis.loop.i_q_ref_q15, w.axis.loop.kp_d_q9) == (0, 0, 0)
        if state not in ("FAULT", "FAULT_REACTION"):
            assert w.axis.faults.snapshot.state == c.enums["axis_state"]["AXIS_" + state], "the snapshot is of another instant"


def test_the_bridge_goes_off_before_a_fault_is_left(world, c):
    """Fault reaction lasts as long as the gates are live."""
    w = world("OPERATION_ENABLED")
    c.fault_raise(w.axis, c.FAULT_STALL)
    w.fabric.adc.SEQUENCE += LOOPS_PER_MS
    w.fabric.gate.STATUS = 1
    c.drive_step(w.axis)
    assert w.state == "FAULT_REACTION"
    w.fabric.adc.SEQUENCE += LOOPS_PER_MS
    c.drive_step(w.axis)
    assert w.state == "FAULT_REACTION", "the gates are still live"
    assert w.step() == "FAULT"


@pytest.mark.parametrize("came", (0, 1, 18, 19, 20, 21, 22, 40))
def test_conversions_that_do_not_come_or_come_too_often_are_a_fault(world, c, came):
    """One either way is phase."""
    w = world()
    w.fabric.adc.SEQUENCE += came - LOOPS_PER_MS
    w.step()
    assert w.axis.faults.cause == (c.FAULT_NONE if abs(came - LOOPS_PER_MS) <= 1 else c.FAULT_LOOP_STOPPED)


def test_latches_that_nobody_has_seen_are_seen_by_the_slow_loop(world, c):
    for bit, cause in (
            (1, "OVERCURRENT_HARDWARE"), (2, "GATE_DRIVER"), (3, "LOOP_STOPPED"), (4, "INTERLOCK"),
            (10, "STO_A"), (11, "STO_B"), (12, "PLL"), (17, "STO_APART"),
            (15, "SLOW_LOOP_STOPPED"), (16, "SLOW_LOOP_STOPPED")):
        w = world("SWITCH_ON_DISABLED")
        w.fabric.adc.SEQUENCE += LOOPS_PER_MS
        w.fabric.gate.STATUS = 1 << bit
        c.drive_step(w.axis)
        assert w.axis.faults.cause == c.enums["fault"]["FAULT_" + cause]


@pytest.mark.parametrize("first, then", (("STO_A", "STO_APART"), ("STO_B", "STO_APART"), ("GATE_DRIVER", "GATE_DRIVER")))
def test_an_input_that_stopped_alone_is_named_once_the_other_has_not_followed(world, c, first, then):
    w = world("FAULT")
    w.axis.faults.cause = c.enums["fault"]["FAULT_" + first]
    count = w.axis.faults.count
    for bits in (1 << 10, 1 << 10 | 1 << 17):
        w.fabric.adc.SEQUENCE += LOOPS_PER_MS
        w.fabric.gate.STATUS = bits
        c.drive_step(w.axis)
        assert w.axis.faults.cause == c.enums["fault"]["FAULT_" + (then if bits >> 17 else first)]
    assert w.axis.faults.count == count, "it is the same one"


@pytest.mark.parametrize("on", (True, False))
def test_gates_that_go_off_without_a_latch_are_a_fault_while_the_loop_is_on(world, c, on):
    w = world("OPERATION_ENABLED" if on else "SWITCH_ON_DISABLED")
    w.axis.loop.status_max = 1 if on else 0xFFFFFFFF
    w.fabric.adc.SEQUENCE += LOOPS_PER_MS
    w.fabric.gate.STATUS = 0
    c.drive_step(w.axis)
    assert w.axis.faults.cause == (c.FAULT_GATES_OFF if on else c.FAULT_NONE)


@pytest.mark.parametrize("sign", (1, -1))
def test_overspeed_counts_between_switching_on_and_off(world, c, sign):
    """The step that leaves READY ends switched on, and the look at the speed comes last. The observer's goes on if aligned."""
    for state, found in zip(STATES, (False, True, True, True, True, False, False)):
        w = world(state)
        before, w.axis.start.aligned = w.axis.faults.cause, True
        w.axis.speed.ref_rpm_q16 = 1 << 24  # a quick stop is not over yet
        w.axis.loop.pll.speed_q32 = sign * ((w.axis.tuning.overspeed_w_q15 + 1) << 13)
        w.step()
        assert (w.axis.faults.cause == c.FAULT_OVERSPEED) == found, state
        assert found or w.axis.faults.cause == before


@pytest.mark.parametrize("gate, adc, cause", [
    (0x21C1E, 0, "STO_APART"), (0x1C1E, 0, "STO_A"), (0x181E, 0, "STO_B"), (0x101E, 0, "PLL"), (0x0C04, 0xF0, "STO_A"),
    (0x02, 0xF0, "OVERCURRENT_HARDWARE"), (0x06, 0, "OVERCURRENT_HARDWARE"), (0x04, 0, "GATE_DRIVER"), (0x14, 0, "GATE_DRIVER"),
    (0x18, 0, "INTERLOCK"), (0x08, 0x10, "LOOP_OVERRUN"), (0x20, 0x10, "ENCODER"), (0x80, 0xF0, "OVERCURRENT"),
    (0x80, 0xE0, "CURRENT_SUM"), (0x80, 0xC0, "OVERVOLTAGE"), (0x80, 0x80, "UNDERVOLTAGE"), (0x40, 0x02, "LOOP_OVERRUN")])
def test_the_cause_behind_a_sample(world, c, gate, adc, cause):
    """What hardware latched comes before what is concluded from the same sample."""
    w = world("OPERATION_ENABLED")
    w.fabric.gate.STATUS, w.fabric.adc.STATUS = gate, adc
    c.drive_sample_fault(w.axis)
    assert w.axis.faults.cause == c.enums["fault"]["FAULT_" + cause]
