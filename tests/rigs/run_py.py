# SPDX-License-Identifier: MIT
"""qemu/run.py as a user calls it."""
import os
import subprocess
import sys

from launcher.paths import REPO

VARIABLES = ("MOTOR", "SCENARIO", "SEED", "PLANT", "SPREAD", "DETUNE", "QEMU", "BUILD", "START")


def run(build, *arguments, **environment):
    """The command line as a user gives it; PATH without surprises from his environment."""
    clean = {key: value for key, value in os.environ.items() if key not in VARIABLES}
    return subprocess.run([sys.executable, str(REPO / "qemu" / "run.py"), *arguments], capture_output=True, text=True,
                          env={**clean, "BUILD": str(build), **environment}, cwd=REPO, check=False)
