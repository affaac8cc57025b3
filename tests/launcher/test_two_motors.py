# SPDX-License-Identifier: MIT
"""Two motors on one image, with a program that plays QEMU: who gets what, whose a line of the console is, what is refused."""
import json
import re

import numpy as np
import pytest
from launcher import LauncherError, simulate
from launcher.load import COLUMNS, cpu_load, load_lines, load_values
from launcher.probes import Symbols
from launcher.transcript import of_axis

from rigs.run_py import run

FIRST, SECOND = "teknic_m2310p", "maxon_ec22"
CURRENT = {"name": "current", "kind": "maximum", "column": "abs(i_a_A)", "min": 1.99, "max": 2.01}
PLAN = {"key": "one", "title": "a test", "end_s": 0.1, "preamble_s": 0.01, "figure": [CURRENT],
        "step": [{"t_s": 0.02, "console": "on"}, {"t_s": 0.05, "event": "load_nm", "args": ["rated_torque_Nm"]}]}
OTHER = {**PLAN, "key": "two", "end_s": 0.08, "step": [{"t_s": 0.03, "console": "speed 500"}, PLAN["step"][1]]}
TOML = """
title = "a test"
end_s = 0.1
preamble_s = 0.01

[[figure]]
name = "speed"
kind = "maximum"
column = "speed_rad_s"
max = {limit}
"""


def both(build, qemu, plan=PLAN, other=OTHER, **more):
    return simulate(plan, FIRST, build=build, qemu=qemu, second={"motor": SECOND, "scenario": other}, **more)


@pytest.fixture
def config(build_of_two, fake_qemu):
    """The twin's configuration of such a run: the lines of axis 1 and of the device, and those of axis 2."""
    both(build_of_two, fake_qemu(), csv=True)
    lines = (build_of_two / "run" / "twin.cfg").read_text().splitlines()
    return lines[:lines.index("axis 2")], lines[lines.index("axis 2"):]


def test_each_axis_has_its_own_plant_files_and_events(config, build_of_two, elf_of_two):
    first, second = config
    out, symbols = (build_of_two / "run").resolve(), Symbols(elf_of_two)
    for lines, folder, pole_pairs, axis, torque in ((first, out, 4, 0, 0.2724), (second, out / "axis2", 1, 1, 0.0207)):
        assert f"trace {folder / 'trace.bin'}" in lines and f"csv {folder / 'trace.csv'}" in lines
        assert f"motor.pole_pairs {pole_pairs}" in lines and f"event 0.05 load_nm {torque:g}" in lines
        assert f"probe state 0x{symbols.of_axis(axis).address('axes[0].state'):08x} u32 1" in lines
    assert symbols.of_axis(1).address("axes[0].state") == symbols.address("axes[1].state") > symbols.address("axes[0].state")
    assert not [line for line in second if line.split()[0] in ("seed", "console", "end", "progress", "irqlog", "chip")]


def test_lines_for_the_second_say_so(config):
    first, second = config
    assert "event 0.02 console on" in first and "event 0.01 console set pole_pairs 4" in first
    assert "event 0.03 console axis 2 speed 500" in second and "event 0.01 console axis 2 set pole_pairs 1" in second
    assert not [line for line in first if "axis 2" in line]
    assert not [line for line in second if " console " in line and " console axis 2 " not in line]


def test_the_run_goes_on_until_both_are_done(config):
    first, second = config
    assert "end 0.1" in first and "event 0.1 end" in first and "event 0.08 end" in second


def test_two_motors_of_a_kind_differ(build_of_two, fake_qemu):
    result = simulate(PLAN, FIRST, build=build_of_two, qemu=fake_qemu(), second={"motor": FIRST, "scenario": PLAN})
    first, second = ((build_of_two / "run" / "twin.cfg").read_text()).split("axis 2\n")
    resistances = [re.search("motor.resistance_ohm .*", part)[0] for part in (first, second)]
    assert resistances[0] != resistances[1]
    beside_another = both(build_of_two, fake_qemu())
    assert beside_another.drive.seed == result.drive.seed == 1
    assert resistances[0] in (build_of_two / "run" / "twin.cfg").read_text(), "the first does not depend on who is second"


def test_each_has_a_result_of_its_own(build_of_two, fake_qemu):
    result = both(build_of_two, fake_qemu())
    second = result.second
    assert result.passed and second.passed and second.second is None
    assert result.trace["speed_rad_s"][0] == 100 and second.trace["speed_rad_s"][0] == 50
    assert result.trace["t_s"][-1] > 0.0999 and second.trace["t_s"][-1] == pytest.approx(0.08)
    assert second.drive.motor.key == SECOND and second.scenario.key == "two" and second.out_dir == result.out_dir / "axis2"
    assert "> on\nok" in result.console and "> speed 500" not in result.console
    assert "> speed 500\nok" in second.console and "> on\n" not in second.console and "> set pole_pairs 1\nok" in second.console


def test_what_one_is_refused_is_not_the_other_s(build_of_two, fake_qemu):
    result = both(build_of_two, fake_qemu("refuses axis 2 speed 500"))
    assert result.passed and not result.second.passed
    assert result.second.figures["refused by the drive"].value == "'speed 500' at 0.030 s: it does not want to"
    result = both(build_of_two, fake_qemu("refuses on"))
    assert result.second.passed and result.figures["refused by the drive"].value == "'on' at 0.020 s: it does not want to"


