# SPDX-License-Identifier: MIT
"""An operator of a drive that has a scope and a vector, and what the scope sends."""
import ctypes

from rigs.console import Operator
from rigs.modbus_line import crc

LOOP, ENTRY = 0x1111, 0x2222  # what the vector holds
SLOTS = 64


def pointer(value):
    return ctypes.c_void_p(value)


class Scoped(Operator):
    """An operator of a drive that has a scope and a vector."""

    def __init__(self, c):
        super().__init__(c)
        self.axis.fabric = ctypes.pointer(self.fabric)
        self.vector, self.pend, self.scope = pointer(LOOP), ctypes.c_uint32(), c.scope()
        self.handlers = c.loop_handlers()
        self.handlers.vector = ctypes.cast(ctypes.pointer(self.vector), type(self.handlers.vector))
        self.axis.loop.handlers = ctypes.pointer(self.handlers)
        c.scope_init(self.scope, self.axis, ENTRY, self.pend, 1 << 9)
        session, self.uart, self.idle = self.console.session, c.structs["mmuart"](), c.structs["idle"]()
        self.clock = ctypes.c_uint32()
        self.idle.time_ms = ctypes.pointer(self.clock)
        session.scope, session.out.uart = ctypes.pointer(self.scope), ctypes.pointer(self.uart)
        session.out.idle = ctypes.pointer(self.idle)

    def tick(self, count=1):
        """The current loop has served a sample, and the sampler comes behind it."""
        for _ in range(count):
            self.fabric.adc.SEQUENCE += 1
            if self.vector.value == ENTRY:
                self.scope.entry.ticks += 1
                self.c.scope_sample(self.scope)

    def choose(self, *names):
        assert self(f"scope signals {','.join(names)}") == ["ok"]


def decoded(frame):
    """(number, values) of a frame, or None: written from the description in stream.h alone."""
    if frame[0] != 1 or frame[-1] != 0 or 0 in frame[:-1]:
        return None
    plain, at, body = bytearray(), 0, frame[1:-1]
    while at < len(body):
        distance = body[at]
        plain += body[at + 1:at + distance]
        at += distance
        if at < len(body):
            plain.append(0)
    if at != len(body) or crc(plain[:-2]) != plain[-2:]:
        return None
    values, value, shift = [], 0, 0
    for byte in plain[3:-2]:
        value, shift = value | (byte & 127) << shift, shift + 7
        if byte < 128:
            values.append((value >> 1) ^ -(value & 1))
            value = shift = 0
    return (int.from_bytes(plain[1:3], "little"), values) if len(values) == plain[0] - 0x50 else None
