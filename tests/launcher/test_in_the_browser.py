# SPDX-License-Identifier: MIT
"""The scope's page, tested in one process each: their tests follow one another on one drive, which workers would tear apart."""
import subprocess
import sys

import pytest

from launcher.paths import REPO


@pytest.mark.parametrize("file", [f"page_{name}run.py" for name in ("axes_", "look_", "", "silent_", "tool_")])
def test_the_page(file):
    done = subprocess.run([sys.executable, "-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider", "-p", "no:xdist",
                           f"tests/launcher/{file}"], cwd=REPO, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    if " passed" not in done.stdout.splitlines()[-1]:
        pytest.skip(next((line for line in done.stdout.splitlines() if line.startswith("SKIPPED")), "no browser"))
