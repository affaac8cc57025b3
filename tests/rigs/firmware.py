# SPDX-License-Identifier: MIT
"""The firmware's rooms, and the models of the plant, as shared libraries of this machine, and the fuzzers made of them."""
import fcntl
import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERE = ROOT / "tests/unit"


def built(name, room="unit"):
    """The library or program of that name in that folder of tests, up to date; safe with several pytest workers."""
    wanted = Path(os.environ.get("BUILD", "build")) / "tests" / room / name
    target = ROOT / wanted
    target.parent.mkdir(parents=True, exist_ok=True)
    with open(target.parent / ".lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        result = subprocess.run(["make", "-s", "NO_INSTALL=1", str(wanted)], cwd=ROOT, capture_output=True, text=True)
        assert result.returncode == 0, result.stdout + result.stderr
    return target
