# SPDX-License-Identifier: MIT
"""docs/silicon.md as data: its facts, what contradicts some of them, and the lines of the bring-up image.

A fact's first cell is a word that names it, or the names that the code has for it, in backticks; those are compared with the
code. `reset:BLOCK.REGISTER`, `power-on:...`, `warm:...` are values that a register has after these, and are compared with
the twin.
"""
import re
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/silicon.md"
FACTS = ("fact", "value", "what", "used in", "source", "verdict")
REASONS = ("no.", "what contradicts it", "fix")
STEPS = ("step", "prints", "documented")
USE = re.compile(r"([^\s(,]+)(?: \(([^)]*)\))?")
VERDICT = re.compile(r"confirmed|unconfirmed: (B\d\d)|contradicted: (C\d)")


@dataclass
class Fact:
    name: str
    value: str
    what: str
    uses: list
    source: str
    verdict: str
    code: list = field(default_factory=list)  # names in the code, or PHASE:BLOCK.REGISTER

    @property
    def settled_by(self):
        """The step of the bring-up, or the reason; None if confirmed."""
        match = VERDICT.fullmatch(self.verdict)
        return match and (match.group(1) or match.group(2))


def tables(text, header):
    """The rows of all tables of the page with this header."""
    lines, rows = text.split("\n"), []
    for number, line in enumerate(lines):
        if cells(line) == list(header):
            for row in lines[number + 2:]:
                if not row.startswith("|"):
                    break
                rows.append(cells(row))
    return rows


def cells(line):
    return [cell.strip() for cell in line.strip().strip("|").split("|")] if line.startswith("|") else []


def facts(text=None):
    found = []
    for row in tables(PAGE.read_text() if text is None else text, FACTS):
        assert len(row) == len(FACTS), f"docs/silicon.md: a row with {len(row)} cells instead of {len(FACTS)}: {row}"
        name, value, what, used, source, verdict = row
        found.append(Fact(name, value, what, USE.findall(used), source, verdict, re.findall(r"`([^`]+)`", name)))
    return found


def column(header, text=None):
    """The first cell of each row of the other tables."""
    return [row[0] for row in tables(PAGE.read_text() if text is None else text, header)]


def number(value):
    """0x10, +0x010 and 16 are numbers, b4 a bit, b7:4 and b3 b1 masks; None for what is none of these."""
    if re.fullmatch(r"\+?0x[0-9A-Fa-f]+|\d+", value):
        return int(value.lstrip("+"), 0)
    bits = 0
    for part in value.split():
        match = re.fullmatch(r"b(\d+)(?::(\d+))?", part)
        if not match:
            return None
        high, low = int(match.group(1)), int(match.group(2) or match.group(1))
        bits |= (1 << (high + 1)) - (1 << low)
    return bits
