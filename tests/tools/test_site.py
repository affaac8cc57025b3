# SPDX-License-Identifier: MIT
"""`make site`: every page of the documents is there, every link leads to something, and the search knows the words."""
import json
import re
import shutil
from pathlib import Path

import pytest

from tools import site

ROOT = Path(__file__).resolve().parents[2]


def test_links_are_moved_to_where_things_are():
    wanted = set()
    text = site.page_text(ROOT / "docs/guides/adding.md", wanted)
    assert "](code.md)" in text and "](../source/" not in text.replace(".txt", "")
    assert all(target.is_file() for target in wanted)


def test_every_page_is_staged_once():
    names = [site.staged(path) for path in site.pages()]
    assert len(set(names)) == len(names) > 40 and {"README.md", "about.md", "guides/softconsole.md"} <= set(names)


def test_the_index_is_the_navigation():
    sections = site.navigation()
    listed = [page for section in sections[2:] for entry in next(iter(section.values())) for page in entry.values()]
    assert len(sections) == 6 and {"reference.md", "console.md", "guides/first-run.md", "changelog.md"} <= set(listed)


@pytest.mark.skipif(not shutil.which("mkdocs"), reason="the site was not built: no mkdocs")
def test_the_site_has_no_dead_link_and_a_search(tmp_path):
    site.main(str(tmp_path))
    made = tmp_path / "site"
    for page in made.rglob("*.html"):
        for target in re.findall(r'href="([^"#:]+)(?:#[^"]*)?"', page.read_text()):
            assert page.name == "404.html" or (page.parent / target).exists(), (page.name, target)
    found = json.loads((made / "search/search_index.json").read_text())["docs"]
    assert any("pole_pairs" in entry["text"] and entry["location"].startswith("reference.html") for entry in found)
