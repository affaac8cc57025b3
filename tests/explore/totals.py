# SPDX-License-Identifier: MIT
"""Of all setups together: what was seen, what was not and why, as `make explore` prints it last. Reads what they printed."""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/tools"), str(ROOT / "firmware/tables"), str(ROOT / "linker/bounds")]

import states_page  # noqa: E402  (the path must be set first)

EARLY = "before start-up ends nothing listens"
BRIEF = "READY is left in the step that enters it"
# places, changes of the status word, and rows of the table that are not seen, and why
NEVER = {
    "not ready": EARLY, "0x00 to 0x40": EARLY, "NOT_READY BOOTED SWITCH_ON_DISABLED": EARLY, "NOT_READY UNTRUSTED FAULT": EARLY,
    "ready": BRIEF, "READY QUICK_STOP SWITCH_ON_DISABLED": BRIEF, "READY OFF SWITCH_ON_DISABLED": BRIEF,
    "READY FAULT FAULT_REACTION": BRIEF,
    "switched on": "its phases are listed", "operation enabled": "its modes are listed",
    "0x07 to 0x27": "16, which the standard leaves open: a quick stop goes on to its end",
}


def names(path, enum, prefix):
    body = re.search(rf"enum {enum} \{{(.*?)\}};", (ROOT / path).read_text(), re.S).group(1)
    return re.findall(rf"^\s+{prefix}(\w+),", body, re.M)


def rows(text):
    """{row: how often printed}, each row of the table among them."""
    states = names("firmware/axis/axis.h", "axis_state", "AXIS_")
    events = names(states_page.HEADER, "drive_event", "DRIVE_EVENT_")
    found = {" ".join(row[:3]): 0 for row in states_page.rows()}
    for before, event, after in re.findall(r"^  row (\d+) (\d+) (\d+)$", text, re.M):
        found[f"{states[int(before)]} {events[int(event)]} {states[int(after)]}"] = 1
    return found


def seen(text):
    """{place or change of the status word: how often}"""
    found = {}
    for name, count in re.findall(r"^  (.{24}) +(\d+)  \d+$", text, re.M) + re.findall(
            r"^  status word (0x.. to 0x..) (\d+) times", text, re.M):
        found[name.strip()] = found.get(name.strip(), 0) + int(count)
    return found


def total(pattern, text):
    return sum(map(int, re.findall(pattern, text, re.M)))


def main():
    text = sys.stdin.read()
    setups, unended = re.findall(r"^(.+): \d+ states, ", text, re.M), re.findall(r"^(.+): .*CUT SHORT", text, re.M)
    table, others = rows(text), seen(text)
    never = sorted(name for name, count in {**table, **others}.items() if count == 0)
    violations = total(r"^in all .* (\d+) violations", text)
    states, transitions = total(r"^.+: (\d+) states", text), total(r"^.+: .*?(\d+) transitions", text)
    examples, blocks = total(r"interrupted in (\d+) states", text), total(r"states at (\d+) blocks", text)
    print(f"\n{len(setups)} setups: {states} states, {transitions} transitions; interrupted in {examples} states at {blocks} "
          f"blocks; {violations} violations\n{sum(table.values())} of {len(table)} rows of the table taken")
    for name in never:
        print(f"  never seen: {name}: {NEVER.get(name, 'NO REASON')}")
    return violations != 0 or bool(unended) or any(name not in NEVER for name in never)


if __name__ == "__main__":
    sys.exit(main())
