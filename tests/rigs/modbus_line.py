# SPDX-License-Identifier: MIT
"""A drive on a line, and somebody who speaks Modbus to it: frames are made here, by the standard, and not by the firmware."""
import ctypes
import struct

from rigs.axes_at_rest import AxesAtRest

US = 1  # the drive's address
FAULT_BASE, PARAM_BASE = 0x0400, 0x1000


def _shifted(value):
    for _ in range(8):
        value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return value


SHIFTED = [_shifted(byte) for byte in range(256)]


def crc(body):
    """CRC-16 of Modbus (Serial Line V1.02, 6.2.2): x^16 + x^15 + x^2 + 1, reflected, from 0xFFFF."""
    value = 0xFFFF
    for byte in body:
        value = value >> 8 ^ SHIFTED[(value ^ byte) & 0xFF]
    return struct.pack("<H", value)


def frame(*body):
    return bytes(body) + crc(bytes(body))


def read(at, count, function=3, unit=US):
    return framed(unit, struct.pack(">BHH", function, at, count))


def framed(unit, pdu):
    return frame(unit, *pdu)


def words(*values):
    return struct.pack(f">{len(values)}H", *(value & 0xFFFF for value in values))


def long(value):
    """A value of 32 bits as two registers, the high one first."""
    return struct.pack(">i" if value < 0 else ">I", value)


def write(at, data, unit=US):
    return framed(unit, struct.pack(">BHHB", 16, at, len(data) // 2, len(data)) + data)


def write_one(at, value, unit=US):
    return framed(unit, struct.pack(">BHH", 6, at, value & 0xFFFF))


class Line(AxesAtRest):
    """The drive `axis`, the first of `axes`, and the slave `modbus`. A poll is a millisecond."""

    def __init__(self, c, count=1):
        super().__init__(c, count)
        self.prepares = True
        self.rs485, self.modbus = c.rs485(), c.structs["modbus"]()
        c.modbus_start(self.modbus, self.rs485, self.axes, self.slots)
        self._clear()

    def _clear(self):
        for name in ("heard_bytes", "heard_taken", "sent_bytes", "marks"):
            getattr(self.c, f"host_bus_{name}").value = 0

    def say(self, data, then_ms=0):
        """Bytes that come between two polls; then so many milliseconds of silence. What the drive sends."""
        c = self.c
        ctypes.memmove(c.host_bus_heard, bytes(data), len(data))
        c.host_bus_heard_bytes.value, c.host_bus_heard_taken.value = len(data), 0
        self._poll()
        sent = self._sent()
        c.host_bus_heard_bytes.value = c.host_bus_heard_taken.value = 0
        return sent + self.wait(then_ms)

    def _poll(self):
        """A turn of the thread, in which all is worked out that has begun; and what the slow loop then takes."""
        self.c.modbus_poll(self.modbus)
        for axis in self.axes:
            self.c.set_point_take(axis)
            while self.prepares and self.c.drive_prepare(axis):
                pass

    def wait(self, ms):
        sent = b""
        if ms > 0:
            self.c.host_bus_marks.value |= self.c.host_bus_silence_mark.value
        for _ in range(ms):
            self.pass_ms()
            self._poll()
            sent += self._sent()
        return sent

    def _sent(self):
        sent = bytes(self.c.host_bus_sent)[:self.c.host_bus_sent_bytes.value]
        self.c.host_bus_sent_bytes.value = 0
        self.rs485.driving = False
        self.c.modbus_poll(self.modbus)  # the last of the echo is there by now
        return sent

    def ask(self, request):
        """The reply's bytes between address and check sum, which must fit."""
        reply = self.say(request)
        assert reply and reply[0] == request[0] and crc(reply[:-2]) == reply[-2:], reply.hex()
        return reply[1:-2]

    def registers(self, at, count, function=3, unit=US):
        pdu = self.ask(read(at, count, function, unit))
        assert pdu[0] == function and pdu[1] == 2 * count, pdu.hex()
        return list(struct.unpack(f">{count}H", pdu[2:]))

    def long(self, at, signed=True):
        return struct.unpack(">i" if signed else ">I", words(*self.registers(at, 2)))[0]

    def everything(self):
        """What no invalid request may change."""
        return (bytes(self.axis.params), bytes(self.axis.reactions.choice), bytes(self.modbus.drives[0].cia402.setpoints),
                self.axis.request, self.axis.state, self.axis.mode, self.axis.speed.target_rpm_q16)

    def param(self, name):
        """The register of a parameter."""
        row = ctypes.addressof(self.c.param_find(name.encode()).contents)
        return PARAM_BASE + 2 * ((row - ctypes.addressof(self.c.param_table)) // ctypes.sizeof(self.c.param_info))
