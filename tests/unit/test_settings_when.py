# SPDX-License-Identifier: MIT
"""When nothing is saved or loaded, and what was learned of the encoder."""
import ctypes
import struct

import pytest

from rigs.settings import (COGGING, COUNTS, INDEX, NEW, OLD, PARAMETER, REACTION, SEEN, Drive, learn, number, parse, record,
                           slot, torque)


@pytest.fixture
def drive(c):
    return Drive(c)


# ---- when not --------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("state", ("NOT_READY", "READY", "SWITCHED_ON", "OPERATION_ENABLED", "QUICK_STOP", "FAULT_REACTION"))
def test_nothing_while_the_bridge_may_be_on(state, drive, c):
    drive.set(**OLD)
    assert drive.save() == "NONE"
    drive.set(**NEW)
    before = drive.params()
    drive.axis.state, drive.fabric.gate.STATUS = c.enums["axis_state"]["AXIS_" + state], 1
    drive.bench.commands = drive.bench.lit = 0
    assert drive.save() == "SAVE_WHILE_ON"
    assert drive.load() == "DRIVE_IS_ON" and drive.kept.state == c.NVM_NOTHING
    assert drive.name(c.drive_defaults(drive.axis).error) == "DRIVE_IS_ON"
    assert drive.params() == before and drive.bench.commands == drive.bench.lit == 0


def test_a_drive_with_a_fault_can_be_saved(drive, c):
    drive.axis.state = c.AXIS_FAULT
    assert drive.save() == "NONE" and drive.load() == "NONE"


def test_not_while_the_shaft_turns(drive):
    drive.axis.speed.speed_rpm_q4 = -31 * 16
    assert drive.save() == "TURNING" and drive.bench.writes == 0


def test_not_at_a_wrong_clock(drive, c):
    c.host_device_fault.value = c.FAULT_CLOCK
    try:
        assert drive.save() == "ENVM_CLOCK" and drive.bench.writes == 0
    finally:
        c.host_device_fault.value = 0


def test_not_where_the_slow_loop_is_dead(drive, c):
    """Programming serves the watchdog, which then would never bite."""
    drive.set(**OLD)
    assert drive.save() == "NONE"  # and the bench's clock has an axis that goes on
    before, other, report = drive.bench.commands, c.axis(), c.saved()
    drive.bench.axis = ctypes.pointer(other)  # now it is another one
    assert drive.name(c.drive_save(drive.axis, drive.slots, report).error) == "BUSY"
    assert drive.bench.commands == before


def test_the_slow_loop_does_not_take_it_for_a_dead_current_loop(drive, c):
    """Conversions have gone unanswered: the next steps do not count them."""
    axis = drive.axis
    axis.heartbeat = drive.fabric.adc.SEQUENCE = 1000
    axis.time_ms = axis.rate_chosen_ms = 50
    axis.time_ms += 40
    assert drive.save() == "NONE"
    assert axis.time_ms - axis.rate_chosen_ms <= 2
    drive.fabric.adc.SEQUENCE = 1400
    c.drive_step(axis)
    assert axis.faults.cause == c.FAULT_NONE


def test_defaults(drive, c):
    initial = drive.params(), drive.choices()
    drive.set(**NEW)
    drive.axis.reactions.choice[c.FAULT_HOMING] = c.REACTION_OFF
    assert drive.save() == "NONE"
    assert drive.name(c.drive_defaults(drive.axis).error) == "NONE"
    assert (drive.params(), drive.choices()) == initial
    assert drive.load() == "NONE" and drive.axis.params.learn_rpm == NEW["learn_rpm"]


# ---- what was learned of the encoder ---------------------------------------------------------------------------------

def test_the_index_and_the_cogging_are_back_wherever_the_counter_begins(drive, c):
    learn(drive, index=1234)
    drive.axis.params.speed_bw_hz = 60
    c.cogging_set_fade(drive.axis.motion.cogging, 60)
    before = {place: torque(drive, (1234 + place) % COUNTS) for place in range(0, COUNTS, 53)}
    assert max(before.values()) > 100
    assert drive.save() == "NONE" and not drive.saved.cogging_dropped
    assert drive.restart() == "NONE"
    start = drive.axis.start
    assert start.index_known and start.index_offset_q32 == 0x89ABCDEF and not start.aligned
    c.drive_restore_cogging(drive.axis)
    assert drive.axis.motion.cogging.count == 0, "the index has not been seen yet"
    drive.fabric.encoder.STATUS, drive.fabric.encoder.INDEX = SEEN, 3210
    c.drive_restore_cogging(drive.axis)
    assert drive.axis.motion.cogging.count == 2 and not drive.axis.nvm_cogging.pending
    for place, torque_q15 in before.items():
        assert abs(torque(drive, (3210 + place) % COUNTS) - torque_q15) <= 1
    assert drive.save() == "NONE" and drive.restart() == "NONE", "and again"


def test_a_map_that_waits_for_the_index_is_stored_as_it_is(drive, c):
    learn(drive)
    assert drive.save() == "NONE" and drive.restart() == "NONE" and drive.axis.nvm_cogging.pending
    first = parse(bytes(drive.raw(0)))[1][COGGING, "cogging"]
    assert drive.save() == "NONE"
    assert parse(bytes(drive.raw(1)))[1][COGGING, "cogging"] == first


def test_without_an_index_there_is_nothing_to_count_from(drive):
    learn(drive)
    drive.axis.start.index_known, drive.fabric.encoder.STATUS = False, 0
    assert drive.save() == "NONE" and drive.saved.cogging_dropped
    assert {kind for kind, _ in parse(bytes(drive.raw(0)))[1]} == {PARAMETER, REACTION}


def test_of_another_encoder_nothing_is_kept(drive):
    """`set encoder_counts`, and no `on` since: what was learned is of the old one."""
    learn(drive)
    drive.set(encoder_counts=4096)
    assert drive.save() == "NONE"
    assert {kind for kind, _ in parse(bytes(drive.raw(0)))[1]} == {PARAMETER, REACTION}


def test_the_scale_of_the_set_comes_with_its_index(drive, c):
    """Not only with the next `on`, which would take another scale for another encoder and forget."""
    drive.put(0, slot([record(PARAMETER, "encoder_counts", number(8192)), record(INDEX, "index", struct.pack("<I", 77))], 1))
    assert drive.load() == "NONE" and drive.axis.start.index_offset_q32 == 77
    drive.axis.loop.vbus_q15 = (drive.axis.tuning.v_min_q15 + drive.axis.tuning.v_max_q15) // 2
    assert drive.name(c.switch_on_at_once(drive.axis).error) == "NONE"
    assert drive.axis.start.index_known and drive.axis.start.index_offset_q32 == 77


def test_what_was_aligned_in_this_life_is_newer_than_what_is_stored(drive):
    learn(drive)
    assert drive.save() == "NONE"
    drive.axis.start.index_offset_q32 = 5
    assert drive.load() == "NONE" and drive.axis.start.index_offset_q32 == 5


def test_in_a_fabric_in_doubt_nothing_is_touched(drive, c):
    learn(drive)
    assert drive.save() == "NONE"
    drive.power_on()
    drive.axis.fabric_untrusted = 0xD0B7FABC
    before = bytes(drive.fabric)
    assert drive.load() == "NONE" and bytes(drive.fabric) == before and not drive.axis.start.index_known
