# SPDX-License-Identifier: MIT
"""Another PWM rate, dead time or clock works, or does not compile and says why."""
import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bench.report import baseline
from launcher import simulate
from launcher.load import CURRENT_LOOP, load_irqlog
from rates.builds import OWN_HZ, RATES_HZ, build_of, make, overrides
from target.runner import CLOSING, run_image

FIGURES = baseline()
RPM = 1200
PLAN = {"key": "rates", "end_s": "load + 0.25", "preamble_s": 0.05, "step": [
    {"t_s": 0.1, "label": "on", "console": "on"},
    {"t_s": "on + on_time_s", "label": "started", "hold_for": "OPERATION_ENABLED"},
    {"t_s": "started + 0.05", "console": f"speed {RPM}"},
    {"t_s": "started + 0.5", "label": "load", "event": "load_nm", "args": ["0.5 * rated_torque_Nm"]}]}


@pytest.fixture(scope="module", params=RATES_HZ)
def run(request, tmp_path_factory):
    build = build_of(request.param, "mssfoc.elf", "mssfoc.hex")
    out = tmp_path_factory.mktemp(f"at{request.param}")
    return request.param, simulate(PLAN, out_dir=out, build=build, plant="ideal", spread=0,
                                   aligned=True, overrides=overrides(request.param)), load_irqlog(out / "irq.bin")


def test_the_loops_run_in_step(run):
    hz, result, log = run
    assert np.median(np.diff(result.trace["t_s"])) == pytest.approx(1 / hz, rel=1e-6)
    assert (log["exception"] == CURRENT_LOOP).sum() == pytest.approx(result.scenario.end_s * hz, rel=0.002)
    assert not result.trace["fault"].any()


def test_speed_and_current_are_to_scale(run):
    """Of the plant, not of what the firmware says; and the load is carried by as much current as it takes."""
    _, result, _ = run
    load_s = result.scenario.names["load"]
    unloaded, loaded = result.trace.between(load_s - 0.05, load_s), result.trace.between(load_s + 0.15, load_s + 0.25)
    for part in (unloaded, loaded):
        assert part["speed_rad_s"].mean() == pytest.approx(RPM * 2 * np.pi / 60, rel=0.003)
        assert abs(part["i_d_A"]).mean() < 0.02 * result.drive.params["i_max_ma"] / 1000
    torque = result.drive.names()["torque_per_ampere"] * (loaded["i_q_A"].mean() - unloaded["i_q_A"].mean())
    assert torque == pytest.approx(0.5 * result.drive.names()["rated_torque_Nm"], rel=0.03)


def test_the_interrupt_takes_as_long_as_at_any_rate(run):
    """Nothing but immediates differs. Where the ripple widens the knee of the dead time, the compiler's handler serves."""
    hz, result, log = run
    operating = (log["exception"] == CURRENT_LOOP) & (log["chained"] == 0) & (log["t_s"] > result.scenario.names["load"])
    like_hz = 20000 if hz >= 16000 else 8000
    assert set(log["cycles"][operating]) == {FIGURES[f"rate.{like_hz}"]["cycles_max"]}


@pytest.mark.parametrize("hz", [hz for hz in RATES_HZ if hz != OWN_HZ])
def test_assembly_equals_c(hz, tmp_path):
    build = build_of(hz, "tests/target/test_current_loop.elf")
    text = run_image(build / "tests" / "target" / "test_current_loop.elf", tmp_path, wall_s=300)
    assert "FAIL" not in text and int(CLOSING.search(text).group(2)) == 0


@pytest.mark.parametrize("choices, reason", [
    ({"PWM_HZ": 25000}, "CONFIG_PWM_HZ must be a multiple of 16"),
    ({"PWM_HZ": 16500}, "CONFIG_PWM_HZ must be a multiple of CONFIG_SLOW_HZ"),
    ({"PWM_HZ": 32000}, "half a PWM period must be a whole number of the fabric's counts"),
    ({"PWM_HZ": 4000}, "tested from 8000 to 40000"),
    ({"PWM_HZ": 50000}, "tested from 8000 to 40000"),
    ({"DEAD_TIME_NS": 2600}, "dead time: 10 to 2550 ns"),
    ({"DEAD_TIME_NS": 0}, "dead time: 10 to 2550 ns"),
    ({"PWM_HZ": 40000, "DEAD_TIME_NS": 2000}, "dead time too long for the PWM period"),
])
def test_what_cannot_work_does_not_compile(choices, reason, tmp_path):
    done = make(tmp_path, "arm/firmware/control/current_loop.o", **choices)
    assert done.returncode != 0 and reason in done.stderr.replace("\\'", "'")


def compiled(source, *options, root="."):
    """Whether the target's compiler takes a source, and what it says."""
    done = subprocess.run([os.environ.get("CROSS", "arm-none-eabi-") + "gcc", "-mcpu=cortex-m3", "-mthumb", "-std=c11",
                           "-fsyntax-only", f"-I{root}", *options, str(source)], capture_output=True, text=True, check=False)
    return done.returncode == 0, done.stderr


def test_a_board_with_another_clock_does_not_compile_until_the_assembly_knows(tmp_path):
    for folder in ("drivers", "firmware", "lib"):
        shutil.copytree(folder, tmp_path / folder)
    board, offsets = tmp_path / "drivers" / "board.h", tmp_path / "drivers" / "fabric" / "offsets.h"
    source = tmp_path / "drivers" / "fabric" / "offsets.c"
    board.write_text(re.sub(r"(?<=BOARD_FABRIC_HZ)( +)100000000u", r"\g<1>80000000u", board.read_text()))
    good, said = compiled(source, root=tmp_path)
    assert not good and "another clock" in said
    offsets.write_text(re.sub(r"(?<=FABRIC_HZ)( +)100000000", r"\g<1>80000000", offsets.read_text()))
    assert compiled(source, root=tmp_path) == (True, "")
    assert compiled(tmp_path / "firmware" / "control" / "current_loop.c", root=tmp_path) == (True, "")


@pytest.mark.parametrize("ns, counts", [(990, 99), (995, 100), (1000, 100), (1001, 101)])
def test_a_dead_time_between_two_counts_is_rounded_up(ns, counts, tmp_path):
    source = tmp_path / "dead.c"
    source.write_text('#include "firmware/settings/config.h"\n'
                      f'_Static_assert(CONFIG_DEAD_COUNTS == {counts}, "rounded up");\n')
    assert compiled(source, f"-DCONFIG_DEAD_TIME_NS={ns}") == (True, "")


@pytest.mark.parametrize("settle_ns, dead_ns, counts", [(1200, 1000, 20), (1200, 300, 90), (1205, 300, 91), (600, 1000, 1)])
def test_of_a_shunts_settling_time_the_dead_time_has_gone_by(settle_ns, dead_ns, counts, tmp_path):
    source = tmp_path / "settle.c"
    source.write_text('#include "firmware/settings/config.h"\n'
                      f'_Static_assert(CONFIG_SETTLE_COUNTS == {counts}, "less the dead time");\n')
    assert compiled(source, f"-DCONFIG_DEAD_TIME_NS={dead_ns}", f"-DCONFIG_SETTLE_NS={settle_ns}") == (True, "")
