# SPDX-License-Identifier: MIT
"""Times that follow from each other, steps that repeat themselves, what the drive could not do, and what it refused."""
from types import SimpleNamespace

import numpy as np
import pytest

from launcher import LauncherError
from launcher.axis import as_held
from launcher.config import twin_config
from launcher.data import MOTORS, available
from launcher.drive import load_drive
from launcher.kind import Run
from launcher.paths import SCENARIOS
from launcher.refusals import judge, refusals, typed
from launcher.scenario import HOLD_MORE, load_scenario
from launcher.trace import Trace

TEKNIC = "teknic_m2310p"


def load(steps, motor=TEKNIC, **more):
    return load_scenario({"end_s": 10, "step": steps, **more}, load_drive(motor))


def times(plan):
    return [step.t_s for step in plan.steps]


def test_labels_may_be_used_before_they_are_written():
    plan = load([{"t_s": "up + ramp_time_s + pause_s", "event": "load_nm", "args": [1]},
                 {"t_s": "on + 0.5", "label": "up", "console": "speed {work_rpm}"},
                 {"t_s": 0.2, "label": "on", "console": "on"},
                 {"t_s": "up + 1", "label": "end"}],
                end_s="end + 0.5", let={"pause_s": "2 * half_s", "half_s": 0.3})
    assert times(plan) == pytest.approx([0.2, 0.7, 0.7 + 0.3 + 0.6]) and plan.end_s == pytest.approx(2.2)
    assert plan.names["end"] == pytest.approx(1.7) and [step.text for step in plan.steps[:2]] == ["on", "speed 1500"]


def test_steps_that_wait_for_a_state():
    plan = load([{"t_s": 0.2, "console": "on"}, {"t_s": 0.4, "after_state": "ON", "event": "end"},
                 {"t_s": "ramp_time_s", "after_state": "ON OFF", "console": "speed {work_rpm}"}])
    assert times(plan) == [0.2] and plan.may_end_early and [step.after for step in plan.late] == [("ON", "OFF"), ("ON",)]
    enums = {"state": {3: "DRIVE_OFF", 4: "DRIVE_ON"}}
    text = twin_config(load_drive(TEKNIC), plan, 1, [], {}, enums=enums)
    assert "event 0.2 console on\nafter state=4,3 0.3 console speed 1500\nafter state=4 0.4 end\n" in text
    for enums in (None, {"state": {3: "DRIVE_OFF"}}):
        with pytest.raises(LauncherError, match="has no state 'ON', for which a step waits"):
            twin_config(load_drive(TEKNIC), plan, 1, [], {}, enums=enums)
    assert (None, "speed 1500") in typed(plan, load_drive(TEKNIC))
    assert not load([{"t_s": 1, "console": "on"}]).may_end_early


@pytest.mark.parametrize("before, after, params, knows", (
    ([], [], {}, True), (["set angle_source 1"], [], {}, False), ([], ["set angle_source 1"], {}, True),
    (["set angle_source 1", "set angle_source 0"], [], {}, True), ([], [], {"angle_source": 1}, False),
    (["set angle_source 0"], [], {"angle_source": 1}, True)))
def test_only_an_encoder_has_an_offset_to_know(before, after, params, knows):
    drive = load_drive(TEKNIC, {"params": params}, aligned=True)
    lines = [*before, "on", "off", *after, "on"]
    steps = [{"t_s": 0.2 + k / 10, "console": line} for k, line in enumerate(lines)]
    plan = load_scenario({"end_s": 3, "preamble_s": 0.1, "step": steps}, drive)
    places = {"axes[0].start.aligned": 0x100, "axes[0].start.rescaled": 0x101}
    symbols = SimpleNamespace(address=lambda name: places.get(name, 0x200))
    text = twin_config(drive, plan, 1, [], {}, symbols, enums={"state": {2: "AXIS_SWITCHED_ON"}})
    assert ("after state=2 0.1 poke 0x00000100 1" in text) == ("poke_offset" in text) == knows


HELD = {"end_s": "again + 1", "step": [
    {"t_s": 0.2, "label": "on", "console": "on"}, {"t_s": "on + 2", "label": "started", "hold_for": "ON"},
    {"t_s": "started + 0.1", "console": "speed 100"},
    {"t_s": "started + 3", "label": "again", "hold_for": "OFF ON"}, {"t_s": "again + 0.2", "console": "off"}]}
