# SPDX-License-Identifier: MIT
"""The node of CANopen, by CiA 301: what it sends, what it refuses and with which code, what becomes of a lost master."""
import struct

import pytest

from rigs.can_node import (EMERGENCY, HEARTBEAT, NODE, OFF, PRE_OPERATIONAL, RESET_COMMUNICATION, RESET_NODE, SDO_IN, SDO_OUT,
                           START, STOP, Node, aborted)

SPEED, POSITION, WORD = 0x60FF0020, 0x607A0020, 0x60400010
RPDO, TPDO = 0x200 + NODE, 0x180 + NODE


@pytest.fixture
def node(c):
    made = Node(c)
    assert made.sent() == [(HEARTBEAT, b"\0")]
    return made


@pytest.fixture
def running(node):
    return node.enabled()


# ---- network management ----

def test_without_a_number_it_is_not_there(c):
    node = Node(c, node=0)
    assert not node.say((0, b"\1\0"), (SDO_IN, bytes(8))) and not node.wait(50) and c.host_can_opened.value == 0


@pytest.mark.parametrize("kbit, taken", [(20, 20), (125, 125), (300, 250), (999, 800), (1000, 1000)])
def test_it_takes_the_highest_rate_that_is_not_above(c, kbit, taken):
    node = Node(c)
    node.sent()
    node.axis.params.can_recover = 1  # a change of that, too
    node.axis.params.can_kbit = kbit
    node.poll()
    assert c.host_can_kbit.value == taken and node.sent() == [(HEARTBEAT, b"\0")]


def test_a_change_of_its_number_takes_it_to_the_other_one(node):
    node.axis.params.can_node = 9
    assert node.wait(1) == [(1, 0x709, b"\0")]
    assert node.say((0x609, struct.pack("<BHBI", 0x40, 0x1000, 0, 0)))[0][0] == 0x589
    node.axis.params.can_node = 0
    closed = node.c.host_can_closed.value
    assert node.wait(1) == [] and node.c.host_can_closed.value == closed + 1
    assert node.canopen.state == 0, "off the bus it is in no state that it has left"


@pytest.mark.parametrize("data, state", [
    *((bytes([command, to]), state) for command, state in ((START, 5), (STOP, 4), (PRE_OPERATIONAL, 127)) for to in (0, NODE)),
    *((data, 127) for data in (bytes([START, NODE + 1]), bytes([START]), bytes([START, NODE, 0]), bytes([3, NODE])))])
def test_commands_change_the_state_and_others_do_not(node, data, state):
    node.say((0, data))
    assert node.canopen.state == state


@pytest.mark.parametrize("command", (RESET_NODE, RESET_COMMUNICATION))
def test_a_reset_forgets_what_was_set_and_boots(node, command):
    node.write(0x1017, 0, 100, 2)
    node.nmt(START)
    node.sent()
    assert node.nmt(command)[:1] == [(HEARTBEAT, b"\0")]
    assert node.canopen.state == 127 and node.value(0x1017) == 0


def test_a_stopped_node_hears_nmt_alone(node):
    node.nmt(START)
    node.nmt(STOP)
    assert not node.say((SDO_IN, struct.pack("<BHBI", 0x40, 0x1000, 0, 0)), (RPDO, b"\6\0"), (0x80, b""))
    assert node.canopen.drives[0].cia402.setpoints.control_word == 0
    node.nmt(PRE_OPERATIONAL)
    assert node.value(0x1000) == 0x00020192


def test_its_heartbeat_says_its_state_in_time(node):
    node.write(0x1017, 0, 10, 2)
    beats = [(at, data) for at, identifier, data in node.wait(55) if identifier == HEARTBEAT]
    assert [late[0] - early[0] for early, late in zip(beats, beats[1:])] == [10] * (len(beats) - 1) and len(beats) >= 5
    assert {data for _, data in beats} == {b"\x7f"}
    node.nmt(START)
    assert {data for _, identifier, data in node.wait(20) if identifier == HEARTBEAT} == {b"\5"}


def test_the_parameter_is_its_heartbeat_at_first(c):
    node = Node(c)
    node.axis.params.can_heartbeat_ms = 7
    node.nmt(RESET_COMMUNICATION)
    assert node.value(0x1017) == 7 and sum(identifier == HEARTBEAT for _, identifier, _ in node.wait(70)) == 10


# ---- the dictionary ----

@pytest.mark.parametrize("index, sub, value, size", [
    (0x1000, 0, 0x00020192, 4), (0x1018, 0, 4, 1), (0x1018, 2, 0x6D666F63, 4), (0x1200, 1, 0x605, 4), (0x1200, 2, 0x585, 4),
    (0x1014, 0, 0x85, 4), (0x1400, 1, 0x205, 4), (0x1403, 1, 0x80000505, 4), (0x1800, 1, 0x40000185, 4), (0x1803, 0, 5, 1),
    (0x1A02, 2, 0x60640020, 4), (0x1010, 1, 1, 4), (0x6060, 0, 3, 1), (0x6041, 0, 0x0250, 2), (0x3000, 0, 4, 4)])
