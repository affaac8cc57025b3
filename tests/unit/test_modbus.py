# SPDX-License-Identifier: MIT
"""What Modbus reads and writes: functions, exceptions, several registers whole or not at all, broadcasts."""
import ctypes
import re
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigs.firmware import ROOT
from rigs.modbus_line import FAULT_BASE, PARAM_BASE, Line, crc, frame, framed, long, read, words, write, write_one

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE, DEVICE_FAILURE = 1, 2, 3, 4
VERSION = re.search(r'CONFIG_VERSION "(.*)"', (ROOT / "firmware/settings/config.h").read_text())[1]


@pytest.fixture
def line(c):
    return Line(c)


def refused(line, request, exception):
    """Whether the request is refused so, and has changed nothing."""
    before = line.everything()
    pdu = line.ask(request)
    return pdu == bytes([request[1] | 0x80, exception]) and line.everything() == before


# ---- reading ----

def fill(line):
    c, axis = line.c, line.axis
    axis.params.i_range_ma, axis.params.v_range_mv = 32768, 65536
    axis.speed.speed_rpm_q4, axis.speed.speed_ref_rpm_q4 = -24001, 16 * 1600 + 8
    axis.loop.i_d_q15, axis.loop.i_q_q15, axis.loop.vbus_q15 = -101, 2002, 12000
    axis.motion.turns.counts = -5
    axis.thermal.winding_q4, axis.thermal.factor_q15 = 16 * 83 + 15, 16384
    axis.time_ms = 5017
    axis.params.i_rated_ma = 4004
    for cause in (c.FAULT_VOLTAGE_LIMIT, c.FAULT_STALL):
        c.fault_warn(axis, cause)


@pytest.mark.parametrize("function", (3, 4))
def test_what_is_measured(line, function):
    fill(line)
    values = line.registers(0x10, 0x1E, function)
    signed = [struct.unpack(">i", words(*values[n:n + 2]))[0] for n in range(0, len(values), 2)]
    assert values[0] == 0x0200 | 0x80 | 0x10 | 0x40 and values[1] == 3
    assert signed[1] == -1500062 and signed[2] == -5
    assert values[6] == 500 and values[7] == 0, "half of the rated current, no fault"
    assert signed[4] == 1600500 and signed[5] == 0
    assert signed[6] == 24000 and signed[7] == -101 and signed[8] == 2002
    assert values[18] == 83 and values[19] == 500
    bits = 1 << line.c.FAULT_VOLTAGE_LIMIT | 1 << line.c.FAULT_STALL
    assert values[20:24] == [bits >> 16 & 0xFFFF, bits & 0xFFFF, bits >> 48, bits >> 32 & 0xFFFF]
    assert signed[12] == 5


def test_the_fault_and_its_snapshot(line, c):
    fill(line)
    faults, snapshot = line.axis.faults, line.axis.faults.snapshot
    faults.cause, faults.detail[0], faults.detail[1] = c.FAULT_ENCODER_DEAD, -3, 1000
    line.axis.state = c.AXIS_FAULT
    snapshot.up_ms, snapshot.state = 2**32 + 70001, c.AXIS_OPERATION_ENABLED
    snapshot.i_a_q15, snapshot.i_b_q15, snapshot.i_c_q15 = 1001, -2002, 3003
    snapshot.i_d_q15, snapshot.i_q_q15, snapshot.vbus_q15 = -4004, 5005, 6000
    snapshot.speed_rpm_q4, snapshot.angle_u16, snapshot.gate_status = 24008, 49152, 0x89ABCDEF
    values = line.registers(0x40, 25)
    assert values[:2] == [c.FAULT_ENCODER_DEAD, c.AXIS_OPERATION_ENABLED] and values[24] == 2700
    assert struct.unpack(">iiIiiiiiIiI", words(*values[2:24])) == (
        -3, 1000, 70001, 1001, -2002, 3003, -4004, 5005, 12000, 1500500, 0x89ABCDEF)
    assert line.registers(0x17, 1) == [0x7305] and line.registers(0x2A, 1) == [c.FAULT_ENCODER_DEAD]
    assert line.registers(0x10, 1)[0] & 0x4F == 0x08


def test_each_fault_has_a_code(c):
    assert c.cia402_error_code(c.FAULT_NONE) == 0 and c.cia402_error_code(1000) == 0xFF00
    assert all(c.cia402_error_code(fault) >= 0x1000 for name, fault in c.enums["fault"].items()
               if name not in ("FAULT_NONE", "FAULT_COUNT"))


