# SPDX-License-Identifier: MIT
"""Frames on the line of a drive that is in operation half of the time: noise, torn and mutated requests, traffic of others with
requests inside, and requests that are right. Nothing of the drive changes, and nothing is answered, but at the last byte of a
frame that fits, to this drive; what is refused has changed nothing."""
import collections
import random

from rigs.bus_frames import KINDS, some_frame
from rigs.modbus_line import US, Line, remainders

FRAMES, PATIENCE_MS = 12_000, 50


def test_nothing_but_a_request_to_this_drive_does_anything(c):
    line, draw, seen = Line(c), random.Random(2463534242), collections.Counter()
    axis = line.axis
    axis.loop.vbus_q15 = axis.tuning.v_min_q15 + 100
    for n in range(FRAMES):
        if n % 8 == 0:  # back to where requests find something to do
            axis.request, axis.faults.cause = c.AXIS_REQUEST_NONE, c.FAULT_NONE
            axis.state = c.AXIS_SWITCH_ON_DISABLED if n % 16 else c.AXIS_OPERATION_ENABLED
            axis.params.modbus_address, axis.params.modbus_baud, axis.params.modbus_parity = US, 115200, 0
            line.wait(1)
        kind, frame = some_frame(draw)
        seen[kind] += 1
        before = line.everything()
        sent = line.say(frame)
        changed = line.everything() != before
        if kind != "right":
            assert not changed and not sent, (kind, frame.hex())
        elif frame[0] == 0:
            assert not sent, frame.hex()
        else:
            refused = sent[1] >= 0x80
            assert sent[0] == US and sent[1] & 0x7F == frame[1] and list(remainders(sent))[-1] == 0, (frame.hex(), sent.hex())
            assert not refused or (not changed and len(sent) == 5 and 1 <= sent[2] <= 4), (frame.hex(), sent.hex())
            seen["refused"] += refused
        seen["written"] += changed
        # behind what is no frame the line must fall silent; behind a frame it need not
        assert not line.wait(PATIENCE_MS if kind in ("mutated", "noise") else draw.randrange(3)), frame.hex()
    assert min(seen[kind] for kind in KINDS) > FRAMES / 6
    assert seen["right"] > seen["refused"] > 0 and seen["written"] > FRAMES / 1000
