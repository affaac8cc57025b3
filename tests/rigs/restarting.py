# SPDX-License-Identifier: MIT
"""A drive that restarts by itself behind a supply that was too low."""
from rigs.drive import World

DELAY_MS, LONG_MS, ENOUGH_V, TOO_LOW = 100, 1500, 13670, 5000


def is_on(c, axis):
    """Its gates are enabled, or it starts and will enable them."""
    return axis.fabric.contents.gate.CONTROL != 0 or axis.state in (
        c.AXIS_READY, c.AXIS_SWITCHED_ON, c.AXIS_OPERATION_ENABLED, c.AXIS_QUICK_STOP)


class Restarting(World):
    """In operation, with one restart allowed; then the supply is too low."""

    def __init__(self, c, **params):
        super().__init__(c)
        self.fabric.adc.OFFSET_A = self.fabric.adc.OFFSET_B = self.fabric.adc.OFFSET_C = 32768
        self.axis.params.retry_count, self.axis.params.retry_delay_ms = 1, DELAY_MS
        for name, value in params.items():
            setattr(self.axis.params, name, value)
        assert c.switch_on_at_once(self.axis).error == c.ERROR_NONE
        self.step()
        self.energised = False
        self.put("OPERATION_ENABLED")

    def supply(self, vbus, ms=0):
        self.fabric.adc.VBUS = vbus
        return self.thread(ms)

    def trip(self):
        self.supply(TOO_LOW)
        self.c.fault_raise(self.axis, self.c.FAULT_UNDERVOLTAGE)
        self.step(3)
        assert self.state == "FAULT"
        self.energised = False

    def thread(self, ms):
        """The thread goes round once a millisecond."""
        for _ in range(ms):
            self.c.drive_retry(self.axis)
            for _ in range(40):
                self.c.drive_prepare(self.axis)
            self.step()
            self.energised = self.energised or is_on(self.c, self.axis)
            assert not (self.axis.faults.cause and self.fabric.gate.CONTROL), "a latched fault and live gates"
        return self.state