def test_who_it_is(line, c):
    assert line.long(0x80) == 0x00020192 and line.long(0x84) == 0x6D666F63
    major, minor, patch = map(int, VERSION.split("."))
    assert line.long(0x86) == major << 16 | minor << 8 | patch
    assert line.long(0x8C) == line.axis.params.i_rated_ma and line.long(0x8E) == line.axis.params.speed_max_rpm
    assert line.registers(0x91, 1) == [c.param_count.value]


def test_parameters_and_reactions_read_back(line, c):
    for name in ("pole_pairs", "inertia_gmm2", "modbus_parity"):
        assert line.long(line.param(name)) == getattr(line.axis.params, name)
    line.axis.params.cross_pm = -100
    assert line.long(line.param("cross_pm")) == -100
    assert line.registers(FAULT_BASE, 40) == list(line.axis.reactions.choice)[:40]


@pytest.mark.parametrize("at, count", [(0x0A, 1), (0x03, 1), (0x02, 1), (0x13, 2), (0x10, 3), (0x2E, 1), (0x3F, 2), (0x1001, 2),
                                       (0x1000, 1), (0x1000, 3), (0xFFFF, 2), (0x0FFF, 2)])
def test_what_is_not_there_or_half_there(line, at, count):
    assert refused(line, read(at, count), ILLEGAL_ADDRESS)


@pytest.mark.parametrize("count", (0, 126, 0xFFFF))
def test_a_count_that_is_none(line, count):
    assert refused(line, read(0x1000, count), ILLEGAL_VALUE)


def test_as_many_as_fit(line, c):
    count = min(124, 2 * c.param_count.value)
    assert len(line.registers(0x1000, count)) == count


@pytest.mark.parametrize("function", (1, 2, 5, 7, 8, 11, 15, 17, 20, 24))
def test_functions_that_there_are_not(line, function):
    body = {15: b"\0\0\0\1\1\1", 20: b"\7\6\0\1\0\0\0\1", 7: b"", 11: b"", 17: b"", 24: b"\0\0"}.get(function, b"\0\0\0\1")
    assert refused(line, framed(1, bytes([function]) + body), ILLEGAL_FUNCTION)


@given(function=st.integers(65, 127), body=st.binary(max_size=40))
@settings(max_examples=60)
def test_functions_that_nobody_knows_end_with_a_silence(c, function, body):
    line = Line(c)
    sent = line.say(framed(1, bytes([function]) + body), then_ms=20)
    assert sent == frame(1, function | 0x80, ILLEGAL_FUNCTION)


# ---- writing ----

def test_one_register(line):
    assert line.ask(write_one(0x0001, 4)) == b"\x06\x00\x01\x00\x04" and line.registers(1, 1) == [4]
    assert line.ask(write_one(0x0006, -250))[0] == 6 and line.registers(6, 1) == [0x10000 - 250]


def test_several(line):
    data = words(0, 10) + long(-1500) + long(123456) + words(-100, 37)
    assert line.ask(write(0x0000, data)) == b"\x10\x00\x00\x00\x08"
    assert words(*line.registers(0, 8)) == data


@pytest.mark.parametrize("request_, exception", [
    (write_one(0x0002, 0), ILLEGAL_ADDRESS), (write_one(0x0010, 0), ILLEGAL_ADDRESS), (write_one(0x000A, 0), ILLEGAL_ADDRESS),
    (write_one(0x0009, 3), ILLEGAL_VALUE),
    (write_one(0x1000, 5), ILLEGAL_ADDRESS), (write_one(0x0001, 2), ILLEGAL_VALUE), (write_one(0x0007, 1), ILLEGAL_VALUE),
    (write_one(0x0006, 32767), ILLEGAL_VALUE), (write(0x0002, long(4001)), ILLEGAL_VALUE),
    (write(0x0002, long(-4001)), ILLEGAL_VALUE), (write(0x1000, long(51)), ILLEGAL_VALUE),
    (write(0x1000, long(0)), ILLEGAL_VALUE), (write(0x1000, long(-2**31)), ILLEGAL_VALUE),
    (write(0x00C0, long(1)), ILLEGAL_VALUE), (write(0x00C2, long(0x65766173)), ILLEGAL_VALUE),
    (write_one(FAULT_BASE, 1), ILLEGAL_VALUE), (write_one(0x0008, 3), ILLEGAL_VALUE), (write_one(0x0008, -1), ILLEGAL_VALUE),
    (write_one(FAULT_BASE + 8, 3), ILLEGAL_VALUE), (frame(1, 16, 0, 1, 0, 0, 0), ILLEGAL_VALUE),
    (frame(1, 16, 0, 1, 0, 1, 4, 0, 3, 0, 3), ILLEGAL_VALUE), (frame(1, 16, 0, 1, 0, 2, 2, 0, 3), ILLEGAL_VALUE),
])
def test_refused(line, request_, exception):
    assert refused(line, request_, exception)


