# SPDX-License-Identifier: MIT
"""The whole path with a program that plays QEMU, and every way it can go wrong: one clear line and a status that is not 0."""
import io
import json
import os
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from launcher import LauncherError, simulate
from launcher.cli import main
from launcher.qemu import ProgressLine, Qemu

from rigs.run_py import VARIABLES, run

SCENARIO = {"key": "test", "title": "a test", "end_s": 0.1, "preamble_s": 0.01,
            "step": [{"t_s": 0.02, "console": "on"}, {"t_s": 0.05, "event": "load_nm", "args": ["rated_torque_Nm"]}],
            "figure": [{"name": "current", "kind": "maximum", "column": "abs(i_a_A)", "min": 1.99, "max": 2.01},
                       {"name": "speed", "kind": "speed_error", "from_s": 0.05, "to_s": 0.1, "reference_rpm": 900}]}
TOML = """
title = "a test"
end_s = 0.1
preamble_s = 0.01

[[figure]]
name = "current"
kind = "maximum"
column = "abs(i_a_A)"
max = {limit}
"""


def test_simulate(build, fake_qemu):
    result = simulate(SCENARIO, build=build, qemu=fake_qemu())
    assert result.passed and result.figures["current"].value == pytest.approx(2.0, abs=1e-3)
    assert result.figures["speed, mean"].value == pytest.approx(100 * (100 * 30 / np.pi / 900 - 1), abs=0.01)
    assert result.figures["speed, mean"].passed is None
    # sin(theta) in phase a is -90 degrees from the d axis at theta: all of it is q current
    np.testing.assert_allclose(result.trace["i_q_true_A"], 2.0, atol=1e-4)
    np.testing.assert_allclose(result.trace["i_d_true_A"], 0.0, atol=1e-4)
    assert "> set pole_pairs 4\nok\n" in result.console and "> on\nok" in result.console
    config = (build / "run" / "twin.cfg").read_text().splitlines()
    assert "seed 1" in config and "event 0.05 load_nm 0.2724" in config and "motor.pole_pairs 4" in config


def test_a_figure_out_of_its_limit_fails(build, fake_qemu):
    worse = dict(SCENARIO, figure=[dict(SCENARIO["figure"][0], min=3)])
    assert not simulate(worse, build=build, qemu=fake_qemu()).passed


def test_what_cannot_be_measured_fails(build, fake_qemu):
    figure = {"name": "off", "kind": "bridge_off", "since": "vbus_V > 100", "max": 2}
    result = simulate(dict(SCENARIO, figure=[figure]), build=build, qemu=fake_qemu())
    assert result.figures["off"].value is None and not result.passed and "never holds" in result.figures["off"].note


@pytest.mark.parametrize("figure, complaint", [
    ({"name": "x", "kind": "none"}, "needs a name and a kind"),
    ({"kind": "distortion", "from_s": 0, "to_s": 1}, "needs a name and a kind"),
    ({"name": "x", "kind": "distortion", "from_s": 0}, "distortion needs 'to_s'"),
    ({"name": "x", "kind": "distortion", "from_s": 0, "to_s": 1, "most": 3}, "distortion does not take 'most'; there are: "),
    ({"name": "x", "kind": "distortoin", "from_s": 0, "to_s": 1}, "needs a name and a kind; did you mean distortion"),
    ({"name": "x", "kind": "distortion", "from_s": "zero", "to_s": 1}, "unknown name 'zero'"),
])
def test_figures_that_make_no_sense(build, fake_qemu, figure, complaint):
    with pytest.raises(LauncherError, match=complaint):
        simulate(dict(SCENARIO, figure=[figure]), build=build, qemu=fake_qemu())


@pytest.mark.parametrize("behaviour, complaint", [
    ("lockup", r"QEMU aborted \(status 134\)[^\n]*\n  \| qemu: fatal: Lockup"),
    ("bad config", r"QEMU ended with status 1\n  \| mssfoc twin: twin.cfg:3: unknown key"),
    ("short", "the run ended at 0.0"),
    ("no machine", "does not know the machine emcraft-sf2"),
])
def test_qemu_goes_wrong(build, fake_qemu, behaviour, complaint):
    with pytest.raises(LauncherError, match=complaint):
        simulate(SCENARIO, build=build, qemu=fake_qemu(behaviour))


