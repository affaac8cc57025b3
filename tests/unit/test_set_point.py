# SPDX-License-Identifier: MIT
"""The mailbox of set-points between thread and slow loop: what replaces, what adds up, and what comes too late."""
import re
from pathlib import Path

import pytest

from rigs.operating import Drive


def test_a_set_point_is_in_effect_from_the_next_step_on(c):
    w = Drive(c)
    assert c.drive_command_speed(w.axis, 700).error == c.ERROR_NONE and w.axis.speed.target_rpm_q16 != 700 << 16
    w.step()
    assert w.axis.speed.target_rpm_q16 == 700 << 16 and not w.axis.set_point.waits


def test_of_two_before_a_step_the_later_counts(c):
    w = Drive(c)
    c.drive_command_position(w.axis, 1000, False)
    c.drive_command_speed(w.axis, 200)
    w.step()
    assert w.mode == "SPEED" and w.axis.speed.target_rpm_q16 == 200 << 16


@pytest.mark.parametrize("mode", ("SPEED", "POSITION"))
@pytest.mark.parametrize("ways, at_once", (
    (((5000, False), (20, True)), (5020, False)), (((500, True), (-200, True)), (300, True))))
def test_relative_ones_before_a_step_count_from_the_one_before(c, mode, ways, at_once):
    w, once = Drive(c, mode, rpm=0), Drive(c, mode, rpm=0)
    for drive, each in ((w, ways), (once, (at_once,))):
        drive.command("position", 0, False)
        for way, relative in each:
            c.drive_command_position(drive.axis, way, relative)
        drive.step()
    assert w.axis.motion.profile.target == once.axis.motion.profile.target != 0


@pytest.mark.parametrize("stop", ("quick_stop", "switch_off"))
def test_a_stop_in_the_same_millisecond_is_not_undone(c, stop):
    """Whichever of the two the thread has said first."""
    w = Drive(c)
    c.drive_command_speed(w.axis, 700)
    getattr(c, "drive_" + stop)(w.axis)
    w.step()
    assert w.state != "OPERATION_ENABLED" and w.axis.speed.target_rpm_q16 != 700 << 16


def test_what_nobody_took_is_not_of_the_next_operation(c):
    w = Drive(c)
    c.drive_command_speed(w.axis, 700)
    c.fault_raise(w.axis, c.FAULT_STALL)
    w.step(3)
    assert w.state == "FAULT" and c.drive_clear_fault(w.axis).error == c.ERROR_NONE
    w.step()
    w.put("SWITCHED_ON")
    c.states_take(w.axis, c.enums["drive_event"]["DRIVE_EVENT_STARTED"])
    w.step()
    assert w.state == "OPERATION_ENABLED" and w.axis.speed.target_rpm_q16 == 0 and not w.axis.set_point.waits


def test_a_position_is_not_taken_once_the_encoder_is_given_up(c):
    """It was allowed when it was said; in the same millisecond the drive has gone on without the encoder."""
    w = Drive(c)
    assert c.drive_command_position(w.axis, 4000, False).error == c.ERROR_NONE
    w.axis.tuning.angle_source = 1
    c.set_point_take(w.axis)
    assert w.mode == "SPEED" and not w.axis.set_point.waits


def test_a_zero_does_not_overtake_a_set_point(c):
    """Which counts from the old one; a slow loop that never takes it leaves both as they are."""
    w = Drive(c, rpm=0)
    c.drive_command_position(w.axis, 4000, False)
    assert c.drive_set_zero(w.axis).error == c.ERROR_BUSY and w.axis.motion.turns.counts != 0
    c.set_point_take(w.axis)
    target = w.axis.motion.profile.target
    here = w.axis.motion.turns.counts
    assert c.drive_set_zero(w.axis).error == c.ERROR_NONE
    assert w.axis.motion.profile.target == target - (here << w.axis.tuning.profile.shift)


def test_each_mode_has_its_place_in_the_table(c):
    """A missing one would be a null pointer when a set-point asks for it."""
    source = (Path(__file__).resolve().parents[2] / "firmware/drive/modes.c").read_text()
    assert set(re.findall(r"\[AXIS_(MODE_\w+)\] = (?:FEATURE_IN\(\w+\) \? )?&mode_", source)) == {
        name[len("AXIS_"):] for name in c.enums["axis_mode"] if name != "AXIS_MODES"}
