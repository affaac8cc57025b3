# SPDX-License-Identifier: MIT
"""Two axes in one node of CANopen: each its own objects, 0x800 apart; the node's affairs are both axes'."""
import configparser
import ctypes
import re
import struct

import pytest

from rigs.axes_at_rest import ALIKE, OBJECTS, OF_THE_LINE, PARAMS, fill
from rigs.can_node import EMERGENCY, NODE, OFF, PRE_OPERATIONAL, RESET_COMMUNICATION, SDO_IN, START, STOP, Node, aborted
from rigs.firmware import ROOT
from eds import eds

AXIS = 0x800
WORD, STATUS, SPEED, VELOCITY = 0x60400010, 0x60410010, 0x60FF0020, 0x606C0020
SECOND = AXIS << 16  # of an entry of a mapping
RPDO, TPDO = 0x200 + NODE, 0x180 + NODE
SAVE, LOAD = 0x65766173, 0x64616F6C
# {name: (index, bytes)} of what an axis has
OWN = {name: (index or 0x2000 + at, size) for name, (at, index, size, _) in OBJECTS.items() if index >= 0x2000 or not index}
WRITTEN = {"control_word": 6, "mode": 8, "target_velocity": 5, "target_position": 77, "target_torque": 9, "homing_method": 37}


@pytest.fixture
def pair(two_buses):
    made = Node(two_buses, count=2)
    made.sent()
    return made


def of(node, axis):
    """All that is one axis'."""
    return bytes(node.axes[axis]), bytes(node.canopen.drives[axis])


def enable(node, *which):
    """These, beside those that are already."""
    which = [n for n in range(2) if n in which or node.axes[n].owner.who == node.c.OWNER_CAN]
    for axis in (n for n in which if node.axes[n].owner.who != node.c.OWNER_CAN):
        for word in (6, 7, 15):
            node.write(0x6040 + axis * AXIS, 0, word, 2)
        node.axes[axis].request, node.axes[axis].state = 0, node.c.AXIS_OPERATION_ENABLED
    node.poll()
    node.sent()
    assert [axis.owner.who == node.c.OWNER_CAN for axis in node.axes] == [n in which for n in range(2)]


# ---- the dictionary ----

def everything(node, offset=0):
    """{what: its value} of an axis' objects."""
    found = {name: node.read(index + offset) for name, (index, _) in OWN.items()}
    found |= {f"parameter {name}": node.read(0x3000 + n + offset) for n, name in enumerate(PARAMS)}
    return found | {f"reaction {n}": node.read(0x2400 + n + offset) for n in range(1, node.c.FAULT_COUNT)}


def filled(node, axis, seed):
    fill(node.c, node.axes[axis], node.canopen.drives[axis], seed)


def test_each_axis_reads_as_a_drive_of_its_own_would(c, pair):
    filled(pair, 0, 1)
    filled(pair, 1, 2)
    alone = [Node(c), Node(c)]
    for n, node in enumerate(alone):
        filled(node, 0, n + 1)
        node.axes[0].time_ms = pair.axes[n].time_ms
    expected = []
    for node in alone:
        c.host_can_saids.value = 0
        expected.append(everything(node))
    found = everything(pair), everything(pair, AXIS)
    expected[1]["parameter can_node"] = bytes(4)  # the line's own are the first axis'
    assert list(found) == expected
    alike = {name for name in found[0] if found[0][name] == found[1][name]}
    assert alike - ALIKE == {f"parameter {name}" for name in OF_THE_LINE if name != "can_node"}


@pytest.mark.parametrize("axis", (0, 1))
@pytest.mark.parametrize("what", ("objects", "parameters", "reactions"))
def test_what_is_written_to_one_is_the_others_no_business(pair, axis, what):
    c = pair.c
    allowed = [c.fault_class(fault).contents.allowed for fault in range(c.FAULT_COUNT)]
    writes = {
        "objects": [(OWN[name][0], value, OWN[name][1]) for name, value in WRITTEN.items()],
        "parameters": [(0x3000 + n, least if initial == most else most, 4)
                       for n, (name, (least, most, initial)) in enumerate(PARAMS.items()) if axis or name not in OF_THE_LINE],
        "reactions": [(0x2400 + n, allowed[n].bit_length() - 1, 2) for n in range(1, c.FAULT_COUNT)]}[what]
    pair.read(0x1000)  # a sign of life for both
    before = of(pair, 1 - axis)
    was = of(pair, axis)
    for index, value, size in writes:
        pair.write(index + axis * AXIS, 0, value, size)
        assert pair.value(index + axis * AXIS) == value & 256 ** size - 1
    assert of(pair, 1 - axis) == before and of(pair, axis) != was and len(writes) >= 6
    assert pair.canopen.node == NODE, "the line's own are the first axis'"


