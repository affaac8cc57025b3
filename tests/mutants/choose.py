# SPDX-License-Identifier: MIT
"""Which mistakes are tried: files by lot and lines, every kind in its turn, no line twice; and how they stand in one build."""
import hashlib
import itertools
import math
from pathlib import Path

from mutants import assembly, python
from mutants.c import Parser
from mutants.mutant import KINDS, without_remarks
from mutants.report import room

ROOMS = ("firmware", "drivers", "startup", "lib", "qemu/twin", "qemu/launcher", "qemu/client")
ENDS = {"qemu/launcher": (".py",), "qemu/client": (".py",)}
NOT = ("rtl_", "fabric_rtl", "modelbench", "modelcheck", "reach")  # `make fabric` judges these, or they are tests' own programs
LOCKSTEP = ("pwm.", "adc.", "gate.", "chopper.", "watch.", "fabric_model.")  # of the twin: tests/fabric/lockstep
TRIES = 40


class Sources:
    """The files that mistakes are put into."""

    def __init__(self, root, rooms=ROOMS, **parser):
        self.root, self.parser = Path(root), Parser(Path(root), **parser)
        left = {room: NOT + (LOCKSTEP if room == "qemu/twin" else ()) for room in rooms}
        paths = [p for room in rooms for p in sorted((self.root / room).rglob("*"))
                 if p.suffix in ENDS.get(room, (".c", ".h", ".S")) and not p.name.startswith(left[room])]
        self.texts = {str(p.relative_to(self.root)): p.read_text(encoding="utf-8") for p in paths}
        self.known = {}

    def mutants(self, file):
        if file not in self.known:
            text = self.texts[file]
            self.known[file] = (python.mutants(file, text) if file.endswith(".py") else
                                assembly.mutants(file, text) if file.endswith(".S") else self.parser.mutants(file, text))
        return self.known[file]

    def _compiles(self, file, text):
        try:
            return file.endswith(".S") or (
                compile(text, file, "exec") if file.endswith(".py") else not self.parser.complaint(file, text))
        except SyntaxError:
            return False

    def weight(self, file):
        """Lines with something in them; a header has some if it has functions."""
        text = self.texts[file] if file.endswith(".py") else without_remarks(self.texts[file])
        lines = [line for line in text.split("\n") if line.strip() and not line.lstrip().startswith("#")]
        return 0 if file.endswith(".h") and "\n{\n" not in text else len(lines)

    def valid(self, mutant, others=()):
        """Whether it compiles, beside the original where it may stand there, clear of others."""
        text = self.texts[mutant.file]
        if mutant.slot and any(one.slot[0] < mutant.slot[1] and mutant.slot[0] < one.slot[1] for one in others if one.slot):
            return False
        beside = "#define MUTANT(n) ((n) == 0)\n" if mutant.file.endswith((".c", ".h")) else ""
        return self._compiles(mutant.file, beside + with_all(text, [(1, mutant)]) if mutant.slot else mutant.applied(text))

    def draw(self, count, seed, takes=lambda file: True):
        """`count` mutants, the same ones for the same tree and seed; fewer if there are no more."""
        weights = {file: weight for file in self.texts if takes(file) and (weight := self.weight(file))}
        left, drawn = {}, {}
        for turn in itertools.count():
            short = count - sum(map(len, drawn.values()))
            if not short or not weights:
                break
            for file, number in shares(weights, short, f"{seed}|{turn}").items():
                left.setdefault(file, sequence(self.mutants(file), seed, file))
                before = len(drawn.setdefault(file, []))
                for mutant in itertools.islice(left[file], TRIES * number):
                    if len(drawn[file]) < before + number and self.valid(mutant, drawn[file]):
                        drawn[file].append(mutant)
                    if len(drawn[file]) == before + number:
                        break
                else:
                    del weights[file]
        return sorted((mutant for some in drawn.values() for mutant in some), key=lambda mutant: mutant.rank(seed))


def with_all(text, numbered):
    """A file's text with all of these beside the original, [(number, mutant)], none of which overlap."""
    for start, end, both in sorted((mutant.beside(number, text) for number, mutant in numbered), reverse=True):
        text = text[:start] + both + text[end:]
    return text


def shares(weights, count, seed):
    """{file: how many}, `count` in all: places at equal distances along all files in a row, the first of them by lot.

    So each file has its chance by its weight, and each room, whose files stand together, its part to within one.
    """
    names = sorted(weights, key=lambda name: (room(name), name))  # a room of one file may stand between files of another
    ends = list(itertools.accumulate(weights[name] for name in names))
    lot = int(hashlib.sha256(f"{seed}|shares".encode()).hexdigest(), 16) / 2**256
    passed = [0, *(math.ceil(count * (end / ends[-1]) - lot) for end in ends)]
    return {name: after - before for name, before, after in zip(names, passed, passed[1:]) if after > before}


def sequence(mutants, seed, file):
    """The file's mutants in the seed's order: kinds in turn, and a line again only when every line has been."""
    def turn(kind):
        return hashlib.sha256(f"{seed}|{file}|{kind}".encode()).hexdigest()
    waiting = {kind: sorted((m for m in mutants if m.kind == kind), key=lambda m: m.rank(seed)) for kind in KINDS}
    kinds = sorted((kind for kind in KINDS if waiting[kind]), key=turn)
    used = set()
    while any(waiting.values()):
        taken = False
        for kind in kinds:
            chosen = next((m for m in waiting[kind] if m.line not in used), None)
            if chosen:
                waiting[kind].remove(chosen)
                used.add(chosen.line)
                taken = True
                yield chosen
        if not taken:
            used.clear()
