# SPDX-License-Identifier: MIT
"""Where the cycles of a function go: its instructions along the longest way, each with its cycles and their reason.

usage: listing.py IMAGE.elf FUNCTION

The rules are those of the bounds (timing.py), data at their worst, memory answers at once. Accesses through pointers that come
from outside are taken to go to RAM. The function's own cycles: the BL that calls it is not among them. What only a sample that
trips executes in the current loop is left out, as wcet.py does.
"""
import re
import sys
from dataclasses import dataclass
from pathlib import Path

import remarks
from addresses import RAM, Constants, operand_registers
from disasm import Image, ImageError
from longest import Longest
from timing import (REFILL, Costs, Waits, base_update, is_load, is_multiple, is_single_load, is_single_store, register_offset,
                    touches_memory)
from wcet import FAULT_CALLS

ROOT = Path(__file__).resolve().parents[2]
CYCCNT = 0xE0001004  # DWT, ARMv7-M C1.8
NOTE_WIDTH = 80
LOAD, STORE, PRODUCT, CONSTANT, DATA, CONDITION, FLOW, OTHER = KINDS = (
    "loads", "stores", "products", "constants", "data processing", "conditions", "calls and branches", "other")


@dataclass(frozen=True)
class Step:
    """One instruction on the way."""
    address: int
    text: str
    cycles: int
    kind: str
    why: str


def costs_of(image, function):
    """With what the constants in the code tell of each access; RAM where they tell nothing."""
    return Costs(Waits(), {at: region or RAM for at, region in Constants(image, function).regions().items()})


def steps(image, function):
    """[Step] from the first instruction to the return. Their sum is that of the longest way: anything else is an error."""
    bound, costs = Longest(image, lambda other: costs_of(image, other), avoid=FAULT_CALLS), costs_of(image, function)
    way = bound.to_return(function)
    found, before, jumped = [], None, True
    for at, following in zip(way.path, [*way.path[1:], None]):
        i = function.code[at]
        reasons, call = why(costs, i, before, jumped), i.flow.startswith("call")
        taken = following is not None and (following != i.end or call)
        cycles = costs.step(i, before, jumped) + costs.leave(i, taken)
        if call:
            inside = image.functions_at[i.targets[0]]
            cycles += bound.cycles(inside)
            reasons.append(f"{bound.cycles(inside)} in {inside.name}")
        found.append(Step(at, str(i), cycles, kind(i), "; ".join(reasons + branch_reason(i, taken, call))))
        before, jumped = None if call else i, taken
    if sum(step.cycles for step in found) != way.cycles:
        raise ImageError(f"{function.name}: the listing has not the cycles of the longest way, {way.cycles}")
    return found


def between_readings(image, function, found):
    """Those of a function's steps that stand between its first and its last reading of the cycle counter."""
    constants = Constants(image, function)
    readings = [n for n, step in enumerate(found)
                if step.kind == LOAD and constants.address(function.code[step.address])[0] == CYCCNT]
    if len(readings) < 2:
        raise ImageError(f"{function.name} does not read the cycle counter twice")
    return found[readings[0] + 1:readings[-1]]


def kind(i):
    if i.mnemonic.startswith("it") or (i.conditional and not i.flow):
        return CONDITION
    if i.flow:
        return FLOW
    if is_load(i):
        return LOAD
    if touches_memory(i):
        return STORE
    if re.match(r"^(mul|mla|mls|[su]mull|[su]mlal)s?$", i.mnemonic):
        return PRODUCT
    if re.match(r"^(movw?|movt|movs|mvn|mvns)$", i.mnemonic) and "#" in i.operands and "," not in i.operands.split("#")[1]:
        return CONSTANT
    return OTHER if re.match(r"^(dsb|dmb|isb|cps\w*|mrs|msr|nop|wfi)$", i.mnemonic) else DATA


def why(costs, i, before, jumped):
    """The rules that make the cycles of `i`, as words; what costs the usual one cycle needs none."""
    reasons = [text for text in (_execution(costs, i, before),) if text]
    if before is not None and touches_memory(i):
        if costs._hazards(i, before) and is_single_store(before):
            reasons.append("+1 store before" if is_load(i) else "+1 base update before")
        if costs._writes_late(before) & operand_registers(i)[2]:
            reasons.append("+1 address just computed")
    if jumped and i.size == 4 and i.address % 4:
        reasons.append("+1 target of 32 bits on a halfword")
    return reasons


def _execution(costs, i, before):
    name, pipelined = i.mnemonic, costs._pipelined(i, before)
    if re.match(r"^it[te]{0,3}$", name):
        return "folded behind 16 bits" if before is not None and before.size == 2 else "behind 32 bits"
    if is_single_load(i):
        return "load behind a load" if pipelined else "load: address, data"
    if is_single_store(i):
        offset = ", register offset" if register_offset(i) else ", base update" if base_update(i) else ""
        return f"store behind a load{offset}" if pipelined else f"store{offset}"
    if name in ("ldrd", "strd"):
        return "address, two words"
    if is_multiple(i):
        refill = f", {REFILL} to go on there" if i.flow == "return" else ""
        return f"address, {len(i.registers)} words{refill}"
    if name in ("smull", "umull"):
        return "64-bit product, wide operands"
    if name in ("smlal", "umlal"):
        return "64-bit product and sum, wide operands"
    if name in ("mla", "mls"):
        return "product, then sum" if name == "mla" else "product, then difference"
    if name in ("udiv", "sdiv"):
        return "quotient, at most"
    if i.flow == "return":
        return "return: refill" if name == "bx" else "return by a load of the PC"
    if i.conditional and not i.flow:
        return "also when skipped"
    return ""


def branch_reason(i, taken, call):
    if call:
        return ["call: refill"]
    if i.flow in ("branch", "jump"):
        return ["taken: refill" if taken else "not taken"]
    return []


class Sources:
    """What the source says beside an instruction: the comment of a line of assembly, or the line of C itself."""

    def __init__(self, image, addresses):
        self._chains, self._files = image.lines_of(addresses), {}

    def chain(self, address):
        """[(function, file, line number)] from the innermost inlined function outwards."""
        found = []
        for name, place in self._chains.get(address, []):
            path, _, number = place.rpartition(":")
            if number.isdigit():
                found.append((name, path, int(number)))
        return found

    def lines(self, path):
        """The lines of a file of this repository, or none."""
        if path not in self._files:
            file = ROOT / path
            inside = file.is_file() and ROOT in file.resolve().parents
            self._files[path] = file.read_text().split("\n") if inside else []
        return self._files[path]

    def line(self, path, number):
        lines = self.lines(path)
        return lines[number - 1].strip() if 0 < number <= len(lines) else ""

    def note(self, step):
        chain = self.chain(step.address)
        if not chain:
            return ""
        _, path, number = chain[0]
        text = self.line(path, number)
        if path.endswith(".S"):
            return remarks.remark(text) or remarks.of_macro(text, self.lines(path), step.text)
        return text


def texts(found, sources):
    """Each step's cycles, instruction, rule and source."""
    for step in found:
        yield f"{step.cycles:>3}  {step.text:<38} {step.why:<34} {sources.note(step)[:NOTE_WIDTH]}".rstrip()


def main(path, name):
    image = Image(path)
    if name not in image.functions:
        raise ImageError(f"{path} has no function {name}")
    found = steps(image, image.functions[name])
    print("\n".join(texts(found, Sources(image, [step.address for step in found]))))
    print(f"{sum(step.cycles for step in found):>3}  together")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    try:
        main(*sys.argv[1:])
    except ImageError as error:
        raise SystemExit(f"mssfoc: {error}") from error
