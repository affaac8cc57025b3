# SPDX-License-Identifier: MIT
"""The console as a person meets it, on the running drive: each line typed and what came back."""
import re

from launcher import simulate
from launcher.drive import console_params, load_drive

OPERATION_S = 0.4  # when a drive that was switched on at 0.1 s, and knows where its rotor stands, is in operation


def asked(result):
    """The console without what the drive says by itself when something is done."""
    return re.sub(r"\n> \ndone: [^\n]*", "", result.console)


def play(tmp_path, *steps, end_s):
    """Events, and lines that are typed behind each other without a pause, at their times; the console afterwards."""
    typed = [{"t_s": t_s, "console": line} for t_s, *what in steps if len(what) == 1 for line in what[0].split("\n")]
    steps = typed + [{"t_s": t_s, "event": what[0], "args": list(what[1:])} for t_s, *what in steps if len(what) > 1]
    return simulate({"key": "console", "end_s": end_s, "preamble_s": 0.05, "step": sorted(steps, key=lambda s: s["t_s"]),
                     "expect_refusal": ".*"}, out_dir=tmp_path, plant="ideal", spread=0, aligned=True)


def test_a_fresh_image_has_the_parameters_of_the_default_motor_and_starts_with_them(tmp_path):
    said = play(tmp_path, (0.1, "get all"), (0.6, "on"), (1.1, "status"), end_s=1.2).console
    fresh = {name: int(value) for name, value in re.findall(r"(?m)^(\w+) = (-?\d+) ", said)}
    told = console_params(load_drive("teknic_m2310p"))
    assert {name: fresh[name] for name in told} == told
    assert "> on\nok\nphase margin of the current loop: " in said and "state: operation enabled" in said


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
