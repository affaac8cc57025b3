# SPDX-License-Identifier: MIT
"""The console as a person meets it, on the running drive: each line typed and what came back."""
import re

import pytest

from launcher import simulate
from launcher.drive import console_params, load_drive

OPERATION_S = 0.4  # when a drive that was switched on at 0.1 s, and knows where its rotor stands, is in operation
GAP_S = 0.02  # between lines: an answer of 200 characters at 115200 baud takes 17 ms


def asked(result):
    """The console without what the drive says by itself when something is done."""
    return re.sub(r"\n> \ndone: [^\n]*", "", result.console)


def answers(tmp_path, lines, start_s=0.1, before=(), gap_s=GAP_S):
    """What the drive answers to each line, typed one after another; `before`: (time, line) typed earlier."""
    steps = [{"t_s": t, "console": line} for t, line in before]
    steps += [{"t_s": start_s + i * gap_s, "console": line} for i, line in enumerate(lines)]
    result = simulate({"end_s": start_s + (len(lines) + 2) * gap_s, "step": steps, "expect_refusal": ".*"}, out_dir=tmp_path,
                      plant="ideal", spread=0, aligned=True)
    exchanges = asked(result).split("\n> ")[1:]
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
                      out_dir=tmp_path, plant="ideal", spread=0, aligned=True)
    assert result.console.count("error: line longer than 80 characters") == 1
    assert "pole_pairs = 4 " in result.console


def test_empty_line_is_no_command(tmp_path):
    assert answers(tmp_path, ["", "version", ""])[::2] == ["", ""]


def test_help_names_every_command(tmp_path):
    text = answers(tmp_path, ["help"], gap_s=0.2)[0]
    commands = {line.split(":")[0].split()[0] for line in text.split("\n")}
    assert commands == {"help", "machine", "status", "on", "off", "quickstop", "speed", "torque", "fault", "clear", "forget",
                        "get", "set", "version", "reaction", "identify", "pv", "pp", "hm", "csp", "csv", "cst", "zero", "learn",
                        "angle", "save", "load", "defaults", "scope", "stream", "sweep"}


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
    replies = answers(tmp_path, ["set pole_pairs 5", "on", "get pole_pairs"], start_s=OPERATION_S, before=[(0.1, "on")])
    assert replies[0] == "error: parameters can change only while the drive is off"
    assert replies[1] == "error: the drive is on already"
    assert replies[2].startswith("pole_pairs = 4 ")


def test_commands_beyond_limits_change_nothing_while_running(tmp_path):
    replies = answers(tmp_path, ["speed 300", "speed 30000", "torque 100", "status"], start_s=OPERATION_S, before=[(0.1, "on")],
                      gap_s=0.15)
    assert replies[:3] == ["ok", "error: beyond speed_max_rpm: at most 4000 rpm", "error: beyond i_max_ma: at most 10650 mA"]
    assert "state: operation enabled" in replies[3] and "reference 300.000 rpm" in replies[3]


def test_a_fresh_image_has_the_parameters_of_the_default_motor_and_starts_with_them(tmp_path):
    replies = answers(tmp_path, ["get all", "on", "status"], gap_s=0.5)
    fresh = {name: int(value) for name, value in re.findall(r"(?m)^(\w+) = (-?\d+) ", replies[0])}
    told = console_params(load_drive("teknic_m2310p"))
    assert {name: fresh[name] for name in told} == told
    assert replies[1].startswith("ok\nphase margin of the current loop: ") and "state: operation enabled" in replies[2]


def play(tmp_path, *steps, end_s):
    """Events, and lines that are typed behind each other without a pause, at their times; the console afterwards."""
    typed = [{"t_s": t_s, "console": line} for t_s, *what in steps if len(what) == 1 for line in what[0].split("\n")]
    steps = typed + [{"t_s": t_s, "event": what[0], "args": list(what[1:])} for t_s, *what in steps if len(what) > 1]
    return simulate({"key": "console", "end_s": end_s, "preamble_s": 0.05, "step": sorted(steps, key=lambda s: s["t_s"]),
                     "expect_refusal": ".*"}, out_dir=tmp_path, plant="ideal", spread=0, aligned=True)