def test_nothing_old_passes_for_a_result(build, fake_qemu):
    simulate(SCENARIO, build=build, qemu=fake_qemu())
    (build / "run" / "report.json").write_text("{}")
    with pytest.raises(LauncherError):
        simulate(SCENARIO, build=build, qemu=fake_qemu("lockup"))
    assert not (build / "run" / "trace.bin").exists() and not (build / "run" / "report.json").exists()


@pytest.mark.parametrize("missing", ["mssfoc.hex", "mssfoc.elf", "qemu/twin.so"])
def test_build_product_missing(build, fake_qemu, missing):
    (build / missing).unlink()
    with pytest.raises(LauncherError, match="is missing: run make first"):
        simulate(SCENARIO, build=build, qemu=fake_qemu())


def test_a_qemu_beside_the_installed_one_finds_its_own_files(tmp_path, fake_qemu, monkeypatch):
    monkeypatch.delenv("QEMU_MODULE_DIR", raising=False)
    (tmp_path / "usr" / "bin").mkdir(parents=True)
    (tmp_path / "usr" / "share" / "qemu").mkdir(parents=True)
    (tmp_path / "usr" / "lib" / "x86_64-linux-gnu" / "qemu").mkdir(parents=True)
    program = tmp_path / "usr" / "bin" / "qemu-system-arm"
    os.rename(fake_qemu(), program)
    qemu = Qemu(str(program))
    assert qemu.data_arguments() == ["-L", str(tmp_path / "usr" / "share" / "qemu")]
    assert qemu.environment()["QEMU_MODULE_DIR"] == str(tmp_path / "usr" / "lib" / "x86_64-linux-gnu" / "qemu")
    assert qemu.number == "9.9.9"


def test_a_program_is_asked_again_when_it_has_changed(fake_qemu):
    path = fake_qemu()
    assert Qemu(path).version == Qemu(path).version
    with open(path, "w", encoding="ascii") as program:
        program.write("#!/bin/sh\necho no emulator\n")
    with pytest.raises(LauncherError, match="is not a QEMU"):
        Qemu(path)


def test_command_line(build, fake_qemu, tmp_path):
    scenario = tmp_path / "good.toml"
    scenario.write_text(TOML.format(limit=3))
    answer = run(build, "run", "--picture", QEMU=fake_qemu(), SCENARIO=str(scenario), SEED="5")
    assert answer.returncode == 0, answer.stderr
    assert "PASS" in answer.stdout and "all 2 limits hold" in answer.stdout and "axis" not in answer.stdout.split("written")[0]
    report = json.loads((build / "run" / "report.json").read_text())
    assert report["passed"] and report["seed"] == 5 and report["figures"][0]["limits"] == {"max": 3.0}
    assert report["versions"]["qemu"].startswith("QEMU emulator") and "GNU C" in report["versions"]["compiler"]
    assert report["motor"]["values"]["electrical"]["pole_pairs"] == 4
    assert (build / "run" / "run.png").read_bytes().startswith(b"\x89PNG")
    scenario.write_text(TOML.format(limit=1))
    answer = run(build, "run", QEMU=fake_qemu(), SCENARIO=str(scenario))
    assert answer.returncode == 1 and "FAIL" in answer.stdout and "1 of 2 limits failed: current" in answer.stdout
    assert not (build / "run" / "run.png").exists(), "drawn on request only"


def test_what_the_drive_refuses_ends_the_run_with_that_line(build, fake_qemu, tmp_path):
    scenario = tmp_path / "refused.toml"
    scenario.write_text(TOML.format(limit=3) + '[[step]]\nt_s = 0.03\nconsole = "on"\n')
    answer = run(build, "run", QEMU=fake_qemu("refuses on"), SCENARIO=str(scenario))
    assert answer.returncode == 1
    assert answer.stderr.strip().splitlines()[-1] == "mssfoc: the drive refused 'on' at 0.030 s: it does not want to"
    report = json.loads((build / "run" / "report.json").read_text())
    assert not report["passed"] and report["figures"][-1]["value"] == "'on' at 0.030 s: it does not want to"