def test_on_the_command_line(build_of_two, fake_qemu, tmp_path):
    good, bad = tmp_path / "good.toml", tmp_path / "bad.toml"
    good.write_text(TOML.format(limit=101))
    bad.write_text(TOML.format(limit=40))
    out = build_of_two / "run"
    answer = run(build_of_two, "run", "--picture", QEMU=fake_qemu(), MOTOR=f"{FIRST} {SECOND}", SCENARIO=str(good))
    assert answer.returncode == 0, answer.stderr
    assert "axis 1: a test" in answer.stdout and "axis 2: a test" in answer.stdout
    assert answer.stdout.count("CPU load at 20 kHz") == answer.stdout.count("    of axis 2  ") == 1
    for folder, speed in ((out, 100), (out / "axis2", 50)):
        report = json.loads((folder / "report.json").read_text())
        assert report["figures"][0]["value"] == speed and report["cpu_load"]["second_loop"]["count"] > 1000
        assert (folder / "run.png").read_bytes().startswith(b"\x89PNG") and not (folder / "trace.bin").exists()
    for scenarios in (f"{good} {bad}", f"{bad} {good}"):
        answer = run(build_of_two, "run", QEMU=fake_qemu(), MOTOR=f"{FIRST} {SECOND}", SCENARIO=scenarios)
        assert answer.returncode == 1 and "1 of 2 limits failed: speed" in answer.stdout


def test_nothing_old_of_a_second_motor_is_left(build, fake_qemu):
    old = build / "run" / "axis2" / "report.json"
    old.parent.mkdir(parents=True)
    old.write_text("{}")
    simulate(PLAN, FIRST, build=build, qemu=fake_qemu())
    assert not old.exists()


@pytest.mark.parametrize("two, environment, complaint", [
    (False, {"MOTOR": "teknic_m2310p maxon_ec22"}, "drives one motor, but two are named: make AXES=2"),
    (True, {"MOTOR": "teknic_m2310p"}, "drives two motors, but one is named: MOTOR=\"a b\""),
    (True, {"MOTOR": "teknic_m2310p none"}, "no motor 'none'"),
    (True, {"MOTOR": "a b c"}, "MOTOR names 3, but the image drives two motors at most"),
    (True, {"MOTOR": "teknic_m2310p", "SCENARIO": "idle idle"}, "SCENARIO names two, MOTOR one"),
    (True, {"MOTOR": "teknic_m2310p maxon_ec22", "FABRIC": "rtl"}, "FABRIC=rtl has one axis only"),
])
def test_mistakes_get_one_line(build, build_of_two, fake_qemu, two, environment, complaint):
    answer = run(build_of_two if two else build, "run", QEMU=fake_qemu(), **environment)
    lines = answer.stderr.strip().splitlines()
    assert answer.returncode == 2 and len(lines) == 1 and complaint in lines[0], answer.stderr


@pytest.mark.parametrize("command", ["console", "scope", "debug"])
def test_only_a_run_a_console_and_the_page_play_two(build_of_two, fake_qemu, command):
    for motor, complaint in ((f"{FIRST} {SECOND}", "names two, which make run, console and scope play alone"),
                             (FIRST, "drives two motors, but one is named"))[command != "debug":]:
        answer = run(build_of_two, command, *(["--no-browser"] if command == "scope" else []), QEMU=fake_qemu(), MOTOR=motor)
        lines = answer.stderr.strip().splitlines()
        assert answer.returncode == 2 and len(lines) == 1 and complaint in lines[0], answer.stderr


def test_there_is_one_watchdog(build_of_two, fake_qemu):
    both(build_of_two, fake_qemu(), other={**OTHER, "watchdog_s": 0.1})
    assert "watchdog 78125" in (build_of_two / "run" / "twin.cfg").read_text().splitlines()
    with pytest.raises(LauncherError, match="one watchdog, but the scenarios want 0.1 and 0.2 s"):
        both(build_of_two, fake_qemu(), {**PLAN, "watchdog_s": 0.1}, {**OTHER, "watchdog_s": 0.2})


CONSOLE = """
mssfoc 0.1.0, 'help' lists the commands
axis 1: settings: none
axis 2: settings: stored
> on
ok
> axis 2 on
ok
> \nfault: axis 1: over-current; see 'fault', then 'clear'
> axis 2 get ld_uh
ld_uh 7
done: axis 2: operation enabled
> axis 2
ok
> off
ok
> axis 1 off
ok
> axis axis
error: no
"""


def test_whose_a_line_is():
    first, second = of_axis(CONSOLE, 0), of_axis(CONSOLE, 1)
    assert first.split("\n")[1:] == [
        "mssfoc 0.1.0, 'help' lists the commands", "settings: none", "> on", "ok", "> ",
        "fault: over-current; see 'fault', then 'clear'", "> off", "ok"]
    assert second.split("\n")[1:] == [
        "mssfoc 0.1.0, 'help' lists the commands", "settings: stored", "> on", "ok", "> get ld_uh", "ld_uh 7",
        "done: operation enabled", "> axis 2", "ok", "> off", "ok", "> axis axis", "error: no", ""]


def test_the_load_of_both():
    rows = [(n * 50e-6 + k * 12e-6, 50 + k, 300 + 10 * k, 200 + k) for n in range(101) for k in range(2)]
    log = {name: np.zeros(len(rows)) for name in COLUMNS}
    for index, name in enumerate(("t_s", "exception", "cycles", "latency_cycles")):
        log[name] = np.array([row[index] for row in rows], float)
    load = cpu_load(log, 50e-6)
    assert (load.current_loop.percent, load.second_loop.percent) == (pytest.approx(6), pytest.approx(6.2))
    assert load.other_interrupts.count == 0 and load.rest_percent == pytest.approx(100 - 12.2)
    assert load.latency_max_cycles == 201 and load.highest_pwm_hz == pytest.approx(100e6 / (2 * 610))
    assert any(line.split()[:3] == ["of", "axis", "2"] for line in load_lines(load))
    assert load_values(load)["second_loop"]["max_cycles"] == 310
