# SPDX-License-Identifier: MIT
"""A fault that may be put into a source file, and how it is known again when the lines around it have moved."""
import hashlib
import re
from dataclasses import dataclass

KINDS = {
    "sign": "+ for -, a minus dropped, ++ for --",
    "operator": "* for /, & for |, >> for <<, ~ dropped; another instruction",
    "constant": "twice or half of a number, a bit of a mask, a mask shifted",
    "off by one": "a number one up or down, < for <=, a shift by one more or less",
    "condition": "negated, always or never true, && for ||",
    "dropped statement": "a call, an assignment, a jump, an instruction",
    "dropped check": "an if that is never taken",
    "order": "two statements exchanged",
    "arguments": "two arguments exchanged",
    "operand": "d for q, low for high, another register or member",
    "state": "another name of the same enum, true for false",
    "volatile": "volatile dropped",
}


@dataclass(frozen=True)
class Fault:
    """`edits` are (start, end, new text) in the file's characters, in order, without overlap."""
    file: str
    function: str
    kind: str
    line: int
    original: str      # the lines that it touches, white space collapsed, without remarks
    replacement: str   # the same lines with the fault
    edits: tuple
    nth: int = 1       # of those in this function that read the same

    @property
    def identity(self):
        """What stays when other lines change."""
        return f"{self.file}|{self.function}|{self.original}|{self.replacement}|{self.nth}"

    def rank(self, seed):
        """Its place in the seed's order."""
        return hashlib.sha256(f"{seed}|{self.identity}".encode()).hexdigest()

    def applied(self, text):
        return with_edits(text, self.edits)


def with_edits(text, edits):
    """The text with every edit made; each leaves the number of lines as it was."""
    for start, end, new in sorted(edits, reverse=True):
        lines = text.count("\n", start, end)
        new = new if new.count("\n") <= lines else new.replace("\n", " ")
        new += "\n" * (lines - new.count("\n"))
        text = text[:start] + new + text[end:]
    return text


def collapsed(text):
    return " ".join(text.split())


def without_remarks(text, assembly=False):
    """Remarks blanked, every character in its place."""
    def blank(match):
        return match.group() if match.group()[0] == '"' else re.sub(r"[^\n]", " ", match.group())
    return re.sub(r'"(?:\\.|[^"\\\n])*"|/\*.*?\*/|//[^\n]*' + ("|@[^\n]*" if assembly else ""), blank, text, flags=re.DOTALL)


def make_faults(file, text, found):
    """Faults from (function, kind, edits), each known by the lines it touches; what changes nothing is left out.

    text: without remarks, so that a fault stays the same when one is rewritten.
    """
    faults, seen, places = [], {}, set()
    for function, kind, edits in sorted(found, key=lambda item: (item[2][0][0], item[1], item[2])):
        first, last = edits[0][0], max(end for _, end, _ in edits)
        start = text.rfind("\n", 0, first) + 1
        end = text.find("\n", last)
        end = len(text) if end < 0 else end
        original = collapsed(text[start:end])
        inner = tuple((a - start, b - start, new) for a, b, new in edits)
        replacement = collapsed(with_edits(text[start:end], inner))
        if original == replacement or (edits, replacement) in places:
            continue
        places.add((edits, replacement))
        key = (function, original, replacement)
        seen[key] = seen.get(key, 0) + 1
        line = text.count("\n", 0, first) + 1
        faults.append(Fault(file, function, kind, line, original, replacement, tuple(edits), seen[key]))
    return faults
