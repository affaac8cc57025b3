# SPDX-License-Identifier: MIT
"""A drive without a motor: a fabric that works, and the axis in any of its states."""
import re

from rigs.firmware import ROOT

STATES = ("SWITCH_ON_DISABLED", "READY", "SWITCHED_ON", "OPERATION_ENABLED", "QUICK_STOP", "FAULT_REACTION", "FAULT")
CHOICES = ("OFF", "STOP", "WARN", "CARRY")
LOOPS_PER_MS = 20
INDEX_SEEN = 1


def identify(fabric):
    """The identity that the firmware looks for: as the register shows it."""
    text = (ROOT / "drivers/fabric/gate.h").read_text()
    fabric.gate.ID = int(re.search(r"#define GATE_ID (0x[0-9A-F]+)u", text).group(1), 16)


def at_rest(c, axis, fabric):
    """As a boot leaves it on its own fabric: off, with initial parameters."""
    c.drive_init(axis, fabric)
    identify(fabric)
    axis.fabric_untrusted, axis.state = 0, c.AXIS_SWITCH_ON_DISABLED


class Rig:
    """An axis at rest and its fabric; what they hold, by its name."""
    def __init__(self, c, **params):
        self.c, self.fabric, self.axis = c, c.fabric(), c.axis()
        at_rest(c, self.axis, self.fabric)
        for name, value in params.items():
            setattr(self.axis.params, name, value)

    @property
    def state(self):
        return self.c.name("axis_state", self.axis.state)

    @property
    def fault(self):
        return self.c.name("fault", self.axis.faults.cause)

    @property
    def mode(self):
        return self.c.name("axis_mode", self.axis.mode)

    def warned(self, name):
        return self.c.fault_warned(self.axis.reports, self.c.enums["fault"]["FAULT_" + name])

    def choose(self, name, choice):
        return self.c.drive_choose_reaction(self.axis, self.c.enums["fault"]["FAULT_" + name], CHOICES.index(choice))


    times = 1  # in so many steps is found what a monitor finds

    def report(self, name, detail=(7, 8)):
        counted = self.axis.faults.count
        for _ in range(self.times):
            self.c.fault_report(self.axis, self.c.enums["fault"]["FAULT_" + name], *detail)
            self.c.reaction_step(self.axis)
        assert self.axis.faults.count - counted <= 1, "it is one fault, however often it is found"


class World(Rig):
    """A fabric that works: conversions come, the gate goes live when it is enabled, the encoder stands."""
    def __init__(self, c, **params):
        super().__init__(c, **params)
        self.fabric.adc.VBUS = 13670  # 24 V of 57.5 V
        self.step(5)

    def step(self, count=1):
        for _ in range(count):
            self.fabric.adc.SEQUENCE += LOOPS_PER_MS
            self.fabric.gate.STATUS = self.fabric.gate.CONTROL & 1
            self.c.drive_step(self.axis)
        return self.state

    def put(self, state):
        """Into a state as it is in the midst of it, without having gone the way."""
        self.axis.state = self.c.enums["axis_state"]["AXIS_" + state]
        live = state in ("SWITCHED_ON", "OPERATION_ENABLED", "QUICK_STOP")
        self.fabric.gate.CONTROL = int(live)
        self.axis.retry.wanted = live
        if state in ("FAULT", "FAULT_REACTION"):
            self.axis.faults.cause = self.c.FAULT_STALL
        return self

    def switch_on(self, begin="switch_on_at_once", starts=1, aligned=None):
        """The start has begun; of several each but the last has been broken off by `off` in its midst."""
        self.fabric.adc.OFFSET_A = self.fabric.adc.OFFSET_B = self.fabric.adc.OFFSET_C = 32768
        self.axis.loop.vbus_q15 = self.fabric.adc.VBUS
        for again in range(starts):
            if again:
                self.step(150)
                assert self.c.drive_switch_off(self.axis).error == 0 and self.step(2) == "SWITCH_ON_DISABLED"
            self.axis.start.aligned = self.axis.start.aligned if aligned is None else aligned
            assert getattr(self.c, begin)(self.axis).error == self.c.ERROR_NONE
            assert self.step() == "SWITCHED_ON"
        return self
