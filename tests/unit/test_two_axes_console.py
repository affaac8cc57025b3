# SPDX-License-Identifier: MIT
"""One console for two axes: which of them a line is for, what each says unasked, and where the scope is."""
import ctypes

import pytest

from rigs.axes_at_rest import AxesAtRest
from rigs.console import Keyboard


class TwoAxes(AxesAtRest, Keyboard):
    """The console of two drives at rest."""

    def __init__(self, c):
        super().__init__(c, 2)
        self.loaded, self.last_run, self.scope = (c.nvm_report * 2)(), c.postmortem(), c.scope()
        self.pend = ctypes.c_uint32()
        c.scope_init(self.scope, self.axes[0], type(self.scope.enter)(), self.pend, 1)
        self.console, session = c.console(), c.session()
        session.axes, session.axis = ctypes.cast(self.axes, type(session.axes)), ctypes.pointer(self.axes[0])
        session.slots, session.loaded = (ctypes.cast(array, type(field)) for array, field in
                                         ((self.slots, session.slots), (self.loaded, session.loaded)))
        session.last_run, session.scope = ctypes.pointer(self.last_run), ctypes.pointer(self.scope)
        c.host_said_bytes.value = 0
        c.console_start(self.console, session)
        self.greeting = self.heard()

    def ramps(self):
        return [axis.params.ramp_rpm_s for axis in self.axes]


@pytest.fixture
def two(two_buses):
    return TwoAxes(two_buses)


def test_each_tells_what_was_stored_for_it(two):
    assert two.greeting.split("\r\n")[2:4] == [f"axis {n}: settings: none stored, initial values" for n in (1, 2)]


def test_a_line_is_for_the_chosen_axis_or_for_one_just_once(two):
    first, second = two.ramps()
    assert two("set ramp_rpm_s 111") == ["ok"] and two.ramps() == [111, second]
    assert two("axis 2 set ramp_rpm_s 222") == ["ok"] and two.ramps() == [111, 222]
    assert two("get ramp_rpm_s")[0].startswith("ramp_rpm_s = 111 ")
    assert two("axis 2") == ["ok"]
    assert two("get ramp_rpm_s")[0].startswith("ramp_rpm_s = 222 ")
    assert two("  axis   1   set ramp_rpm_s 333") == ["ok"] and two.ramps() == [333, 222]
    assert two("set ramp_rpm_s 444") == ["ok"] and two.ramps() == [333, 444]
    assert two("axis 1") == ["ok"] and two("set ramp_rpm_s 555") == ["ok"] and two.ramps() == [555, 444]


@pytest.mark.parametrize("line", ("axis 0", "axis 3", "axis -1", "axis 3 off", "axis 0 set ramp_rpm_s 7", "axis x off"))
def test_an_axis_there_is_not(two, line):
    before = two.ramps()
    assert two(line) == ["error: there is no such axis: they count from 1 to 2"] and two.ramps() == before
    assert two("set ramp_rpm_s 111") == ["ok"] and two.ramps() == [111, before[1]]


@pytest.mark.parametrize("line, answer", (
    ("axis", "error: usage: axis NUMBER"), ("axis two", "error: two: not a whole number"),
    ("axis 1 axis 2", "error: usage: axis NUMBER"),
    ("axis 2 nonsense", "error: nonsense: unknown command; 'help' lists them")))
def test_what_is_no_line_for_an_axis(two, line, answer):
    assert two(line) == [answer]
    assert two.console.session.axis.contents.params.ramp_rpm_s == two.ramps()[0]


def test_faults_and_warnings_name_their_axis(two):
    two.axes[1].faults.cause = two.c.FAULT_OVERCURRENT
    two.axes[0].reports.warned[0] = 1 << two.c.FAULT_OVERTEMPERATURE
    said = two("status")
    assert "fault: axis 2: over-current; see 'fault', then 'clear'" in said
    assert [line for line in said if line.startswith("warning: axis 1: ")]
    assert not [line for line in two("status") if "axis" in line], "once"


def test_the_scope_goes_with_the_chosen_axis(two):
    elsewhere = ["error: the scope is with the axis that 'axis' has chosen: choose this one first"]
    for line in ("scope off", "scope", "sweep", "stream 0 115200"):
        assert two("axis 2 " + line)[-1:] == elsewhere, line
    assert two("axis 2") == ["ok"]
    assert ctypes.addressof(two.scope.axis.contents) == ctypes.addressof(two.axes[1])
    assert two("scope")[-1] != elsewhere[0] and two("axis 1 scope off") == elsewhere
    places = [ctypes.addressof(source.word.contents) for source in two.scope.sources[:two.scope.choice.count]]
    ours = [(ctypes.addressof(part), ctypes.sizeof(part)) for part in (two.axes[1], two.fabrics[1])]
    assert all(any(start <= place < start + size for start, size in ours) for place in places)


def test_a_capture_under_way_keeps_the_scope(two):
    two.scope.capture.state = two.c.CAPTURE_WAITING
    assert two("axis 2") == ["error: a capture is under way; wait for its end, or 'scope off'"]
    assert two("set ramp_rpm_s 111") == ["ok"] and two.ramps()[0] == 111


def test_what_the_scope_kept_of_one_axis_is_not_the_others(two):
    two.scope.recorder.kept, two.scope.recorder.kept_end = 1, 5
    two.axes[1].faults.cause = two.c.FAULT_OVERCURRENT
    two("axis 2")
    assert two.scope.recorder.kept == 0 and two.scope.recorder.had_fault == two.c.FAULT_OVERCURRENT


def test_saving_asks_the_other_axis_too(two):
    two.axes[1].state = two.c.AXIS_OPERATION_ENABLED
    both = "error: saving keeps the core from both motors: the other axis off and at rest first"
    assert two("save") == [both]
    two.axes[1].state = two.c.AXIS_SWITCH_ON_DISABLED
    two.axes[1].speed.speed_rpm_q4 = 100 * 16
    assert two("save") == [both]


def test_one_is_identified_at_a_time(two):
    two.axes[1].identify.running = True
    assert two("identify") == ["error: the other axis is identified; wait for its end, or switch it off"]