STATES = {"state": {3: "DRIVE_OFF", 4: "DRIVE_ON"}}


def test_what_comes_after_a_hold_moves_with_it():
    drive = load_drive(TEKNIC)
    plan = load_scenario(HELD, drive)
    lines = twin_config(drive, plan, 1, [], {}, enums=STATES).splitlines()
    assert lines[-4] == "event 0.2 console on"
    assert lines[-3:] == ["after state=4 0.1 console speed 100", "after state=4,3,4 0.2 console off", "after state=4,3,4 1 end"]
    assert f"end {6.2 + HOLD_MORE * 5.2:g}" in lines


@pytest.mark.parametrize("states, speed_s, off_s", [
    ([3, 3, 3, 3, 3], 2.3, 5.4), ([3, 4, 4, 4, 4], 4.1, 7.2), ([3, 4, 4, 3, 3], 4.1, 7.2), ([3, 4, 3, 4, 4], 4.1, 6.2)])
def test_a_plan_knows_when_its_holds_were_over(states, speed_s, off_s):
    drive = load_drive(TEKNIC)
    plan = load_scenario(HELD, drive)
    trace = {"t_s": np.arange(2.0, 7.0), "state": np.array(states)}
    assert times(as_held(plan, HELD, drive, trace, STATES)) == pytest.approx([0.2, speed_s, off_s])


@pytest.mark.parametrize("steps, complaint", [
    ([{"t_s": 1, "hold_for": "ON", "event": "end"}], "needs a label"), ([{"t_s": 1, "label": "a", "hold_for": ""}], "one to 4"),
    ([{"t_s": n, "label": f"l{n}", "hold_for": "ON A B"} for n in (1, 2)], "one to 4 names of states in all")])
def test_what_cannot_hold(steps, complaint):
    with pytest.raises(LauncherError, match=complaint):
        load(steps)


@pytest.mark.parametrize("step, complaint", [
    ({"t_s": 1, "after_state": ""}, "one to 4 names of states"), ({"t_s": 1, "after_state": "A B C D E"}, "one to 4 names"),
    ({"t_s": 11, "after_state": "ON"}, "outside 0..10 s")])
def test_steps_that_cannot_wait(step, complaint):
    with pytest.raises(LauncherError, match=complaint):
        load([{**step, "event": "end"}])


def test_a_step_that_repeats_itself():
    plan = load([{"t_s": "a", "each": {"hz": [50, 100, "2 * 100"]}, "every_s": "1 / hz", "end_label": "done",
                  "event": "sensor_sine", "args": ["rated_current_A", "hz", "0"]},
                 {"t_s": 1.0, "label": "a"}, {"t_s": "done", "event": "sensor_sine", "args": ["0", "0", "0"]}])
    assert times(plan) == pytest.approx([1.0, 1.02, 1.03, 1.035])
    assert [step.args[1] for step in plan.steps] == ["50", "100", "200", "0"]


@pytest.mark.parametrize("steps, complaint", [
    ([{"t_s": "a + 1", "label": "b"}, {"t_s": "b", "label": "a"}], "depends on itself: b -> a -> b"),
    ([{"t_s": 1, "label": "a"}, {"t_s": 1, "label": "a"}], "the name 'a' is taken"),
    ([{"t_s": 1, "label": "work_rpm"}], "the name 'work_rpm' is taken"),
    ([{"t_s": 1, "label": "two words"}], "is not one word"),
    ([{"t_s": "nowhere", "console": "on"}], "unknown name 'nowhere'"),
    ([{"t_s": "1 +", "console": "on"}], "is not an expression"),
    ([{"t_s": 1, "every_s": 1, "console": "on"}], "need 'each'"),
    ([{"t_s": 1, "each": {"x": []}, "every_s": 1, "console": "on"}], "write each"),
    ([{"t_s": 1, "each": {"x": [1]}, "console": "on"}], "'every_s' is missing"),
    ([{"t_s": -1, "label": "a"}], "-1 s is outside"),
])
def test_times_that_make_no_sense(steps, complaint):
    with pytest.raises(LauncherError, match=complaint):
        load(steps)


