# SPDX-License-Identifier: MIT
"""What begins, begins the second time as the first: of an earlier run nothing counts any more but what is named here."""
import ctypes
import functools

import pytest

from rigs.operating import Drive

OLD = 77  # in every number that an earlier run has left
# function: the parts of the axis that it begins ("": a state of its own), and what stays in them: settings, what the device has
# learnt, and what is written again before it is read
BEGINS = {
    "supervision_begin": ("supervision lock_watch", ""),
    "supervision_begin_again": ("supervision lock_watch", "supervision.encoder"),  # it has its own end: failover
    "hall_watch_begin": ("hall_watch", ""),
    "flying_begin": ("flying", ""),
    "injection_begin": ("injection", ""),
    "sensorless_begin": ("sensorless", ""),
    "failover_reset": ("failover", ""),
    "start_begin": ("start", "start.aligned start.wired start.remembered start.index start.learns start.alignment start.check "
                             "start.wiring start.suspected start.recheck_wiring"),
    "start_hall_begin": ("hall", "hall.clock hall.edge hall.invalid hall.move hall.push hall.sector hall.skipped "
                                 "hall.speed.angle"),
    "alignment_start": ("", ""), "calibration_start": ("", ""), "canopen_start": ("", ""), "cia402_init": ("", ""),
    "cogging_learn_begin": ("", ""), "current_loop_init": ("", ""), "emf_reset": ("", ""), "emf_track_begin": ("", ""),
    "encoder_sense_start": ("", ""), "field_watch_reset": ("", ""), "hall_learn_begin": ("", ""), "homing_begin": ("", ""),
    "identify_begin": ("", ""), "lock_watch_begin": ("", ""), "offset_check_start": ("", ""), "oscillation_init": ("", ""),
    "position_begin": ("", ""), "reaction_init": ("", ""), "saliency_start": ("", ""), "slot_begin": ("", ""),
    "speed_estimate_reset": ("", ""), "speed_loop_init": ("", ""), "thermal_init": ("", ""), "wiring_start": ("", ""),
    "zero_watch_begin": ("", ""),
    "capture_begin": ("", "before level samples when words"),
    "field_pass_start": ("", "field first_counts reference"),
    "notch_reset": ("", "c_q gain on rc_q"),
    "pendulum_start": ("", "ahead applied sense"),
    "load_angle_start": ("", "back centre forward ratio saliency"),
    "retry_forget": ("", "good_since_ms latched_ms resume_rpm start_rpm"),
    "modbus_frame_forget": ("", "bytes"),
    "line_clear": ("", "argument history last_was_cr lines text"),
}


def numbers(state, path=""):
    """(path, structure or array, its member or place) of every number."""
    array = isinstance(state, ctypes.Array)
    for name in range(len(state)) if array else [field for field, _ in state._fields_]:
        value, here = of(state, name), path if array else f"{path}.{name}".lstrip(".")
        if isinstance(value, (ctypes.Structure, ctypes.Array)):
            yield from numbers(value, here)
        elif isinstance(value, int):
            yield here, state, name


def of(where, name):
    return where[name] if isinstance(where, ctypes.Array) else getattr(where, name)


def begun(c, function, parts, old):
    """[(path, value)] of the state behind it."""
    w, begins = Drive(c), getattr(c, function)
    known = {type(one): one for one in (w.axis.tuning, w.axis.params, w.axis.loop, w.axis.motion.turns)}
    own = w.axis if parts else begins.argtypes[0]._type_()
    states = {part: functools.reduce(getattr, part.split("."), w.axis) for part in parts.split()} or {"": own}
    for state in states.values():
        ctypes.memset(ctypes.addressof(state), 0, ctypes.sizeof(state))
        for _, where, name in list(numbers(state)) if old else ():
            new = True if isinstance(of(where, name), bool) else OLD
            where.__setitem__(name, new) if isinstance(where, ctypes.Array) else setattr(where, name, new)
    begins(own, *[kind(1) if not hasattr(kind, "contents") else known.get(kind._type_) or kind._type_()
                  for kind in begins.argtypes[1:]])
    return [(path, of(where, name)) for part, state in states.items() for path, where, name in numbers(state, part)]


@pytest.mark.parametrize("function", BEGINS)
def test_of_an_earlier_run_nothing_counts(c, function):
    parts, stays = BEGINS[function]
    first, again = (begun(c, function, parts, old) for old in (False, True))
    left = {path for (path, one), (_, other) in zip(first, again) if one != other}
    assert not [path for path in left if not any(path.startswith(name) for name in stays.split())]
    assert not [name for name in stays.split() if not any(path.startswith(name) for path in left)], "it begins with that, too"


@pytest.mark.parametrize("event, state", (("QUICK_STOP", "OPERATION_ENABLED"), ("FAULT_STOP", "OPERATION_ENABLED")))
def test_a_stop_counts_its_own_milliseconds(c, event, state):
    w = Drive(c, rpm=0)
    w.axis.state = c.enums["axis_state"]["AXIS_" + state]
    w.axis.stopping_ms = w.axis.unlimited_braking_ms = OLD
    assert c.states_take(w.axis, c.enums["drive_event"]["DRIVE_EVENT_" + event])
    assert w.axis.stopping_ms == w.axis.unlimited_braking_ms == 0 == w.axis.speed.target_rpm_q16


def test_a_bridge_that_goes_off_leaves_no_torque_behind(c):
    """Of the rest only settings, tables and what is measured of the supply stay."""
    s = c.torque_control()
    left = ("torque_q15", "probe_q15", "demand_sum_q15", "burn_q15", "return_q19", "copper_q15")
    for name in left:
        setattr(s, name, OLD)
    c.torque_reset(s)
    assert [getattr(s, name) for name in left] == [0] * len(left)


def test_each_try_of_the_polarity_is_judged_by_its_own_scatter(c):
    """The one before it was too faint to tell: sums and squares begin anew, with more current."""
    w = Drive(c, rpm=0)
    s = w.axis.injection
    s.step, s.i_q15, s.tries, s.ms = c.STEP_POLARITY, 1000, 0, 4 * 24
    for name, value in (("with", 600), ("against", 600), ("with_squares", 10**9), ("against_squares", 10**9)):
        setattr(s, name, value)
    assert c.injection_start_step(w.axis) == c.INJECTION_RUNNING
    assert s.step == c.STEP_POLARITY and s.tries == 1 and s.i_q15 == 1500
    assert (s.ms, getattr(s, "with"), s.against, s.with_squares, s.against_squares) == (0, 0, 0, 0, 0)
