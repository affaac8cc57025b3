# SPDX-License-Identifier: MIT
"""Frames on the CAN bus of a drive that is in operation half of the time. By the standard it is known which is meant for this
node: any other changes nothing, and nothing is sent for it; a request by SDO has one answer, and what is refused has changed
nothing; process data changes set-points alone. Layer setting has a storm of its own, in test_canopen_lss.py."""
import collections
import random
import struct

from rigs.can_node import (NODE, PRE_OPERATIONAL, RESET_COMMUNICATION, RESET_NODE, SDO_IN, SDO_OUT, START, STOP, Node)

FRAMES, STOPPED, OPERATIONAL = 60_000, 4, 5
REMOTE, LAYER_SETTING = 1 << 15, 0x7E5
NMT = (START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION)
COMMANDS = (0x40, 0x23, 0x27, 0x2B, 0x2F, 0x21, 0x20, 0x22, 0x60, 0x70, 0x01, 0x11, 0x00, 0x80)
INDICES = (0x1000, 0x1003, 0x1005, 0x1008, 0x1010, 0x1011, 0x1014, 0x1016, 0x1017, 0x1018, 0x1021, 0x1400, 0x1403, 0x1600,
           0x1603, 0x1800, 0x1802, 0x1A00, 0x1A03, 0x2008, 0x2408, 0x3000, 0x3010, 0x3024, 0x6040, 0x6041, 0x6060, 0x6064,
           0x606C, 0x6071, 0x607A, 0x6098, 0x60FF)
OWN = (0x000, 0x080, 0x205, 0x305, 0x405, 0x505, 0x605, 0x77F, 0x585, 0x705)


def data(draw, count):
    return bytes(draw.randrange(256) if draw.randrange(2) else 0 for _ in range(count))


def some_frame(draw):
    """(identifier, data)"""
    kind = draw.randrange(5)
    if kind < 2:
        other = draw.randrange(2048) | (REMOTE if draw.randrange(8) == 0 else 0)
        return draw.choice(OWN) if kind else other, data(draw, draw.randrange(9))
    if kind == 2:
        command = draw.randrange(256) if draw.randrange(3) == 0 else START
        return 0, bytes([command, NODE if draw.randrange(2) else draw.randrange(3)])
    if kind == 3:
        return 0x100 * draw.randint(2, 5) + NODE, (bytes([draw.randrange(32), 0]) + data(draw, 6))[:draw.randint(2, 8)]
    near = draw.choice(INDICES) + (draw.randrange(4) if draw.randrange(4) == 0 else 0)
    index = draw.randrange(65536) if draw.randrange(8) == 0 else near
    sub = 0 if draw.randrange(2) else draw.randrange(10)
    return SDO_IN, struct.pack("<BHB", draw.choice(COMMANDS), index & 0xFFFF, sub) + data(draw, 4)


def meant_as(node, identifier, frame):
    """What it is to this node: a request, process data, a command, or nothing."""
    state = node.canopen.state
    if identifier == SDO_IN and len(frame) == 8 and state != STOPPED:
        return "request"
    received = {pdo.id & 0x7FF for pdo in node.canopen.rpdo if not pdo.id >> 31 and pdo.count}
    if state == OPERATIONAL and identifier in received | {node.canopen.sync_id}:
        return "process"
    return "command" if identifier == 0 and len(frame) == 2 and frame[0] in NMT and frame[1] in (0, NODE) else "nothing"


def all_of(node):
    """(what process data may change, the rest) of all that a frame may write, and what follows from it at once."""
    axis, can = node.axis, node.canopen
    told = bytes(can.drives[0].cia402.setpoints), axis.mode, axis.request, axis.speed.target_rpm_q16, axis.torque_command_q15
    pdos = [(pdo.id, pdo.count) for pdo in (*can.rpdo, *can.tpdo)]
    return told, (bytes(axis.params), bytes(axis.reactions.choice), axis.state, can.state, can.heartbeat_ms, can.consumer,
                  can.sync_id, can.emergency_id, pdos)


def restore(node, on):
    """Back to where frames find something to do; what the drive then has to tell has been told."""
    c, axis = node.c, node.axis
    node.canopen.drives[0].cia402.stage = c.CIA402_DISABLED
    axis.request, axis.faults.cause, axis.params.can_node = c.AXIS_REQUEST_NONE, c.FAULT_NONE, NODE
    axis.state = c.AXIS_OPERATION_ENABLED if on else c.AXIS_SWITCH_ON_DISABLED
    for _ in range(3):
        axis.time_ms += 200
        node.poll()
    node.sent()


def test_nothing_is_done_that_no_frame_asked_for(c):
    node, draw, seen = Node(c), random.Random(2463534242), collections.Counter()
    for n in range(FRAMES):
        if n % 8 == 0:
            restore(node, n % 16 == 0)
        identifier, frame = some_frame(draw)
        if identifier == LAYER_SETTING:
            continue
        meant, (told, rest) = meant_as(node, identifier, frame), all_of(node)
        answers = node.hear((identifier, frame))
        now_told, now_rest = all_of(node)
        changed, said = (now_told, now_rest) != (told, rest), (hex(identifier), frame.hex(), answers)
        seen[meant] += 1
        if meant == "request":
            replies = [answer for sent, answer in answers if sent == SDO_OUT]
            aborts = frame[0] >> 5 == 4  # the client's own has no answer
            refused = aborts or replies[0][0] == 0x80
            assert len(replies) == (not aborts) and not (refused and changed), said
            seen.update({"refused": refused, "written": changed})
        elif meant == "process":
            assert now_rest == rest, said
        elif meant == "nothing":
            assert not changed and not answers, said
        c.host_can_saids.value = c.host_can_taken.value = 0
        node.poll()  # what a frame leads to in the drive is over before the next one
        node.sent()
    assert min(seen["request"] + seen["process"] + seen["command"], seen["nothing"]) > FRAMES / 5
    assert seen["request"] > seen["refused"] > 0, seen
    assert seen["written"] > FRAMES / 1000 and seen["process"] > FRAMES / 50, seen
