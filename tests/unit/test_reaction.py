# SPDX-License-Identifier: MIT
"""What follows from a fault: the choice that its class allows, the controlled stop, the warning, and trying again."""
import pytest

from rigs.drive import CHOICES, World

# off alone: hardware, and whatever leaves the motor without control
OFF_ONLY = ("OVERCURRENT_HARDWARE", "GATE_DRIVER", "INTERLOCK", "LOOP_OVERRUN", "OVERCURRENT", "CURRENT_SUM",
            "OVERVOLTAGE", "UNDERVOLTAGE", "CURRENT_OFFSET", "LOOP_STOPPED", "WATCHDOG", "EXCEPTION", "CLOCK", "FABRIC",
            "OPEN_PHASE")


@pytest.fixture
def world(c):
    def made(state="OPERATION_ENABLED", **choices):
        w = World(c)
        for cause, choice in choices.items():
            assert w.choose(cause, choice).error == c.ERROR_NONE
        c.supervision_begin(w.axis)
        return w.put(state)
    return made


@pytest.fixture(params=(1, 2), ids=("once", "twice"))
def report(request):
    """What comes of a report comes of the second one, too."""
    def reported(w, name):
        w.times = request.param
        w.report(name)
    return reported


@pytest.mark.parametrize("name", OFF_ONLY)
def test_what_leaves_the_motor_without_control_can_only_be_off(world, c, name, report):
    w = world("SWITCH_ON_DISABLED")
    for choice in CHOICES:
        assert (w.choose(name, choice).error == c.ERROR_NONE) == (choice == "OFF")
    w.put("OPERATION_ENABLED")
    report(w, name)
    assert w.fabric.gate.CONTROL == 0 and w.fault == name and list(w.axis.faults.detail) == [7, 8]


def test_choices_are_made_while_off(world, c):
    w = world("OPERATION_ENABLED")
    assert w.choose("SPEED_DEVIATION", "WARN").error == c.ERROR_DRIVE_IS_ON


def test_a_warning_is_remembered_until_the_next_on_and_changes_nothing(world, c, report):
    w = world(SPEED_DEVIATION="WARN")
    report(w, "SPEED_DEVIATION")
    assert w.step(2) == "OPERATION_ENABLED" and w.fault == "NONE" and w.fabric.gate.CONTROL == 1
    assert c.fault_warned(w.axis.reports, c.FAULT_SPEED_DEVIATION)
    assert not c.fault_warned(w.axis.reports, c.FAULT_STALL)
    w.put("SWITCH_ON_DISABLED")
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
    w.step()
    assert not c.fault_warned(w.axis.reports, c.FAULT_SPEED_DEVIATION)


def test_a_stop_is_a_quick_stop_with_the_fault_latched_then_off(world, c, report):
    w = world(OVERTEMPERATURE="STOP")
    w.axis.speed.ref_rpm_q16 = 1000 * 65536
    report(w, "OVERTEMPERATURE")
    assert w.fault == "OVERTEMPERATURE" and w.fabric.gate.CONTROL == 1
    assert w.step() == "QUICK_STOP" and w.axis.speed.target_rpm_q16 == 0
    assert w.step(3) == "QUICK_STOP" and w.fabric.gate.CONTROL == 1
    w.axis.speed.ref_rpm_q16 = 0
    w.step(4)
    assert w.state == "FAULT" and w.fabric.gate.CONTROL == 0 and w.fault == "OVERTEMPERATURE"
    assert not w.axis.reactions.stopping


@pytest.mark.parametrize("comes", ("off", "fault"))
def test_what_comes_during_a_stop_for_a_fault_switches_off_and_ends_in_the_first_fault(world, c, comes, report):
    w = world(OVERTEMPERATURE="STOP")
    w.axis.speed.ref_rpm_q16 = 1000 * 65536
    report(w, "OVERTEMPERATURE")
    assert w.step() == "QUICK_STOP"
    if comes == "off":
        assert c.drive_switch_off(w.axis).error == c.ERROR_NONE
        assert w.step() == "FAULT_REACTION"
    else:
        c.fault_raise(w.axis, c.FAULT_OVERCURRENT)
    assert w.fabric.gate.CONTROL == 0
    assert w.step(3) == "FAULT" and w.fault == "OVERTEMPERATURE"


