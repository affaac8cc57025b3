# SPDX-License-Identifier: MIT
"""What the ELF says of the image's variables, types and functions, as plain data that can be kept.

Reading DWARF takes a third of a second, so the answer is kept beside the ELF. It is told to be of this very ELF, and of this
very reader, by a hash of both; runs in parallel may write it at the same time, for each replaces the file whole.
"""
import base64
import hashlib
import json
import os
import tempfile
from pathlib import Path

from .errors import Refused

_TRANSPARENT = ("DW_TAG_typedef", "DW_TAG_const_type", "DW_TAG_volatile_type")
_SIGNED_ENCODINGS = (0x05, 0x06)  # DW_ATE_signed, DW_ATE_signed_char
_UNSIGNED_ENCODINGS = (0x02, 0x07, 0x08)  # DW_ATE_boolean, DW_ATE_unsigned, DW_ATE_unsigned_char
_NUMBERS = {(1, False): "u8", (1, True): "s8", (2, False): "u16", (2, True): "s16", (4, False): "u32", (4, True): "s32",
            (8, False): "u64", (8, True): "s64"}


def described(elf_path):
    """{"producer": text, "functions": {name: address}, "variables": {name: [address, type]}, "enums": {tag: [[value, name]]},
    "segments": [[address, base64]], "types": [...]}; a type is an index into "types", or None. A type has "size" (bytes or
    None), "number" ("s32", ... or ""), "enum" (its tag or ""), "members" ({name: [offset, type]}), "element" (type of an
    array's elements) and "count" (of them, or None).
    """
    try:
        content = Path(elf_path).read_bytes()
    except OSError as error:
        raise Refused(f"cannot read {elf_path}: {error.strerror} (run make first)") from error
    key = hashlib.sha256(content + Path(__file__).read_bytes()).hexdigest()
    kept = Path(f"{elf_path}.symbols")
    known = _kept(kept, key)
    if known is None:
        known = _read(elf_path)
        _keep(kept, key, known)
    return known


def _kept(path, key):
    try:
        entry = json.loads(path.read_text())
        return entry["symbols"] if entry["key"] == key else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _keep(path, key, symbols):
    """A folder that cannot be written to costs time, nothing else."""
    draft = None
    try:
        handle, draft = tempfile.mkstemp(prefix=path.name, dir=path.parent)
        with os.fdopen(handle, "w") as file:
            json.dump({"key": key, "symbols": symbols}, file)
        os.replace(draft, path)
    except OSError:
        if draft:
            Path(draft).unlink(missing_ok=True)


def _read(elf_path):
    from elftools.common.exceptions import ELFError  # half of the launcher's start-up, for what is mostly kept
    from elftools.elf.elffile import ELFFile

    try:
        with open(elf_path, "rb") as file:
            elf = ELFFile(file)
            if not elf.has_dwarf_info():
                raise Refused(f"{elf_path} has no debug information (built without -g?)")
            return {**_Reader().read(elf.get_dwarf_info()), "functions": _functions(elf), "segments": _segments(elf)}
    except ELFError as error:
        raise Refused(f"{elf_path} is not an ELF file: {error}") from error


def _functions(elf):
    """The address of the first instruction has bit 0, the Thumb mark, cleared."""
    table = elf.get_section_by_name(".symtab")
    return {symbol.name: symbol["st_value"] & ~1 for symbol in (table.iter_symbols() if table else ())
            if symbol["st_info"]["type"] == "STT_FUNC"}


def _segments(elf):
    """What the image loads, and where."""
    return [[segment["p_vaddr"], base64.b64encode(segment.data()).decode()] for segment in elf.iter_segments()
            if segment["p_type"] == "PT_LOAD"]


def found(known, name):
    """(address, type) of a dotted name, log[2].code; None when the image has none of that name."""
    head, *members = name.replace("[", ".[").split(".")
    address, kind = known["variables"].get(head, (None, None))
    for member in members:
        entry = {"members": {}, "element": None} if kind is None else known["types"][kind]
        step = _element(known, entry, member[1:-1]) if member.startswith("[") else entry["members"].get(member)
        if step is None:
            return None
        address, kind = address + step[0], step[1]
    return None if address is None else (address, kind)


