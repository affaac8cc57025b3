# SPDX-License-Identifier: MIT
"""The console as a person meets it, on the running drive: each line typed and what came back."""
import re

import pytest

from launcher import simulate
from launcher.drive import console_params, load_drive

GAP_S = 0.02  # between lines: an answer of 200 characters at 115200 baud takes 17 ms


def answers(tmp_path, lines, start_s=0.1, before=(), gap_s=GAP_S):
    """What the drive answers to each line, typed one after another; `before`: (time, line) typed earlier."""
    steps = [{"t_s": t, "console": line} for t, line in before]
    steps += [{"t_s": start_s + i * gap_s, "console": line} for i, line in enumerate(lines)]
    result = simulate({"end_s": start_s + (len(lines) + 2) * gap_s, "step": steps, "expect_refusal": ".*"}, out_dir=tmp_path,
                      plant="ideal", spread=0)
    exchanges = result.console.split("\n> ")[1:] if "\n> " in result.console else []
    replies = [part.split("\n", 1) for part in exchanges][len(before):]
    assert [echo for echo, *_ in replies[:len(lines)]] == [line for line in lines], result.console
    return [reply[1].strip() if len(reply) > 1 else "" for reply in replies[:len(lines)]]


BAD = {
    "bogus": "error: bogus: unknown command",
    "speed": "error: usage: speed RPM",
    "speed 1 2": "error: usage: speed RPM",
    "a b c d e f": "error: a: unknown command",
    "speed fast": "error: fast: not a whole number of rpm",
    "speed 1.5": "error: 1.5: not a whole number of rpm",
    "speed 99999999999999999999": "error: 99999999999999999999: not a whole number",
    "speed --5": "error: --5: not a whole number of rpm",
    "speed 100": "error: the drive is not in operation",
    "torque 1": "error: the drive is not in operation",
    "torque 1.2345": "error: 1.2345: not a current in amperes",
    "torque -": "error: -: not a current in amperes",
    "get nothing": "error: nothing: no such parameter",
    "set nothing 1": "error: nothing: no such parameter",
    "set pole_pairs": "error: usage: set PARAM VALUE",
    "set pole_pairs many": "error: many: not a whole number",
    "set pole_pairs 0": "error: pole_pairs must be 1...50",
    "set pole_pairs 51": "error: pole_pairs must be 1...50",
    "set pole_pairs -2147483648": "error: -2147483648: not a whole number",
    "quickstop": "error: the drive is not in operation",
    "clear": "error: no fault is latched",
    "x" * 80: "error: " + "x" * 80 + ": unknown command",
    "HELP": "error: HELP: unknown command",
}


def test_bad_input_gets_one_line_and_changes_nothing(tmp_path):
    before = answers(tmp_path / "a", ["get all"], gap_s=0.2)
    lines = list(BAD)
    replies = answers(tmp_path / "b", lines + ["get all"], gap_s=0.1)
    for line, reply in zip(lines, replies):
        assert "\n" not in reply and reply.startswith(BAD[line]), (line, reply)
    assert replies[-1] == before[0]


def test_over_long_line_is_refused_whole(tmp_path):
    line = "set pole_pairs 7" + " " * 100
    result = simulate({"end_s": 0.2, "step": [{"t_s": 0.05, "console": line}, {"t_s": 0.1, "console": "get pole_pairs"}]},
                      out_dir=tmp_path, plant="ideal", spread=0)
    assert result.console.count("error: line longer than 80 characters") == 1
    assert "pole_pairs = 4 " in result.console


def test_empty_line_is_no_command(tmp_path):
    assert answers(tmp_path, ["", "version", ""])[::2] == ["", ""]


def test_help_names_every_command(tmp_path):
    text = answers(tmp_path, ["help"], gap_s=0.2)[0]
    commands = {line.split(":")[0].split()[0] for line in text.split("\n")}
    assert commands == {"help", "status", "on", "off", "quickstop", "speed", "torque", "fault", "clear", "get", "set",
                        "version"}


def test_set_and_get(tmp_path):
    replies = answers(tmp_path, ["set ramp_rpm_s 1234", "get ramp_rpm_s", "set ramp_rpm_s +5", "get ramp_rpm_s"])
    assert replies[0] == "ok" and replies[1].startswith("ramp_rpm_s = 1234 ")
    assert replies[2] == "ok" and replies[3].startswith("ramp_rpm_s = 5 ")


@pytest.mark.parametrize("setting, complaint", [
    ("set i_max_ma 20000", "i_max_ma must be at most 85 % of i_trip_ma"),
    ("set i_trip_ma 23000", "i_trip_ma must be at most 95 % of i_range_ma"),
    ("set v_min_mv 50000", "v_min_mv must be below v_max_mv"),
    ("set speed_max_rpm 30000", "speed_max_rpm must be below overspeed_rpm"),
    ("set lq_uh 1000000", "current gain out of range"),
    ("set v_min_mv 30000", "the bus voltage is below v_min_mv"),
])
def test_parameters_that_do_not_fit_together_keep_the_drive_off(tmp_path, setting, complaint):
    replies = answers(tmp_path, [setting, "on", "status"], gap_s=0.06)
    assert replies[0] == "ok" and replies[1].startswith("error: " + complaint), replies
    assert "state: switch on disabled" in replies[2]


def test_parameters_cannot_change_while_the_drive_is_on(tmp_path):
    replies = answers(tmp_path, ["set pole_pairs 5", "on", "get pole_pairs"], start_s=1.2, before=[(0.1, "on")])
    assert replies[0] == "error: parameters can change only while the drive is off"
    assert replies[1] == "error: the drive is on already"
    assert replies[2].startswith("pole_pairs = 4 ")


def test_commands_beyond_limits_change_nothing_while_running(tmp_path):
    replies = answers(tmp_path, ["speed 300", "speed 30000", "torque 100", "status"], start_s=1.2, before=[(0.1, "on")],
                      gap_s=0.15)
    assert replies[:3] == ["ok", "error: beyond speed_max_rpm", "error: beyond i_max_ma"]
    assert "state: operation enabled" in replies[3] and "reference 300.000 rpm" in replies[3]


def test_a_fresh_image_has_the_parameters_of_the_default_motor_and_starts_with_them(tmp_path):
    replies = answers(tmp_path, ["get all", "on", "status"], gap_s=0.9)
    fresh = {name: int(value) for name, value in re.findall(r"(?m)^(\w+) = (-?\d+) ", replies[0])}
    assert fresh == console_params(load_drive("teknic_m2310p"))
    assert replies[1] == "ok" and "state: operation enabled" in replies[2]
