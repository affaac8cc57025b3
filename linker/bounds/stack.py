# SPDX-License-Identifier: MIT
"""Worst-case stack of every entry point, with nesting, from the linked image; and how deep it went in a run.

usage: stack.py IMAGE.elf OBJECT_DIR             the table; fails if a bound does not fit its reservation
       stack.py --linker IMAGE.elf OBJECT_DIR    the bounds as options for the linker, which then refuses what does not fit
       stack.py --measure IMAGE.elf OBJECT_DIR   the table, then a run in the twin and the high-water mark beside the bound

The depth is followed through the instructions (frames.py) and must agree with what the compiler says of each of its own
functions (crosscheck.py). Recursion, a frame of unknown size or a call through a pointer whose targets are not known
is an error, not a guess.
"""
import sys
from dataclasses import dataclass

from crosscheck import check_against_compiler
from disasm import Image, ImageError
from entries import HARDWARE_FRAME, source_priorities, vector_entries, with_priorities
from frames import deepest

# A fault inside the fault handler is a HardFault, and an NMI can interrupt that: each starts anew below the one before.
FAULT_LEVELS = 3


@dataclass
class Row:
    name: str
    own: int
    nested: int  # with everything less urgent below it and its hardware frame; 0: on the fault stack
    chain: tuple


@dataclass
class Bounds:
    rows: list
    main: int
    main_reserved: int
    fault: int
    fault_reserved: int

    @property
    def fits(self):
        return self.main <= self.main_reserved and self.fault <= self.fault_reserved


def bounds(image, priorities):
    """The bound of each entry point, and of both stacks."""
    reset, fault, entries = vector_entries(image)
    own, chain = deepest(image, reset)
    rows, total = [Row(reset.name, own, own, chain)], own
    entries = with_priorities(entries, priorities)
    for level in sorted({entry.priority for entry in entries}, reverse=True):
        worst = 0
        for entry in (e for e in entries if e.priority == level):  # equals do not interrupt each other
            own, chain = deepest(image, entry.function)
            rows.append(Row(entry.function.name, own, total + HARDWARE_FRAME + own, chain))
            worst = max(worst, HARDWARE_FRAME + own)
        total += worst
    own, chain = deepest(image, fault)
    rows.append(Row("every fault", own, 0, (fault.name, *chain[1:])))
    return Bounds(rows, total + HARDWARE_FRAME, image.value("link_stack_top") - image.value("link_stack_limit"),
                  FAULT_LEVELS * own + (FAULT_LEVELS - 1) * HARDWARE_FRAME,
                  image.value("link_fault_stack_top") - image.value("link_fault_stack_limit"))


def show(found, agreed, out=print):
    out(f"{'entry point':<24}{'own bytes':>10}{'nested':>8}  deepest chain")
    for row in found.rows:
        out(f"{row.name:<24}{row.own:>10}{row.nested or '':>8}  {' > '.join(row.chain[1:])}")
    out(f"main stack: at most {found.main} of {found.main_reserved} bytes, with the frame of a fault on top")
    out(f"fault stack: at most {found.fault} of {found.fault_reserved} bytes, {FAULT_LEVELS} levels")
    out(f"frames and calls of {agreed} functions agree with the compiler's")


def worked_out(image_path, objects):
    image = Image(image_path)
    agreed = check_against_compiler(image, objects)
    return image, bounds(image, source_priorities()), agreed


def main(image_path, objects, mode=""):
    image, found, agreed = worked_out(image_path, objects)
    if mode == "--linker":
        print(f"-Wl,--defsym=LINK_STACK_BOUND={found.main},--defsym=LINK_FAULT_STACK_BOUND={found.fault}")
        return 0
    show(found, agreed)
    if not found.fits:
        print("mssfoc: the stack does not fit; enlarge it in linker/m2s010.ld", file=sys.stderr)
        return 1
    if mode == "--measure":
        from highwater import compare
        return compare(image, found)
    return 0


if __name__ == "__main__":
    arguments = sys.argv[1:]
    chosen = arguments.pop(0) if arguments[:1] in (["--linker"], ["--measure"]) else ""
    if len(arguments) != 2:
        raise SystemExit(__doc__)
    try:
        sys.exit(main(*arguments, chosen))
    except ImageError as error:
        raise SystemExit(f"mssfoc: {error}") from error
