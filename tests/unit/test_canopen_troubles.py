# SPDX-License-Identifier: MIT
"""A CAN line that is cut for a while, troubles of communication in 0x1001 and EMCY, and modes that wait for their edge."""
import struct

import pytest

from rigs.can_node import EMERGENCY, HEARTBEAT, NODE, START, Node

RPDO, TPDO = 0x200 + NODE, 0x180 + NODE


@pytest.fixture
def node(c):
    made = Node(c)
    made.sent()
    yield made
    c.host_can_cut.value = 0


@pytest.fixture
def running(node):
    return node.enabled()


def test_what_found_no_room_comes_when_the_line_is_back_and_nothing_old_does(running):
    """The cable is cut, the drive faults, its status word changes: all that is told once it is back is what is so then."""
    c = running.c
    running.write(0x1017, 0, 20, 2)
    running.wait(50)
    c.host_can_cut.value = 1
    running.wait(2000)
    running.axis.faults.cause, running.axis.faults.count, running.axis.state = c.FAULT_STALL, 1, c.AXIS_FAULT
    running.wait(1000)
    assert not running.sent(), "nobody hears"
    c.host_can_cut.value = 0
    came = running.wait(30)
    assert len(came) <= 8 and sum(identifier == HEARTBEAT for _, identifier, _ in came) <= 3, came
    assert [struct.unpack("<H", data[:2])[0] for _, identifier, data in came if identifier == EMERGENCY] == [0x7121]
    words = [data for _, identifier, data in came if identifier == TPDO]
    assert words[-1][0] & 0x4F == 0x08 and len(words) <= 2


def test_a_fault_told_to_a_line_that_was_cut_already_is_told_again(running):
    c = running.c
    c.host_can_cut.value = 1
    running.wait(5)
    running.axis.faults.cause, running.axis.faults.count = c.FAULT_STALL, 1
    running.wait(500)
    c.host_can_cut.value = 0
    told = [data[:2] for _, identifier, data in running.wait(30) if identifier == EMERGENCY]
    assert set(told) == {struct.pack("<H", 0x7121)}
    assert running.value(0x1003) == 1, "one fault, however often it is told"


@pytest.mark.parametrize("leaves_after_ms", (0, 20))
def test_who_comes_to_a_line_on_which_nobody_was_is_answered_at_once(node, leaves_after_ms):
    """His request has the higher priority: it comes before the heartbeat has left that nobody took so far."""
    c = node.c
    node.write(0x1017, 0, 20, 2)
    c.host_can_cut.value = 1
    node.wait(2000)
    c.host_can_cut.value = int(leaves_after_ms > 0)
    came = node.say((0x600 + NODE, struct.pack("<BHBI", 0x40, 0x1000, 0, 0)))
    for _ in range(leaves_after_ms):
        came += [frame[1:] for frame in node.wait(1)]
    c.host_can_cut.value = 0
    came += [frame[1:] for frame in node.wait(5)]
    assert [data.hex() for identifier, data in came if identifier == 0x580 + NODE] == ["4300100092010200"]
    assert sum(identifier == HEARTBEAT for identifier, _ in came) <= 2, "and nothing old"


def test_who_joins_anew_says_so_though_nobody_was_there_before(node):
    c = node.c
    node.write(0x1017, 0, 20, 2)
    c.host_can_cut.value = 1
    node.wait(2000)
    node.axis.params.can_node = NODE + 1
    node.wait(2)
    c.host_can_cut.value = 0
    assert (HEARTBEAT + 1, b"\0") in [frame[1:] for frame in node.wait(5)]


@pytest.mark.parametrize("trouble, detail, comes, ends", [
    (0x8210, RPDO, lambda n: n.say((RPDO, b"\6")), lambda n: n.say((RPDO, b"\6\0"))),
    (0x8130, 0x7F, lambda n: n.wait(200), lambda n: n.say((0x77F, b"\5"))),
    (0x8130, 0x7F, lambda n: n.wait(200), lambda n: n.write(0x1016, 1, 0, 4))])
def test_a_trouble_of_communication_stands_in_the_register_until_it_is_over(node, trouble, detail, comes, ends):
    """CiA 301, 7.2.7 and 7.5.2.2: bits 0 and 4; and again, if it comes again."""
    node.nmt(START)
    for _ in range(2):
        node.write(0x1016, 1, 0x7F << 16 | 50, 4)
        node.say((0x77F, b"\5"))
        node.say((RPDO, b"\6\0"))
        came = [frame[-1] for frame in comes(node) + node.wait(2) if frame[-2] == EMERGENCY]
        assert came == [struct.pack("<HBIB", trouble, 0x11, detail, 0)] and node.value(0x1001) == 0x11
        ended = [frame[-1] for frame in (ends(node) or []) + node.wait(2) if frame[-2] == EMERGENCY]
        assert ended in ([bytes(8)], []) and node.value(0x1001) == 0
        node.wait(2)
    assert node.value(0x1003) == 2


def test_a_heartbeat_parameter_counts_at_once(node):
    node.axis.params.can_heartbeat_ms = 7
    assert sum(identifier == HEARTBEAT for _, identifier, _ in node.wait(70)) >= 9
    node.axis.params.can_heartbeat_ms = 0
    node.wait(2)
    assert not [frame for frame in node.wait(50) if frame[1] == HEARTBEAT]


@pytest.mark.parametrize("mode", (1, 6))
def test_a_mode_that_waits_for_its_edge_is_shown_and_holds(running, mode):
    c, axis = running.c, running.axis
    running.write(0x60FF, 0, 500, 4)
    axis.state = c.AXIS_OPERATION_ENABLED
    running.poll()
    assert axis.speed.target_rpm_q16 == 500 << 16
    running.write(0x6060, 0, mode, 1)
    assert running.value(0x6061) == mode and axis.speed.target_rpm_q16 == 0
    axis.speed.speed_rpm_q4 = 500 * 16
    assert not running.value(0x6041) & 0x1400, "it brakes, and has taken no target"
    axis.speed.speed_rpm_q4 = 0
    assert running.value(0x6041) & 0x1400 == 0x0400
    running.write(0x6060, 0, 3, 1)
    assert running.value(0x6061) == 3 and axis.speed.target_rpm_q16 == 500 << 16


def test_the_mode_alone_is_no_control_word(running):
    """canopen's BaseNode402 changes the mode by the first RPDO that has it."""
    running.axis.state = running.c.AXIS_OPERATION_ENABLED
    running.say((0x300 + NODE, b"\x08"))
    assert running.value(0x6060) == 8 and running.axis.request == running.c.AXIS_REQUEST_NONE
    assert running.axis.owner.who == running.c.OWNER_CAN


@pytest.mark.parametrize("how", ("reset communication", "reset node", "another rate"))
def test_behind_a_reset_what_is_latched_is_told_anew(node, how):
    """0x1003 has been forgotten, and whoever comes now has heard nothing: so it is where a drive was bus-off meanwhile."""
    node.c.fault_raise(node.axis, node.c.FAULT_UNDERVOLTAGE)
    node.axis.state = node.c.AXIS_FAULT
    node.wait(2)
    if how == "another rate":
        node.axis.params.can_kbit = 250
        came = node.wait(3)
    else:
        came = [(0, *frame) for frame in node.nmt(130 if how == "reset communication" else 129)] + node.wait(2)
    identifiers = [identifier for _, identifier, _ in came if identifier in (HEARTBEAT, EMERGENCY)]
    assert identifiers[:2] == [HEARTBEAT, EMERGENCY]
    assert node.value(0x1003, 0) == 1 and node.value(0x1003, 1) & 0xFFFF == 0x3220
