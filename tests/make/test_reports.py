# SPDX-License-Identifier: MIT
"""The reports that no other test asks for by their command: each is made, and says what it is for."""
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("target, said", (
    ("size", "Clarke_Lib_Do"), ("stack", "high-water mark: "), ("wcet", "whole interrupt, a sample that trips"),
    ("jitter", "working speed, rated load"), ("eds", "written: "), ("client", "written: "),
    ("libero BOARD=creative", "creative")))
def test_a_report_is_made(target, said):
    result = subprocess.run(["make", "-s", *target.split(), "NO_INSTALL=1"], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0 and said in result.stdout, result.stderr
