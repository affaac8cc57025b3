# SPDX-License-Identifier: MIT
"""The state machine of CiA 402 on the axis's requests: each transition, each that there is not, set-points, fault reset."""
import pytest

from rigs.controller import (DISABLED, ENABLE, FAULT, HALT, NEW, NO_VOLTAGE, OPERATION, QUICK_STOP, QUICK_STOP_ACTIVE,
                             REACTION, READY, RESET, SHUTDOWN, SWITCHED_ON, SWITCH_ON, Controller)
from rigs.modbus_line import long, words, write


@pytest.fixture(params=(1, 2), ids=("alone", "second of two"))
def c(c, two_buses, request):
    return (c, two_buses)[request.param - 1]


def test_step_by_step_into_operation(plc):
    assert plc.state == DISABLED
    assert plc.control(SHUTDOWN) == READY and plc.axis.request == plc.c.AXIS_REQUEST_NONE
    assert plc.control(SWITCH_ON) == SWITCHED_ON and plc.axis.request == plc.c.AXIS_REQUEST_NONE
    assert plc.control(ENABLE) == SWITCHED_ON, "not before the axis is"
    assert plc.taken("AXIS_SWITCHED_ON") == "ON" and plc.state == SWITCHED_ON, "calibration, alignment"
    plc.taken("AXIS_OPERATION_ENABLED")
    assert plc.state == OPERATION and plc.status & 0x210 == 0x210


def test_ready_goes_into_operation_at_one_word_and_disabled_does_not(plc):
    assert plc.control(ENABLE) == DISABLED and plc.control(SWITCH_ON) == DISABLED
    assert plc.axis.request == plc.c.AXIS_REQUEST_NONE
    plc.control(SHUTDOWN)
    plc.control(ENABLE)
    assert plc.axis.request == plc.c.AXIS_REQUEST_ON


@pytest.mark.parametrize("word, request_, state", [
    (SHUTDOWN, "OFF", READY), (SWITCH_ON, "OFF", SWITCHED_ON), (NO_VOLTAGE, "OFF", DISABLED), (0x05, "OFF", DISABLED)])
def test_out_of_operation(plc, word, request_, state):
    plc.enabled().control(word)
    assert plc.taken("AXIS_SWITCH_ON_DISABLED") == request_ and plc.state == state


def test_quick_stop_brakes_and_ends_in_switch_on_disabled(plc):
    plc.enabled().control(QUICK_STOP)
    assert plc.taken("AXIS_QUICK_STOP") == "QUICK_STOP" and plc.state == QUICK_STOP_ACTIVE
    for word in (ENABLE, SHUTDOWN, SWITCH_ON, QUICK_STOP):
        assert plc.control(word) == QUICK_STOP_ACTIVE and plc.axis.request == plc.c.AXIS_REQUEST_NONE
    plc.taken("AXIS_SWITCH_ON_DISABLED")
    assert plc.state == DISABLED and plc.control(ENABLE) == DISABLED, "from the beginning again"
    assert plc.control(SHUTDOWN) == READY and plc.control(QUICK_STOP) == DISABLED


def test_quick_stop_while_it_starts_switches_off(plc):
    for word in (SHUTDOWN, SWITCH_ON, ENABLE):
        plc.control(word)
    plc.taken("AXIS_SWITCHED_ON")
    plc.control(QUICK_STOP)
    assert plc.taken("AXIS_SWITCH_ON_DISABLED") == "OFF" and plc.state == DISABLED


@pytest.mark.parametrize("state, seen", (("AXIS_FAULT", FAULT), ("AXIS_FAULT_REACTION", REACTION)))
def test_a_fault_is_shown_and_obeys_nothing_but_a_reset(plc, c, state, seen):
    plc.enabled()
    plc.axis.faults.cause = c.FAULT_STALL
    plc.taken(state)
    for word in (SHUTDOWN, SWITCH_ON, ENABLE, NO_VOLTAGE):
        assert plc.control(word) == seen and plc.axis.request == c.AXIS_REQUEST_NONE


