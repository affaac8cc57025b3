# SPDX-License-Identifier: MIT
"""Somebody who types at the console of an axis, and what he is told."""
import ctypes
import re

from rigs.drive import Rig
from rigs.firmware import ROOT

VERSION = "mssfoc " + re.search(r'CONFIG_VERSION "(.*)"', (ROOT / "firmware/settings/config.h").read_text())[1]
SAID = f"{VERSION}, commit unknown, PWM 20000 Hz, dead time 1000 ns, all features"  # on the host nobody tells the commit
I_RANGE_MA, V_RANGE_MV = 32768, 65536  # so that a step of Q15 is 1 mA, and 2 mV


class Keyboard:
    """What is typed at `console`, and what comes back."""

    def heard(self):
        text = bytes(self.c.host_said)[:self.c.host_said_bytes.value].decode()
        self.c.host_said_bytes.value = 0
        return text

    def type(self, text):
        """What comes back, echo and prompt included."""
        ctypes.memmove(self.c.host_heard, text, len(text))
        self.c.host_heard_bytes.value, self.c.host_heard_taken.value = len(text), 0
        while self.c.console_poll(self.console):
            pass
        return self.heard()

    def __call__(self, line):
        """The lines that answer a command."""
        said = self.type(line.encode() + b"\r")
        self.c.set_point_take(self.axis)
        assert said.startswith(line + "\r\n") and said.endswith("\r\n> ")
        return said[len(line) + 2:-len("\r\n> ")].split("\r\n") if said != line + "\r\n> " else []


class Operator(Rig, Keyboard):
    """Somebody who types at the console of an axis, and what he is told."""

    def __init__(self, c):
        super().__init__(c, i_range_ma=I_RANGE_MA, v_range_mv=V_RANGE_MV)
        self.last_run, self.console, session = c.postmortem(), c.console(), c.session()
        c.host_envm_new(self.axis, 8e-3, 1)
        self.slots, self.kept = c.host_slots(), c.nvm_report()
        session.axis, session.last_run = ctypes.pointer(self.axis), ctypes.pointer(self.last_run)
        session.slots, session.loaded = ctypes.pointer(self.slots), ctypes.pointer(self.kept)
        c.host_heard_bytes.value = c.host_heard_taken.value = c.host_said_bytes.value = 0
        c.console_start(self.console, session)
        self.greeting = self.heard()
