# SPDX-License-Identifier: MIT
"""What a drive has on its buses: registers of Modbus and objects of CANopen, by name.

`make client` writes the list from the firmware's tables, registers.csv, which is in the package that it makes. A drive of
another version has another list: `make client` beside its image writes that.
"""
import csv
from dataclasses import dataclass
from pathlib import Path

from .errors import Refused

PACKED = Path(__file__).with_name("registers.csv")
# a name's unit -> how much of which unit that is
SCALES = {"mA": (0.001, "A"), "mV": (0.001, "V"), "0.001 rpm": (0.001, "rpm"), "0.1 %": (0.1, "%"), "0.1 deg": (0.1, "deg")}


@dataclass(frozen=True)
class Entry:
    name: str
    register: int
    index: int      # of CANopen
    subindex: int
    bits: int
    signed: bool
    writable: bool
    unit: str
    least: int | None
    most: int | None

    def scaled(self, raw):
        scale = SCALES.get(self.unit)
        return raw * scale[0] if scale else raw


class Registers:
    """objects, parameters {name: Entry}; faults, refusals {number: text}"""

    def __init__(self, path=None):
        self.objects, self.parameters, self.faults, self.refusals = {}, {}, {}, {}
        path = Path(path or PACKED)
        try:
            with open(path, encoding="utf-8", newline="") as stream:
                for row in csv.DictReader(stream):
                    self._take(row)
        except FileNotFoundError as error:
            raise Refused(f"{path} is not there: a bus needs the list of registers; install what `make client` makes, or pass "
                          "registers=, the file that it writes") from error
        except (KeyError, ValueError) as error:
            raise Refused(f"{path} is no list of registers as `make client` writes it: {error}") from error

    def _take(self, row):
        kind, name = row["kind"], row["name"]
        if kind in ("fault", "refusal"):
            {"fault": self.faults, "refusal": self.refusals}[kind][int(row["number"])] = name
        elif kind in ("object", "parameter"):
            least, most = (int(row[end]) if row[end] else None for end in ("least", "most"))
            {"object": self.objects, "parameter": self.parameters}[kind][name] = Entry(
                name, int(row["register"]), int(row["index"], 16), int(row["subindex"]), int(row["type"][1:]),
                row["type"].startswith("I"), row["access"] == "RW", row["unit"], least, most)