@pytest.mark.parametrize("axis", (0, 1))
def test_a_refusal_is_of_the_axis_that_was_asked(pair, axis):
    with aborted(0x08000022):
        pair.write(0x2008 + axis * AXIS, 0, 1, 2)
    assert [pair.value(0x202B + n * AXIS) == pair.c.ERROR_NOT_OPERATING for n in range(2)] == [n == axis for n in range(2)]
    pair.axes[axis].state = pair.c.AXIS_OPERATION_ENABLED
    with aborted(0x08000022):
        pair.write(0x3000 + axis * AXIS, 0, 5, 4)
    pair.write(0x3000 + (1 - axis) * AXIS, 0, 5, 4)


def test_it_says_that_there_are_several(pair, c):
    assert [pair.value(index) for index in (0x1000, 0x67FF, 0x6FFF)] == [0xFFFF0192, 0x00020192, 0x00020192]
    alone = Node(c)
    assert alone.value(0x1000) == 0x00020192
    for index in (0x67FF, 0x6FFF, 0x6840, 0x2810, 0x2C26, 0x3800):
        with aborted(0x06020000):
            alone.read(index)


@pytest.mark.parametrize("index", (0x1810 + 0x100, 0x1818, 0x5800, 0x7040, 0x7840, 0x3800 + 200, 0x2C00, 0x28C0))
def test_what_is_no_axis_is_not_there(pair, index):
    with aborted(0x06020000):
        pair.read(index)


@pytest.mark.parametrize("axes", (1, 2))
def test_the_sheet_has_what_the_node_has(c, two_buses, axes):
    sheet = configparser.ConfigParser(interpolation=None)
    sheet.optionxform = str
    sheet.read_string(eds(axes))
    node, sizes = Node((c, two_buses)[axes - 1], count=axes), {2: 1, 5: 1, 3: 2, 6: 2, 4: 4, 7: 4}
    names = {}
    for name in sheet.sections():
        place = name.partition("sub")
        if len(place[0]) != 4 or "DataType" not in sheet[name] or sheet[name]["DataType"] in ("0x0009", "0x000F"):
            continue
        index, sub = int(place[0], 16), int(place[2] or "0", 16)
        assert len(node.read(index, sub)) == sizes[int(sheet[name]["DataType"], 16)], name
        names |= {index: sheet[name]["ParameterName"]} if index >= 0x2000 else {}
    others = len({one.index for one in (c.profile_object * c.profile_object_count.value).from_address(
        ctypes.addressof(c.profile_objects))})
    assert len(names) == axes * (len(OWN) + others + len(PARAMS) + c.FAULT_COUNT - 1) + 2 * (axes - 1)
    assert all(name == f"{names[index - AXIS]}, axis 2" for index, name in names.items() if index & AXIS)
    assert node.value(0x1000) == int(sheet["1000"]["DefaultValue"], 0)


def test_both_are_stored_and_restored(pair):
    c, row = pair.c, list(PARAMS).index("ramp_rpm_s")
    for axis, value in enumerate((1234, 4321)):
        pair.write(0x3000 + row + axis * AXIS, 0, value, 4)
    pair.write(0x1010, 1, SAVE, 4)
    pair.write(0x1011, 1, LOAD, 4)
    assert [axis.params.ramp_rpm_s for axis in pair.axes] == [PARAMS["ramp_rpm_s"][2]] * 2 and pair.axis.params.can_node == NODE
    assert pair.value(0x1018, 0) == 4, "it stays on the bus"
    for axis, slots, value in zip(pair.axes, pair.slots, (1234, 4321)):
        assert c.drive_load(axis, slots, c.nvm_report()).error == c.ERROR_NONE and axis.params.ramp_rpm_s == value


@pytest.mark.parametrize("on", (0, 1))
@pytest.mark.parametrize("sub", (0x1010, 0x1011))
def test_none_is_while_one_is_on(pair, on, sub):
    for axis in pair.axes:
        axis.params.ramp_rpm_s = 1234
    pair.axes[on].state = pair.c.AXIS_OPERATION_ENABLED
    with aborted(0x08000022):
        pair.write(sub, 1, {0x1010: SAVE, 0x1011: LOAD}[sub], 4)
    assert [axis.params.ramp_rpm_s for axis in pair.axes] == [1234] * 2
    assert not any(pair.c.slots_check(slots).any for slots in pair.slots)


