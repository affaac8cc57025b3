# SPDX-License-Identifier: MIT
"""What a guide shows of the console, played again on the image in QEMU.

A block of a page is played when a comment stands before it:

    <!-- drive teknic_m2310p -->             a new drive; `bare`: without its parameters; other words are options (OPTIONS)
    <!-- the same drive -->                  it goes on where the last block ended

A line of the block that begins with "> " is typed; "(1.5 s later)" waits; the others are what the drive says.

    /usr/bin/python3 tests/guides/transcript.py [PAGE...]    writes what the drive says now into the pages, or into all guides
"""
import re
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"<!-- (drive [^\n]*|the same drive) -->\n+```text\n(.*?)```", re.DOTALL)
WAIT = re.compile(r"\(([\d.]+) s later\)")
TYPED = "> "
FIRST_S, PREAMBLE_S, TYPING_S = 0.1, 0.05, 0.5
GAP_S = 0.3  # between lines: the longest answer takes 0.2 s
OPTIONS = {"sensorless": {"sensors": "none"}}


@dataclass
class Session:
    """A drive and what is typed at it, over one block or several."""
    motor: str
    options: dict
    bare: bool
    blocks: list = field(default_factory=list)  # of lists of lines
    places: list = field(default_factory=list)  # of the blocks' texts in the page


def sessions(page):
    found = []
    for match in BLOCK.finditer(page):
        what, lines = match[1].split(), match[2].splitlines()
        if what[0] == "drive":
            words = what[2:]
            unknown = set(words) - set(OPTIONS) - {"bare"}
            if unknown:
                raise ValueError(f"a drive is {', '.join([*OPTIONS, 'bare'])}, not {unknown.pop()}")
            options = {key: value for word in words for key, value in OPTIONS.get(word, {}).items()}
            found.append(Session(what[1], options, "bare" in words))
        elif not found:
            raise ValueError("'the same drive' stands before any drive")
        found[-1].blocks.append(lines)
        found[-1].places.append(match.span(2))
    return found


def plan(session):
    """(steps, end): the lines of all blocks at their times."""
    t, steps = FIRST_S + (0 if session.bare else TYPING_S), []
    for line in (line for block in session.blocks for line in block):
        wait = WAIT.fullmatch(line)
        if wait:
            t += float(wait[1])
        elif line.startswith(TYPED):
            steps.append({"t_s": round(t, 6), "console": line[len(TYPED):]})
            t += GAP_S
    return steps, t + GAP_S


def said(console, lines):
    """The answer to each typed line, with what came by itself behind it."""
    answers, typed = [], list(lines)
    for piece in ("\n" + console).split("\n" + TYPED):
        echo, _, rest = piece.partition("\n")
        if len(answers) < len(typed) and echo == typed[len(answers)]:
            answers.append(rest.splitlines())
        elif answers and not echo:
            answers[-1] += rest.splitlines()
    if len(answers) != len(typed):
        raise ValueError(f"no answer to '{typed[len(answers)]}' in:\n{console}")
    return [[line for line in answer if line] for answer in answers]


def play(session, folder):
    """The blocks as they are today."""
    from launcher import simulate
    steps, end_s = plan(session)
    scenario = {"end_s": end_s, "step": steps, "expect_refusal": ".*"} | ({} if session.bare else {"preamble_s": PREAMBLE_S})
    result = simulate(scenario, session.motor, out_dir=folder, **session.options)
    answers = iter(said(result.console, [step["console"] for step in steps]))
    blocks = []
    for block in session.blocks:
        now = []
        for line in block:
            if line.startswith(TYPED):
                now += [line, *next(answers)]
            elif WAIT.fullmatch(line):
                now.append(line)
        blocks.append(now)
    return blocks


def renewed(page, folder):
    replaced = [(place, block) for session in sessions(page)
                for place, block in zip(session.places, play(session, folder))]
    for (begin, end), block in sorted(replaced, reverse=True):
        page = page[:begin] + "".join(line + "\n" for line in block) + page[end:]
    return page


def same(shown, now):
    """Whether two lines differ in numbers only; what is typed must be the same."""
    if shown.startswith(TYPED) or now.startswith(TYPED):
        return shown == now
    return re.sub(r"-?\d+(\.\d+)?", "#", shown) == re.sub(r"-?\d+(\.\d+)?", "#", now)


def main(names):
    sys.path[:0] = [str(ROOT / "qemu"), str(ROOT / "tests")]
    with tempfile.TemporaryDirectory() as folder:
        for path in map(Path, names) if names else sorted((ROOT / "docs" / "guides").glob("*.md")):
            path.write_text(renewed(path.read_text(), Path(folder)))


if __name__ == "__main__":
    main(sys.argv[1:])