def test_store_and_restore_are_save_and_defaults(line, c):
    initial = line.axis.params.ramp_rpm_s
    assert line.ask(write(line.param("ramp_rpm_s"), long(1234)))[0] == 16
    assert line.ask(write(0x00C0, long(0x65766173)))[0] == 16
    assert c.slots_check(line.slots).any, "it stands in the array"
    assert line.ask(write(0x00C2, long(0x64616F6C)))[0] == 16 and line.axis.params.ramp_rpm_s == initial
    assert c.drive_load(line.axis, line.slots, c.nvm_report()).error == c.ERROR_NONE and line.axis.params.ramp_rpm_s == 1234


def test_with_the_bridge_on_neither_happens(line, c):
    line.axis.params.ramp_rpm_s, line.axis.state = 1234, c.AXIS_OPERATION_ENABLED
    for request in (write(0x00C0, long(0x65766173)), write(0x00C2, long(0x64616F6C))):
        assert refused(line, request, DEVICE_FAILURE)
    assert line.axis.params.ramp_rpm_s == 1234


def test_parameters_change_only_while_off(line, c):
    assert line.ask(write(line.param("ramp_rpm_s"), long(1234)))[0] == 16 and line.axis.params.ramp_rpm_s == 1234
    line.axis.state = c.AXIS_OPERATION_ENABLED
    assert refused(line, write(line.param("ramp_rpm_s"), long(999)), DEVICE_FAILURE)
    assert refused(line, write_one(FAULT_BASE + c.FAULT_STALL, c.REACTION_WARN), DEVICE_FAILURE)
    line.axis.state = c.AXIS_FAULT
    assert line.ask(write_one(FAULT_BASE + c.FAULT_STALL, c.REACTION_WARN))[0] == 6
    assert line.axis.reactions.choice[c.FAULT_STALL] == c.REACTION_WARN


def test_a_reaction_leaves_all_others_as_they_are(line, c):
    choices = [(7 * fault + 1) % 3 + 1 for fault in range(c.FAULT_COUNT)]
    for fault, choice in enumerate(choices):
        line.axis.reactions.choice[fault] = choice
    choices[c.FAULT_STALL] = c.REACTION_WARN
    assert line.ask(write_one(FAULT_BASE + c.FAULT_STALL, c.REACTION_WARN))[0] == 6
    assert list(line.axis.reactions.choice)[:c.FAULT_COUNT] == choices
    for fault in range(c.FAULT_COUNT):
        assert line.ask(write_one(FAULT_BASE + fault, c.REACTION_OFF))[0] == 6
    assert set(line.axis.reactions.choice[:c.FAULT_COUNT]) == {c.REACTION_OFF}, "each has its register"


def pair(line, first, second):
    """Two parameters that stand next to each other, as one request."""
    at = line.param(first)
    assert line.param(second) == at + 2
    return lambda one, other: write(at, long(one) + long(other))


def test_several_parameters_go_together_or_not_at_all(line):
    """Singly each may be set, as on the console; together they are looked at as switching on would."""
    both = pair(line, "i_max_ma", "i_trip_ma")
    assert line.ask(both(9000, 14000))[0] == 16
    assert refused(line, both(14000, 14000), ILLEGAL_VALUE), "i_max beyond 85 % of i_trip"
    assert refused(line, both(9000, 23000), ILLEGAL_VALUE), "i_trip beyond the range"
    assert refused(line, both(9000, 0), ILLEGAL_VALUE), "out of its own range"
    assert line.ask(write(line.param("i_max_ma"), long(14000)))[0] == 16 and line.axis.params.i_max_ma == 14000


