# SPDX-License-Identifier: MIT
"""A drive on a CAN bus, and somebody who speaks CANopen to it: frames are made here, by the standard."""
import ctypes
import struct

import pytest

from rigs.axes_at_rest import AxesAtRest

NODE = 5
SDO_IN, SDO_OUT, EMERGENCY, HEARTBEAT = 0x600 + NODE, 0x580 + NODE, 0x80 + NODE, 0x700 + NODE
START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 1, 2, 128, 129, 130
OFF = 0x80000000  # of a PDO's identifier
SIZES = {1: "<B", 2: "<H", 4: "<I"}


class Abort(Exception):
    """The server's reason."""


def aborted(code):
    return pytest.raises(Abort, match=f"^{code}$")


class Node(AxesAtRest):
    """The drive `axis`, the first of `axes`, and the node `canopen`. A poll is a millisecond."""

    def __init__(self, c, node=NODE, count=1, heartbeat_ms=0):
        super().__init__(c, count)
        for axis in self.axes:
            axis.loop.vbus_q15 = axis.tuning.v_min_q15 + 100
        self.axis.params.can_node, self.axis.params.can_heartbeat_ms = node, heartbeat_ms
        self.can, self.canopen = c.structs["can"](), c.structs["canopen"]()
        for name in ("saids", "taken", "heards", "opened", "closed", "state", "cut"):
            getattr(c, f"host_can_{name}").value = 0
        c.canopen_start(self.canopen, self.can, self.axes, self.slots)

    def sent(self):
        """[(identifier, data)] since the last time."""
        c = self.c
        found = [(f.id, bytes(f.data)[:f.count]) for f in c.host_can_heard[:c.host_can_heards.value]]
        c.host_can_heards.value = 0
        return found

    def say(self, *frames):
        """Frames between two polls; what the drive then sends."""
        c = self.c
        for number, (identifier, data) in enumerate(frames):
            place = c.host_can_said[number]
            place.id, place.count = identifier, len(data)
            place.data[:len(data)] = list(data)
        c.host_can_saids.value, c.host_can_taken.value = len(frames), 0
        self.poll()
        return self.sent()

    def poll(self):
        """A turn of the thread, in which all is worked out that has begun; and what the slow loop then takes."""
        self.c.canopen_poll(self.canopen)
        for axis in self.axes:
            self.c.set_point_take(axis)
            while self.c.drive_prepare(axis):
                pass

    def wait(self, ms):
        """[(milliseconds, identifier, data)] of what it sends meanwhile."""
        found = []
        for n in range(ms):
            self.pass_ms()
            self.poll()
            found += [(n + 1, *frame) for frame in self.sent()]
        return found

    def nmt(self, command, node=NODE):
        return self.say((0, bytes([command, node])))

    def enabled(self):
        """Operational, and the drive enabled by control words."""
        self.nmt(START)
        for word in (6, 7, 15):
            self.say((0x200 + NODE, struct.pack("<H", word)))
        self.axis.request, self.axis.state = 0, self.c.AXIS_OPERATION_ENABLED
        self.poll()
        self.sent()
        assert self.axis.owner.who == self.c.OWNER_CAN
        return self

    def request(self, data):
        """The SDO server's answer: one frame."""
        answers = [answer for identifier, answer in self.say((SDO_IN, data)) if identifier == SDO_OUT]
        assert len(answers) == 1 and len(answers[0]) == 8, answers
        if answers[0][0] == 0x80:
            raise Abort(struct.unpack("<I", answers[0][4:])[0])
        return answers[0]

    def write(self, index, sub, value, size):
        data = struct.pack(SIZES[size], value & (256 ** size - 1)).ljust(4, b"\0")
        answer = self.request(struct.pack("<BHB", 0x23 | (4 - size) << 2, index, sub) + data)
        assert answer == struct.pack("<BHBI", 0x60, index, sub, 0)

    def read(self, index, sub=0):
        """The value's bytes."""
        answer = self.request(struct.pack("<BHBI", 0x40, index, sub, 0))
        assert answer[1:4] == struct.pack("<HB", index, sub)
        if answer[0] & 2:
            return answer[4:8 - (answer[0] >> 2 & 3)]
        length, got, toggle = struct.unpack("<I", answer[4:])[0], b"", 0
        while len(got) < length:
            answer = self.request(bytes([0x60 | toggle << 4]) + bytes(7))
            assert answer[0] >> 4 == toggle
            got += answer[1:8 - (answer[0] >> 1 & 7)]
            toggle ^= 1
        assert answer[0] & 1 and len(got) == length
        return got

    def value(self, index, sub=0):
        return int.from_bytes(self.read(index, sub), "little")

    def remap(self, index, *entries):
        """A PDO by the index of its communication, under the identifier that it has."""
        identifier = self.value(index, 1)
        self.write(index, 1, identifier | OFF, 4)
        self.write(index + 0x200, 0, 0, 1)
        for sub, entry in enumerate(entries, 1):
            self.write(index + 0x200, sub, entry, 4)
        self.write(index + 0x200, 0, len(entries), 1)
        self.write(index, 1, identifier & ~OFF, 4)

    def param(self, name):
        """The index of a parameter."""
        row = ctypes.addressof(self.c.param_find(name.encode()).contents)
        return 0x3000 + (row - ctypes.addressof(self.c.param_table)) // ctypes.sizeof(self.c.param_info)

    def everything(self):
        """What no frame may change that is not meant for it."""
        return (bytes(self.axis.params), bytes(self.axis.reactions.choice), bytes(self.canopen.drives[0].cia402.setpoints),
                self.axis.request, self.axis.state, self.axis.mode, self.axis.speed.target_rpm_q16, self.canopen.state)
