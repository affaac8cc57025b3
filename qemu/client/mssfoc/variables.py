# SPDX-License-Identifier: MIT
"""Every variable of the drive's image by its name, as a debugger has it: axes[0].speed.integral_q29. The ELF says where it is
and what; the console reads the word (`scope values @2000a1bc`), which also goes into captures, streams and triggers."""
import difflib
import os
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from .dwarf import described, found
from .errors import Refused

# how the name of a variable ends, before any _q15, and its unit
UNITS = {"ma": "mA", "mv": "mV", "nv": "nV", "rpm": "rpm", "rpm_s": "rpm/s", "ms": "ms", "us": "us", "s": "s", "hz": "Hz",
         "counts": "counts", "cdeg": "0.01 deg", "deg": "deg", "c": "degC", "pct": "%", "pm": "0.001", "w": "W",
         "mohm": "mOhm", "uh": "uH", "uwb": "uWb", "gmm2": "g mm2", "unm": "uNm", "uf": "uF", "clocks": "clocks"}
# what holds an enumeration, as a word: lib and firmware keep no enum where another context writes
WORDS = {"state": "axis_state", "mode": "axis_mode", "request": "axis_request", "faults.cause": "fault"}
RAM, RAM_END = 0x20000000, 0x20010000
NAMED = re.compile(r"(.*?)(?:_q(\d+))?")
LOW = re.compile(r"below|falls")


@dataclass(frozen=True)
class Variable:
    name: str
    address: int
    type: str  # s32, u8, ...
    unit: str
    step: float  # of its raw value, in its unit: 2^-29 of what ends with _q29
    enum: dict   # {number: word} of an enumeration

    @property
    def text(self):
        return f"variable, {self.type}"

    @property
    def bits(self):
        return int(self.type[1:])

    @property
    def words(self):
        """What the console is asked for: the word in whose upper end it stands, so that one is above another where they are;
        of eight bytes both."""
        last = self.address + self.bits // 8 - 4
        return f"@{self.address % RAM:x},@{last % RAM:x}" if self.bits == 64 else f"@{last % RAM:x}"

    @property
    def signal(self):
        if self.bits == 64:
            raise Refused(f"{self.name} has two words: a capture has signals of one")
        return self.words

    def of(self, word, high=0):
        """Its value, of a word of the console or an array of them; a whole number where it has no fraction."""
        whole = (word & 0xFFFFFFFF | high << 32) >> max(0, 32 - self.bits)
        whole = whole & (1 << self.bits) - 1 if self.bits < 64 or self.type[0] == "u" else whole
        if self.type[0] == "s" and self.bits < 64:
            whole = whole - ((whole >> self.bits - 1) << self.bits)
        return whole * self.step if self.step != 1 else whole

    def trigger(self, when, level):
        """The words of `scope trigger` behind its name: of a word in thousandths, which is how all its bits are typed."""
        raw = round(level / self.step)
        least, most = ((-1 << self.bits - 1), (1 << self.bits - 1) - 1) if self.bits < 64 else (0, -1)
        if not least <= raw <= most:
            raise Refused(f"{self.name} is a {self.type}: a trigger is between {least * self.step:g} and {most * self.step:g}")
        below = (1 << 32 - self.bits) - 1 if LOW.fullmatch(when) else 0
        word = raw * (1 << 32 - self.bits) + below
        return f"{when} {'-' if word < 0 else ''}{abs(word) // 1000}.{abs(word) % 1000:03d}"


class Variables:
    """Of an ELF. `version`: what the drive says of its image, which must be this one."""

    def __init__(self, elf, version=""):
        self._known = described(elf)
        said = version.partition(", PWM")[0]
        if said.encode() not in Path(elf).read_bytes():
            raise Refused(f"{elf} is not the image of this drive, which runs {said}")

    @cached_property
    def names(self):
        """All numbers in RAM, each element of an array its own."""
        return [name for name, (address, kind) in sorted(self._known["variables"].items())
                if RAM <= address < RAM_END for name in self._below(name, kind)]

    def _below(self, name, kind):
        entry = {} if kind is None else self._known["types"][kind]
        if entry.get("number"):
            yield name
        for member, (_, inner) in entry.get("members", {}).items():
            yield from self._below(f"{name}.{member}", inner)
        for at in range(entry.get("count") or 0):
            yield from self._below(f"{name}[{at}]", entry["element"])

    def like(self, text, most=20):
        """Names that have all words of a text in them, the shortest first."""
        words = text.lower().split()
        found = (name for name in self.names if all(word in name.lower() for word in words))
        return sorted(found, key=lambda name: (len(name), name))[:most]

    def find(self, name):
        """The Variable, or Refused with what may be meant."""
        there = found(self._known, name)
        entry = None if there is None or there[1] is None else self._known["types"][there[1]]
        if entry is None or not entry["number"]:
            near = difflib.get_close_matches(name, self.names, 1, 0.7)
            raise Refused(f"{name} is no number of this image" + (f"; is {near[0]} meant?" if near else ""))
        if not RAM <= there[0] < RAM_END:
            raise Refused(f"{name} is a constant, and not in RAM")
        plain, fraction = NAMED.fullmatch(name).groups()
        unit = next((UNITS[end] for end in sorted(UNITS, key=len, reverse=True) if plain.endswith(f"_{end}")), "")
        tag = entry["enum"] or next((tag for end, tag in WORDS.items() if re.fullmatch(rf"axes\[\d\]\.{end}", name)), "")
        words = self._known["enums"].get(tag, [])
        prefix = os.path.commonprefix([word for _, word in words]).rpartition("_")[0]
        return Variable(name, there[0], entry["number"], unit, 2.0 ** -int(fraction) if fraction else 1,
                        {number: word[len(prefix):].strip("_").lower().replace("_", " ") for number, word in words})
