# SPDX-License-Identifier: MIT
"""Which faults are tried, in which order: every file with a decision gets its share, every kind its turn, no line two."""
import hashlib
from collections import Counter
from pathlib import Path

from mutants.ctext import regions
from mutants.fault import KINDS, without_remarks
from mutants.faults_asm import asm_faults, instructions
from mutants.faults_c import c_faults, decides, enum_neighbours, identifiers

WEIGHT = {"function": 1.0, "table": 0.3, "macro": 0.15, "type": 0.0}  # of a line; code decides more than constants do
SELDOM = {"volatile": 3, "order": 2}  # these have their turn every so many rounds: most change nothing that matters


class Sources:
    """The files that faults are put into, and every fault there is."""

    def __init__(self, root, rooms=("firmware", "drivers", "startup"), also=("lib",)):
        self.root = Path(root)
        self.texts = self._read(rooms)
        c_texts = {name: text for name, text in {**self.texts, **self._read(also)}.items() if not name.endswith(".S")}
        uses = Counter(name for text in c_texts.values() for name in identifiers(text))
        enums = enum_neighbours(c_texts)
        self.faults = {name: asm_faults(name, text) if name.endswith(".S") else c_faults(name, text, uses, enums)
                       for name, text in self.texts.items()}
        self.weights = {name: _weight(name, text) for name, text in self.texts.items()}
        self.decides = {name for name, text in self.texts.items() if name.endswith(".S") or decides(text)}

    def _read(self, rooms):
        paths = [p for room in rooms for p in sorted((self.root / room).rglob("*")) if p.suffix in (".c", ".h", ".S")]
        return {str(p.relative_to(self.root)): p.read_text(encoding="utf-8") for p in paths}


def _weight(name, text):
    """Lines with something in them, each counted as what it belongs to."""
    if name.endswith(".S"):
        return len(list(instructions(without_remarks(text, assembly=True))))
    lines = {}
    for region in regions(text, name):
        for token in region.tokens:
            line = text.count("\n", 0, token.start)
            lines[line] = max(lines.get(line, 0.0), WEIGHT[region.kind])
    return sum(lines.values())


def shares(weights, count, least=()):
    """{file: how many}, by weight, and one at least for each of `least`; the sum is `count` if that suffices."""
    total = sum(weights.values())
    exact = {name: weight * count / total for name, weight in weights.items()} if total else {}
    given = {name: max(int(value), 1 if name in least else 0) for name, value in exact.items()}
    for name in sorted(exact, key=lambda n: (given[n] - exact[n], n)):
        if sum(given.values()) >= count:
            break
        given[name] += 1
    while sum(given.values()) > count and max(given.values()) > 1:
        given[max((n for n in given if given[n] > 1), key=lambda n: (given[n] - exact[n], n))] -= 1
    return given


def sequence(faults, seed, file):
    """The file's faults in the seed's order: kinds in turn, and a line again only when every line has been."""
    def turn(kind):
        return hashlib.sha256(f"{seed}|{file}|{kind}".encode()).hexdigest()
    waiting = {kind: sorted((f for f in faults if f.kind == kind), key=lambda f: f.rank(seed)) for kind in KINDS}
    kinds = sorted((kind for kind in KINDS if waiting[kind]), key=turn)
    used, number = set(), 0
    while any(waiting.values()):
        number += 1
        taken = False
        for kind in kinds:
            if number % SELDOM.get(kind, 1) == 0:
                chosen = next((f for f in waiting[kind] if f.line not in used), None)
                if chosen:
                    waiting[kind].remove(chosen)
                    used.add(chosen.line)
                    taken = True
                    yield chosen
        if not taken and number % 6 == 0:
            used.clear()
