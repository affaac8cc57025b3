# SPDX-License-Identifier: MIT
"""Every scenario of qemu/scenarios on the flashed image: all its verdicts must hold. Limits and reasons stand there."""
from pathlib import Path

import pytest

from launcher import simulate

SCENARIOS = sorted(path.stem for path in Path("qemu/scenarios").glob("*.toml"))
MOTORS = sorted(path.stem for path in Path("qemu/motors").glob("*.toml"))
ON_ALL_MOTORS = ("default", "current_step", "idle")


def verdicts(result):
    return [f"{f.name}: {f.value} {f.unit}, limit {f.limit_text}" for f in result.figures.values() if f.passed is False]


@pytest.mark.parametrize("name", [s for s in SCENARIOS if s not in ON_ALL_MOTORS])
def test_scenario(name, tmp_path):
    result = simulate(name, out_dir=tmp_path)
    assert any(figure.limited for figure in result.figures.values()), "a scenario without a limit proves nothing"
    assert not verdicts(result)


@pytest.mark.parametrize("name", ON_ALL_MOTORS)
@pytest.mark.parametrize("motor", MOTORS)
def test_on_every_motor(name, motor, tmp_path):
    assert not verdicts(simulate(name, motor=motor, out_dir=tmp_path))


def test_one_seed_one_trace_another_seed_another(tmp_path):
    short = {"key": "short", "end_s": 1.0, "preamble_s": 0.05, "step": [{"t_s": 0.15, "console": "on"}]}
    traces = []
    for name, seed in (("a", 7), ("b", 7), ("c", 8)):
        simulate(short, seed=seed, out_dir=tmp_path / name)
        traces.append((tmp_path / name / "trace.bin").read_bytes())
    assert traces[0] == traces[1]
    assert traces[0] != traces[2]
