# SPDX-License-Identifier: MIT
"""The plant against motulator, where PyPI can be had; and that a machine which is not the same is found out."""
from pathlib import Path

import pytest

from launcher import motulator_check
from launcher.motulator_check import (VERSION, Difference, check_motulator, config_of, differences, environment, machine_of,
                                      machines)


@pytest.mark.parametrize("motor", machines(), ids=lambda name: Path(name).stem)
def test_the_plant_is_the_one_that_motulator_has(motor):
    python, why = environment()
    if python is None:
        pytest.skip(why)
    for difference in differences(motor, python):
        assert difference.within, difference


def test_another_machine_is_found_out(monkeypatch):
    python, why = environment()
    if python is None:
        pytest.skip(why)
    monkeypatch.setattr(motulator_check, "config_of",
                        lambda machine: config_of({**machine, "resistance_ohm": 1.02 * machine["resistance_ohm"]}))
    assert not all(difference.within for difference in differences("thor_pmsyrm", python))


def test_without_motulator_one_line_says_so(monkeypatch, tmp_path):
    monkeypatch.setattr(motulator_check.sys, "executable", "/bin/false")
    lines = []
    assert check_motulator(tmp_path, lines.append) == 0
    assert len(lines) == 1 and f"motulator {VERSION} is left out" in lines[0]


def test_what_is_compared(monkeypatch):
    monkeypatch.setattr(motulator_check, "environment", lambda build: ("python", ""))
    monkeypatch.setattr(motulator_check, "differences", lambda *_: [Difference("current", 1e-4, 2e-3, 1e-3)])
    lines = []
    assert check_motulator("build", lines.append) == len(machines())
    assert sum("FAIL" in line for line in lines) == len(machines())
    machine = machine_of("thor_pmsyrm")
    assert machine["saturation"]["a_dq"] > 0
    assert f"load.stiffness_nm_rad {machine['shaft']['stiffness_nm_rad']:.17g}" in config_of(machine)
