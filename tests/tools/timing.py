# SPDX-License-Identifier: MIT
"""Upper bounds of the Cortex-M3's cycles, instruction by instruction and pair by pair, for code that is not executed.

Rules: Cortex-M3 Technical Reference Manual r2p1, 3.3, where it gives a range the upper end, and docs/timing.md. What a
rule makes depend on data (products of 64 bits, quotients, conditions) counts as it is at its worst; what it makes depend
on addresses is taken from constants found in the code (addresses.py), at its worst where they are not known.
"""
import re
from dataclasses import dataclass
from pathlib import Path

from addresses import APB, CODE, PPB, RAM, SYSTEM_BUS, operand_registers, region_bus

ROOT = Path(__file__).resolve().parents[2]
ENTRY, EXIT = 12, 10  # without wait states, the vector over another bus than the stack
FRAME_WORDS = 8        # that an exit pops
LOCKED_BYTES = 8192    # drivers/mss/cache.h
REFILL = 3  # of POP and LDM with the PC; an exception's return has it in EXIT
TAKEN, NOT_TAKEN, COMPARE_TAKEN = 2, 1, 3
_LONG = {"smull": 5, "umull": 5, "smlal": 7, "umlal": 7}
_SINGLE_LOAD = re.compile(r"^ldr(s?[bh])?$")
_SINGLE_STORE = re.compile(r"^str[bh]?$")


@dataclass(frozen=True)
class Waits:
    """Wait cycles of one access, as the twin's keys cycles.* have them. The defaults of the keys: default_waits()."""
    apb_read: int = 0
    apb_write: int = 0
    ppb: int = 0
    esram: int = 0
    envm_wait: int = 0  # of a read and of a fetch that the cache does not serve
    cache: int = 1      # 2: the device's, locked as start-up locks it
    vector: int = 0     # more of an entry whose vector comes over the stack's bus: the firmware's does

    def of(self, region, is_store):
        """Wait cycles of one word in a region; None: the region is not known."""
        apb = self.apb_write if is_store else self.apb_read
        known = {APB: apb, PPB: self.ppb, RAM: 0 if is_store else self.esram, CODE: self.fetch(None)}
        return max(known.values()) if region is None else known[region]

    def fetch(self, address):
        """Of a word of code or constants; None: anywhere."""
        served = self.cache == 1 or (self.cache == 2 and address is not None and address < LOCKED_BYTES)
        return 0 if served else self.envm_wait

    @property
    def entry(self):
        return ENTRY + self.vector + self.esram

    @property
    def exit(self):
        return EXIT + FRAME_WORDS * self.esram


def default_waits(keys=ROOT / "qemu" / "twin" / "cycles_keys.c"):
    """The wait cycles the twin uses when it is told none."""
    found = dict(re.findall(r"KEY\((\w+),[^,]+,[^,]+,\s*(\d+)\)", keys.read_text()))
    return Waits(**{key: int(found[key]) for key in Waits.__dataclass_fields__})


def is_single_load(i):
    return bool(_SINGLE_LOAD.match(i.mnemonic)) and i.flow == ""


def is_single_store(i):
    return bool(_SINGLE_STORE.match(i.mnemonic))


def is_multiple(i):
    return i.mnemonic in ("push", "pop") or i.mnemonic.startswith(("ldm", "stm"))


def is_load(i):
    """Loads of the PC, too."""
    return bool(_SINGLE_LOAD.match(i.mnemonic)) or i.mnemonic in ("ldrd", "pop") or i.mnemonic.startswith("ldm")


def touches_memory(i):
    return is_load(i) or is_single_store(i) or i.mnemonic in ("strd", "push", "tbb", "tbh") or i.mnemonic.startswith("stm")


def base_update(i):
    return bool(re.search(r"\]!|\],\s*#", i.operands))


def register_offset(i):
    inside = re.search(r"\[(.*?)\]", i.operands)
    return bool(inside and re.search(r",\s*(r\d|sl|fp|ip|lr)", inside.group(1)))


def words(i):
    if is_multiple(i):
        return len(i.registers)
    return 2 if i.mnemonic in ("ldrd", "strd") else 1 if touches_memory(i) else 0


