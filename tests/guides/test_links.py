# SPDX-License-Identifier: MIT
"""Pages: every link leads somewhere, every page is within two clicks of README, and README's blocks are up to date."""
import re

import pytest

from guides.transcript import ROOT
from tools import front

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
CLICKS = 2
FENCE = re.compile(r"^ *```.*?^ *```", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\]\(([^)\s]+)\)|(?:href|src)=\"([^\"]+)\"")


def name(path):
    return str(path.relative_to(ROOT))


def links(page):
    """(path, anchor) of what a page links to within the repository."""
    for pair in LINK.findall(FENCE.sub("", page.read_text())):
        target = pair[0] or pair[1]
        if "://" not in target:
            file, _, anchor = target.partition("#")
            yield ((page.parent / file).resolve() if file else page), anchor


def anchors(page):
    """The names of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)", FENCE.sub("", page.read_text()), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def distances(pages_links, start):
    """{page: clicks from the start}, of those that can be reached."""
    far, edge = {start: 0}, [start]
    while edge:
        page = edge.pop(0)
        for target in pages_links.get(page, ()):
            if target not in far:
                far[target] = far[page] + 1
                edge.append(target)
    return far


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_link_leads_somewhere(page):
    for target, anchor in links(page):
        assert target.exists(), f"{name(page)}: no {target}"
        if anchor and target.suffix == ".md":
            assert anchor in anchors(target), f"{name(page)}: {name(target)} has no heading #{anchor}"


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
