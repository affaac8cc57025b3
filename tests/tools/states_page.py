# SPDX-License-Identifier: MIT
"""docs/states.md from the table in firmware/drive/states.c: its diagram, and each row beside the standard's transition.

    states_page.py          writes the page
"""
import re
from pathlib import Path

import pages

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "firmware/drive/states.c"
HEADER = ROOT / "firmware/drive/states.h"
PAGE = ROOT / "docs/states.md"

ROW = re.compile(r"\{([A-Z_()| ]+), DRIVE_EVENT_([A-Z_]+), AXIS_([A-Z_]+), (\w+), (\w+)\},")
GROUP = re.compile(r"#define BRIDGE_ON (\(.*\))")
# IEC 61800-7-201, finite state automaton: {(from, to): number}; 13 leads from every state
STANDARD = {("NOT_READY", "SWITCH_ON_DISABLED"): 1, ("SWITCH_ON_DISABLED", "READY"): 2, ("READY", "SWITCHED_ON"): 3,
            ("SWITCHED_ON", "OPERATION_ENABLED"): 4, ("OPERATION_ENABLED", "SWITCHED_ON"): 5, ("SWITCHED_ON", "READY"): 6,
            ("READY", "SWITCH_ON_DISABLED"): 7, ("OPERATION_ENABLED", "READY"): 8,
            ("OPERATION_ENABLED", "SWITCH_ON_DISABLED"): 9, ("SWITCHED_ON", "SWITCH_ON_DISABLED"): 10,
            ("OPERATION_ENABLED", "QUICK_STOP"): 11, ("QUICK_STOP", "SWITCH_ON_DISABLED"): 12,
            ("FAULT_REACTION", "FAULT"): 14, ("FAULT", "SWITCH_ON_DISABLED"): 15, ("QUICK_STOP", "OPERATION_ENABLED"): 16}
# a fabric that start-up does not trust is not touched, so there is nothing to react with
DIRECT = {("NOT_READY", "FAULT"): "13, 14"}


def rows(text=None):
    """[(from, event, to, guard, action)], one for each state that a row of the table leads from."""
    text = SOURCE.read_text() if text is None else text
    bridge_on = GROUP.search(text).group(1)
    table = text[text.index("transition_table[] = {"):]
    table = " ".join(table[:table.index("\n};")].split())
    found = [(state, event, to, guard, action) for states, event, to, guard, action in ROW.findall(table)
             for state in re.findall(r"IN\((\w+)\)", states.replace("BRIDGE_ON", bridge_on))]
    assert len(ROW.findall(table)) == table.count("DRIVE_EVENT_"), "a row that this does not read"
    return found


def standard(before, after):
    """The standard's number of this change; None if it has none."""
    if before == after:
        return "-"
    return STANDARD.get((before, after)) or (13 if after == "FAULT_REACTION" else DIRECT.get((before, after)))


def words(name):
    return name.lower().replace("_", " ")


def events():
    """{event: what the header says of it}."""
    return dict(re.findall(r"DRIVE_EVENT_(\w+),\s*/\* (.*?) \*/", HEADER.read_text()))


def diagram():
    """A Mermaid diagram: changes between the same two states share an arrow."""
    arrows = {}
    for before, event, after, *_ in rows():
        arrows.setdefault((before, after), []).append(words(event))
    lines = ["```mermaid", "stateDiagram-v2", "    [*] --> NOT_READY"]
    lines += [f"    {before} --> {after}: {', '.join(dict.fromkeys(names))}" for (before, after), names in arrows.items()]
    return "\n".join(lines + ["```", ""])


def table():
    lines = ["| from | event | if | does | to | CiA 402 |", "|---|---|---|---|---|---|"]
    for before, event, after, guard, action in rows():
        guard, action = ("" if name == "NULL" else f"`{name}`" for name in (guard, action))
        lines.append(f"| {words(before)} | {words(event)} | {guard} | {action} | {words(after)} | {standard(before, after)} |")
    return "\n".join(lines + [""])


def page(text):
    return pages.replaced(pages.replaced(text, "diagram", diagram()), "table", table())


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text()))