def test_objects_are_there_with_their_size(node, index, sub, value, size):
    got = node.read(index, sub)
    assert (int.from_bytes(got, "little"), len(got)) == (value, size)


def test_a_text_of_whole_segments_ends_with_its_last(node):
    """12 bytes are 7 and 5; the toggle bit must be kept, and an abort by the client ends it."""
    assert node.read(0x1008) == b"mssfoc" and node.read(0x1009) == b"SmartFusion2"
    node.request(struct.pack("<BHBI", 0x40, 0x1009, 0, 0))
    with aborted(0x05030000):
        node.request(bytes([0x70]) + bytes(7))
    with aborted(0x05040001):
        node.request(bytes([0x60]) + bytes(7))
    node.request(struct.pack("<BHBI", 0x40, 0x1009, 0, 0))
    assert not node.say((SDO_IN, struct.pack("<BHBI", 0x80, 0x1009, 0, 0)))
    with aborted(0x05040001):
        node.request(bytes([0x60]) + bytes(7))


SERVICES = [0, 0x7F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x705, 0x7E4, 0x7E5, 0x7FF]  # CiA 301, table 81


@pytest.mark.parametrize("index", (0x1005, 0x1014))
def test_sync_and_emcy_take_no_identifier_of_another_service(node, index):
    for value in SERVICES:
        with aborted(0x06090030):
            node.write(index, 0, value, 4)
    for value in (0x80, 0x85, 0xFF, 0x100, 0x181, 0x580, 0x600, 0x680, 0x6DF):
        node.write(index, 0, value, 4)
        assert node.value(index) == value


@pytest.mark.parametrize("code, index, sub, value, size", [
    (0x06020000, 0x5000, 0, 0, 4), (0x06090011, 0x1018, 5, 0, 4), (0x06090011, 0x1008, 1, 0, 4), (0x06010002, 0x1000, 0, 0, 4),
    (0x06010002, 0x6041, 0, 0, 2), (0x06010002, 0x1008, 0, 0, 4), (0x06010002, 0x1018, 0, 0, 1), (0x06070012, 0x6040, 0, 6, 4),
    (0x06070013, 0x60FF, 0, 6, 2), (0x06090030, 0x6060, 0, 2, 1), (0x06090030, 0x60FF, 0, 5000, 4),
    (0x06090031, 0x3000, 0, 51, 4), (0x06010002, 0x1001, 0, 0, 1), (0x06010002, 0x1200, 1, 0x605, 4),
    (0x06090032, 0x3000, 0, 0, 4), (0x08000020, 0x1010, 1, 1, 4), (0x08000020, 0x1011, 1, 0, 4), (0x06090030, 0x1003, 0, 1, 1),
    (0x06090030, 0x1005, 0, 0x40000080, 4), (0x06090030, 0x1014, 0, 0x7F, 4), (0x06090030, 0x1016, 1, 128 << 16 | 5, 4),
    (0x06010000, 0x1600, 0, 0, 1), (0x06090030, 0x1400, 1, 0x605, 4), (0x06090030, 0x1400, 2, 241, 1),
    (0x06090030, 0x1400, 1, 0x20000205, 4), (0x06090030, 0x2400 + 1, 0, 1, 2)])
def test_what_cannot_be_is_refused_by_the_standards_code(node, code, index, sub, value, size):
    before = node.everything()
    with aborted(code):
        node.write(index, sub, value, size)
    assert node.everything() == before


def test_a_value_can_come_in_segments(node):
    for value, parts in ((0x00020304, ((0x08, 3), (0x1D, 1))), (0x00010203, ((0x07, 4),)), (7, ((0x08, 3), (0x1D, 1)))):
        index, data = node.param("ramp_rpm_s") if value > 7 else 0x3000, struct.pack("<I", value)
        node.request(struct.pack("<BHBI", 0x21, index, 0, 4))
        for head, count in parts:
            assert node.request(bytes([head]) + data[:count].ljust(7, b"\0")) == bytes([0x20 | head & 0x10]) + bytes(7)
            data = data[count:]
        assert node.value(index) == value
    node.request(struct.pack("<BHBI", 0x20, 0x3000, 0, 0))
    with aborted(0x06070012):
        node.request(bytes([0x01]) + bytes(7))
    node.request(struct.pack("<BHBI", 0x20, 0x3000, 0, 0))
    with aborted(0x05030000):
        node.request(bytes([0x17]) + bytes(7))
    assert node.axis.params.pole_pairs == 7


