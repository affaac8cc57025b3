# SPDX-License-Identifier: MIT
"""A PLC that drives by CiA 402: control words out, status words in."""
from rigs.modbus_line import US, Line, framed, write_one

SHUTDOWN, SWITCH_ON, ENABLE, QUICK_STOP, NO_VOLTAGE, RESET, HALT, NEW = 0x06, 0x07, 0x0F, 0x02, 0x00, 0x80, 0x100, 0x10
DISABLED, READY, SWITCHED_ON, OPERATION, QUICK_STOP_ACTIVE, FAULT, REACTION = 0x40, 0x21, 0x23, 0x27, 0x07, 0x08, 0x0F


class Controller(Line):
    """A PLC: control words out, status words in, of the last axis. That axis's slow loop is played by the test."""

    def __init__(self, c):
        super().__init__(c, c.motors)
        self.axis, self.fabric, self.drive = self.axes[-1], self.fabrics[-1], self.modbus.drives[c.motors - 1]
        self.axis.loop.vbus_q15 = self.axis.tuning.v_min_q15 + 100

    def ask(self, request):
        """Whatever is asked, it is its own axis that is."""
        return super().ask(framed(US + self.c.motors - 1, request[1:-2]))

    def control(self, word):
        assert self.ask(write_one(0, word))[0] == 6
        self.wait(1)
        return self.state

    @property
    def status(self):
        return self.registers(0x10, 1)[0]

    @property
    def state(self):
        status = self.status
        return status & 0x6F if status & 0x20 or not status & 0x40 else status & 0x4F

    def taken(self, state):
        """The slow loop has carried out what is asked for, and the axis is in this state."""
        asked, self.axis.request = self.axis.request, self.c.AXIS_REQUEST_NONE
        self.axis.state = getattr(self.c, state)
        self.wait(1)
        return self.c.name("axis_request", asked)

    def enabled(self):
        for word in (SHUTDOWN, SWITCH_ON, ENABLE):
            self.control(word)
        assert self.taken("AXIS_SWITCHED_ON") == "ON"
        self.taken("AXIS_OPERATION_ENABLED")
        return self

    @property
    def refusal(self):
        return self.c.name("error", self.registers(0x2B, 1)[0])
