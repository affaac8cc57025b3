# SPDX-License-Identifier: MIT
"""Parameter `direction`: what goes in is turned, and what comes out, at every border; between them nothing knows of it."""
import pytest

from rigs.can_node import START, Abort, Node
from rigs.console import Operator
from rigs.operating import REQUESTS, Drive
from rigs.scoped import Scoped


@pytest.mark.parametrize("name", [name for name in REQUESTS if name != "home"])
def test_set_points_of_every_mode_are_turned(c, name):
    value, *rest = REQUESTS[name][1:]
    w = Drive(c, rpm=0)
    w.axis.motion.turns.counts = 0
    w.axis.params.direction = 1
    assert getattr(c, f"drive_command_{name}")(w.axis, value, *rest).error == c.ERROR_NONE
    assert w.axis.set_point.value == -value


def test_homing_searches_the_other_way_and_its_method_is_none(c):
    w = Drive(c, rpm=0)
    w.axis.params.direction, w.axis.params.home_rpm = 1, 40
    assert c.tuning_compute(w.axis.params, w.axis.tuning).error == c.ERROR_NONE
    assert w.axis.tuning.home_rpm_q16 == -40 * 65536
    assert w.command("home", c.HOMING_BLOCK) == c.ERROR_NONE and w.axis.motion.homing.method == c.HOMING_BLOCK


@pytest.mark.parametrize("least", (-2**31, 2**31 - 1))
def test_the_least_position_does_not_overflow(c, least):
    w = Drive(c, rpm=0)
    w.axis.params.direction = 1
    assert c.drive_command_position(w.axis, least, False).error == c.ERROR_NONE
    assert (w.axis.set_point.value + least) % 2**32 == 0


def test_what_is_shown_is_turned(c):
    w = Drive(c, rpm=300)
    w.axis.motion.turns.counts, w.axis.loop.i_q_q15, w.axis.loop.i_d_q15 = 5000, 700, -90
    shown = [c.drive_status(w.axis)]
    w.axis.params.direction = 1
    shown.append(c.drive_status(w.axis))
    for name, sign in (("speed_rpm_q4", -1), ("position", -1), ("i_q_q15", -1), ("i_d_q15", 1), ("vbus_q15", 1)):
        assert getattr(shown[1], name) == sign * getattr(shown[0], name), name
    assert shown[1].position == -5000
    c.fault_raise(w.axis, c.FAULT_STALL)
    assert w.axis.faults.snapshot.speed_rpm_q4 == -300 * 16 and w.axis.faults.snapshot.i_q_q15 == -700


def test_a_target_is_reached_in_either_direction(c):
    """Bit 10 of the status word compares what is shown with what was asked for."""
    w = Drive(c, rpm=-500)
    w.axis.params.direction = 1
    w.axis.speed.target_rpm_q16 = -500 * 65536
    status = c.cia402_status_word(c.cia402(), w.axis, c.drive_status(w.axis))
    assert status >> 10 & 1


def test_polarity_is_the_parameter(c):
    node = Node(c)
    node.nmt(START)
    assert node.read(0x607E) == b"\0"
    node.write(0x607E, 0, 0xC0, 1)
    assert node.axis.params.direction == 1 and node.read(0x607E) == b"\xC0"
    for half in (0x40, 0x80, 0x01):
        with pytest.raises(Abort, match=f"^{0x06090030}$"):
            node.write(0x607E, 0, half, 1)
    assert node.axis.params.direction == 1
    node.axis.state = c.AXIS_OPERATION_ENABLED
    with pytest.raises(Abort, match=f"^{0x08000022}$"):
        node.write(0x607E, 0, 0, 1)
    node.axis.state = c.AXIS_SWITCH_ON_DISABLED
    node.write(0x607E, 0, 0, 1)
    assert node.axis.params.direction == 0


def test_a_trigger_means_what_is_shown(c):
    """Above 100 rpm as shown is below -100 as the machine has it."""
    scoped = Scoped(c)
    assert scoped("set direction 1") == ["ok"]
    scoped.choose("speed")
    assert scoped("scope trigger speed rises 100") == ["ok"]
    assert any("trigger: speed rises 100.000 rpm" in line for line in scoped("scope"))
    assert scoped.scope.capture.level == -1600 and scoped.scope.capture.when == c.CAPTURE_FALLS
    assert scoped("scope trigger vbus above 20") == ["ok"] and scoped.scope.capture.when == c.CAPTURE_ABOVE


def test_it_changes_only_while_off(c):
    operator = Operator(c)
    operator.axis.state = c.AXIS_OPERATION_ENABLED
    assert operator("set direction 1")[0].startswith("error") and operator.axis.params.direction == 0
    assert operator("forget")[0].startswith("error")
    operator.axis.state = c.AXIS_SWITCH_ON_DISABLED
    operator.axis.start.aligned = operator.axis.start.index_known = True
    assert operator("forget") == ["ok"]
    assert not operator.axis.start.aligned and not operator.axis.start.index_known
