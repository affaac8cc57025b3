# SPDX-License-Identifier: MIT
"""Requests in the time of one millisecond, with a slow loop that lives or is dead; and a fabric in doubt."""
import ctypes

import pytest

from rigs.drive import Rig

REQUESTS = {"on": ("switch_on_at_once",), "quickstop": ("drive_quick_stop",), "clear": ("drive_clear_fault",),
            "speed": ("drive_command_speed", 100), "torque": ("drive_command_current", 100)}


@pytest.fixture
def axis(c):
    rig = Rig(c)
    rig.axis.state, rig.fabric.gate.CONTROL = c.AXIS_OPERATION_ENABLED, 1
    yield rig.axis  # the rig keeps its fabric alive


def call(c, axis, name):
    function, *args = REQUESTS[name]
    return getattr(c, function)(axis, *args).error


@pytest.mark.parametrize("pending", ["ON", "OFF", "QUICK_STOP", "CLEAR"])
@pytest.mark.parametrize("name", REQUESTS)
def test_with_a_dead_slow_loop_a_second_request_is_refused_and_the_first_stays(c, axis, name, pending):
    axis.request = c.enums["axis_request"]["AXIS_REQUEST_" + pending]
    before = bytes(axis)
    assert call(c, axis, name) == c.ERROR_BUSY
    assert bytes(axis) == before, "refused, nothing has changed"


@pytest.mark.parametrize("lives", (True, False))
def test_off_leaves_the_gates_to_a_slow_loop_that_lives_or_shuts_them_by_itself(c, axis, lives):
    axis.request = c.AXIS_REQUEST_NONE if lives else c.AXIS_REQUEST_QUICK_STOP
    assert c.drive_switch_off(axis).error == c.ERROR_NONE
    assert axis.fabric.contents.gate.CONTROL == lives and axis.request == c.AXIS_REQUEST_OFF


def test_parameters_cannot_change_while_a_request_is_under_way(c, axis):
    axis.state = c.AXIS_SWITCH_ON_DISABLED
    assert c.drive_is_off(axis)
    axis.request = c.AXIS_REQUEST_ON
    assert not c.drive_is_off(axis)


@pytest.mark.parametrize("name", ["quickstop", "speed", "torque"])
def test_masks_are_put_back(c, axis, name):
    basepri = ctypes.c_uint32.in_dll(c._library, "host_basepri")
    for state in (c.AXIS_OPERATION_ENABLED, c.AXIS_QUICK_STOP):
        axis.state, axis.request, basepri.value = state, c.AXIS_REQUEST_NONE, 0
        call(c, axis, name)
        assert basepri.value == 0


@pytest.mark.parametrize("name", ["on", "quickstop", "speed", "torque"])
def test_what_the_slow_loop_does_just_before_it_is_held_counts(c, axis, name):
    """A fault comes at the last moment: what was looked at before is looked at again, or only then."""
    basepri, at_level = ctypes.c_uint32.in_dll(c._library, "host_basepri"), []

    def slow_loop_steps(level):
        at_level.append(level)
        if level:
            axis.state, axis.faults.cause = c.AXIS_FAULT_REACTION, c.FAULT_STALL
    axis.state = c.AXIS_SWITCH_ON_DISABLED if name == "on" else c.AXIS_OPERATION_ENABLED
    axis.fabric.contents.adc.VBUS = axis.loop.vbus_q15 = 13670
    axis.speed.target_rpm_q16 = -77
    hook = ctypes.CFUNCTYPE(None, ctypes.c_uint32)(slow_loop_steps)
    slot = ctypes.c_void_p.in_dll(c._library, "host_on_mask")
    slot.value = ctypes.cast(hook, ctypes.c_void_p).value
    try:
        assert call(c, axis, name) == (c.ERROR_FAULT_LATCHED if name == "on" else c.ERROR_NOT_OPERATING)
    finally:
        slot.value = None
    assert at_level == [4, 0] and basepri.value == 0, "the level of the slow loop, and back"
    assert axis.request == c.AXIS_REQUEST_NONE and axis.mode == c.AXIS_MODE_SPEED and axis.speed.target_rpm_q16 == -77


@pytest.mark.parametrize("fault, error", [("CLOCK", "CLOCK"), ("STACK_GUARD", "STACK_GUARD"), ("WATCHDOG_OFF", "WATCHDOG_OFF"),
                                          ("NONE", "NONE")])
def test_a_fault_is_not_cleared_while_the_device_lacks_something(c, axis, fault, error):
    axis.state, axis.faults.cause = c.AXIS_FAULT, c.FAULT_STALL
    c.host_device_fault.value = c.enums["fault"]["FAULT_" + fault]
    try:
        assert call(c, axis, "clear") == c.enums["error"]["ERROR_" + error]
        assert axis.request == (c.AXIS_REQUEST_CLEAR if fault == "NONE" else c.AXIS_REQUEST_NONE)
    finally:
        c.host_device_fault.value = 0


def test_a_fault_that_is_still_being_reacted_to_is_not_cleared_yet(c, axis):
    axis.state = c.AXIS_FAULT_REACTION
    assert call(c, axis, "clear") == c.ERROR_BUSY


@pytest.mark.parametrize("cause", ["CLOCK", "FABRIC"])
def test_a_fabric_in_doubt_is_left_as_it_is(c, cause):
    """All of its registers hold what no write of the firmware would leave there."""
    fabric, axis = c.fabric(), c.axis()
    ctypes.memset(ctypes.byref(fabric), 0xA5, ctypes.sizeof(fabric))
    before = bytes(fabric)
    fault = c.enums["fault"]["FAULT_" + cause]
    c.drive_init(axis, fabric)
    c.drive_start(axis, fault)
    for _ in range(20):
        c.drive_step(axis)
    for name in REQUESTS:
        assert call(c, axis, name) != c.ERROR_NONE
        c.drive_step(axis)
    assert c.drive_switch_off(axis).error == c.ERROR_NONE
    c.fault_raise(axis, c.FAULT_STALL)
    assert call(c, axis, "clear") == c.ERROR_FABRIC_DOUBTED
    assert bytes(fabric) == before
    assert axis.state == c.AXIS_FAULT and axis.faults.cause == fault and axis.time_ms == 20 + len(REQUESTS)


def test_the_clock_does_not_wrap(c, axis):
    axis.time_ms = 2**32 - 2
    for up_ms in (2**32 - 1, 2**32, 2**32 + 1):
        c.drive_step(axis)
        assert c.axis_up_ms(axis) == up_ms


def test_identify_with_ratings_that_do_not_go_together_is_no_request(c, axis):
    """They would be found later, too, but by then a start would be under way."""
    axis.state = c.AXIS_SWITCH_ON_DISABLED
    axis.fabric.contents.gate.CONTROL = 0
    axis.fabric.contents.adc.VBUS = axis.params.v_max_mv * 32768 // axis.params.v_range_mv - 100
    axis.params.v_min_mv = axis.params.v_max_mv
    tuning = bytes(axis.tuning)
    assert c.drive_identify(axis).error == c.ERROR_V_LIMITS
    assert axis.request == c.AXIS_REQUEST_NONE and bytes(axis.tuning) == tuning
