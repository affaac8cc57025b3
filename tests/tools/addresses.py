# SPDX-License-Identifier: MIT
"""Where a function's loads and stores go, as far as the constants in its code tell."""
import re

from disasm import ImageError

CODE, RAM, APB, PPB = "code", "RAM", "APB", "PPB"
CODE_BUS, SYSTEM_BUS, PRIVATE_BUS = "code bus", "system bus", "private peripheral bus"
_BUS = {CODE: CODE_BUS, RAM: SYSTEM_BUS, APB: SYSTEM_BUS, PPB: PRIVATE_BUS}
_NO_RESULT = re.compile(r"^(cmp|cmn|tst|teq|b|cbn?z|it[te]*|nop|msr|dsb|dmb|isb|cps\w*|wfi|push|tbb|tbh|bx|bl|blx)$")
KEPT_POINTERS = {("axes", 12): "trig_chords"}  # axes[0].loop.sine, LOOP_SINE: current_loop_init()
_REGISTER = re.compile(r"\b(r\d\d?|sl|fp|ip|sp|lr|pc)\b")
CLOBBERED_BY_CALL = ("r0", "r1", "r2", "r3", "ip", "lr")


def region_of(address):
    """ARMv7-M memory map, B3.1; the fabric and the peripherals of this device lie at 0x40000000...0x5FFFFFFF."""
    if address is None:
        return None
    if address < 0x20000000:
        return CODE
    if address < 0x40000000:
        return RAM
    return APB if address < 0x60000000 else PPB if address >= 0xE0000000 else None


def region_bus(region):
    return _BUS.get(region)


def operand_registers(i):
    """(registers it writes as results, registers it updates as addresses, registers its address comes from)."""
    operands = i.operands.replace(" ", "")
    inside = re.search(r"\[(.*?)\]", operands)
    address = set(_REGISTER.findall(inside.group(1))) if inside else set()
    if i.mnemonic in ("push", "pop"):
        return (set(i.registers) if i.mnemonic == "pop" else set()), {"sp"}, {"sp"}
    if i.mnemonic.startswith(("ldm", "stm")):
        base = operands.split(",")[0]
        updated = {base.rstrip("!")} if "!" in base else set()
        return (set(i.registers) if i.mnemonic.startswith("ldm") else set()), updated, {base.rstrip("!")}
    updated = set(_REGISTER.findall(inside.group(1))[:1]) if inside and re.search(r"\]!|\],#", operands) else set()
    if i.mnemonic.startswith("str") or _NO_RESULT.match(i.mnemonic):
        return set(), updated, address
    names = operands.split("[")[0].split(",")
    count = 2 if i.mnemonic in ("ldrd", "smull", "umull", "smlal", "umlal") else 1
    return {name for name in names[:count] if _REGISTER.fullmatch(name)}, updated, address


class Constants:
    """Values of registers along a function: {address: {register: (value, exact)}}, for what is the same on every way.

    An inexact value is a pointer into an object whose index is not known: good for its region only.
    """

    def __init__(self, image, function):
        self.image, self.function, self.before = image, function, {}
        work = [(function.start, {"sp": (image.values.get("link_stack_top", 0x20000000), False)})]
        while work:
            address, state = work.pop()
            known = self.before.get(address)
            merged = state if known is None else {r: v for r, v in known.items() if state.get(r) == v}
            if merged != known:
                self.before[address] = merged
                instruction = function.code[address]
                after = self._after(instruction, merged)
                work += [(to, after) for to in function.successors(instruction) if to in function.code]

    def address(self, i):
        """(value, exact) of the address an access goes to, or (None, False)."""
        state, operands = self.before.get(i.address, {}), i.operands.replace(" ", "")
        if i.mnemonic in ("push", "pop"):
            return state.get("sp", (None, False))
        inside = re.search(r"\[(.*?)\]", operands)
        parts = (inside.group(1) if inside else operands.split(",")[0].rstrip("!")).split(",")
        if parts[0] == "pc":
            offset = int(parts[1][1:]) if len(parts) > 1 and parts[1].startswith("#") else 0
            return ((i.address + 4) & ~3) + offset, True
        value, exact = state.get(parts[0], (None, False))
        if value is None:
            return None, False
        if len(parts) > 1:
            if not parts[1].startswith("#"):
                return (value, False) if self._is_pointer(value) else (None, False)
            value += int(parts[1][1:])
        return value, exact

    def regions(self):
        """{address of the access: region or None}."""
        return {at: region_of(self.address(self.function.code[at])[0]) for at in self.before}

    def _is_pointer(self, value):
        return value >= 0x20000000 or any(start <= value < start + size for start, size in self.image.objects.values())

    def _after(self, i, state):
        after = dict(state)
        written, updated, _ = operand_registers(i)
        for register in written | updated:
            if register != "sp":
                after.pop(register, None)
        if i.flow.startswith("call"):
            for register in CLOBBERED_BY_CALL:
                after.pop(register, None)
        value = None if i.conditional else self._value(i, state)
        if value is not None and len(written) == 1 and "sp" not in written:
            after[next(iter(written))] = value
        return after

    def _value(self, i, state):
        parts = i.operands.replace(" ", "").split(",")
        name = re.sub(r"s$", "", i.mnemonic) if i.mnemonic in ("movs", "adds", "subs") else i.mnemonic
        if name == "ldr" and "[pc" in i.operands:
            try:
                return self.image.word(self.address(i)[0]), True
            except ImageError:
                return None
        if name == "ldr" and "[" in i.operands:
            return self._initial_pointer(*self.address(i))
        if name in ("mov", "movw") and len(parts) == 2:
            return (int(parts[1][1:]) & 0xFFFFFFFF, True) if parts[1].startswith("#") else state.get(parts[1])
        if name == "movt":
            low = state.get(parts[0])
            return low and ((low[0] & 0xFFFF) | int(parts[1][1:]) << 16, low[1])
        if name in ("add", "sub") and len(parts) >= 2:
            return self._sum(parts if len(parts) > 2 else [parts[0], *parts], state, 1 if name == "add" else -1)
        return None

    def _initial_pointer(self, address, exact):
        """A pointer in RAM that is initialised to a constant table is taken to stay there; KEPT_POINTERS are set at start."""
        if not exact or region_of(address) != RAM:
            return None
        for (name, offset), table in KEPT_POINTERS.items():
            if name in self.image.objects and address == self.image.objects[name][0] + offset:
                return self.image.objects[table][0], False
        try:
            value = self.image.word(address)
        except ImageError:
            return None
        return (value, False) if region_of(value) == CODE and self._is_pointer(value) else None

    def _sum(self, parts, state, sign):
        base = state.get(parts[1])
        if parts[2].startswith("#"):
            return base and ((base[0] + sign * int(parts[2][1:])) & 0xFFFFFFFF, base[1])
        pointers = [v for v in (base, state.get(parts[2]) if len(parts) == 3 else None) if v and self._is_pointer(v[0])]
        return (pointers[0][0], False) if sign > 0 and len(pointers) == 1 else None
