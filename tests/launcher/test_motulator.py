# SPDX-License-Identifier: MIT
"""The plant against motulator, where PyPI can be had; and that a machine which is not the same is found out."""
import json
from pathlib import Path

import numpy as np
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


def test_a_difference_is_the_largest_of_either_sign_by_what_is_rated(monkeypatch):
    rated = machine_of("thor_pmsyrm")["rated"]
    theirs = np.array([[1.0, 2.0, 0.5, 100, -200, 300], [2.0, -1.0, 0.7, -50, 80, 310]])
    off = np.array([[-3.0, 4.0, -0.2, -1, 0, 0], [0.6, -0.8, 0.1, 0.5, -4, 6.2]])
    played = {"sequence": [[1e-3, 5, 0.25]], "samples": [[2, 0, *theirs[0]], [0, 0, *theirs[1]], [3, 0, *theirs[0]]]}
    rows = [[0, *(theirs + off)[1]], [0] * 7, [0, *(theirs + off)[0]]]  # it played no further
    told = []

    def run(command, text):
        told.append(text)
        return json.dumps(played) if command[0] == "python" else "\n".join(" ".join(map(str, row)) for row in rows)
    monkeypatch.setattr(motulator_check, "_run", run)
    found = {one.what: one for one in differences("thor_pmsyrm", "python")}
    assert json.loads(told[0])["pole_pairs"] == 2 and told[1] == f"{1e-3:.17g} 5 0.25\n"
    for what, share in (("current", np.array([5, 1]) / rated["current_a"]),
                        ("torque", np.array([0.2, 0.1]) / rated["torque_nm"]),
                        ("speed", np.array([0.01, 0.005])), ("speed of the load", np.array([0, 0.02])),
                        ("bus voltage", np.array([0, 0.02]))):
        assert found[what].largest == pytest.approx(share.max()), what
        assert found[what].rms == pytest.approx(np.sqrt(np.mean(share**2))), what
