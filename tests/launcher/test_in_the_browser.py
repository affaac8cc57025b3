# SPDX-License-Identifier: MIT
"""The scope's page, tested in one process each: their tests follow one another on one drive, which workers would tear apart."""
import subprocess
import sys

import pytest

from launcher.paths import REPO


FILES = [f"page_{name}run.py" for name in ("axes_", "keys_", "load_", "look_", "", "silent_", "tool_")]


@pytest.mark.parametrize("file", FILES)
def test_the_page(file):
    done = subprocess.run([sys.executable, "-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider", "-p", "no:xdist",
                           f"tests/launcher/{file}"], cwd=REPO, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    if " passed" not in done.stdout.splitlines()[-1]:
        pytest.skip(next((line for line in done.stdout.splitlines() if line.startswith("SKIPPED")), "no browser"))


def test_the_pictures_of_the_page_move_and_are_small():
    """`make pictures` has made them: what README shows moves, and has at most 2 MB."""
    from PIL import Image  # matplotlib's

    moving = REPO / "docs/scope.gif"
    assert "docs/scope.gif" in (REPO / "README.md").read_text(encoding="utf-8")
    with Image.open(moving) as shown, Image.open(REPO / "docs/scope.png") as still:
        assert shown.n_frames > 20 and shown.width > shown.height and still.width > still.height
    assert all(path.stat().st_size < 2_000_000 for path in (moving, REPO / "docs/scope.png", REPO / "docs/scope-phone.png"))