def _element(known, entry, index):
    size = None if entry["element"] is None else known["types"][entry["element"]]["size"]
    if size is None or not index.isdigit() or (entry["count"] is not None and int(index) >= entry["count"]):
        return None
    return int(index) * size, entry["element"]


class _Reader:
    """Variables with a fixed address, the types they lead to, enums by tag, and the compiler's own description."""

    def __init__(self):
        self._types, self._known = [], {}

    def read(self, dwarf):
        variables, enums, producer = {}, {}, ""
        for unit in dwarf.iter_CUs():
            top = unit.get_top_DIE()
            if "DW_AT_producer" in top.attributes:
                producer = producer or top.attributes["DW_AT_producer"].value.decode(errors="replace")
            for die in top.iter_children():
                if die.tag == "DW_TAG_variable":
                    variables.update(self._variable(die))
                elif die.tag == "DW_TAG_enumeration_type" and "DW_AT_name" in die.attributes:
                    enums.setdefault(_name(die), _enumerators(die))
        return {"producer": producer, "variables": variables, "enums": enums, "types": self._types}

    def _variable(self, die):
        location = die.attributes.get("DW_AT_location")
        if location is None or not isinstance(location.value, list):
            return {}
        if len(location.value) != 5 or location.value[0] != 0x03:  # DW_OP_addr and 32 bits
            return {}
        declared = die
        if "DW_AT_specification" in die.attributes:  # declared in a header first
            declared = die.get_DIE_from_attribute("DW_AT_specification")
        if "DW_AT_name" not in declared.attributes:
            return {}
        typed = die if "DW_AT_type" in die.attributes else declared
        return {_name(declared): [int.from_bytes(bytes(location.value[1:]), "little"), self._type(typed)]}

    def _type(self, die):
        """The index of the type of a DIE without typedefs and qualifiers, or None."""
        while "DW_AT_type" in die.attributes:
            die = die.get_DIE_from_attribute("DW_AT_type")
            if die.tag not in _TRANSPARENT:
                return self._index(die)
        return None

    def _index(self, die):
        if die.offset not in self._known:
            self._known[die.offset] = len(self._types)
            size = die.attributes.get("DW_AT_byte_size")
            entry = {"size": size.value if size else None, "number": _number(die), "enum": "", "members": {}, "element": None,
                     "count": None}
            self._types.append(entry)
            if die.tag in ("DW_TAG_structure_type", "DW_TAG_union_type"):
                entry["members"] = self._members(die)
            elif die.tag == "DW_TAG_enumeration_type" and "DW_AT_name" in die.attributes:
                entry["enum"] = _name(die)
            elif die.tag == "DW_TAG_array_type":
                entry["element"], entry["count"] = self._type(die), _count(die)
        return self._known[die.offset]

    def _members(self, die):
        found = {}
        for child in die.iter_children():
            if child.tag == "DW_TAG_member" and "DW_AT_name" in child.attributes:
                offset = child.attributes.get("DW_AT_data_member_location")
                found[_name(child)] = [offset.value if offset else 0, self._type(child)]
        return found


def _name(die):
    return die.attributes["DW_AT_name"].value.decode()


def _number(die):
    """How the twin reads it, or empty if it is no number that the twin reads."""
    size, encoding = die.attributes.get("DW_AT_byte_size"), die.attributes.get("DW_AT_encoding")
    encoding = encoding.value if encoding else None
    if size is None or (die.tag != "DW_TAG_enumeration_type" and encoding not in _SIGNED_ENCODINGS + _UNSIGNED_ENCODINGS):
        return ""
    return _NUMBERS.get((size.value, encoding in _SIGNED_ENCODINGS), "")


def _count(die):
    """Of an array's elements; None where it is not said."""
    ranges = [child.attributes for child in die.iter_children() if child.tag == "DW_TAG_subrange_type"]
    bound = ranges[0].get("DW_AT_upper_bound") if ranges else None
    return bound.value + 1 if bound is not None and isinstance(bound.value, int) else None


def _enumerators(die):
    return [[child.attributes["DW_AT_const_value"].value, _name(child)]
            for child in die.iter_children() if child.tag == "DW_TAG_enumerator"]