def test_where_there_is_nothing_to_stop_a_stop_is_off(world, report):
    w = world("SWITCHED_ON", OVERTEMPERATURE="STOP")
    report(w, "OVERTEMPERATURE")
    assert w.fabric.gate.CONTROL == 0


def retrying(world, name, **params):
    w = world()
    for key, value in params.items():
        setattr(w.axis.params, key, value)
    w.c.fault_raise(w.axis, w.c.enums["fault"]["FAULT_" + name])
    w.step(3)
    assert w.state == "FAULT"
    return w


def wait(w, ms):
    for _ in range(ms):
        w.c.drive_retry(w.axis)
        while w.c.drive_prepare(w.axis):
            pass
        w.step()
    return w.state


def test_it_tries_again_as_often_as_it_may(world, c):
    w = retrying(world, "UNDERVOLTAGE", retry_count=2, retry_delay_ms=100)
    assert wait(w, 90) == "FAULT"
    assert wait(w, 20) == "SWITCHED_ON" and w.axis.retry.count == 1
    for left in (True, False):
        c.fault_raise(w.axis, c.FAULT_UNDERVOLTAGE)
        w.step(3)
        assert (wait(w, 120) != "FAULT") == left
    assert c.drive_clear_fault(w.axis).error == c.ERROR_NONE and w.axis.retry.count == 0, "a person has seen it"


def test_it_waits_for_the_cause_to_go(world, c):
    w = retrying(world, "UNDERVOLTAGE", retry_count=1, retry_delay_ms=100)
    w.fabric.adc.VBUS = 5000
    assert wait(w, 400) == "SWITCH_ON_DISABLED", "cleared; `on` refuses the voltage"
    w.fabric.adc.VBUS = 13670
    assert wait(w, 5) == "SWITCHED_ON"


def test_it_waits_until_it_is_cool(world, c):
    w = retrying(world, "OVERTEMPERATURE", retry_count=1, retry_delay_ms=100)
    w.fabric.adc.TEMP = 800 + 16 * 125
    assert wait(w, 500) == "FAULT"
    w.fabric.adc.TEMP = 800 + 16 * 100
    assert any(wait(w, 1) == "SWITCHED_ON" for _ in range(120))


@pytest.mark.parametrize("name", ("GATE_DRIVER", "ENCODER_SLIP", "OPEN_PHASE", "OVERSPEED", "COMMAND_TIMEOUT"))
def test_what_does_not_pass_by_itself_is_not_tried_again(world, name):
    w = retrying(world, name, retry_count=5, retry_delay_ms=10)
    assert wait(w, 100) == "FAULT"


def test_good_operation_gives_the_retries_back(world, c):
    w = world()
    w.axis.retry.count = 3
    c.drive_retry(w.axis)
    w.axis.state = c.AXIS_SWITCHED_ON
    c.drive_retry(w.axis)
    w.axis.state = c.AXIS_OPERATION_ENABLED
    w.axis.time_ms += 9_999
    c.drive_retry(w.axis)
    assert w.axis.retry.count == 3
    w.axis.time_ms += 1
    c.drive_retry(w.axis)
    assert w.axis.retry.count == 0


def test_too_hot_is_refused(world, c):
    w = world("SWITCH_ON_DISABLED")
    w.axis.thermal.winding_q4 = w.axis.thermal.max_q4 + 1
    assert c.switch_on_at_once(w.axis).error == c.ERROR_TOO_HOT


