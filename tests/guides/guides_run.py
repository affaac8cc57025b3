# SPDX-License-Identifier: MIT
"""`make guides`: whatever the guides tell the reader to type, into the shell or at the drive. Minutes; one after the other, for
all of them write into the same build folder."""
import os
import re

import pytest

from guides.transcript import BLOCK, ROOT
from rigs.guide_pages import ELSEWHERE, GUIDES, lines, shell, stale


@pytest.fixture
def own_motor():
    """my.toml in the project's folder, as the guide has it: the smallest file of docs/motors.md."""
    text = re.search(r"```toml\n(.*?)```", (ROOT / "docs" / "motors.md").read_text(), re.DOTALL)[1]
    path = ROOT / "my.toml"
    path.write_text(text)
    yield
    path.unlink()


@pytest.mark.parametrize("line", [line for line in lines() if line not in ELSEWHERE])
def test_a_command_works(line, own_motor):
    build = os.environ.get("BUILD", "build")
    if line.startswith("make "):
        line = f"{line} BUILD={build}"
    else:
        assert line.startswith("build/"), f"{line}: neither a command of make nor a program that it builds"
        line = build + line.removeprefix("build")
    result = shell(line, ROOT)
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize("guide", [guide for guide in GUIDES if BLOCK.search(guide.read_text())], ids=lambda guide: guide.stem)
def test_the_drive_says_what_the_guide_shows(guide, tmp_path):
    complaint = stale(guide, tmp_path)
    assert not complaint, complaint