# ---- process data ----

def points(node):
    return [(drive.cia402.setpoints.control_word, drive.cia402.setpoints.target_rpm) for drive in node.canopen.drives]


def test_a_received_one_may_be_for_both(pair):
    pair.remap(0x1400, WORD + SECOND, WORD, SPEED + SECOND)
    pair.nmt(START)
    pair.say((RPDO, struct.pack("<HHi", 7, 6, 321)))
    assert points(pair) == [(6, 0), (7, 321)]


@pytest.mark.parametrize("speeds", [(4001, 5), (5, 4001)])
def test_it_acts_on_both_or_on_none(pair, speeds):
    pair.remap(0x1400, SPEED, SPEED + SECOND)
    pair.nmt(START)
    pair.say((RPDO, struct.pack("<ii", 1, 2)))
    before = of(pair, 0), of(pair, 1)
    pair.say((RPDO, struct.pack("<ii", *speeds)))
    assert points(pair) == [(0, 1), (0, 2)] and (of(pair, 0), of(pair, 1)) == before


def test_one_for_the_second_leaves_the_first_alone(pair):
    pair.remap(0x1401, WORD + SECOND, 0x68600008)
    pair.nmt(START)
    pair.say((0x80, b""))
    before = of(pair, 0)
    pair.say((RPDO + 0x100, struct.pack("<Hb", 6, 8)))
    assert of(pair, 0) == before and pair.canopen.drives[1].cia402.setpoints.mode == 8


def test_a_sent_one_may_be_of_both(pair):
    pair.remap(0x1800, STATUS + SECOND, VELOCITY, STATUS)
    pair.axes[0].speed.speed_rpm_q4, pair.axes[1].speed.speed_rpm_q4 = 16, 32
    pair.canopen.drives[1].cia402.stage = pair.c.CIA402_READY
    told = [data for identifier, data in pair.nmt(START) if identifier == TPDO]
    assert told == [struct.pack("<HiH", 0x0231, 1000, 0x0250)]
    pair.canopen.drives[0].cia402.stage = pair.c.CIA402_READY
    assert [data for _, identifier, data in pair.wait(1) if identifier == TPDO] == [struct.pack("<HiH", 0x0231, 1000, 0x0231)]
    pair.remap(0x1801, 0x10000020, 0x6FFF0020)
    types = [data for _, identifier, data in pair.wait(100) if identifier == 0x285]
    assert types == [struct.pack("<II", 0xFFFF0192, 0x00020192)]


def test_the_page_gives_the_second_its_own(pair):
    """The writes of docs/can.md, in their order."""
    page = (ROOT / "docs/can.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| 0x(1[4-9A]03):([\d, ]+) \| (.*) \|$", page, re.MULTILINE)
    for index, subs, values in rows:
        for sub, value in zip(subs.split(", "), values.split("; ")):
            number, _, node = value.partition(" + ")
            pair.write(int(index, 16), int(sub), int(number, 0) + (NODE if node else 0), 1 if sub == "0" else 4)
    assert len(rows) == 6
    pair.nmt(START)
    pair.axes[1].speed.speed_rpm_q4 = 16
    sent = pair.say((0x500 + NODE, struct.pack("<Hi", 6, 123)), (0x80, b""))
    assert points(pair) == [(0, 0), (6, 123)]
    assert [data for identifier, data in sent if identifier == 0x485] == [struct.pack("<Hi", 0x0231, 1000)]


@pytest.mark.parametrize("code, entry", [(0x06040041, STATUS + SECOND), (0x06040041, 0x68400020), (0x06040041, 0x38000020)])
def test_what_cannot_be_mapped_of_the_first_cannot_of_the_second(pair, code, entry):
    pair.write(0x1400, 1, RPDO | OFF, 4)
    pair.write(0x1600, 0, 0, 1)
    with aborted(code):
        pair.write(0x1600, 1, entry, 4)


# ---- faults, and the master ----

def told(node, ms=1):
    return [data for _, identifier, data in node.wait(ms) if identifier == EMERGENCY]


