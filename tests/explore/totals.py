# SPDX-License-Identifier: MIT
"""Of all setups together: what was seen, what was not and why, as `make explore` prints it last. Reads what they printed."""
import re
import sys

NEVER = {
    "not ready": "before start-up ends nothing listens",
    "ready": "left in the step that enters it",
    "switched on": "its phases are listed",
    "operation enabled": "its modes are listed",
    "0x00 to 0x40": "before start-up ends nothing listens",
    "0x07 to 0x27": "16, which the standard leaves open: a quick stop goes on to its end",
}


def seen(text):
    """{place or transition: how often}"""
    found = {}
    for name, count in re.findall(r"^  (.{24}) +(\d+)  \d+$", text, re.M) + re.findall(
            r"^  status word (0x.. to 0x..) (\d+) times", text, re.M):
        found[name.strip()] = found.get(name.strip(), 0) + int(count)
    return found


def total(pattern, text):
    return sum(map(int, re.findall(pattern, text, re.M)))


def main():
    text = sys.stdin.read()
    setups = re.findall(r"^(.+): \d+ states, ", text, re.M)
    unended = re.findall(r"^(.+): .*CUT SHORT", text, re.M)
    violations = total(r"^in all .* (\d+) violations", text)
    never = sorted(name for name, count in seen(text).items() if count == 0)
    states, transitions = total(r"^.+: (\d+) states", text), total(r"^.+: .*?(\d+) transitions", text)
    examples, blocks = total(r"interrupted in (\d+) states", text), total(r"states at (\d+) blocks", text)
    known = total(r"^in all .* (\d+) known$", text)
    print(f"\n{len(setups)} setups: {states} states, {transitions} transitions; interrupted in {examples} states at {blocks} "
          f"blocks; {violations} violations, {known} known")
    for name in never:
        print(f"  never seen: {name}: {NEVER.get(name, 'NO REASON')}")
    return violations != 0 or bool(unended) or any(name not in NEVER for name in never)


if __name__ == "__main__":
    sys.exit(main())