def test_a_scenario_beyond_the_motor_is_not_run(build, fake_qemu, tmp_path):
    scenario = tmp_path / "beyond.toml"
    scenario.write_text(TOML.format(limit=3) + '[[step]]\nt_s = 0.03\nconsole = "speed 9000"\n')
    answer = run(build, "run", QEMU=fake_qemu(), SCENARIO=str(scenario))
    assert answer.returncode == 2 and answer.stdout == ""
    assert answer.stderr.strip().endswith("is beyond Teknic M-2310P-LN-04K's speed_max_rpm: 4000 rpm")


@pytest.mark.parametrize("arguments, environment, complaint", [
    (["run"], {"MOTOR": "none"}, "no motor 'none'; there are: "),
    (["run"], {"SCENARIO": "none"}, "no scenario 'none'; there are: "),
    (["run"], {"MOTOR": "teknic"}, "; did you mean teknic_m2310p?"),
    (["run"], {"MOTOR": "Teknik_m2310p"}, "; did you mean teknic_m2310p?"),
    (["run"], {"MOTOR": "nope.toml"}, "; nope.toml is no file"),
    (["run"], {"MOTOR": "../motors/teknic_m2310p"}, "no motor '../motors/teknic_m2310p'"),
    (["run"], {"SCENARIO": "revesal"}, "; did you mean reversal_under_load?"),
    (["run"], {"START": "now"}, "no START 'now'; there are: found, aligned"),
    (["run"], {"PLANT": "full,-saturatoin"}, "; did you mean saturation?"),
    (["run"], {"QEMU": "no-such-qemu"}, "QEMU 'no-such-qemu' is not a program"),
    (["run"], {"QEMU": "/bin/ls"}, "'/bin/ls' is not a QEMU"),
    (["run"], {"SEED": "many"}, "SEED 'many' is not a whole number"),
    (["run"], {"SEED": "-1"}, "SEED -1 is outside"),
    (["scope", "--at", "99999"], {}, "port 99999 is outside 0..65535"),
    (["run"], {"BUILD": "/nonexistent"}, "is missing: run make first"),
    (["console"], {"MOTOR": "none"}, "no motor 'none'"),
    (["debug", "--port", "0"], {}, "port 0 is outside"),
    (["models", "--motor", "none"], {}, "is missing: run make twin first"),
    (["fly"], {}, "invalid choice: 'fly'"),
    ([], {}, "required: COMMAND"),
])
def test_mistakes_get_one_line(build, fake_qemu, monkeypatch, capsys, arguments, environment, complaint):
    lines = refused(monkeypatch, capsys, arguments, {"BUILD": str(build), "QEMU": fake_qemu(), **environment})
    assert len(lines) == 1 and lines[0].startswith("mssfoc: ") and complaint in lines[0], lines


def refused(monkeypatch, capsys, arguments, environment):
    """What the launcher says in this process."""
    for variable in VARIABLES:
        monkeypatch.delenv(variable, raising=False)
    for variable, text in environment.items():
        monkeypatch.setenv(variable, text)
    try:
        status = main(arguments)
    except SystemExit as end:
        status = end.code
    said = capsys.readouterr()
    assert (status, said.out) == (2, "")
    return said.err.splitlines()


# (how it is given, its least and its most, what is said beyond, what of another mistake once it is taken)
NUMBERS = [
    (["scope", "--at", "{}"], {"MOTOR": "none"}, 0, 65535, "port {} is outside 0..65535", "no motor"),
    (["debug", "--port", "{}"], {"MOTOR": "none"}, 1, 65535, "port {} is outside 1..65535", "no motor"),
    (["console"], {"CONSOLE": "tcp:{}", "MOTOR": "none"}, 1, 65535, "CONSOLE 'tcp:{}' is neither pty nor tcp:PORT", "no motor"),
    (["console"], {"CAN": "tcp:{}"}, 1, 65535, "CAN 'tcp:{}' is neither pty nor tcp:PORT, nor join:PORT", "canbus is missing"),
    (["run"], {"SEED": "{}", "MOTOR": "none"}, 0, 2**32 - 1, "SEED {} is outside 0..4294967295", "no motor"),
    (["run"], {"SPREAD": "{}", "SCENARIO": "none"}, 0, 10, "SPREAD {} is outside 0..10", "no scenario"),
    (["run"], {"MOTOR": "lot:{}", "SCENARIO": "none"}, 1, 10**6, "is not lot:N with N from 1 to 1000000", "no scenario"),
    (["run"], {"DETUNE": "flux_uwb={}", "SCENARIO": "none"}, -2**31, 2**31, "is beyond 32 bits", "no scenario"),
    (["campaign", "--motors", "lot:{}-1", "--scenarios", "none"], {}, 1, 1, "is not lot:A-B with 1 <= A <= B", "no scenario"),
    (["campaign", "--motors", "lot:1000000-{}", "--scenarios", "none"], {}, 10**6, 10**6, "is not lot:A-B", "no scenario"),
    (["campaign", "--seeds", "{}", "--motors", "none"], {}, 1, 10000, "SEEDS '{}' is not a whole number from 1", "no motor"),
    (["campaign", "--part", "lot", "--from", "{}", "--lots", "no"], {}, 1, 10**6, "FROM '{}' is not a whole number", "N 'no'"),
    ("campaign --part lot --from 1000000 --jobs no --lots {}".split(), {}, 1, 10000, "N '{}' is not a", "JOBS 'no'"),
    *(([*"campaign --part start --motors teknic_m2310p --what no --angles".split(), angles], {}, 0, 360,
       "ANGLES '{}' is not a number from 0 to 360", "WHAT 'no' is none") for angles in ("{}", "9 {}")),
]


