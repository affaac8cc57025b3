# SPDX-License-Identifier: MIT
"""The scope's page, tested in one process each: their tests follow one another on one drive, which workers would tear apart."""
import subprocess
import sys

import pytest

from launcher.paths import REPO


@pytest.mark.parametrize("file", (
    pytest.param("page_look_run.py", marks=pytest.mark.long), pytest.param("page_run.py", marks=pytest.mark.rest),
    "page_silent_run.py", pytest.param("page_tool_run.py", marks=pytest.mark.rest)))
def test_the_page(file, request):
    sample = [option for option in ("--sample", "--most") if request.config.getoption(option)]
    done = subprocess.run([sys.executable, "-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider", "-p", "no:xdist", *sample,
                           f"tests/launcher/{file}"], cwd=REPO, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    if " passed" not in done.stdout.splitlines()[-1]:
        pytest.skip(next((line for line in done.stdout.splitlines() if line.startswith("SKIPPED")), "no browser"))