def test_shutdown_during_a_stop_for_a_fault_is_forgotten_with_the_fault(plc, c):
    plc.enabled()
    plc.axis.faults.cause, plc.axis.faults.count, plc.axis.reactions.stopping = c.FAULT_OVERTEMPERATURE, 1, True
    plc.taken("AXIS_QUICK_STOP")
    assert plc.control(SHUTDOWN) == QUICK_STOP_ACTIVE
    # the fault, and `clear` at the console, before the bus is polled again
    plc.axis.faults.cause, plc.axis.reactions.stopping, plc.axis.state = c.FAULT_NONE, False, c.AXIS_SWITCH_ON_DISABLED
    now = c.drive_status(plc.axis)
    assert c.cia402_status_word(plc.drive.cia402, plc.axis, now) & 0x6F == DISABLED
    plc.wait(1)
    assert plc.state == DISABLED


def test_a_reset_is_an_edge_and_clears(plc, c):
    plc.control(RESET)
    plc.axis.faults.cause, plc.axis.state = c.FAULT_STALL, c.AXIS_FAULT
    cleared = lambda: plc.axis.request == c.AXIS_REQUEST_CLEAR or plc.refusal != "NONE"  # noqa: E731
    plc.control(RESET)
    assert not cleared(), "it was set already"
    plc.control(0)
    plc.fabric.gate.STATUS = plc.fabric.encoder.STATUS = 0
    plc.control(RESET)
    assert plc.refusal == "NONE" and plc.axis.request == c.AXIS_REQUEST_CLEAR
    for word in (SHUTDOWN, SWITCH_ON, ENABLE):
        assert plc.control(word) == FAULT and plc.axis.request == c.AXIS_REQUEST_CLEAR, "not before it is cleared"
    plc.axis.faults.cause = c.FAULT_NONE
    assert plc.taken("AXIS_SWITCH_ON_DISABLED") == "CLEAR" and plc.state == DISABLED
    assert plc.control(ENABLE) == DISABLED and plc.control(SHUTDOWN) == READY


def test_what_the_axis_refuses_is_kept(plc):
    plc.axis.loop.vbus_q15 = 0
    plc.control(SHUTDOWN)
    assert plc.control(ENABLE) == SWITCHED_ON and plc.refusal == "BUS_LOW" and not plc.status & 0x10
    assert plc.status & 0x100, "whoever reads the status word alone sees it, too"
    plc.axis.loop.vbus_q15 = plc.axis.tuning.v_min_q15
    plc.control(ENABLE)
    assert plc.refusal == "NONE" and plc.axis.request == plc.c.AXIS_REQUEST_ON and not plc.status & 0x100


@pytest.mark.parametrize("word, state", [(SHUTDOWN, READY), (SWITCH_ON, SWITCHED_ON), (0, DISABLED), (2, DISABLED)])
def test_a_word_that_the_bridge_does_not_need_ends_a_refusal_too(plc, word, state):
    plc.axis.loop.vbus_q15 = 0
    for each in (SHUTDOWN, SWITCH_ON, ENABLE):
        plc.control(each)
    assert plc.refusal == "BUS_LOW"
    assert plc.control(word) == state and plc.refusal == "NONE" and not plc.status & 0x100


def target(plc, rpm):
    assert plc.ask(write(2, long(rpm)))[0] == 16
    plc.wait(1)
    return plc.axis.speed.target_rpm_q16 / 65536


def test_speed(plc):
    target(plc, 700)
    plc.enabled()
    assert plc.axis.speed.target_rpm_q16 == 700 * 65536, "the target there was"
    assert target(plc, -300) == -300 and plc.registers(0x11, 1) == [3]
    plc.axis.speed.speed_rpm_q4 = -300 * 16
    assert plc.status & 0x1400 == 0x0400, "reached, and not at rest"
    plc.axis.speed.speed_rpm_q4 = 0
    assert plc.status & 0x1400 == 0x1000
    plc.control(ENABLE | HALT)
    assert plc.axis.speed.target_rpm_q16 == 0 and target(plc, 500) == 0, "halt"
    plc.control(ENABLE)
    assert plc.axis.speed.target_rpm_q16 == 500 * 65536
    plc.control(ENABLE | HALT)
    assert plc.control(ENABLE) == OPERATION and plc.axis.speed.target_rpm_q16 == 500 * 65536, "no new target was needed"