class Costs:
    """cost(instruction, before, waits...): `regions` maps the address of an access to its region or None."""

    def __init__(self, waits, regions):
        self.waits, self.regions = waits, regions

    def bus(self, i):
        return region_bus(self.regions.get(i.address))

    def memory_waits(self, i):
        """A load waits for its words; of a store's words the last is posted: stall() and posted() have it."""
        if not touches_memory(i):
            return 0
        if re.search(r"\[pc\b", i.operands):
            return words(i) * self.waits.fetch(i.address)  # a constant stands behind its function
        is_store = not is_load(i)
        return (words(i) - is_store) * self.waits.of(self.regions.get(i.address), is_store)

    def stall(self, i, pending):
        """Cycles that `i` waits for the write posted before it, which takes `pending` cycles more."""
        meets = touches_memory(i) and self.bus(i) in (None, SYSTEM_BUS)
        return pending if meets or i.mnemonic in ("dsb", "dmb") else 0

    def posted(self, i, pending):
        """Cycles that a posted write still takes when `i` is done: at most, so `i` counts with its fewest cycles."""
        if touches_memory(i) and not is_load(i):
            return self.waits.of(self.regions.get(i.address), True)
        return 0 if self.stall(i, pending) else max(0, pending - self._fewest(i))

    @staticmethod
    def _fewest(i):
        """Folded instructions and stores behind loads take none; of a branch leave() counts."""
        return 0 if i.mnemonic.startswith("it") or is_single_store(i) or i.flow else 1

    def fetch_waits(self, i):
        """Where memory does not answer at once each word of code waits; at worst no word serves two instructions."""
        return self.waits.fetch(i.address) * (1 if i.address % 4 + i.size <= 4 else 2)

    def step(self, i, before, jumped):
        """Cycles of `i` after `before` (None at an entry); `jumped`: by a taken branch. Calls count as their BL only."""
        cost = max(self._execution(i, before), 1 if self.waits.fetch(i.address) else 0)
        cost += self.memory_waits(i) + self.fetch_waits(i)
        if before is not None:
            cost += self._hazards(i, before)
        if jumped:
            cost += 1 if i.size == 4 and i.address % 4 else 0
        return cost

    def _execution(self, i, before):
        name = i.mnemonic
        pipelined = self._pipelined(i, before)
        if name.startswith("it") and re.match(r"^it[te]{0,3}$", name):
            return 0 if before is not None and before.size == 2 else 1
        if is_single_load(i):
            return 1 if pipelined else 2
        if is_single_store(i):
            return max(1 if i.conditional else 0, (2 if register_offset(i) else 1) - (1 if pipelined else 0))
        if name in ("ldrd", "strd"):
            return 3
        if is_multiple(i):
            return 1 + len(i.registers) + (REFILL if i.flow == "return" else 0)
        if name in ("mla", "mls"):
            return 2
        if name in _LONG:
            return _LONG[name]
        if name in ("udiv", "sdiv"):
            return 12
        if name in ("dsb", "dmb"):
            return 4
        if name == "isb":
            return 3
        if name in ("cbz", "cbnz", "b", "bl"):
            return 0  # on the way out: leave()
        if name in ("tbb", "tbh"):
            return 6
        if name == "bx" and i.operands == "lr":
            return 3 if before is not None and "lr" in operand_registers(before)[0] else 2
        if i.flow in ("call pointer", "jump pointer", "return"):
            return 5 if name.startswith("ldr") else 3
        return 1

    def leave(self, i, taken):
        """Cycles of a branch itself, by which way it goes on."""
        if i.mnemonic in ("cbz", "cbnz"):
            return COMPARE_TAKEN if taken else NOT_TAKEN
        if i.mnemonic in ("b", "bl"):
            return TAKEN if taken else NOT_TAKEN
        return 0

    def _pipelined(self, i, before):
        if before is None or not is_single_load(before) or before.conditional or base_update(before) or base_update(i):
            return False
        same_bus = self.bus(i) is not None and self.bus(i) == self.bus(before)
        loaded = operand_registers(before)[0]
        return same_bus and not loaded & operand_registers(i)[2]

    def _hazards(self, i, before):
        extra = 0
        if touches_memory(i) and self._writes_late(before) & operand_registers(i)[2]:
            extra += 1
        if is_single_store(before) and is_load(i):
            extra += 1
        elif is_single_store(before) and base_update(before) and touches_memory(i):
            extra += 1
        return extra

    @staticmethod
    def _writes_late(before):
        written = set() if touches_memory(before) else operand_registers(before)[0]  # a load's are there when it ends
        if before.mnemonic in _LONG:  # of a 64-bit product only the high half comes late
            return {before.operands.replace(" ", "").split(",")[1]}
        return written