XON, XOFF = "\x11", "\x13"


def test_of_a_paste_longer_than_the_buffer_nothing_is_lost(tmp_path):
    """The thread is held up for 80 ms, in which 920 characters would come: 512 fit into the buffer, 16 into the receiver."""
    values = [100000 + n for n in range(60)]
    paste = "\n".join(f"set ramp_rpm_s {value}" for value in values)
    result = play(tmp_path, (0.099, "poke_rom", "&console_poll", "0xE7FE"), (0.1, paste),
                  (0.179, "poke_rom", "&console_poll", "*console_poll"), (0.7, "get ramp_rpm_s"), end_s=0.75)
    said = result.console[result.console.index("set ramp_rpm_s 100000") - 10:]
    plain = said.replace(XON, "").replace(XOFF, "")
    assert [int(value) for value in re.findall(r"> set ramp_rpm_s (\d+)\nok\n", plain)] == values, plain
    assert result.console.count(XOFF) >= 1 and result.console.count(XON) == result.console.count(XOFF)
    assert f"ramp_rpm_s = {values[-1]} " in plain


def within_a_millisecond(tmp_path, *lines, running=True):
    """Typed without a pause; the answers, and the result. A short line takes less than the slow loop's period."""
    at_s = OPERATION_S + 0.2 if running else 0.1
    before = [(0.1, "on"), (OPERATION_S, "speed 300")] if running else []
    result = play(tmp_path, *before, (at_s, "\n".join(lines)), (at_s + 0.04, "status"), end_s=at_s + 0.1)
    text = asked(result)
    text = text[text.rindex("\n> " + lines[0]):]
    return [part.split("\n")[1] for part in text.split("\n> ")[1:len(lines) + 1]], result, text


def test_off_and_on_are_both_carried_out(tmp_path):
    answered, result, text = within_a_millisecond(tmp_path, "off", "set ramp_rpm_s 999", "get ramp_rpm_s")
    assert answered == ["ok", "ok", "ramp_rpm_s = 999 rpm/s  (1...1000000)"]
    answered, result, text = within_a_millisecond(tmp_path / "on", "off", "on", running=False)
    assert answered == ["ok", "ok"] and "state: switched on" in text


def test_clear_and_on_are_both_carried_out(tmp_path):
    result = play(tmp_path, (0.2, "driver_fault", "1"), (0.21, "driver_fault", "0"), (0.3, "clear\non"), (0.35, "status"),
                  end_s=0.4)
    assert result.console.count("\nok") >= 2 and "state: switched on" in result.console
    assert "error:" not in result.console


def test_a_command_behind_a_quick_stop_is_refused_and_the_motor_stops(tmp_path):
    answered, result, text = within_a_millisecond(tmp_path, "quickstop", "speed 500", "torque 1")
    refused = "error: the drive is not in operation; use 'on' and wait for it"
    assert answered == ["ok", refused, refused]
    assert result.trace.between(OPERATION_S + 0.29, OPERATION_S + 0.3)["speed_rad_s"].max() < 1


def test_the_uptime_does_not_wrap(tmp_path):
    """49.7 days after the start 32 bits of milliseconds are used up."""
    result = play(tmp_path, (0.1, "poke", "&axes[0].time_ms", "0xFFFFFFB0"), (0.12, "status"), (0.2, "status"),
                  (0.24, "driver_fault", "1"), (0.26, "fault"), end_s=0.3)
    first, second = (float(value) for value in re.findall(r"up: (\d+\.\d+) s", result.console))
    assert first == pytest.approx(4294967.216 + 0.02, abs=0.005) and second == pytest.approx(first + 0.08, abs=0.005)
    assert float(re.search(r"\nat: (\d+\.\d+) s", result.console).group(1)) == pytest.approx(first + 0.12, abs=0.005)