@pytest.mark.parametrize("places", (("PARAM",), ("REACTION",), ("PARAM", "REACTION"), ("PARAM", "REACTION", "PARAM")))
def test_settings_of_any_kind_in_one_change_need_a_drive_that_is_off(line, c, places):
    drive, kinds = line.modbus.drives[0], {"REACTION": 2, "PARAM": 3}  # of object_place
    for state, refusal in ((c.AXIS_OPERATION_ENABLED, c.OBJECT_BAD_STATE), (c.AXIS_SWITCH_ON_DISABLED, c.OBJECT_OK)):
        change, line.axis.state = c.structs["object_change"](), state
        c.object_begin(change, drive)
        for kind in places:
            number, value = (c.FAULT_STALL, c.REACTION_WARN) if kind == "REACTION" else (0, 5)
            assert c.object_change(change, c.object_place(kind=kinds[kind], number=number), value) == c.OBJECT_OK
        before = line.everything()
        assert c.object_commit(change, drive) == refusal and (line.everything() == before) == (refusal != c.OBJECT_OK)


# ---- another source of the angle ----


def refusal(line):
    return line.registers(0x2B, 3)[0]


def test_the_source_of_the_angle_is_the_one_in_effect_and_the_same_again_is_nothing(line):
    line.axis.params.angle_source = 2
    assert line.registers(8, 1) == [0] and line.ask(write_one(8, 0))[0] == 6
    line.axis.tuning.angle_source = 1
    assert line.registers(8, 1) == [1] and refusal(line) == 0


def test_another_source_is_refused_at_once_or_later_and_says_why(line, c):
    assert line.ask(write_one(8, 1)) == bytes([0x86, DEVICE_FAILURE]) and refusal(line) == c.ERROR_NOT_OPERATING
    axis = line.axis
    axis.state, axis.mode, axis.start.aligned = c.AXIS_OPERATION_ENABLED, c.AXIS_MODE_POSITION, True
    axis.owner.who = c.OWNER_MODBUS
    assert line.ask(write_one(8, 2)) == bytes([0x86, DEVICE_FAILURE]) and refusal(line) == c.ERROR_SOURCE_MODE
    axis.mode, line.fabric.encoder.HALL, line.prepares = c.AXIS_MODE_SPEED, 5, False
    assert line.ask(write_one(8, 2))[0] == 6 and axis.handover.under_way and refusal(line) == 0
    assert line.registers(8, 1) == [0], "not yet"
    line.wait(2000)
    assert not c.drive_prepare(axis)
    line.wait(1)
    assert refusal(line) == c.ERROR_SOURCE_SLOW and line.registers(0x2C, 2)[1] == 60 // axis.params.pole_pairs + 1


def test_a_write_that_ends_beyond_the_table_changes_nothing(line, c):
    last = PARAM_BASE + 2 * (c.param_count.value - 1)
    assert refused(line, write(last, long(1) + long(1)), ILLEGAL_ADDRESS)
    assert refused(line, write(0x0006, words(100, 34, 0, 2, 0)), ILLEGAL_ADDRESS)


