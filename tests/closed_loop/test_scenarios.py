# SPDX-License-Identifier: MIT
"""Every scenario of qemu/scenarios as `make run` plays it, on the default motor: all its verdicts hold, or the launcher says
what is beyond that motor. Limits and reasons stand in the scenarios. All motors: tests/budgets/test_quality.py, the campaign.
"""
import pytest
from launcher import LauncherError, simulate
from launcher.data import available
from launcher.paths import SCENARIOS

from rigs.verdicts import verdicts

EXACT = {"plant": "ideal", "spread": 0, "aligned": True}
REFUSED = {"overmodulation": "no overmodulation: low-side shunts, .* do not see a phase that stays high"}
SWEEP, STANDS_DEG = "current_sweep", 60  # which turns the rotor by 30 degrees: then no phase is near zero


@pytest.mark.parametrize("name", available(SCENARIOS))
def test_scenario(name, tmp_path):
    if name in REFUSED:
        with pytest.raises(LauncherError, match=REFUSED[name]):
            simulate(name, out_dir=tmp_path)
        return
    assert not verdicts(simulate(name, out_dir=tmp_path))


def test_the_swept_loop_is_the_one_that_was_designed(tmp_path):
    """Crossover where current_bw_hz says; with 1.5 periods of delay its margin is 90 - 360 * 1000 Hz * 75 us = 63 degrees."""
    result = simulate(SWEEP, out_dir=tmp_path, start_angle=STANDS_DEG, **EXACT)
    for axis in "qd":
        assert result.figures[f"phase margin of i_{axis}"].value == pytest.approx(63, abs=2)
        assert result.figures[f"bandwidth of i_{axis}, -90 degrees"].value == pytest.approx(1570, rel=0.03)


def test_a_refused_command_fails_the_run_and_is_named(tmp_path):
    steps = [{"t_s": 0.15, "console": "set v_min_mv 30000"}, {"t_s": 0.2, "console": "on"}]
    result = simulate({"end_s": 0.3, "preamble_s": 0.05, "step": steps}, out_dir=tmp_path, **EXACT)
    assert not result.passed
    assert result.figures["refused by the drive"].value.startswith("'on' at 0.200 s: the bus voltage is below v_min_mv")


def test_one_seed_one_trace_another_seed_another(tmp_path):
    short = {"key": "short", "end_s": 1.0, "preamble_s": 0.05, "step": [{"t_s": 0.15, "console": "on"}]}
    traces = []
    for name, seed in (("a", 7), ("b", 7), ("c", 8)):
        simulate(short, seed=seed, out_dir=tmp_path / name)
        traces.append((tmp_path / name / "trace.bin").read_bytes())
    assert traces[0] == traces[1]
    assert traces[0] != traces[2]
