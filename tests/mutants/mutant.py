# SPDX-License-Identifier: MIT
"""A mistake that may be put into a source file: how it is known again when lines around it have moved, and how it stands beside
the original in one build, chosen at run time."""
import hashlib
import re
from dataclasses import dataclass

KINDS = ("forgotten clear", "lost call", "order", "lost condition", "half a check", "comparison", "copy error", "unit",
         "off by one", "race", "lost bound", "sign", "enumerator")  # docs/mutants.md says what each is


@dataclass(frozen=True)
class Mutant:
    """`edits` are (start, end, new text) in the file's characters, in order, without overlap.

    slot: (start, end, "expression" or "statement") of what stands in one build with the mutant; None: where neither may stand
    """
    file: str
    function: str
    kind: str
    line: int
    original: str      # the lines that it touches, white space collapsed, without remarks
    replacement: str   # the same lines with the mistake
    edits: tuple
    slot: tuple
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

    def beside(self, number, text):
        """(start, end, text) of the slot with both in it: which one is decided by the number that is chosen at run time."""
        start, end, form = self.slot
        was = text[start:end]
        now = with_edits(was, [(a - start, b - start, new) for a, b, new in self.edits])
        now = now if self.file.endswith(".py") else without_remarks(now)
        now = " ".join(line.strip() for line in now.split("\n"))
        if self.file.endswith(".py"):
            both = f"if not _mutant({number}): {was}" if form == "statement" else f"(({now}) if _mutant({number}) else ({was}))"
        elif form == "expression":
            both = f"(MUTANT({number}) ? ({now}) : ({was}))"
        else:
            both = f"{{ if (MUTANT({number})) {{ {now} }} else {{ {was} }} }}"
        return start, end, both


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


def without_remarks(text):
    """Remarks of C blanked, every character in its place."""
    def blank(match):
        return match.group() if match.group()[0] == '"' else re.sub(r"[^\n]", " ", match.group())
    return re.sub(r'"(?:\\.|[^"\\\n])*"|/\*.*?\*/|//[^\n]*', blank, text, flags=re.DOTALL)


def mutants_of(file, text, found):
    """From (function, kind, edits, slot), each known by the lines it touches; what changes nothing is left out.

    text: without remarks, so that a mutant stays the same when one is rewritten.
    """
    mutants, seen, places = [], {}, set()
    for function, kind, edits, slot in sorted(found, key=lambda item: (item[2][0][0], item[1], item[2])):
        first, last = edits[0][0], max(end for _, end, _ in edits)
        start, end = text.rfind("\n", 0, first) + 1, text.find("\n", last)
        end = len(text) if end < 0 else end
        original = collapsed(text[start:end])
        replacement = collapsed(with_edits(text[start:end], [(a - start, b - start, new) for a, b, new in edits]))
        if original == replacement or (first, last, replacement) in places:
            continue
        places.add((first, last, replacement))
        key = (function, original, replacement)
        seen[key] = seen.get(key, 0) + 1
        line = text.count("\n", 0, first) + 1
        mutants.append(Mutant(file, function, kind, line, original, replacement, tuple(edits), slot, seen[key]))
    return mutants