def test_a_fault_is_told_with_its_axis_and_its_end(pair):
    c = pair.c
    pair.nmt(START)
    pair.sent()
    pair.axes[1].faults.cause, pair.axes[1].faults.count = c.FAULT_OVERVOLTAGE, 1
    assert told(pair) == [struct.pack("<HBBBHB", 0x3210, 0b101, c.FAULT_OVERVOLTAGE, 2, 0, 0)]
    pair.axes[0].faults.cause, pair.axes[0].faults.count = c.FAULT_ENCODER_SLIP, 1
    assert told(pair) == [struct.pack("<HBBBHB", 0x7305, 0b101, c.FAULT_ENCODER_SLIP, 1, 0, 0)]
    assert pair.value(0x1003, 1) == (0x100 | c.FAULT_ENCODER_SLIP) << 16 | 0x7305
    assert pair.value(0x1003, 2) == (0x200 | c.FAULT_OVERVOLTAGE) << 16 | 0x3210
    pair.axes[1].faults.cause = c.FAULT_NONE
    assert told(pair) == [struct.pack("<HBBBHB", 0, 0b001, 0, 2, 0, 0)] and pair.value(0x1001) == 1
    pair.axes[0].faults.cause = c.FAULT_NONE
    assert told(pair) == [struct.pack("<HBBBHB", 0, 0, 0, 1, 0, 0)] and not told(pair, 50)


def test_two_faults_at_once_are_told_no_sooner_than_they_may(pair):
    pair.write(0x1015, 0, 100, 2)  # 10 ms
    pair.wait(20)
    for axis in pair.axes:
        axis.faults.cause, axis.faults.count = pair.c.FAULT_OVERVOLTAGE, 1
    times = [at for at, identifier, _ in pair.wait(30) if identifier == EMERGENCY]
    assert len(times) == 2 and times[1] - times[0] == 10


def lost(node):
    return [axis.master_lost for axis in node.axes]


@pytest.mark.parametrize("command", (STOP, PRE_OPERATIONAL, RESET_COMMUNICATION))
@pytest.mark.parametrize("which", [(0,), (1,), (0, 1)])
def test_a_master_that_takes_the_node_out_of_operation_is_lost_to_who_operates(pair, command, which):
    pair.nmt(START)
    enable(pair, *which)
    pair.nmt(command)
    assert lost(pair) == [2 * (n in which) for n in range(2)]
    for n in set(range(2)) - set(which):
        if command != STOP:
            enable(pair, *which, n)
            assert lost(pair)[n] == 0, "it began without"
    pair.nmt(START)
    assert lost(pair) == [2 * (n in which) for n in range(2)], "what it had enabled is over"


def test_a_heartbeat_that_stops_and_bus_off_are_both_axes(pair):
    pair.nmt(START)
    enable(pair, 0, 1)
    pair.write(0x1016, 1, 0x7F << 16 | 30, 4)
    pair.say((0x77F, b"\5"))
    pair.wait(32)
    assert lost(pair) == [1, 1]
    pair.c.host_can_state.value = pair.c.CAN_OFF
    pair.wait(1)
    assert lost(pair) == [3, 3]
    pair.axis.params.can_node = 0
    pair.wait(1)
    assert lost(pair) == [0, 0]


@pytest.mark.parametrize("frame", [(SDO_IN, struct.pack("<BHBI", 0x40, 0x1000, 0, 0)), (RPDO, b"\0\0"), (0, bytes([1, NODE])),
                                   (0x77F, b"\5")])
def test_what_is_meant_for_the_node_is_a_sign_of_life_for_both(pair, frame):
    pair.nmt(START)
    pair.write(0x1016, 1, 0x7F << 16 | 30, 4)
    for axis in pair.axes:
        axis.command_ms = 0
    pair.say(frame)
    assert [axis.command_ms != 0 for axis in pair.axes] == [True, True]


@pytest.mark.parametrize("stopped", (0, 1))
def test_a_stop_of_one_axis_does_not_wait_for_the_other(pair, stopped):
    """Both words in one frame, and the console commands the axis that is to go on: that is refused, and the stop is not."""
    enable(pair, 0, 1)
    pair.remap(0x1403, WORD, WORD + SECOND)
    pair.nmt(START)
    pair.axes[1 - stopped].owner.who = pair.c.OWNER_CONSOLE
    pair.poll()
    words = (0, 0x0F) if stopped == 0 else (0x0F, 0)
    pair.say((0x500 + NODE, struct.pack("<HH", *words)))
    assert [axis.request == pair.c.AXIS_REQUEST_OFF for axis in pair.axes] == [n == stopped for n in range(2)]
