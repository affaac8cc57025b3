# SPDX-License-Identifier: MIT
"""Addresses of the firmware's variables from the DWARF of the ELF: what a debugger's live watch does.

The image has no code for this. The twin reads the memory at these addresses once a PWM period.
"""
from dataclasses import dataclass

import numpy as np
from elftools.common.exceptions import ELFError
from elftools.elf.elffile import ELFFile

from .errors import LauncherError
from .paths import shown

_TRANSPARENT = ("DW_TAG_typedef", "DW_TAG_const_type", "DW_TAG_volatile_type")
_SIGNED_ENCODINGS = (0x05, 0x06)  # DW_ATE_signed, DW_ATE_signed_char
_UNSIGNED_ENCODINGS = (0x02, 0x07, 0x08)  # DW_ATE_boolean, DW_ATE_unsigned, DW_ATE_unsigned_char
_TYPES = {(1, False): "u8", (1, True): "s8", (2, False): "u16", (2, True): "s16", (4, False): "u32", (4, True): "s32"}


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
            with open(elf_path, "rb") as file:
                elf = ELFFile(file)
                if not elf.has_dwarf_info():
                    raise LauncherError(f"{shown(elf_path)} has no debug information (built without -g?)")
                self._dwarf = elf.get_dwarf_info()
                self._functions = self._function_addresses(elf)
                self._segments = [(segment["p_vaddr"], segment.data()) for segment in elf.iter_segments()
                                  if segment["p_type"] == "PT_LOAD"]
                self._collect()
        except OSError as error:
            raise LauncherError(f"cannot read {shown(elf_path)}: {error.strerror} (run make first)") from error
        except ELFError as error:
            raise LauncherError(f"{shown(elf_path)} is not an ELF file: {error}") from error

    def _collect(self):
        """Variables with a fixed address (name -> address, type DIE), enums by tag, and the compiler's own description."""
        self._globals, self._enums, self.producer = {}, {}, ""
        for unit in self._dwarf.iter_CUs():
            top = unit.get_top_DIE()
            if "DW_AT_producer" in top.attributes:
                self.producer = self.producer or top.attributes["DW_AT_producer"].value.decode(errors="replace")
            for die in top.iter_children():
                if die.tag == "DW_TAG_variable":
                    self._add_variable(die)
                elif die.tag == "DW_TAG_enumeration_type" and "DW_AT_name" in die.attributes:
                    self._enums.setdefault(die.attributes["DW_AT_name"].value.decode(), die)

    @staticmethod
    def _function_addresses(elf):
        """name -> address of the first instruction (bit 0, the Thumb mark, cleared)."""
        table = elf.get_section_by_name(".symtab")
        return {} if table is None else {symbol.name: symbol["st_value"] & ~1 for symbol in table.iter_symbols()
                                         if symbol["st_info"]["type"] == "STT_FUNC"}

    def _bytes(self, address, size):
        """What the image loads there, or None."""
        for start, data in self._segments:
            if start <= address and address - start + size <= len(data):
                return data[address - start:address - start + size]
        return None

    def _add_variable(self, die):
        location = die.attributes.get("DW_AT_location")
        if location is None or not isinstance(location.value, list):
            return
        if len(location.value) != 5 or location.value[0] != 0x03:  # DW_OP_addr and 32 bits
            return
        declared = die
        if "DW_AT_specification" in die.attributes:  # declared in a header first
            declared = die.get_DIE_from_attribute("DW_AT_specification")
        if "DW_AT_name" in declared.attributes:
            typed = die if "DW_AT_type" in die.attributes else declared
            name = declared.attributes["DW_AT_name"].value.decode()
            self._globals[name] = (int.from_bytes(bytes(location.value[1:]), "little"), self._type(typed))

    def enum(self, tag):
        """value -> enumerator of `enum tag`, empty when there is none of that name."""
        die = self._enums.get(tag)
        if die is None:
            return {}
        return {child.attributes["DW_AT_const_value"].value: child.attributes["DW_AT_name"].value.decode()
                for child in die.iter_children() if child.tag == "DW_TAG_enumerator"}

    @staticmethod
    def _type(die):
        """The type of a DIE without typedefs and qualifiers, or None."""
        while die is not None and "DW_AT_type" in die.attributes:
            die = die.get_DIE_from_attribute("DW_AT_type")
            if die.tag not in _TRANSPARENT:
                return die
        return None

    def find(self, name):
        """The Variable of a dotted name, or None when the image has none of that name."""
        head, *members = name.replace("[", ".[").split(".")
        if head not in self._globals:
            return None
        address, kind = self._globals[head]
        for member in members:
            step = self._element(kind, member) if member.startswith("[") else self._member(kind, member)
            if step is None:
                return None
            address, kind = address + step[0], step[1]
        return self._variable(name, address, kind)

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

    def _member(self, kind, name):
        if kind is None or kind.tag not in ("DW_TAG_structure_type", "DW_TAG_union_type"):
            return None
        for child in kind.iter_children():
            if child.tag == "DW_TAG_member" and child.attributes.get("DW_AT_name") is not None \
                    and child.attributes["DW_AT_name"].value.decode() == name:
                offset = child.attributes.get("DW_AT_data_member_location")
                return (offset.value if offset else 0), self._type(child)
        return None

    def _element(self, kind, index_text):
        if kind is None or kind.tag != "DW_TAG_array_type" or not index_text[1:-1].isdigit():
            return None
        element = self._type(kind)
        return int(index_text[1:-1]) * element.attributes["DW_AT_byte_size"].value, element

    @staticmethod
    def _variable(name, address, kind):
        if kind is None or "DW_AT_byte_size" not in kind.attributes:
            return Variable(name, address, "")
        size = kind.attributes["DW_AT_byte_size"].value
        encoding = kind.attributes["DW_AT_encoding"].value if "DW_AT_encoding" in kind.attributes else None
        if kind.tag != "DW_TAG_enumeration_type" and encoding not in _SIGNED_ENCODINGS + _UNSIGNED_ENCODINGS:
            return Variable(name, address, "")
        return Variable(name, address, _TYPES.get((size, encoding in _SIGNED_ENCODINGS), ""))


# column of the trace, variable in the image, what one raw unit is worth, needed for the report
_CURRENT, _VOLTAGE, _ONE, _Q4 = "current", "voltage", 1.0, 1.0 / 16
WATCH = [
    ("i_d_A", "current_loop.i_d_q15", _CURRENT, True),
    ("i_q_A", "current_loop.i_q_q15", _CURRENT, True),
    ("i_d_ref_A", "current_loop.i_d_ref_q15", _CURRENT, True),
    ("i_q_ref_A", "current_loop.i_q_ref_q15", _CURRENT, True),
    ("v_d_V", "current_loop.v_d_q15", _VOLTAGE, False),
    ("v_q_V", "current_loop.v_q_q15", _VOLTAGE, False),
    ("vbus_fw_V", "current_loop.vbus_q15", _VOLTAGE, False),
    ("angle_next_q32", "current_loop.pll.angle_q32", _ONE, False),
    ("angle_offset_q32", "current_loop.angle_offset_q32", _ONE, False),
    ("speed_fw_rpm", "speed_loop.speed_rpm_q4", _Q4, True),
    ("speed_ref_rpm", "speed_loop.speed_ref_rpm_q4", _Q4, True),
    ("state", "drive.state", _ONE, True),
    ("fault", "drive.fault", _ONE, True),
]


# the meaning of columns that hold an enum: the firmware keeps them as words
ENUM_COLUMNS = {"state": "drive_state", "fault": "fault"}


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