@pytest.mark.parametrize("source, by_hand, resumes", ((1, False, True), (0, False, False), (1, True, False)))
def test_a_rotor_that_was_lost_goes_on_to_its_speed(world, c, source, by_hand, resumes):
    """Without an encoder and by itself; once."""
    w = world()
    w.axis.params.angle_source = w.axis.tuning.angle_source = source
    w.axis.params.retry_count, w.axis.params.retry_delay_ms = 1, 10
    w.axis.speed.target_rpm_q16 = 1500 << 16
    c.fault_raise(w.axis, c.FAULT_LOCK_LOST)
    w.step(3)
    assert wait(w, 20) == "SWITCHED_ON"
    if by_hand:
        assert c.drive_switch_off(w.axis).error == c.ERROR_NONE and w.step(2) == "SWITCH_ON_DISABLED"
        assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE and w.step() == "SWITCHED_ON"
    c.states_take(w.axis, c.DRIVE_EVENT_STARTED)
    assert w.state == "OPERATION_ENABLED" and w.axis.speed.target_rpm_q16 == (1500 << 16 if resumes else 0)
    assert not w.axis.retry.resumes


@pytest.mark.parametrize("mode", ("TORQUE", "CYCLIC_TORQUE", "CYCLIC_SPEED", "POSITION", "HOMING"))
def test_behind_another_mode_than_speed_there_is_none_to_go_on_to(world, c, mode):
    """Torque control holds its largest speed as a limit, and homing its own."""
    w = world()
    w.axis.params.angle_source = w.axis.tuning.angle_source = 1
    w.axis.params.retry_count, w.axis.params.retry_delay_ms = 1, 10
    w.axis.mode, w.axis.speed.target_rpm_q16 = c.enums["axis_mode"]["AXIS_MODE_" + mode], 4000 << 16
    c.fault_raise(w.axis, c.FAULT_LOCK_LOST)
    w.step(3)
    assert wait(w, 20) == "SWITCHED_ON"
    c.states_take(w.axis, c.DRIVE_EVENT_STARTED)
    assert w.mode == "SPEED" and w.axis.speed.target_rpm_q16 == 0


def test_a_fault_in_a_start_has_no_older_speed_to_go_on_to(world, c):
    """The operation before it had one; this one is yet to be given its own."""
    w = world()
    w.axis.params.angle_source = w.axis.tuning.angle_source = 1
    w.axis.params.retry_count, w.axis.params.retry_delay_ms = 1, 10
    w.axis.speed.target_rpm_q16 = 1500 << 16
    assert c.drive_switch_off(w.axis).error == c.ERROR_NONE and w.step(2) == "SWITCH_ON_DISABLED"
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE and w.step() == "SWITCHED_ON"
    c.fault_raise(w.axis, c.FAULT_LOCK_LOST)
    w.step(3)
    assert wait(w, 20) == "SWITCHED_ON"
    c.states_take(w.axis, c.DRIVE_EVENT_STARTED)
    assert w.state == "OPERATION_ENABLED" and w.axis.speed.target_rpm_q16 == 0


def test_more_reports_than_a_step_has_room_for_switch_off(world, c):
    """Each of them may be a warning that changes nothing; the one that finds no room may be the one that matters."""
    w = world(STALL="WARN")
    for _ in range(len(w.axis.reports.report)):
        c.fault_report(w.axis, c.FAULT_STALL, 0, 0)
    assert w.fault == "NONE"
    c.fault_report(w.axis, c.FAULT_SPEED_DEVIATION, 7, 8)
    assert w.fault == "SPEED_DEVIATION" and w.fabric.gate.CONTROL == 0 and list(w.axis.faults.detail) == [7, 8]


@pytest.mark.parametrize("cause", ("ENCODER_SLIP", "COMMAND_TIMEOUT"))
def test_each_warning_is_in_the_status_word(world, c, cause):
    w = world()
    c.fault_warn(w.axis, getattr(c, f"FAULT_{cause}"))
    assert c.fault_any_warned(w.axis.reports)
    c.fault_clear_warnings(w.axis.reports)
    assert not c.fault_any_warned(w.axis.reports)
