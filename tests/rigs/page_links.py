# SPDX-License-Identifier: MIT
"""Links of the pages: where they lead, and how many clicks that takes."""
import re

FENCE = re.compile(r"^ *```.*?^ *```", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\]\(([^)\s]+)\)|(?:href|src)=\"([^\"]+)\"")


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
