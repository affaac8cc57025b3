# SPDX-License-Identifier: MIT
"""Switching on, a part at a time: what the thread serves in between cannot come in between."""
import pytest

from rigs.controller import DISABLED, ENABLE, NO_VOLTAGE, SHUTDOWN, SWITCHED_ON, SWITCH_ON, Controller
from rigs.drive import Rig
from rigs.modbus_line import long, read, write

SPEED_MAX = 0x1000
ENOUGH_Q15 = 13670


@pytest.fixture
def plc(c):
    """Asked to enable operation; of what that takes, a few parts are done."""
    plc = Controller(c)
    for word in (SHUTDOWN, SWITCH_ON):
        plc.control(word)
    plc.prepares = False
    assert plc.control(ENABLE) == SWITCHED_ON
    for _ in range(5):
        assert c.drive_prepare(plc.axis)
    return plc


PACE_MS = 32


def parts(plc, a_ms=4):
    """How many it takes until nothing is left to do, so many a millisecond."""
    count = 1
    while plc.c.drive_prepare(plc.axis):
        count += 1
        plc.axis.time_ms += count % a_ms == 0
        assert count < 10_000
    return count


def test_nothing_is_asked_of_the_axis_before_the_last_part(plc, c):
    assert plc.axis.request == c.AXIS_REQUEST_NONE and not c.drive_is_off(plc.axis) and plc.state == SWITCHED_ON
    assert parts(plc) > 50
    assert plc.axis.request == c.AXIS_REQUEST_ON and plc.axis.switching.outcome.error == c.ERROR_NONE
    assert not c.drive_prepare(plc.axis), "once"


def test_the_axis_starts_in_the_same_millisecond_however_many_cycles_the_tables_take(c):
    """Also where the clock wraps meanwhile; and one pace later, where they take longer than one."""
    def asked_after_ms(a_ms, begun_ms=0):
        rig = Rig(c)
        rig.axis.loop.vbus_q15, rig.axis.time_ms = ENOUGH_Q15, begun_ms
        assert c.drive_switch_on(rig.axis).error == c.ERROR_NONE
        parts(rig, a_ms)
        assert rig.axis.request == c.AXIS_REQUEST_ON
        return (rig.axis.time_ms - begun_ms) % 2**32
    assert {asked_after_ms(a_ms, begun_ms) for a_ms in (2, 3, 4, 10) for begun_ms in (7, 2**32 - 5)} == {PACE_MS}
    assert asked_after_ms(1) == 2 * PACE_MS


def test_the_tables_are_those_of_a_build_at_once(plc, c):
    parts(plc)
    torque, tuning = c.torque_control(), type(plc.axis.tuning)()
    c.tuning_compute(plc.axis.params, tuning)
    c.torque_build(torque, plc.axis.params, tuning, plc.axis.loop.vbus_q15)
    assert bytes(torque.map) == bytes(plc.axis.torque.map) and bytes(torque.weakening) == bytes(plc.axis.torque.weakening)
    assert tuning.weakens == plc.axis.tuning.weakens


def test_a_bus_that_reads_in_between_is_answered(plc):
    for _ in range(20):
        assert plc.ask(read(0x10, 8))[0] == 3 and plc.c.drive_prepare(plc.axis)


def test_parameters_stay_as_they_are(plc, c):
    before = bytes(plc.axis.params)
    assert plc.ask(write(SPEED_MAX, long(3)))[:2] == bytes([0x90, 4])
    assert c.drive_defaults(plc.axis).error == c.ERROR_DRIVE_IS_ON
    assert bytes(plc.axis.params) == before


@pytest.mark.parametrize("request_", ("drive_switch_on", "drive_identify"))
def test_a_second_start_is_refused(plc, c, request_):
    builder = bytes(plc.axis.switching.builder)
    assert getattr(c, request_)(plc.axis).error == c.ERROR_ALREADY_ON
    assert bytes(plc.axis.switching.builder) == builder and plc.axis.switching.under_way


def test_what_switches_off_ends_it(plc, c):
    assert plc.control(NO_VOLTAGE) == DISABLED
    assert not c.drive_prepare(plc.axis) and plc.axis.request == c.AXIS_REQUEST_NONE
    assert plc.axis.switching.outcome.error == c.ERROR_SWITCHED_OFF


def test_a_fault_ends_it(plc, c):
    c.fault_raise(plc.axis, c.FAULT_STALL)
    assert not c.drive_prepare(plc.axis)
    assert plc.axis.request == c.AXIS_REQUEST_NONE and plc.axis.switching.outcome.error == c.ERROR_FAULT_LATCHED


def test_a_bus_that_has_sunk_meanwhile_is_found_at_the_end_and_told(plc, c):
    plc.axis.loop.vbus_q15 = plc.axis.tuning.v_min_q15 - 1
    parts(plc)
    plc.wait(1)
    assert plc.axis.request == c.AXIS_REQUEST_NONE and plc.refusal == "BUS_LOW" and plc.state == DISABLED


def test_a_retry_that_was_refused_at_the_end_is_made_again(c, plc):
    plc.axis.retry.due = plc.axis.retry.wanted = True
    plc.axis.loop.vbus_q15 = plc.axis.tuning.v_min_q15 - 1
    parts(plc)
    plc.axis.loop.vbus_q15 += 100
    for _ in range(2):
        c.drive_retry(plc.axis)
        assert parts(plc) > 50 or plc.axis.request
    assert plc.axis.request == c.AXIS_REQUEST_ON and not plc.axis.retry.due


def test_switching_that_has_ended_keeps_its_outcome(plc, c):
    """Who switches off later did not end it."""
    parts(plc)
    for error in (c.ERROR_NONE, c.ERROR_BUS_LOW):
        plc.axis.switching.outcome.error, plc.axis.switching.outcome.value = error, 7
        assert c.drive_switch_off(plc.axis).error == c.ERROR_NONE
        outcome = plc.axis.switching.outcome
        assert (outcome.error, outcome.value, plc.axis.switching.under_way) == (error, 7, False)
