# SPDX-License-Identifier: MIT
"""The console says when what a command has begun is done, once, and nothing when it has ended otherwise."""
import pytest

TEXTS = {"ON": "operation enabled", "IDENTIFY": "identify; 'identify show' lists what it found", "LEARN": "learning",
         "MOVE": "in position", "HOME": "homed"}


@pytest.fixture(autouse=True)
def initial(operator):
    operator.c.params_init(operator.axis.params)


def said(operator):
    return [line for line in operator.type(b"").split("\r\n") if line and line != "> "]


def begin(c, operator, what, *, state, mode="SPEED"):
    operator.console.session.progress[0] = getattr(c, f"PROGRESS_{what}")
    operator.axis.state, operator.axis.mode = getattr(c, f"AXIS_{state}"), getattr(c, f"AXIS_MODE_{mode}")


ENDS = [  # what, state and mode on the way, and at the end
    ("ON", ("SWITCHED_ON", "SPEED"), ("OPERATION_ENABLED", "SPEED")),
    ("LEARN", ("OPERATION_ENABLED", "LEARNING"), ("OPERATION_ENABLED", "SPEED")),
    ("LEARN", ("SWITCHED_ON", "SPEED"), ("SWITCH_ON_DISABLED", "SPEED")),
    ("HOME", ("OPERATION_ENABLED", "HOMING"), ("OPERATION_ENABLED", "POSITION"))]


@pytest.mark.parametrize("what, way, end", ENDS)
def test_the_end_is_said_once(c, operator, what, way, end):
    begin(c, operator, what, state=way[0], mode=way[1])
    operator.axis.motion.homed = True
    assert said(operator) == []
    begin(c, operator, what, state=end[0], mode=end[1])
    assert said(operator) == [f"done: {TEXTS[what]}"] and said(operator) == []


@pytest.mark.parametrize("mode", ("SPEED", "POSITION", "TORQUE"))
def test_homing_that_another_mode_has_ended_is_not_done(c, operator, mode):
    begin(c, operator, "HOME", state="OPERATION_ENABLED", mode=mode)
    operator.axis.motion.homed = False
    assert said(operator) == [] and said(operator) == []


def test_a_move_is_done_when_its_profile_is(c, operator):
    begin(c, operator, "MOVE", state="OPERATION_ENABLED", mode="POSITION")
    profile = operator.axis.motion.profile
    profile.target = profile.position + 1
    assert said(operator) == []
    profile.position = profile.target
    assert said(operator) == ["done: in position"]


def test_identify_is_done_when_it_runs_no_more(c, operator):
    begin(c, operator, "IDENTIFY", state="SWITCHED_ON")
    operator.axis.identify.running = True
    assert said(operator) == []
    operator.axis.identify.running, operator.axis.state = False, c.AXIS_SWITCH_ON_DISABLED
    assert said(operator) == [f"done: {TEXTS['IDENTIFY']}"]


@pytest.mark.parametrize("what", TEXTS)
def test_a_fault_ends_it_in_its_own_words(c, operator, what):
    begin(c, operator, what, state="FAULT")
    operator.axis.faults.cause = c.FAULT_STALL
    assert said(operator) == ["fault: stall; see 'fault', then 'clear'"]
    begin(c, operator, "NONE", state="OPERATION_ENABLED")
    assert said(operator) == []


def test_what_is_switched_off_is_not_done(c, operator):
    for what in ("ON", "MOVE", "HOME"):
        begin(c, operator, what, state="SWITCH_ON_DISABLED")
        assert said(operator) == []


@pytest.mark.parametrize("line, accepted", (("speed 1", True), ("speed 4001", False), ("get ramp_rpm_s", None), ("zero", True)))
def test_only_another_command_that_is_accepted_ends_it(c, operator, line, accepted):
    """What is asked meanwhile does not, nor does what is refused."""
    begin(c, operator, "MOVE", state="OPERATION_ENABLED", mode="POSITION")
    operator.axis.motion.profile.target = 5
    operator(line)
    assert (operator.console.session.progress[0] == c.PROGRESS_NONE) == bool(accepted)


def test_lines_for_programs_stand_between_answers(c, operator):
    operator.type(b"machine on\r")
    begin(c, operator, "ON", state="OPERATION_ENABLED")
    assert operator.type(b"") == "done: operation enabled\r\n"


@pytest.mark.parametrize("phase, name", (("ALIGN", "aligning"), ("WIRING", "wiring test"), ("IDENTIFY", "identifying")))
def test_status_names_the_phase_of_a_start(c, operator, phase, name):
    operator.axis.state = c.AXIS_SWITCHED_ON
    operator.axis.start.phase = getattr(c, f"START_{phase}")
    assert operator("status")[0] == f"state: switched on ({name})"
    operator.axis.state = c.AXIS_OPERATION_ENABLED
    assert operator("status")[0] == "state: operation enabled"


def test_each_phase_has_a_name(c):
    names = [c.message_of_phase(n).decode() for n in range(c.START_PHASES)]
    assert all(names) and c.message_of_phase(c.START_PHASES) == b"unknown"


@pytest.mark.parametrize("line, answer", [
    ("scope signals i_q i_d", "usage: scope signals A,B,...|values A,B,...|every TICKS|before SAMPLES|trigger never"),
    ("scope trigger i_q above", "usage: scope trigger SIGNAL above|below|rises|falls VALUE"),
    ("scope arm now please", "usage: scope list|arm|fire|off|read|fault"),
    ("stream 1 115200", "stream: its frames are not for a terminal; 'machine on' first"),
    ("statu", "statu: unknown command; 'help' lists them; did you mean status?"),
    ("HELP", "HELP: unknown command; 'help' lists them; did you mean help?"),
    ("get ld", "ld: no such parameter; 'get all' lists them; did you mean ld_uh?"),
    ("get x", "x: no such parameter; 'get all' lists them"),
    ("reaction encoder_ded off",
     "encoder_ded: no such fault; 'reaction' lists those with a choice, '_' stands for a blank; did you mean encoder_dead?"),
    ("scope trigger i_p above 1", "i_p: no such signal; 'scope list' has them; did you mean i_a?"),
    ("learn_rpm 20", "learn_rpm: unknown command; 'help' lists them")])
def test_what_is_not_understood_says_what_would_be(operator, line, answer):
    assert operator(line) == [f"error: {answer}"]


def test_what_has_been_changed_can_be_typed_again(c, operator):
    for line in ("set pole_pairs 7", "set home_rpm -20"):
        assert operator(line) == ["ok"]
    lines = operator("get --changed")
    assert operator("defaults") == ["ok"] and operator("get --changed") == []
    assert [operator(line) for line in lines] == [["ok"], ["ok"]] and operator("get --changed") == lines
