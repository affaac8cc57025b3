# SPDX-License-Identifier: MIT
"""C for tests in Python: structures, enums and functions of a shared library, as its own debug information describes them.

    c = Library("firmware.so")
    axis = c.axis()                  # struct axis, members by name
    c.drive_step(axis)                # a structure where a pointer is expected is passed by address
    c.enums["fault"]["FAULT_NONE"]   # and c.FAULT_NONE

Nothing is declared twice, so a test cannot disagree with the header.
"""
import ctypes

from elftools.elf.elffile import ELFFile

from rigs.debug_info import entries

INTEGERS = {(True, 1): ctypes.c_int8, (True, 2): ctypes.c_int16, (True, 4): ctypes.c_int32, (True, 8): ctypes.c_int64,
            (False, 1): ctypes.c_uint8, (False, 2): ctypes.c_uint16, (False, 4): ctypes.c_uint32, (False, 8): ctypes.c_uint64}
BOOLEAN, FLOAT, SIGNED, SIGNED_CHAR = 0x02, 0x04, 0x05, 0x06
PREFIXES = {"axis_state": "AXIS", "flying_result": "FLYING", "slot_state": "SLOT"}  # of the others it is the enum's own name
TRANSPARENT = ("DW_TAG_typedef", "DW_TAG_const_type", "DW_TAG_volatile_type", "DW_TAG_restrict_type")


class Named(ctypes.Structure):
    """Its members are told by their names: their order is the firmware's affair."""
    __slots__ = ()

    def __init__(self, **members):
        super().__init__(**members)


class Library:
    motors = 1  # for so many it is compiled
    structure = Named
    loaded = []

    def __init__(self, path):
        self.loaded.append(self)
        self._library = ctypes.CDLL(str(path))
        self._made = {}
        self.structs, self.enums = {}, {}
        self._entries, top = entries(path)
        for entry in top:
            self._take(entry)

    def __getattr__(self, name):
        for table in (self.structs, *self.enums.values()):
            if name in table:
                return table[name]
        raise AttributeError(f"the library has no '{name}' in its debug information")

    def name(self, enum, value):
        """The enumerator's, without what all of that enum begin with: "STALL" of c.name("fault", 14)."""
        return next(name for name, number in self.enums[enum].items() if number == value)[len(PREFIXES.get(enum, enum)) + 1:]

    def address_of_static(self, name, beside):
        """Where a static variable stands, by the symbols: as far from `beside`, which can be found by its name."""
        with open(self._library._name, "rb") as file:
            symbols = ELFFile(file).get_section_by_name(".symtab")
            static, known = (symbols.get_symbol_by_name(one)[0]["st_value"] for one in (name, beside))
        return ctypes.addressof(ctypes.c_char.in_dll(self._library, beside)) + static - known

    def _take(self, die):
        name = die.name
        if "DW_AT_declaration" in die.attributes:
            return
        if die.tag == "DW_TAG_structure_type" and name:
            self._type(die)
        elif die.tag == "DW_TAG_enumeration_type" and name:
            self.enums[name] = self._members(die)
        elif die.tag == "DW_TAG_subprogram" and "DW_AT_external" in die.attributes:  # inlined elsewhere or not
            self._function(name, die)
        elif die.tag == "DW_TAG_variable" and "DW_AT_location" in die.attributes:
            declared = self._entries[die.refers.get("DW_AT_specification", die.number)]
            name, kind = declared.name, self._of(declared)
            if kind is not None and hasattr(self._library, name):
                setattr(self, name, kind.in_dll(self._library, name))

    def _function(self, name, die):
        function = getattr(self._library, name, None)
        if function is not None:
            function.restype = self._of(die)
            function.argtypes = [self._of(child) for child in self._children(die, "DW_TAG_formal_parameter")]
            setattr(self, name, function)

    def _of(self, die):
        """The ctypes type that `die` refers to; None for void."""
        return self._type(self._entries[die.refers["DW_AT_type"]]) if "DW_AT_type" in die.refers else None

    def _children(self, die, tag):
        return [child for child in map(self._entries.__getitem__, die.children) if child.tag == tag]

    def _type(self, die):
        if die.tag in TRANSPARENT:
            return self._of(die)
        if die.number not in self._made:
            getattr(self, "_" + die.tag.removeprefix("DW_TAG_"))(die)
        return self._made[die.number]

    def _base_type(self, die):
        encoding, size = die.attributes["DW_AT_encoding"], die.attributes["DW_AT_byte_size"]
        kind = ctypes.c_bool if encoding == BOOLEAN else INTEGERS.get((encoding in (SIGNED, SIGNED_CHAR), size))
        kind = ctypes.c_double if (encoding, size) == (FLOAT, 8) else kind  # a model's, never the firmware's
        self._made[die.number] = kind or ctypes.c_char * size

    def _enumeration_type(self, die):
        self._made[die.number] = INTEGERS[(min(self._members(die).values(), default=0) < 0, die.attributes["DW_AT_byte_size"])]

    def _pointer_type(self, die):
        self._made[die.number] = ctypes.c_void_p  # for a structure that points to itself; of a function, whatever it takes
        if "DW_AT_type" in die.refers and self._entries[die.refers["DW_AT_type"]].tag == "DW_TAG_subroutine_type":
            return
        target = self._of(die)
        if target is not None:
            self._made[die.number] = ctypes.c_char_p if target is ctypes.c_int8 else ctypes.POINTER(target)

    def _subroutine_type(self, die):
        self._made[die.number] = ctypes.CFUNCTYPE(
            self._of(die), *[self._of(child) for child in self._children(die, "DW_TAG_formal_parameter")])

    def _array_type(self, die):
        kind = self._of(die)
        counts = [child.attributes for child in self._children(die, "DW_TAG_subrange_type")]
        for count in reversed(counts):
            upper = count.get("DW_AT_upper_bound")
            kind = kind * (upper + 1 if upper is not None else 0)
        self._made[die.number] = kind

    def _structure_type(self, die):
        self._aggregate(die, self.structure)

    def _union_type(self, die):
        self._aggregate(die, ctypes.Union)

    def _aggregate(self, die, base):
        name = die.name
        known, declared = self.structs.get(name) if name else None, "DW_AT_declaration" in die.attributes
        if known is not None and (declared or ctypes.sizeof(known) == die.attributes["DW_AT_byte_size"]):
            self._made[die.number] = known  # the same header in another translation unit
            return
        only_declared = known is not None and not hasattr(known, "_fields_")
        kind = known if only_declared else type(name or "anonymous", (base,), {"__slots__": ()})  # no member but C's
        self._made[die.number] = kind
        if name:
            self.structs[name] = kind
        if declared:
            return
        members = self._children(die, "DW_TAG_member")
        if any("DW_AT_bit_size" in child.attributes for child in members):  # FILE of the C library; ctypes packs otherwise
            kind._fields_ = [("opaque", ctypes.c_char * die.attributes["DW_AT_byte_size"])]
            return
        fields = [(child.name or f"anonymous_{number}", self._of(child)) for number, child in enumerate(members)]
        kind._anonymous_ = [field for (field, _), child in zip(fields, members) if not child.name]
        kind._fields_ = fields
        for (field, _), child in zip(fields, members):
            at = child.attributes.get("DW_AT_data_member_location")
            assert getattr(kind, field).offset == (at or 0), f"{name}.{field} is laid out otherwise"

    def _members(self, die):
        return {child.name: child.attributes["DW_AT_const_value"] for child in self._children(die, "DW_TAG_enumerator")}
