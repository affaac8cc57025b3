# SPDX-License-Identifier: MIT
"""Two axes on one line of Modbus: the second answers under the next address, with the same registers."""
import struct

import pytest

from rigs.axes_at_rest import ALIKE, OBJECTS, OF_THE_LINE, PARAMS, fill
from rigs.modbus_line import FAULT_BASE, PARAM_BASE, US, Line, crc, frame, framed, long, read, words, write, write_one

BROADCAST, DEVICE_FAILURE = 0, 4
SAVE = 0x65766173
WRITTEN = {"control_word": 6, "mode": 8, "target_velocity": 5, "target_position": 77, "target_torque": 9, "homing_method": 37}


@pytest.fixture
def pair(two_buses):
    return Line(two_buses, count=2)


def of(line, axis):
    """All that is one axis'."""
    return bytes(line.axes[axis]), bytes(line.modbus.drives[axis])


def everything(line, unit=US):
    """{what: its registers} under an address."""
    found = {name: line.registers(at, (size + 1) // 2, unit=unit) for name, (at, _, size, _) in OBJECTS.items()}
    params = line.registers(PARAM_BASE, 100, unit=unit) + line.registers(PARAM_BASE + 100, 2 * len(PARAMS) - 100, unit=unit)
    reactions = line.registers(FAULT_BASE, line.c.FAULT_COUNT, unit=unit)
    found |= {f"parameter {name}": params[2 * n:2 * n + 2] for n, name in enumerate(PARAMS)}
    return found | {f"reaction {n}": reactions[n] for n in range(1, len(reactions))}


def test_each_axis_reads_as_a_drive_of_its_own_would(c, pair):
    alone = [Line(c), Line(c)]
    for n in range(2):
        fill(c, pair.axes[n], pair.modbus.drives[n], n + 1)
        fill(c, alone[n].axis, alone[n].modbus.drives[0], n + 1)
    expected = []
    for one in alone:
        c.modbus_start(one.modbus, one.rs485, one.axes, one.slots)  # the library has one line
        fill(c, one.axis, one.modbus.drives[0], 1 + len(expected))
        expected.append(everything(one))
    found = [everything(pair), everything(pair, US + 1)]
    assert found == expected
    alike = {name for name in found[0] if found[0][name] == found[1][name]}
    assert alike - ALIKE == {f"parameter {name}" for name in OF_THE_LINE}


@pytest.mark.parametrize("axis", (0, 1))
def test_what_is_written_to_one_is_the_others_no_business(pair, axis):
    c, unit = pair.c, US + axis
    allowed = [c.fault_class(fault).contents.allowed for fault in range(c.FAULT_COUNT)]
    writes = [(OBJECTS[name][0], long(value) if OBJECTS[name][2] == 4 else words(value)) for name, value in WRITTEN.items()]
    writes += [(PARAM_BASE + 2 * n, long(least if initial == most else most))
               for n, (name, (least, most, initial)) in enumerate(PARAMS.items()) if axis or name not in OF_THE_LINE]
    writes += [(FAULT_BASE + n, words(allowed[n].bit_length() - 1)) for n in range(1, c.FAULT_COUNT)]
    before, was = of(pair, 1 - axis), of(pair, axis)
    for at, data in writes:
        assert pair.ask(write(at, data, unit))[0] == 16
        assert words(*pair.registers(at, len(data) // 2, unit=unit)) == data
    assert of(pair, 1 - axis) == before and of(pair, axis) != was
    assert pair.modbus.address == US, "the line's own are the first axis'"


@pytest.mark.parametrize("axis", (0, 1))
def test_a_command_and_its_refusal_are_of_the_axis_that_was_asked(pair, axis):
    assert pair.ask(write_one(8, 1, US + axis)) == bytes([0x86, DEVICE_FAILURE])
    refused = [pair.registers(0x2B, 1, unit=US + n) == [pair.c.ERROR_NOT_OPERATING] for n in range(2)]
    assert refused == [n == axis for n in range(2)]
    for word in (6, 7, 15):
        pair.axes[axis].loop.vbus_q15 = pair.axes[axis].tuning.v_min_q15 + 100
        pair.ask(write_one(0, word, US + axis))
    assert [one.owner.who == pair.c.OWNER_MODBUS for one in pair.axes] == [n == axis for n in range(2)]


@pytest.mark.parametrize("axis", (0, 1))
def test_a_request_is_a_sign_of_life_for_the_axis_that_was_asked(pair, axis):
    pair.registers(0x10, 1, unit=US + axis)
    assert [axis.command_ms != 0 for axis in pair.axes] == [n == axis for n in range(2)]


def test_who_it_is_is_said_under_both(pair):
    said = [pair.ask(framed(US + n, bytes([0x2B, 0x0E, 1, 0]))) for n in range(2)]
    assert said[0] == said[1] and b"mssfoc" in said[0]


def test_a_broadcast_reaches_both_and_none_answers(pair):
    assert pair.say(write(PARAM_BASE, long(7), BROADCAST)) == b"" and pair.say(write_one(0, 6, BROADCAST)) == b""
    assert [axis.params.pole_pairs for axis in pair.axes] == [7, 7]
    assert [drive.cia402.stage for drive in pair.modbus.drives] == [pair.c.CIA402_READY] * 2
    assert all(axis.command_ms for axis in pair.axes)


@pytest.mark.parametrize("unit", (US - 2 & 0xFF, US + 2, 248))
def test_no_other_address_is_heard(pair, unit):
    assert pair.say(read(0x10, 1, unit=unit), then_ms=60) == b""
    assert pair.registers(0x91, 1, unit=US + 1) == [len(PARAMS)]


def test_the_highest_address_leaves_none_for_a_second(pair):
    pair.axis.params.modbus_address = 247
    pair.wait(1)
    assert pair.say(read(0x91, 1, unit=248), then_ms=60) == b"" and pair.registers(0x91, 1, unit=247) == [len(PARAMS)]


def test_at_address_0_neither_is_there(pair):
    pair.axis.params.modbus_address = 0
    pair.wait(1)
    before = of(pair, 0), of(pair, 1)
    for unit in (0, 1, 2):
        assert pair.say(write(PARAM_BASE, long(7), unit), then_ms=60) == b""
    assert [axis.params.pole_pairs for axis in pair.axes] == [4, 4] and before[1][1] == of(pair, 1)[1]


@pytest.mark.parametrize("request_of", [lambda unit: read(0x10, 1, unit=unit)[:-3],
                                        lambda unit: write(PARAM_BASE, bytes(200), unit)[:50]])
@pytest.mark.parametrize("broken, whole", [(US, US + 1), (US + 1, US), (US + 1, US + 1)])
def test_who_broke_off_may_start_over_with_the_other(pair, broken, whole, request_of):
    """Even where what follows would still fit into what has begun."""
    pair.say(request_of(broken), then_ms=5)
    reply = pair.say(read(0x91, 1, unit=whole))
    assert reply == frame(whole, 3, 2, 0, len(PARAMS)) and crc(reply[:-2]) == reply[-2:]


@pytest.mark.parametrize("unit", (US, US + 1))
def test_what_would_be_its_own_answer_is_no_request(pair, unit):
    """Frames of others may have two lengths, those to this drive one."""
    assert pair.say(frame(unit, 3, 4, 0, 0x10, 0, 1)) == b""
    pair.wait(60)
    assert pair.registers(0x91, 1, unit=unit) == [len(PARAMS)]


def test_an_answer_of_another_is_not_taken_for_a_request_to_the_second(pair):
    assert pair.say(read(0x10, 2, unit=US + 2)) == b""
    assert pair.say(framed(US + 2, struct.pack(">BB4s", 3, 4, b"\2\3\0\x10"))) == b""
    assert pair.registers(0x91, 1, unit=US + 1) == [len(PARAMS)]


@pytest.mark.parametrize("function", (0x41, 0x64))
def test_an_unknown_function_is_answered_under_the_seconds_address(pair, function):
    assert pair.say(frame(US + 1, function, 1, 2), then_ms=10) == frame(US + 1, function | 0x80, 1)


@pytest.mark.parametrize("axis", (0, 1))
def test_none_stores_while_the_other_is_on(pair, axis):
    pair.axes[1 - axis].state = pair.c.AXIS_OPERATION_ENABLED
    assert pair.ask(write(0xC0, long(SAVE), US + axis)) == bytes([0x90, DEVICE_FAILURE])
    assert pair.registers(0x2B, 1, unit=US + axis) == [pair.c.ERROR_SAVE_BESIDE_ON]


@pytest.mark.parametrize("axis", (0, 1))
def test_each_stores_for_itself(pair, axis):
    c = pair.c
    pair.axes[axis].params.ramp_rpm_s = 1234
    assert pair.ask(write(0xC0, long(SAVE), US + axis))[0] == 16
    assert [c.slots_check(slots).any for slots in pair.slots] == [n == axis for n in range(2)]
    pair.ask(write(0xC2, long(0x64616F6C), US + axis))
    assert pair.axes[axis].params.ramp_rpm_s == PARAMS["ramp_rpm_s"][2]
    assert c.drive_load(pair.axes[axis], pair.slots[axis], c.nvm_report()).error == c.ERROR_NONE
    assert pair.axes[axis].params.ramp_rpm_s == 1234
