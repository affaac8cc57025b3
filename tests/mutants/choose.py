# SPDX-License-Identifier: MIT
"""Which faults are tried, in which order: files by lot and weight, every kind in its turn, no line twice."""
import hashlib
import itertools
import math
from collections import Counter
from pathlib import Path

from mutants.ctext import regions
from mutants.fault import KINDS, without_remarks
from mutants.faults_asm import asm_faults, instructions
from mutants.faults_c import c_faults, enum_neighbours, identifiers
from mutants.report import room

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


def shares(weights, count, seed):
    """{file: how many}, `count` in all: places at equal distances along all files in a row, the first of them by lot.

    So each file has its chance by its weight, and each room, whose files stand together, its part to within one.
    """
    names = sorted(weights, key=lambda name: (room(name), name))
    ends = list(itertools.accumulate(weights[name] for name in names))
    lot = int(hashlib.sha256(f"{seed}|shares".encode()).hexdigest(), 16) / 2**256
    passed = [0, *(math.ceil(count * (end / ends[-1]) - lot) for end in ends)]
    return {name: after - before for name, before, after in zip(names, passed, passed[1:]) if after > before}


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
