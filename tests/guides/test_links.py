# SPDX-License-Identifier: MIT
"""Pages: every link leads somewhere, every page is within two clicks of README, and README's blocks are up to date."""
import re

import pytest

from guides.transcript import ROOT
from rigs.page_links import anchors, distances, links
from tools import front

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
CLICKS = 2


def name(path):
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_link_leads_somewhere(page):
    for target, anchor in links(page):
        assert target.exists(), f"{name(page)}: no {target}"
        if anchor and target.suffix == ".md":
            assert anchor in anchors(target), f"{name(page)}: {name(target)} has no heading #{anchor}"


def test_every_promise_names_tests_that_there_are():
    promises = re.findall(r"(?s)^- \*\*(.*?)\n(?=- |\n)", (ROOT / "docs/promises.md").read_text(), re.MULTILINE)
    assert len(promises) > 7
    for promise in promises:
        named = re.findall(r"`(tests/[\w/]+\.py)?(?:::(\w+))?`", promise)
        assert named and named[0][0], promise
        for file, function in named:
            text = (ROOT / file).read_text() if file else text
            assert f"\ndef {function}(" in text if function else "\ndef test_" in text, (file, function)


def test_every_page_is_two_clicks_from_readme():
    far = distances({page: [target for target, _ in links(page)] for page in PAGES}, ROOT / "README.md")
    lost = {name(page): far.get(page, "not at all") for page in PAGES if far.get(page, CLICKS + 1) > CLICKS}
    assert not lost


def test_a_page_too_far_is_found():
    """The walker itself: a chain of three, and a page that nobody names."""
    assert distances({"a": ["b"], "b": ["c", "a"], "c": ["d"]}, "a") == {"a": 0, "b": 1, "c": 2, "d": 3}


@pytest.mark.parametrize("block", ["figures", "limits"])
def test_readme_says_what_the_pages_and_the_sources_say(block):
    assert front.block("README.md", block) == front.blocks()[block], "stale: /usr/bin/python3 tests/tools/front.py"
