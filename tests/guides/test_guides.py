# SPDX-License-Identifier: MIT
"""Guides name what there is, and show what the drive says; `make guides` runs all that they tell the reader to type."""
import re

import pytest

from guides.transcript import ROOT, same, sessions
from rigs.guide_pages import ELSEWHERE, GUIDES, lines, shell, stale
from rows import faults, refusals


@pytest.mark.parametrize("line", sorted(ELSEWHERE & set(lines())))
def test_make_knows_a_command_that_is_run_elsewhere(line):
    assert shell(line.replace("make", "make -n", 1), ROOT).returncode == 0


def test_no_exception_is_stale():
    assert ELSEWHERE <= set(lines())


def test_the_drive_says_what_a_guide_shows(tmp_path):
    """The others: guides_run.py."""
    assert not stale(ROOT / "docs/guides/trouble.md", tmp_path)


def test_what_differs_in_numbers_only_is_the_same():
    assert same("up: 4.799 s", "up: 5.1 s") and same("d -0.014 A", "d 0.2 A")
    assert not same("> speed 100", "> speed 200") and not same("ok", "error: no") and not same("ok", "> ok")


def test_a_session_names_what_it_can_be():
    (one,) = sessions("<!-- drive thor_pmsyrm bare -->\n```text\n> on\n(2 s later)\n```\n"
                       "<!-- the same drive -->\n```text\n> off\n```\n")
    assert (one.motor, one.bare, one.blocks) == ("thor_pmsyrm", True, [["> on", "(2 s later)"], ["> off"]])
    with pytest.raises(ValueError, match="not fast"):
        sessions("<!-- drive thor_pmsyrm fast -->\n```text\n```\n")


@pytest.mark.parametrize("guide", GUIDES, ids=lambda guide: guide.stem)
def test_what_a_guide_names_is_there(guide):
    text = guide.read_text()
    for path in re.findall(r"`((?:firmware|drivers|lib|tests|qemu|linker|startup|docs)/[\w./]*)`", text):
        assert (ROOT / path).exists(), path
    for link in re.findall(r"\]\(([^)#]+)", text):
        assert (guide.parent / link).resolve().exists(), link


def test_the_symptoms_name_faults_that_exist():
    names = {row.text for row in faults().values()} | {re.sub("^&", "...", row.text) for row in refusals().values()}
    said = (ROOT / "firmware/operate/commands_drive.c").read_text()
    known = names | {"on", "characters were lost"} | {f"warning: {name}" for name in names}
    for row in re.findall(r"^\| (`[^|]*?) \|", (ROOT / "docs/guides/trouble.md").read_text(), re.MULTILINE):
        for name in re.findall(r"`([^`]+)`", row):
            assert name in known or name.endswith(" ...") and name.removesuffix("...") in said, name
