# SPDX-License-Identifier: MIT
"""Addresses of the firmware's variables from the DWARF of the ELF: what a debugger's live watch does.

The image has no code for this. The twin reads the memory at these addresses once a PWM period.
"""
import base64
import copy
import re
from dataclasses import dataclass

import numpy as np

from mssfoc.dwarf import described, found
from mssfoc.errors import Refused

from .errors import LauncherError
from .paths import shown


FIRST_AXIS = "axes[0]"
READ = ("u8", "s8", "u16", "s16", "u32", "s32")  # numbers that the twin reads


@dataclass
class Variable:
    """Where a variable (or a member of one) is and how to read it; `type` is empty if it is no number the twin reads."""
    name: str
    address: int
    type: str


@dataclass
class Probe:
    """A column of the trace: the raw value times `scale`."""
    column: str
    address: int
    type: str
    scale: float


class Symbols:
    """Looks up `current_loop.i_d_q15`, `log[2].code`, ... in one ELF file."""

    def __init__(self, elf_path):
        self.path = elf_path
        try:
            self._known = known = described(elf_path)
        except Refused as error:
            raise LauncherError(str(error).replace(str(elf_path), shown(elf_path))) from error
        self.producer = known["producer"]
        self._functions, self._types = known["functions"], known["types"]
        self._enums = known["enums"]
        self._segments = [(start, base64.b64decode(data)) for start, data in known["segments"]]
        self._axis = 0

    @property
    def axes(self):
        """How many motors the image drives."""
        return 2 if self.of_axis(1).find(FIRST_AXIS) else 1

    def of_axis(self, axis):
        """The same image, in which axes[0] means this one of its axes, from 0."""
        view = copy.copy(self)
        view._axis = axis
        return view

    def _bytes(self, address, size):
        """What the image loads there, or None."""
        for start, data in self._segments:
            if start <= address and address - start + size <= len(data):
                return data[address - start:address - start + size]
        return None

    def enum(self, tag):
        """value -> enumerator of `enum tag`, empty when there is none of that name."""
        return dict(self._enums.get(tag, []))

    def find(self, name):
        """The Variable of a dotted name, or None when the image has none of that name."""
        if name.startswith(FIRST_AXIS):
            name = f"axes[{self._axis}]{name[len(FIRST_AXIS):]}"
        there = found(self._known, name)
        kind = None if there is None or there[1] is None else self._types[there[1]]["number"]
        return there and Variable(name, there[0], kind if kind in READ else "")

    def address(self, name):
        """The address of a variable or a function, or a clear line."""
        variable = self.find(name)
        if variable is not None:
            return variable.address
        if name in self._functions:
            return self._functions[name]
        raise LauncherError(f"{shown(self.path)} has no variable or function '{name}'")

    def code16(self, name):
        """The first halfword of a function's code, or a clear line."""
        code = self._bytes(self._functions[name], 2) if name in self._functions else None
        if code is None:
            raise LauncherError(f"{shown(self.path)} has no function '{name}'")
        return int.from_bytes(code, "little")

    def integer(self, name, size, signed=False):
        """The value a constant variable (or a member of one) has in the image, or a clear line."""
        variable = self.find(name)
        data = None if variable is None else self._bytes(variable.address, size)
        if data is None:
            raise LauncherError(f"{shown(self.path)} has no constant called '{name}'")
        return int.from_bytes(data, "little", signed=signed)

    def text(self, address, longest=64):
        """The zero-terminated text at an address of the image."""
        text = bytearray()
        while len(text) < longest and (byte := self._bytes(address + len(text), 1)) not in (None, b"\0"):
            text += byte
        return text.decode("ascii", errors="replace")


# column of the trace, variable in the image, what one raw unit is worth, needed for the report
_CURRENT, _VOLTAGE, _ONE, _Q4 = "current", "voltage", 1.0, 1.0 / 16
WATCH = [
    ("i_d_A", "axes[0].loop.i_d_q15", _CURRENT, True),
    ("i_q_A", "axes[0].loop.i_q_q15", _CURRENT, True),
    ("i_d_ref_A", "axes[0].loop.i_d_ref_q15", _CURRENT, True),
    ("i_q_ref_A", "axes[0].loop.i_q_ref_q15", _CURRENT, True),
    ("v_d_V", "axes[0].loop.v_d_q15", _VOLTAGE, False),
    ("v_q_V", "axes[0].loop.v_q_q15", _VOLTAGE, False),
    ("vbus_fw_V", "axes[0].loop.vbus_q15", _VOLTAGE, False),
    ("angle_next_q32", "axes[0].loop.pll.angle_q32", _ONE, False),
    ("angle_offset_q32", "axes[0].loop.angle_offset_q32", _ONE, False),
    ("speed_fw_rpm", "axes[0].speed.speed_rpm_q4", _Q4, True),
    ("speed_ref_rpm", "axes[0].speed.speed_ref_rpm_q4", _Q4, True),
    ("count_fw", "axes[0].motion.turns.count", _ONE, False),
    ("following_counts", "axes[0].motion.position.error_counts", _ONE, False),
    ("cogging_A", "axes[0].motion.cogging_q15", _CURRENT, False),
    ("mode", "axes[0].mode", _ONE, False),
    ("observer_leads", "axes[0].loop.field_follows", 1 / 0xFFFFFFFF, False),
    ("observer_margin", "axes[0].loop.flux.margin_q8", 1 / 256, False),
    ("state", "axes[0].state", _ONE, True),
    ("fault", "axes[0].faults.cause", _ONE, True),
]


# the meaning of columns that hold an enum: the firmware keeps them as words
ENUM_COLUMNS = {"state": "axis_state", "fault": "fault", "mode": "axis_mode"}


def code_of(enum, name):
    """The number of an enumerator that is called NAME after its prefix (READY is DRIVE_READY); -1 when there is none."""
    return next((code for code, text in enum.items() if re.sub(r"^[A-Z]+?_", "", text) == name), -1)


def make_probes(symbols, drive):
    """The probes for this image and drive, and the enum names of the columns that have them: {column: {value: name}}."""
    scales = {_CURRENT: drive.params["i_range_ma"] / 1000 / 32768, _VOLTAGE: drive.params["v_range_mv"] / 1000 / 32768}
    probes = []
    for column, name, unit, needed in WATCH:
        variable = symbols.find(name)
        if variable is None or not variable.type:
            if needed:
                raise LauncherError(f"{shown(symbols.path)} has no number called '{name}', which the trace needs")
            continue
        probes.append(Probe(column, variable.address, variable.type, scales.get(unit, unit)))
    return probes, {column: symbols.enum(tag) for column, tag in ENUM_COLUMNS.items()}


def add_belief(trace):
    """Adds angle_fw_rad: the electrical angle of the field, unwrapped, that the firmware took for the sample of each row.

    A row shows the firmware's memory after its interrupt has answered the row's sample. By then the observer holds its
    prediction for the next sample (lib/pll.h); the angle that this sample was turned by stands in the row before.
    """
    if "angle_next_q32" not in trace or "angle_offset_q32" not in trace:
        return
    predicted = np.concatenate([trace["angle_next_q32"][:1], trace["angle_next_q32"][:-1]])
    turns = (predicted + trace["angle_offset_q32"]) / 2.0 ** 32
    trace["angle_fw_rad"] = np.unwrap(2 * np.pi * (turns % 1.0))