@given(st.data())
@settings(max_examples=150)
def test_all_or_nothing(c, data):
    """A block of commands of which one value at most is wrong: all of it is there, or none."""
    line = Line(c)
    values = {"mode": data.draw(st.sampled_from([1, 3, 4, 6, 8, 9, 10, 0, 2, -1])), "rpm": data.draw(st.integers(-4200, 4200)),
              "counts": data.draw(st.integers(-2**31, 2**31 - 1)), "torque": data.draw(st.integers(-1600, 1600)),
              "homing": data.draw(st.sampled_from([34, -1, 37, 0]))}
    block = words(0, values["mode"]) + long(values["rpm"]) + long(values["counts"]) + words(values["torque"], values["homing"])
    before = words(*line.registers(0, 8))
    good = (values["mode"] in (1, 3, 4, 6, 8, 9, 10) and abs(values["rpm"]) <= 4000 and values["homing"] in (34, -1, 37)
            and abs(values["torque"]) * 7100 // 1000 <= 10650)
    assert (line.ask(write(0, block))[0] == 16) == good
    assert words(*line.registers(0, 8)) == (block if good else before)


def test_mask(line):
    line.ask(write_one(0x0000, 0x0012))
    assert line.ask(framed(1, struct.pack(">BHHH", 22, 0, 0x00F2, 0x0025))) == struct.pack(">BHHH", 22, 0, 0x00F2, 0x0025)
    assert line.registers(0, 1) == [0x0017], "the example of the standard"
    assert refused(line, framed(1, struct.pack(">BHHH", 22, 2, 0, 0)), ILLEGAL_ADDRESS)
    assert refused(line, framed(1, struct.pack(">BHHH", 22, 16, 0, 0)), ILLEGAL_ADDRESS)
    assert refused(line, framed(1, struct.pack(">BHHH", 22, 1, 0, 2)), ILLEGAL_VALUE)


def test_write_and_read(line):
    request = framed(1, struct.pack(">BHHHHB", 23, 0, 4, 1, 3, 6) + words(10) + long(77))
    assert line.ask(request) == b"\x17\x08" + words(0, 10) + long(77), "what was written is what is read"


@pytest.mark.parametrize("reads, at, count, data, exception", [
    (0x2E, 1, 1, words(4), ILLEGAL_ADDRESS), (0x00, 16, 1, words(4), ILLEGAL_ADDRESS), (0x00, 1, 1, words(2), ILLEGAL_VALUE)])
def test_write_and_read_is_whole(line, reads, at, count, data, exception):
    assert refused(line, framed(1, struct.pack(">BHHHHB", 23, reads, 1, at, count, len(data)) + data), exception)


# ---- identification ----

def identify(line, code, first=0):
    pdu = line.ask(frame(1, 0x2B, 0x0E, code, first))
    if pdu[0] != 0x2B:
        return pdu[1]
    assert pdu[:6] == bytes([0x2B, 0x0E, code, 0x82, 0, 0])
    objects, rest = {}, pdu[7:]
    while rest:
        objects[rest[0]], rest = rest[2:2 + rest[1]].decode(), rest[2 + rest[1]:]
    assert len(objects) == pdu[6]
    return objects


def test_identification(line):
    assert identify(line, 1) == {0: "mssfoc", 1: "mssfoc", 2: VERSION}
    regular = identify(line, 2)
    assert list(regular) == list(range(7)) and regular[4] == "mssfoc motor drive"
    assert identify(line, 3) == regular and identify(line, 4, 2) == {2: VERSION}
    assert identify(line, 1, 2) == {2: VERSION} and identify(line, 1, 9) == identify(line, 1)
    assert identify(line, 4, 7) == ILLEGAL_ADDRESS and identify(line, 0) == identify(line, 5) == ILLEGAL_VALUE
    assert refused(line, frame(1, 0x2B, 0x0D, 1, 0), ILLEGAL_FUNCTION)


# ---- broadcast, address ----

def test_a_broadcast_is_obeyed_and_never_answered(line):
    assert line.say(write(0x0002, long(300), unit=0), then_ms=20) == b"" and line.long(2) == 300
    assert line.say(write_one(0x0001, 4, unit=0), then_ms=20) == b"" and line.registers(1, 1) == [4]
    for request in (read(0x10, 1, unit=0), write_one(0x0001, 2, unit=0), frame(0, 0x2B, 0x0E, 1, 0), frame(0, 0x41, 1, 2)):
        before = line.everything()
        assert line.say(request, then_ms=80) == b"" and line.everything() == before


@pytest.mark.parametrize("unit", (2, 17, 247, 255))
def test_another_address_is_another_drive(line, unit):
    before = line.everything()
    for request in (write_one(0x0001, 4, unit), write(0x0002, long(300), unit), read(0x10, 1, unit=unit)):
        assert line.say(request, then_ms=20) == b"" and line.everything() == before


def test_who_is_spoken_to_hears(line):
    """For the command time-out: requests to this drive count, those to others and damaged ones do not."""
    line.axis.command_ms = 0
    for request in (read(0x10, 1, unit=2), read(0x10, 1)[:-1] + b"\0"):
        line.say(request, then_ms=60)
        assert line.axis.command_ms == 0
    line.say(read(0x10, 1))
    assert line.axis.command_ms == line.axis.time_ms


def test_the_registers_are_one_table(c):
    """No two values overlap, and the frame of the smallest reply fits each."""
    taken = {}
    for number, item in enumerate(c.objects):
        for at in range(item.at, item.at + (2 if item.type >= c.OBJECT_TYPE_U32 else 1)):
            assert taken.setdefault(at, number) == number
    assert max(taken) < FAULT_BASE < FAULT_BASE + c.FAULT_COUNT < PARAM_BASE and crc(b"") == b"\xff\xff"