@pytest.mark.parametrize("line, complaint", [
    ("speed {speed_max_rpm + 1}", r"'speed 4001' at 1 s is beyond Teknic M-2310P-LN-04K's speed_max_rpm: 4000 rpm"),
    ("speed -4001", "beyond"),
    ("torque {i_max_A + 0.1}", r"'torque 10.75' at 1 s is beyond .*'s i_max_ma: 10.65 A"),
])
def test_what_is_beyond_the_motor_is_said_before_the_run(line, complaint):
    with pytest.raises(LauncherError, match=complaint) as raised:
        load([{"t_s": 1, "console": line}])
    assert "\n" not in str(raised.value)
    assert load([{"t_s": 1, "console": line}], expect_refusal="beyond").steps


def test_limits_are_those_that_the_scenario_itself_has_set():
    steps = [{"t_s": 0.5, "console": "set speed_max_rpm 4500"}, {"t_s": 1, "console": "speed 4400"}]
    assert len(load(steps).steps) == 2


@pytest.mark.parametrize("motor", available(MOTORS))
def test_every_shipped_scenario_fits_every_motor_and_asserts_that_the_drive_was_on(motor):
    drive = load_drive(motor)
    for name in available(SCENARIOS):
        try:
            plan = load_scenario(name, drive)
        except LauncherError as refusal:  # of these two only, and with the motor's name and the reason
            assert name in ("field_weakening", "overmodulation") and (": no field weakening: " in str(refusal) or
                                                                       ": no overmodulation: " in str(refusal))
            continue
        assert any(step.text == "on" for step in plan.steps), name
        assert all(ord(char) < 128 for step in plan.steps for char in step.text), name
        asked = [figure for figure in plan.figures
                 if figure["kind"] in ("state", "state_at") and figure["equal"] == "OPERATION_ENABLED"]
        assert asked, f"{name}: nothing says that the drive was on"
        assert plan.end_s < 35, f"{name}: longer than two alignments of the heaviest rotor take"


# ---- refusals ------------------------------------------------------------------------------------------------------

CONSOLE = """mssfoc 0.1.0
> set pole_pairs 4
ok
> on
error: the bus voltage is below v_min_mv; see 'status'
> speed 100
error: the drive is not in operation; use 'on' and wait for it
> status
state: switch on disabled
"""
TYPED = [(0.05, "set pole_pairs 4"), (0.2, "on"), (1.2, "speed 100"), (1.5, "status")]


def verdict(expect="", console=CONSOLE, fault_from_s=9.0):
    t = np.arange(0, 2, 0.001)
    trace = Trace({"t_s": t, "fault": np.where(t < fault_from_s, 0.0, 5.0)})
    run = Run(trace, console, None, {"fault": {5: "FAULT_ENCODER"}}, {})
    return judge(SimpleNamespace(expect_refusal=expect), run, TYPED)


def test_refusals_know_their_line_and_its_time():
    found = refusals(CONSOLE, TYPED)
    assert [(r.line, r.t_s) for r in found] == [("on", 0.2), ("speed 100", 1.2)]
    assert found[0].answer == "the bus voltage is below v_min_mv; see 'status'"


def test_of_two_lines_alike_the_refused_one_is_named():
    found = refusals("> on\nok\n> off\nok\n> on\nerror: no\n", [(0.2, "on"), (0.5, "off"), (0.7, "on")])
    assert [(r.line, r.t_s) for r in found] == [("on", 0.7)]


def test_the_first_refusal_is_named():
    figure = verdict()
    assert figure.passed is False
    assert figure.value == "'on' at 0.200 s: the bus voltage is below v_min_mv; see 'status'"
    assert verdict(console="> on\nok\n").passed


def test_a_fault_that_was_there_before_is_named_with_it():
    found = verdict(expect="^on: ", fault_from_s=0.9).value
    assert found.startswith("'speed 100' at 1.200 s: ") and found.endswith("(fault ENCODER since 0.900 s)")


def test_expected_refusals_must_come_and_others_must_not():
    assert verdict(expect="^on: .*v_min|^speed").passed
    assert verdict(expect="^on: ").passed is False
    figure = verdict(expect="never", console="> on\nok\n")
    assert figure.passed is False and figure.value == "nothing, but 'never' was expected"
    with pytest.raises(LauncherError, match="expect_refusal"):
        load([{"t_s": 1, "console": "on"}], expect_refusal="(")