@pytest.mark.parametrize("mode, axis_mode", [(4, "TORQUE"), (9, "CYCLIC_SPEED"), (10, "CYCLIC_TORQUE"), (3, "SPEED")])
def test_a_mode_takes_its_target(plc, c, mode, axis_mode):
    plc.enabled()
    plc.ask(write(0x0000, words(ENABLE, mode) + long(250) + long(0) + words(100, 34)))
    plc.wait(1)
    assert plc.axis.mode == getattr(c, "AXIS_MODE_" + axis_mode) and plc.registers(0x11, 1) == [mode]
    if mode == 4:
        assert plc.axis.torque_command_q15 != 0
    if mode == 9:
        assert plc.axis.motion.cyclic.target == 250 * 65536


def test_torque_is_relative_to_the_rated_current(plc, c):
    plc.enabled()
    plc.ask(write(0x0000, words(ENABLE, 4) + long(0) + long(0) + words(-500, 34)))
    plc.wait(1)
    at_half = plc.axis.torque_command_q15
    plc2 = Controller(c).enabled()
    assert c.drive_command_current(plc2.axis, -7100 // 2).error == 0
    c.set_point_take(plc2.axis)
    assert plc2.axis.torque_command_q15 == at_half < 0


def test_a_position_waits_for_the_edge_of_bit_4(plc, c):
    plc.enabled()
    plc.ask(write(0x0000, words(ENABLE, 1) + long(0) + long(4000) + words(0, 34)))
    plc.wait(1)
    assert plc.axis.mode == c.AXIS_MODE_SPEED
    plc.control(ENABLE | NEW)
    position = lambda: c.drive_status(plc.axis).target  # noqa: E731
    assert plc.axis.mode == c.AXIS_MODE_POSITION and position() == 4000
    assert plc.status & 0x1000, "acknowledged"
    plc.ask(write(0x0004, long(-100)))
    plc.wait(1)
    assert position() == 4000
    plc.control(ENABLE)
    assert not plc.status & 0x1000
    plc.control(ENABLE | NEW | 0x40)
    assert position() == 3900, "relative"


def test_homing(plc, c):
    plc.enabled()
    plc.ask(write(0x0000, words(ENABLE, 6) + long(0) + long(0) + words(0, -1)))
    plc.control(ENABLE | NEW)
    assert plc.axis.mode == c.AXIS_MODE_HOMING and plc.axis.motion.homing.method == c.HOMING_BLOCK
    plc.axis.mode, plc.axis.motion.homed = c.AXIS_MODE_POSITION, True
    assert plc.status & 0x1400 == 0x1400


def test_what_the_console_does_is_seen(plc, c):
    """Switched on at the console, and off: the bus's way begins anew only where it had enabled operation."""
    plc.taken("AXIS_OPERATION_ENABLED")
    assert plc.state == OPERATION
    plc.ask(write(2, long(600)))
    plc.wait(2)
    assert plc.axis.speed.target_rpm_q16 == 0, "who has not enabled it does not move it"
    plc.control(SHUTDOWN)
    assert plc.state == OPERATION and plc.axis.request == c.AXIS_REQUEST_NONE, "nor stops it by what only prepares"
    plc.control(NO_VOLTAGE)
    assert plc.taken("AXIS_SWITCH_ON_DISABLED") == "OFF"
    plc.enabled()
    plc.taken("AXIS_SWITCH_ON_DISABLED")
    assert plc.state == DISABLED


def test_warning_and_limit(plc, c):
    plc.enabled()
    assert not plc.status & 0x880
    c.fault_warn(plc.axis, c.FAULT_POLARITY)
    plc.axis.speed.at_limit = True
    assert plc.status & 0x880 == 0x880
