# SPDX-License-Identifier: MIT
"""Brings budgets to the present figures. Needs build/bench.json (make bench).

usage: update.py             tightens what has become better than its slack
       update.py --loosen    takes all present figures over: say in each reason why

GCC 12's figures stand in tests/budgets.toml, where reasons stay. Another compiler's stand beside it (budgets-gcc14.toml): those
that GCC 12's do not hold, no others. So GCC 12 comes first. `.ci/budgets DIR` does all of it with both.
"""
import json
import os
import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from figures import BUDGETS, ROOT, gather, load, slack  # noqa: E402

from compiler import REFERENCE, file_of, version  # noqa: E402

LINE = re.compile(r'^("[^"]+"|\w+)(\s*= \{ max = )(\d+)(,.*)$')


def updated(text, figures, loosen):
    section, lines = None, []
    for line in text.split("\n"):
        head = re.match(r"^\[(\w+)\]$", line)
        match = LINE.match(line)
        if head:
            section = head.group(1)
        elif match:
            name, before = match.group(1).strip('"'), int(match.group(3))
            now = renewed(section, name, figures[section].get(name, before), before, loosen)
            if now != before:
                print(f"{section} {name}: {before} -> {now}")
                line = f"{match.group(1)}{match.group(2)}{now}{match.group(4)}"
        lines.append(line)
    return "\n".join(lines)


def renewed(section, name, now, before, loosen):
    below, above = slack(section, name, before)
    return now if loosen or now < before - (below if above else 0) else before


def beside(budgets, own, figures, loosen):
    """{section: {row: figure}} that replaces `own`, where `budgets` of the reference do not hold."""
    found = {}
    for section, rows in budgets.items():
        for name, row in rows.items():
            before = own.get(section, {}).get(name, row["max"])
            now = figures[section].get(name, before)
            kept = renewed(section, name, now, before, loosen)
            below, above = slack(section, name, row["max"])
            if not row["max"] - below <= now <= row["max"] + above:
                found.setdefault(section, {})[name] = kept
            if found.get(section, {}).get(name, row["max"]) != before:
                print(f"{section} {name}: {before} -> {found.get(section, {}).get(name, row['max'])}")
    return found


def as_text(found, which):
    lines = ["# SPDX-License-Identifier: MIT",
             f"# Budgets with GCC {which}, where those of tests/budgets.toml do not hold; the reasons stand there. Written by",
             "# tests/budgets/update.py."]
    for section, rows in found.items():
        lines += ["", f"[{section}]", *(f"{json.dumps(name) if re.search(r'[^A-Za-z0-9_-]', name) else name} = {figure}"
                                       for name, figure in rows.items())]
    return "\n".join(lines) + "\n"


def main():
    if sys.argv[1:] not in ([], ["--loosen"]):
        raise SystemExit(__doc__)
    build = ROOT / (os.environ.get("BUILD") or "build")
    figures = gather(json.loads((build / "bench.json").read_text()), build)
    loosen = bool(sys.argv[1:])
    if version() == REFERENCE:
        BUDGETS.write_text(updated(BUDGETS.read_text(), figures, loosen))
    else:
        own = file_of(BUDGETS, version())
        found = beside(load(BUDGETS), load(own) if own.is_file() else {}, figures, loosen)
        own.write_text(as_text(found, version()))


if __name__ == "__main__":
    main()
