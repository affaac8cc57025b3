# SPDX-License-Identifier: MIT
"""Debug information of a shared library, as far as C's interface goes: read once for each build, which takes ten seconds, and
kept beside the library. A type of one name and size is there once, in whichever translation units its header is."""
import os
import pickle
from dataclasses import dataclass, field

from elftools.elf.elffile import ELFFile

TOP = ("DW_TAG_structure_type", "DW_TAG_enumeration_type", "DW_TAG_subprogram", "DW_TAG_variable")
CHILDREN = ("DW_TAG_member", "DW_TAG_enumerator", "DW_TAG_subrange_type", "DW_TAG_formal_parameter")
REFERENCES = ("DW_AT_type", "DW_AT_specification")
KEPT = ("DW_AT_name", "DW_AT_declaration", "DW_AT_external", "DW_AT_low_pc", "DW_AT_location", "DW_AT_encoding",
        "DW_AT_byte_size", "DW_AT_bit_size", "DW_AT_upper_bound", "DW_AT_data_member_location", "DW_AT_const_value")


@dataclass
class Entry:
    tag: str
    number: int
    attributes: dict                                # without those in REFERENCES
    refers: dict = field(default_factory=dict)      # {one of them: number of an entry}
    children: list = field(default_factory=list)    # numbers

    @property
    def name(self):
        return self.attributes["DW_AT_name"].decode() if "DW_AT_name" in self.attributes else None


def entries(path):
    """(all of them, those at the top): Entry.number is its place among all."""
    status, kept = os.stat(path), f"{path}.interface"
    if os.path.exists(kept):
        with open(kept, "rb") as file:
            made_of, found = pickle.load(file)
        if made_of == (status.st_size, status.st_mtime_ns):
            return found
    found = _read(path)
    with open(f"{kept}.{os.getpid()}", "wb") as file:
        pickle.dump(((status.st_size, status.st_mtime_ns), found), file)
    os.replace(file.name, kept)
    return found


def _read(path):
    whole, places, top = [], {}, []
    with open(path, "rb") as file:
        for unit in ELFFile(file).get_dwarf_info().iter_CUs():
            top += [_number(die, whole, places) for die in unit.get_top_DIE().iter_children() if die.tag in TOP]
    return whole, [whole[number] for number in dict.fromkeys(top)]


def _number(die, whole, places):
    attributes = {name: die.attributes[name].value for name in KEPT if name in die.attributes}
    name, is_type = attributes.get("DW_AT_name"), die.tag.endswith("_type") or die.tag == "DW_TAG_typedef"
    place = (die.tag, name, attributes.get("DW_AT_byte_size")) if name and is_type else die.offset
    if place not in places:
        entry = Entry(die.tag, len(whole), attributes)
        places[place] = entry.number
        whole.append(entry)
        for reference in REFERENCES:
            if reference in die.attributes:
                entry.refers[reference] = _number(die.get_DIE_from_attribute(reference), whole, places)
        entry.children += [_number(child, whole, places) for child in die.iter_children() if child.tag in CHILDREN]
    return places[place]
