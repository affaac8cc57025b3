# SPDX-License-Identifier: MIT
"""Which functions a test executes, of the image at the twin or of the unit tests' libraries, and which a fault changes: a test
that executes none of those says nothing of the fault, and need not be asked.

A test that starts no twin of its own looks at what another of its file has started: it counts for all that those execute.
"""
import re
import struct
from collections import defaultdict

from elftools.elf.elffile import ELFFile
from elftools.elf.relocation import RelocationSection

SPAN = 0x80000  # as qemu/twin/reach.h has it
ESRAM = 2
CODE = (".text.unlikely.", ".text.startup.", ".text.")
QUIET = (".ARM.", ".eh_frame")  # how to unwind: nobody does


def _place(address):
    return (address % SPAN + (SPAN if address >> 28 == ESRAM else 0)) // 2


class Functions:
    """Those of a linked image."""

    def __init__(self, path):
        with open(path, "rb") as stream:
            table = ELFFile(stream).get_section_by_name(".symtab")
            self.places = [(symbol.name, symbol["st_value"] & ~1, symbol["st_size"]) for symbol in table.iter_symbols()
                           if symbol["st_info"]["type"] == "STT_FUNC" and symbol["st_size"]]

    def executed(self, bits):
        """The names of those of which the twin's TWIN_REACH saw any instruction."""
        number = int.from_bytes(bits, "little")
        return frozenset(name for name, address, size in self.places
                         if number >> _place(address) & ((1 << size // 2) - 1))


def _sections(path):
    """{name of a section that is loaded: (what it holds, what it refers to)}."""
    found, refers = {}, {}
    with open(path, "rb") as stream:
        file = ELFFile(stream)
        for section in file.iter_sections():
            if isinstance(section, RelocationSection):
                target, symbols = file.get_section(section["sh_info"]), file.get_section(section["sh_link"])
                refers[target.name] = [(r["r_offset"], r["r_info_type"], _referred(file, symbols.get_symbol(r["r_info_sym"])))
                                       for r in section.iter_relocations()]
            elif section["sh_flags"] & 2 and not section.name.startswith(QUIET):  # SHF_ALLOC
                found[section.name] = section.data() if section["sh_type"] != "SHT_NOBITS" else section["sh_size"]
    return {name: (data, refers.get(name)) for name, data in found.items()}


def _referred(file, symbol):
    if symbol["st_info"]["type"] != "STT_SECTION":
        return symbol.name
    return file.get_section(symbol["st_shndx"]).name


def changed_functions(pairs):
    """The functions that differ between objects as they were and as they are, [(path, path)]; None if more than code does."""
    names = set()
    for was, now in pairs:
        before, after = _sections(was), _sections(now)
        differ = {name for name in {*before, *after} if before.get(name) != after.get(name)}
        if any(not name.startswith(CODE) for name in differ):
            return None
        names |= {_function(name) for name in differ & set(before)}
    return frozenset(names)


def _function(section):
    return section.removeprefix(next(prefix for prefix in CODE if section.startswith(prefix)))


# ---- the unit tests' libraries ----

LIBRARIES = {name: f"build/tests/unit/{name}.so" for name in ("firmware", "system")}


class Entered:
    """Which functions of the libraries tests enter, from what watch.py has left of them."""

    def __init__(self):
        self.by_test, self.by_file, self.places = defaultdict(set), defaultdict(set), {}

    def names(self, root, library):
        """{place: name} of a library's functions."""
        if library not in self.places:
            with open(root / LIBRARIES[library], "rb") as stream:
                table = ELFFile(stream).get_section_by_name(".symtab")
                self.places[library] = {symbol["st_value"]: re.sub(r"\..*", "", symbol.name) for symbol in table.iter_symbols()
                                        if symbol["st_info"]["type"] == "STT_FUNC" and symbol["st_value"]}
        return self.places[library]

    def take(self, root, folder, tests):
        """Of the tests that were run as this list."""
        for path in sorted(folder.glob("*.places")):
            whose, *_, library, _ = path.name.split(".")
            names = self.names(root, library)
            places = {names[place] for (place,) in struct.iter_unpack("<I", path.read_bytes()) if place in names}
            test = tests[int(whose.removeprefix("file-"))]
            if whose.startswith("file-"):
                self.by_file[test.file] |= places
            else:
                self.by_test[test.name] |= places

    def known(self):
        """Every function that could be entered."""
        return frozenset(name for names in self.places.values() for name in names.values())

    def of(self, test):
        """None where nothing is known: nothing of the file enters any."""
        found = frozenset(self.by_test[test.name] | self.by_file[test.file])
        of_file = any(seen for name, seen in self.by_test.items() if name.split("::")[0] == test.file)
        return found if found or of_file or self.by_file[test.file] else None


def entered_by(fault, changed, known):
    """The functions of the libraries that a fault is in; None if that cannot be said: then every unit test concerns it."""
    if fault.function in known:
        return frozenset({fault.function})
    if changed is None or fault.file.endswith(".h"):
        return None
    return changed & known or None


def of_tests(functions_of, tests, bits):
    """{name of a test: functions it executes}, of those of whose file anything is known.

    functions_of   the Functions of a product: what was executed where says something of the image that was run alone
    bits           {name: what the twin left}
    """
    own = {test.name: functions_of(test.product).executed(bits[test.name]) for test in tests
           if test.product and test.name in bits}
    by_file = defaultdict(frozenset)
    for name, seen in own.items():
        by_file[name.split("::")[0]] |= seen
    return {test.name: own.get(test.name) or by_file[test.file] for test in tests if by_file.get(test.file)}
