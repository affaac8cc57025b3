# SPDX-License-Identifier: MIT
"""What the console's answers say. Each function takes the lines of one answer."""
import re
from dataclasses import dataclass

from .errors import Refused

PARAMETER = re.compile(r"(\w+) = (-?\d+)(?: (\S.*?))?  \((-?\d+)\.\.\.(-?\d+)\)")
SIGNAL = re.compile(r"(\w+) (\S+) (-?\d+)/(\d+): (.*)")
UNITS = {"none": "", "%_of_bus": "% of bus"}


@dataclass(frozen=True)
class Parameter:
    name: str
    value: int
    unit: str
    least: int
    most: int


@dataclass(frozen=True)
class Signal:
    unit: str
    step: float  # what one step of its raw value is, in its unit
    text: str

    def of(self, raw):
        return raw * self.step


def _place(word):
    """The console tells "@2000a1bc", and is told "@a1bc"."""
    return int(word[1:], 16) & 0xFFFF


class Names:
    """Of signals and variables for the console, which knows variables by their words' addresses, and back."""

    def __init__(self, variables):
        """variables()   the Variables of the image, or Refused"""
        self._variables, self._of_words = variables, {}

    def line(self, line):
        """A line of the console that may have variables, whose names have dots or brackets, where signals stand."""
        if found := re.fullmatch(r"((?:axis \d )?scope signals )(\S+)", line):
            return found[1] + ",".join(map(self._told, found[2].split(",")))
        if not (found := re.fullmatch(r"((?:axis \d )?scope trigger )(\S*[.[]\S*) (\w+) (-?[\d.]+)", line)):
            return line
        before, name, when, level = found.groups()
        return f"{before}{self._told(name)} {self._variables().find(name).trigger(when, float(level))}"

    def _told(self, name):
        if "." not in name and "[" not in name:
            return name
        one = self._variables().find(name)
        self._of_words[_place(one.signal)] = name, one
        return one.signal

    def heard(self, names, signals):
        """{name: Signal or Variable} of what the console names, in its order; a word that nobody here has chosen is raw."""
        return dict(self._of_words.get(_place(name), (name, Signal("", 1, "a word"))) if name.startswith("@")
                    else (name, signals[name]) for name in names)


def accepted(lines):
    """The answer as it came. Raises Refused where it is an error."""
    for line in lines:
        if line.startswith("error: "):
            raise Refused(line.removeprefix("error: "))
    return lines


def parameters(lines):
    """{name: Parameter} of `get`."""
    rows = [found for found in map(PARAMETER.fullmatch, lines) if found]
    return {row[1]: Parameter(row[1], int(row[2]), row[3] or "", int(row[4]), int(row[5])) for row in rows}


def signals(lines):
    """{name: Signal} of `scope list`."""
    rows = [found.groups() for found in map(SIGNAL.fullmatch, lines) if found]
    if not rows:
        raise Refused("the drive has no scope: is its firmware older than this program?")
    return {name: Signal(UNITS.get(unit, unit), int(milli) / int(per) / 1000, text) for name, unit, milli, per, text in rows}


def chosen(lines):
    """The names of the signals that a capture holds, of `scope`."""
    return re.match(r"signals: (\S+), every", lines[0]).group(1).split(",")


def capture(lines):
    """{"names", "rows" of raw values, "trigger", "per_ms"} of `scope read` or `scope fault`."""
    lines = lines[next((at for at, line in enumerate(lines) if line.startswith("samples: ")), len(lines)):]
    if len(lines) < 4:
        raise Refused("there is no capture")
    heading = dict(item.split(": ") for item in lines[0].split(", "))
    return {"names": lines[1].split(), "rows": [[int(value) for value in line.split()] for line in lines[3:-1]],
            "trigger": int(heading["trigger"]), "per_ms": int(heading["a millisecond has"]) / int(heading["every"])}


def fields(lines):
    """{what: its text} of `status` and `fault`."""
    return dict(line.split(": ", 1) for line in lines if ": " in line)


def fault(lines):
    """The name of what is latched, or None, of `fault`."""
    name = next(line for line in lines if line.startswith("fault: ")).removeprefix("fault: ")
    return None if name == "none" else name


def number(text, unit):
    """The first number with that unit behind it, or None."""
    found = re.search(rf"(-?\d+(?:\.\d+)?) {unit}\b", text)
    return found and float(found[1])


def amperes(text):
    """(i_d, i_q) of status."""
    return tuple(float(value) for value in re.findall(r"\b[dq] (-?\d+\.\d+) A", text)[:2])
