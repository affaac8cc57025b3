# SPDX-License-Identifier: MIT
"""Who writes which part of struct axis, from which context: watched while the drive is used, and held to docs/contexts.md."""
import re
from pathlib import Path

import pytest

from rigs.restarting import Restarting

PAGE = Path(__file__).resolve().parents[2] / "docs/contexts.md"
ROW = re.compile(r"(?m)^\| `(\w+)` \| ([^|]*) \| ([^|]*)\|")
CONTEXTS = ("interrupt", "slow loop", "thread")


def declared():
    """{member: contexts that may write it}"""
    return {name: {context for context in CONTEXTS if context in writers} for name, writers, _ in ROW.findall(PAGE.read_text())}


class Watched(Restarting):
    """Each call belongs to a context; what it has changed is written down."""

    def __init__(self, c):
        self.written = {}
        super().__init__(c)
        self.members = [(name, getattr(type(self.axis), name)) for name, *_ in type(self.axis)._fields_]

    def by(self, context, function, *values):
        before = bytes(self.axis)
        result = getattr(self.c, function)(self.axis, *values)
        after = bytes(self.axis)
        for name, field in self.members:
            part = slice(field.offset, field.offset + field.size)
            if before[part] != after[part]:
                self.written.setdefault(name, {}).setdefault(context, set()).add(function)
        return result

    def ms(self, count=1):
        for _ in range(count):
            for function in ("drive_retry", "drive_learn", "drive_restore_cogging", "drive_prepare"):
                self.by("thread", function)
            self.fabric.adc.SEQUENCE += 20
            self.fabric.gate.STATUS = self.fabric.gate.CONTROL & 1
            self.by("slow loop", "drive_step")

    def on(self):
        assert self.by("thread", "drive_switch_on").error == self.c.ERROR_NONE
        while self.by("thread", "drive_prepare"):
            pass
        self.ms(200)

    def operate(self):
        """As if the start had found what it looks for: no motor is there to find."""
        self.axis.faults.cause, self.axis.loop.locked_out, self.axis.loop.status_max = self.c.FAULT_NONE, 0, 0
        self.put("SWITCHED_ON")
        self.by("slow loop", "states_take", self.c.enums["drive_event"]["DRIVE_EVENT_STARTED"])
        self.ms(5)
        assert self.state == "OPERATION_ENABLED"


def use(w):
    """A day of the drive: on, every kind of set-point, stops, faults out of each context, a retry, learning, settings."""
    c = w.c
    w.by("thread", "drive_switch_off")
    w.ms(3)
    w.on()
    w.operate()
    for name, *values in (("speed", 300), ("current", 500), ("position", 100, True), ("cyclic_speed", 10),
                          ("cyclic_current", 10), ("home", 0), ("speed", 0)):
        w.by("thread", "drive_command_" + name, *values)
        w.ms(5)
    w.by("thread", "drive_learn_cogging")
    w.ms(5)
    w.by("thread", "drive_change_source", 1)
    w.ms(5)
    w.by("thread", "drive_set_zero")
    w.by("thread", "drive_quick_stop")
    w.ms(20)
    w.operate()
    w.fabric.gate.STATUS = 4 | 1
    w.by("interrupt", "drive_sample_fault")
    w.ms(5)
    w.by("thread", "drive_clear_fault")
    w.ms(5)
    for name in ("drive_defaults", "drive_identify", "drive_switch_off", "drive_clear_fault"):
        w.by("thread", name)
        w.ms(20)
    w.by("thread", "drive_choose_reaction", c.FAULT_STALL, c.REACTION_WARN)
    w.axis.params.retry_count, w.axis.params.retry_delay_ms = 1, 100
    w.on()
    w.operate()
    w.supply(5000)
    w.by("slow loop", "fault_raise", c.FAULT_UNDERVOLTAGE)
    w.ms(5)
    w.supply(13670)
    w.ms(300)


@pytest.fixture(scope="module")
def written(c):
    w = Watched(c)
    use(w)
    return w.written


def test_each_part_of_the_axis_is_on_the_page(c):
    assert set(declared()) == {name for name, *_ in type(c.axis())._fields_}


def test_nobody_writes_what_is_anothers(written):
    wrong = {(name, context): functions for name, by in written.items() for context, functions in by.items()
             if context not in declared()[name]}
    assert not wrong


def test_the_day_reaches_most_of_it(written):
    """Or the test above would say little: what the thread, the slow loop and the interrupt write has been seen."""
    seen = {(name, context) for name, by in written.items() for context in by}
    assert {("set_point", "thread"), ("set_point", "slow loop"), ("request", "thread"), ("retry", "thread"),
            ("faults", "interrupt"), ("state", "slow loop"), ("tuning", "slow loop"), ("switching", "thread")} <= seen
    assert len(seen) > 25
