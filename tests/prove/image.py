# SPDX-License-Identifier: MIT
"""What the linked image says of itself: where symbols are, the members of a structure, the words of a constant, the code."""
import struct

import disassembly
from disassembly import Code, Unknown
from elftools.elf.elffile import ELFFile


class Image:
    def __init__(self, path):
        self.path = path
        with open(path, "rb") as file:
            elf = ELFFile(file)
            self.symbols = {symbol.name: (symbol["st_value"] & ~1, symbol["st_size"])
                            for symbol in elf.get_section_by_name(".symtab").iter_symbols()}
            self.parts = [(s["p_vaddr"], s.data()) for s in elf.iter_segments() if s["p_type"] == "PT_LOAD"]
            self.structures = _structures(elf.get_dwarf_info())

    def address(self, name):
        if name not in self.symbols:
            raise Unknown(f"symbol {name}: it is not in {self.path}")
        return self.symbols[name][0]

    def words(self, name):
        """Of a constant, signed."""
        start, size = self.symbols[name]
        for address, data in self.parts:
            if address <= start and start + size <= address + len(data):
                return struct.unpack_from(f"<{size // 4}i", data, start - address)
        raise Unknown(f"constant {name}: it is in no segment of {self.path}")

    def members(self, name):
        """{offset: name} of the members of 32 bits, those of inner structures included."""
        return dict(_flat(self.structures[name], self.structures, 0))

    def code(self, *names):
        """Of all these functions together."""
        found = disassembly.functions(self.path, set(names))
        missing = set(names) - set(found)
        if missing:
            raise Unknown(f"functions {', '.join(sorted(missing))}: not in {self.path}")
        parts = [found[name] for name in names]
        return Code(sum((part.instructions for part in parts), []), {k: v for part in parts for k, v in part.words.items()})


def _structures(dwarf):
    """{name: [(member, offset, name of its structure or None, its size)]}"""
    found = {}
    for unit in dwarf.iter_CUs():
        for die in unit.get_top_DIE().iter_children():
            if die.tag == "DW_TAG_structure_type" and "DW_AT_name" in die.attributes and die.has_children:
                found.setdefault(_name(die), [_member(child) for child in die.iter_children()
                                              if child.tag == "DW_TAG_member"])
    return found


def _member(die):
    kind = die.get_DIE_from_attribute("DW_AT_type")
    while kind.tag in ("DW_TAG_typedef", "DW_TAG_const_type", "DW_TAG_volatile_type"):
        kind = kind.get_DIE_from_attribute("DW_AT_type")
    size = kind.attributes["DW_AT_byte_size"].value if "DW_AT_byte_size" in kind.attributes else 0
    inner = _name(kind) if kind.tag == "DW_TAG_structure_type" else None
    return _name(die), die.attributes["DW_AT_data_member_location"].value, inner, size


def _name(die):
    return die.attributes["DW_AT_name"].value.decode() if "DW_AT_name" in die.attributes else ""


def _flat(members, structures, start):
    for name, offset, inner, size in members:
        if inner:
            yield from _flat(structures[inner], structures, start + offset)
        elif size == 4:
            yield start + offset, name
