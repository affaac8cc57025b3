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
