# SPDX-License-Identifier: MIT
"""`make mutants` on the project itself: one mutant, from the command to the verdict. test_mutants.py plays the engine on one
of four lines, which has neither this Makefile nor this ladder."""
import json
import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FILE = "firmware/control/notch.c"


def test_a_mutant_of_the_drive_is_built_and_judged(tmp_path):
    """By the shortest rung: who notices it is not asked here."""
    command = ["make", "mutants", "N=1", "JOBS=1", "RUNGS=image", f"FILES={FILE}", f"BUILD={tmp_path}", "NO_INSTALL=1"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    verdict = re.search(rf"^ +1 (noticed|survived) {FILE}:\d+ ", done.stdout, re.MULTILINE)
    assert verdict, done.stdout + done.stderr
    rows = json.loads((tmp_path / "mutants/result.json").read_text())["rows"]
    (judged,) = rows
    assert judged["outcome"] == verdict[1] and judged["rungs"] == ["image"], judged
    assert judged["how"] in ("passed", "failed") and judged["build_s"] > 0 and judged["tests_s"] > 0, judged
    assert re.search(r"^firmware/control +1 ", done.stdout, re.MULTILINE), "the share of each room"