@pytest.mark.parametrize("first", (0xA0, 0xC2, 0xE0, 0x00, 0x60))
def test_what_is_no_command_is_refused(node, first):
    with aborted(0x05040001):
        node.request(bytes([first]) + bytes(7))


@pytest.mark.parametrize("length", (0, 1, 4, 7))
def test_a_request_of_another_length_is_none(node, length):
    assert not node.say((SDO_IN, bytes([0x40, 0, 0x10, 0, 0, 0, 0])[:length]))


# ---- process data ----

def test_a_received_one_acts_at_once_or_with_sync(node):
    node.remap(0x1403, WORD, SPEED)
    node.nmt(START)
    node.say((0x505, struct.pack("<Hi", 6, 123)))
    points = node.canopen.drives[0].cia402.setpoints
    assert (points.control_word, points.target_rpm) == (6, 123)
    node.write(0x1403, 2, 1, 1)
    node.say((0x505, struct.pack("<Hi", 6, 456)))
    assert points.target_rpm == 123
    node.say((0x80, b""))
    assert points.target_rpm == 456
    node.say((0x505, struct.pack("<Hi", 6, 4001)), (0x80, b""))
    assert points.target_rpm == 456, "all of it, or none"


def test_a_received_one_that_waits_for_sync_waits_no_more_behind_pre_operational(node):
    node.remap(0x1403, WORD, SPEED)
    node.write(0x1403, 2, 1, 1)
    node.nmt(START)
    points = node.canopen.drives[0].cia402.setpoints
    node.say((0x505, struct.pack("<Hi", 6, 456)))
    node.nmt(PRE_OPERATIONAL)
    node.nmt(START)
    node.say((0x80, b""))
    assert (points.control_word, points.target_rpm) == (0, 0)
    node.say((0x505, struct.pack("<Hi", 6, 789)), (0x80, b""))
    assert points.target_rpm == 789


def test_two_in_one_turn_are_two_words(running):
    """Edges are commands: a set-point's comes between two words that differ in bit 4 alone."""
    running.write(0x6060, 0, 1, 1)
    running.remap(0x1402, WORD, POSITION)
    running.axis.state = running.c.AXIS_OPERATION_ENABLED
    running.say((0x405, struct.pack("<Hi", 0x0F, 1000)), (0x405, struct.pack("<Hi", 0x1F, 1000)),
                (0x405, struct.pack("<Hi", 0x0F, 1000)))
    assert running.axis.set_point.value == 1000 or running.axis.mode == running.c.AXIS_MODE_POSITION


def test_one_that_is_too_short_is_told_and_does_nothing(node):
    node.nmt(START)
    node.sent()
    before = node.everything()
    said = node.say((RPDO, b"\6"))
    assert [(identifier, data[:2]) for identifier, data in said if identifier == EMERGENCY] == [(EMERGENCY, b"\x10\x82")]
    assert node.everything() == before


def test_none_before_it_is_operational(node):
    assert not node.say((RPDO, b"\6\0"), (0x80, b"")) and node.canopen.drives[0].cia402.setpoints.control_word == 0