@pytest.mark.parametrize("arguments, environment, least, most, beyond, behind", NUMBERS)
def test_numbers_have_bounds(build, fake_qemu, monkeypatch, capsys, arguments, environment, least, most, beyond, behind):
    for value, complaint in ((least - 1, beyond), (least, behind), (most, behind), (most + 1, beyond)):
        def given(text):
            return text.replace("{}", str(value))
        lines = refused(monkeypatch, capsys, [given(word) for word in arguments],
                        {"BUILD": str(build), "QEMU": fake_qemu(), **{key: given(text) for key, text in environment.items()}})
        assert len(lines) == 1 and given(complaint) in lines[0], lines


def test_a_full_disk_is_named(build, fake_qemu, monkeypatch):
    """QEMU's own words are lost then: its log is on the same disk."""
    monkeypatch.setattr("launcher.qemu.shutil.disk_usage", lambda _: SimpleNamespace(free=4096))
    with pytest.raises(LauncherError, match="the disk of .* is full: .* BUILD=path"):
        simulate(SCENARIO, build=build, qemu=fake_qemu("bad config"))


def test_list(build):
    answer = run(build, "list")
    assert answer.returncode == 0 and "teknic_m2310p" in answer.stdout and "fault_short" in answer.stdout


def test_a_live_drive_runs_no_faster_than_the_clock(tmp_path, capsys):
    """The program claims 1 s of simulated time in a tenth of that; it must be held back, and its status returned. What is to be
    read at the end of the typed parameters is said once."""
    import time
    from launcher.console import LEAD_S, _keep_pace
    hasty = ("import sys, time\nfor n in range(21):\n    open(sys.argv[1], 'w').write('t=%.3f s\\n' % (n * 0.05))\n"
             "    time.sleep(0.005)\nsys.exit(3)\n")
    progress = tmp_path / "progress"
    start = time.monotonic()
    process = subprocess.Popen([sys.executable, "-c", hasty, str(progress)])
    assert _keep_pace(process, progress, "try\nthis\n") == 3
    assert capsys.readouterr().out == "\r\ntry\r\nthis\r\n> "
    assert time.monotonic() - start > 1.0 - 2 * LEAD_S  # and not how much later: that is the host's load


def test_progress_is_told_once_a_quarter_where_nobody_looks():
    stream = io.StringIO()
    line = ProgressLine("run", stream)
    for now_s in np.arange(0.1, 4.05, 0.1):
        line(now_s, 4.0)
    assert [float(text.split()[1]) for text in stream.getvalue().splitlines()] == pytest.approx([1.0, 2.0, 3.0, 4.0], abs=0.11)


@pytest.mark.parametrize("live, said", [(False, "run: 1.20 of 1.00 s simulated\n"),
                                        (True, f"\rrun [{'#' * 30}] 1.20 of 1.00 s simulated ")])
def test_progress_past_the_planned_end(live, said):
    """A late start makes a run longer than planned."""
    stream = io.StringIO()
    stream.isatty = lambda: live
    line = ProgressLine("run", stream)
    line(1.2, 1.0)
    assert stream.getvalue() == said
    line.done()
    assert stream.getvalue() == said + ("\r\033[K" if live else "")
