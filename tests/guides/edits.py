# SPDX-License-Identifier: MIT
"""The blocks of docs/guides/adding.md, as changes of the sources: where each stands, and what is added there.

usage: edits.py        writes the page's table of costs
"""
import re
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
GUIDE = ROOT / "docs/guides/adding.md"
PAGE = GUIDE.read_text()
BLOCK = re.compile(r"^```c\n(.*?)^```", re.DOTALL | re.MULTILINE)
EDIT = re.compile(r'^// (\S+), (new|(?:after|before|replace) "([^\n]*?)":)(?: (.*))?$')
LICENCE = "/* SPDX-License-Identifier: MIT */\n"


@dataclass
class Edit:
    path: str
    how: str     # new, after, before, replace
    words: str   # by which the place is found
    inline: str  # what follows on the same line
    below: list  # and below

    def place(self, text):
        assert text.count(self.words) == 1, f"{self.path}: {text.count(self.words)} times {self.words!r}"
        return text.index(self.words)

    def applied(self, text):
        if self.how == "new":
            return LICENCE + "\n".join(self.below) + "\n"
        at = self.place(text)
        if self.how == "replace":
            return text[:at] + "\n".join([self.inline, *self.below]) + text[at + len(self.words):]
        begin, end = text.rfind("\n", 0, at) + 1, text.index("\n", at) + 1
        line = text[begin:end]
        added = line[:len(line) - len(line.lstrip())] + self.inline if self.inline else "\n".join([*self.below, ""])
        return text[:begin] + added + "\n" + text[begin:] if self.how == "before" else text[:end] + added + "\n" + text[end:]


def edits(page=PAGE):
    found = []
    for block in BLOCK.findall(page):
        for line in block.splitlines():
            head = EDIT.match(line)
            if head:
                path, how, words, inline = head.groups()
                found.append(Edit(path, how.split()[0], words or "", inline or "", []))
            else:
                assert not line.startswith("//"), line
                found[-1].below.append(line)
    return found


def costs(page=PAGE):
    """What each addition takes: a table."""
    lines = ["| addition | files, new ones | lines |", "|---|---|---|"]
    for section in page.split("\n## ")[1:]:
        its = edits(section)
        new = {edit.path for edit in its if edit.how == "new"}
        count = sum(bool(edit.inline) + len(edit.below) for edit in its)
        lines.append(f"| {section.splitlines()[0]} | {len({edit.path for edit in its})}, {len(new)} | {count} |")
    return "\n".join(lines) + "\n"


def apply(folder, page=PAGE):
    """Puts the page's blocks into the sources there; returns the files that differ now."""
    for edit in edits(page):
        path = folder / edit.path
        assert (edit.how == "new") != path.exists(), edit.path
        path.write_text(edit.applied("" if edit.how == "new" else path.read_text()))
    return sorted({edit.path for edit in edits(page)})


def copied(folder, names):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).exists():
            shutil.copy2(ROOT / name, folder / name)


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT / "tests/tools"))
    from pages import replace_block
    replace_block(GUIDE, "costs", costs())