@pytest.mark.parametrize("every", (1, 3))
def test_synchronous_ones_come_with_every_so_manieth_sync(node, every):
    node.write(0x1802, 2, every, 1)
    node.nmt(START)
    came = [sum(identifier == 0x385 for identifier, _ in node.say((0x80, b""))) for _ in range(9)]
    assert came == ([0] * (every - 1) + [1]) * (9 // every)


def test_an_acyclic_one_comes_with_sync_when_it_has_changed(node):
    node.write(0x1802, 2, 0, 1)
    node.nmt(START)
    assert sum(identifier == 0x385 for _ in range(5) for identifier, _ in node.say((0x80, b""))) == 1
    node.say((RPDO, b"\6\0"))
    assert sum(identifier == 0x385 for _ in range(5) for identifier, _ in node.say((0x80, b""))) == 1


def test_one_comes_when_it_changes_and_no_sooner_than_it_may(node):
    node.write(0x1800, 5, 0, 2)
    node.write(0x1800, 3, 200, 2)  # 20 ms
    node.nmt(START)
    node.wait(30)
    times = []
    for n in range(8):
        node.canopen.drives[0].cia402.stage = n % 2 + 1
        times += [10 * n + at for at, identifier, _ in node.wait(10) if identifier == TPDO]
    node.wait(30)
    assert len(times) >= 3 and min(late - early for early, late in zip(times, times[1:])) >= 20
    assert not [frame for frame in node.wait(100) if frame[1] == TPDO]


def test_one_comes_by_its_timer(node):
    node.nmt(START)
    node.wait(5)
    times = [at for at, identifier, _ in node.wait(400) if identifier == TPDO]
    assert len(times) == 4 and {late - early for early, late in zip(times, times[1:])} == {100}


@pytest.mark.parametrize("code, entry", [(0x06040041, 0x60410010), (0x06040041, 0x60400020), (0x06040041, 0x30000020),
                                         (0x06020000, 0x50000010), (0x06040041, 0x10100120)])
def test_what_cannot_be_mapped_is_refused(node, code, entry):
    node.write(0x1400, 1, 0x205 | OFF, 4)
    node.write(0x1600, 0, 0, 1)
    with aborted(code):
        node.write(0x1600, 1, entry, 4)


def test_eight_bytes_are_the_most(node):
    node.write(0x1400, 1, 0x205 | OFF, 4)
    node.write(0x1600, 0, 0, 1)
    for sub, entry in enumerate((SPEED, POSITION, WORD), 1):
        node.write(0x1600, sub, entry, 4)
    with aborted(0x06040042):
        node.write(0x1600, 0, 3, 1)
    with aborted(0x06020000):
        node.write(0x1600, 0, 4, 1)
    node.write(0x1600, 0, 2, 1)


# ---- faults, and the master ----

def test_a_fault_is_told_and_its_end(node):
    node.nmt(START)
    node.sent()
    node.axis.faults.cause, node.axis.faults.count = node.c.FAULT_OVERVOLTAGE, 1
    told = [data for _, identifier, data in node.wait(1) if identifier == EMERGENCY]
    assert told == [struct.pack("<HBIB", 0x3210, 0b101, node.c.FAULT_OVERVOLTAGE, 0)]
    assert not [frame for frame in node.wait(50) if frame[1] == EMERGENCY]
    assert node.value(0x1003) == 1 and node.value(0x1003, 1) == node.c.FAULT_OVERVOLTAGE << 16 | 0x3210
    node.axis.faults.count = 2  # cleared and found again, between two looks
    assert [data for _, identifier, data in node.wait(1) if identifier == EMERGENCY] == told
    node.axis.faults.cause = node.c.FAULT_NONE
    assert [data for _, identifier, data in node.wait(1) if identifier == EMERGENCY] == [bytes(8)]
    assert node.value(0x1001) == 0 and node.value(0x1003) == 2
    node.write(0x1003, 0, 0, 1)
    assert node.value(0x1003) == 0 and node.value(0x1003, 1) == 0


def test_a_master_whose_heartbeat_stops_is_lost_and_told(running):
    running.write(0x1016, 1, 0x7F << 16 | 30, 4)
    running.wait(100)
    assert running.axis.master_lost == 0, "it is watched from its first heartbeat on"
    for _ in range(4):
        running.say((0x77F, b"\5"))
        running.wait(30)
    assert running.axis.master_lost == 0
    told = [data[:2] for _, identifier, data in running.wait(2) if identifier == EMERGENCY]
    assert told == [b"\x30\x81"] and running.axis.master_lost == 1
    running.say((0x77F, b"\5"))
    assert running.axis.master_lost == 1, "as long as this bus commands"


def test_bus_off_is_a_lost_master_and_its_end_is_told(running):
    running.c.host_can_state.value = running.c.CAN_OFF
    running.wait(1)
    assert running.axis.master_lost == 3
    running.c.host_can_state.value = running.c.CAN_ACTIVE
    told = [data[:2] for _, identifier, data in running.wait(3) if identifier == EMERGENCY]
    assert told == [b"\x40\x81", b"\0\0"] and running.axis.master_lost == 3, "as long as this bus commands"


def test_who_operates_otherwise_has_lost_no_master(node):
    node.nmt(START)
    node.axis.state = node.c.AXIS_OPERATION_ENABLED
    node.write(0x1016, 1, 0x7F << 16 | 30, 4)
    node.say((0x77F, b"\5"))
    node.wait(100)
    node.nmt(STOP)
    assert node.axis.master_lost == 0


def test_either_order_of_nmt_and_control_word_enables_it(node):
    for word in (6, 7, 15):
        node.write(0x6040, 0, word, 2)
    assert node.axis.owner.who == node.c.OWNER_CAN
    node.nmt(START)
    assert node.axis.master_lost == 0


def test_what_is_meant_for_it_is_a_sign_of_life(node):
    """For the command time-out: not what others say."""
    node.nmt(START)
    for frame, heard in (((SDO_IN, struct.pack("<BHBI", 0x40, 0x1000, 0, 0)), True), ((RPDO, b"\0\0"), True),
                         ((SDO_IN + 1, bytes(8)), False), ((SDO_OUT, bytes(8)), False), ((0x80, b""), False)):
        node.axis.command_ms = 0
        node.say(frame)
        assert (node.axis.command_ms != 0) == heard, frame
