# SPDX-License-Identifier: MIT
"""Worst-case cycles of the current loop's interrupt, each of its handlers, from the instructions of the linked image.

usage: wcet.py IMAGE.elf LOG TRIPPED
       the logs of interrupts (irqlog) of a run and of one that ends in a fault of the current loop; fails if a bound is below

The longest way must be free of loops. What only a sample that trips executes is a bound of its own. Cycles of entry and exit
are included; interrupts that are more urgent do not exist; waits are the twin's; the cache is locked (drivers/mss/cache.h).
"""
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path += [str(ROOT / "qemu"), str(ROOT / "linker/bounds")]

from addresses import Constants  # noqa: E402
from disasm import Image, ImageError  # noqa: E402
from entries import choices  # noqa: E402
from launcher.recording import read_recording  # noqa: E402
from longest import Longest  # noqa: E402
from timing import REFILL, Costs, default_waits  # noqa: E402

HANDLER, EXCEPTION = "FabricIrq0_IRQHandler", 50
FAULT_CALLS = ("current_loop_fault", "drive_sample_fault", "fault_raise")
LOOPS = {"axis_up_ms": 0}  # reads again if the clock moved meanwhile: not under the most urgent interrupt
PWM = range(0x50000000, 0x50000100)  # docs/fabric.md, slot 0


@dataclass
class Bound:
    latency: int  # exception entry until the last PWM write is done
    whole: int    # exception entry to return
    fault: int    # the same for a sample that trips


def bound(image, waits, handler=HANDLER):
    function = image.functions.get(handler)
    if function is None:
        raise ImageError(f"the image has no {handler}")
    known = {}

    def costs(of):
        if of.name not in known:
            known[of.name] = Costs(waits, Constants(image, of).regions())
        return known[of.name]

    normal = Longest(image, costs, avoid=FAULT_CALLS)
    way = normal.to_return(function)
    constants = Constants(image, function)
    writes = [w.cycles for i, w in normal.ways(function) if i.mnemonic == "str" and constants.address(i)[0] in PWM]
    if not writes:
        raise ImageError(f"{handler} does not write the PWM")
    fault = Longest(image, costs, LOOPS).to_return(function)
    after = waits.exit - (REFILL if function.code[way.path[-1]].mnemonic != "bx" else 0)
    return Bound(waits.entry + max(writes), waits.entry + way.cycles + after, waits.entry + fault.cycles + waits.exit)


def handlers(image):
    """Names: the one that stands in the vector table first, then the others that may."""
    return [HANDLER, *(f.name for f in choices(image).get(EXCEPTION, []) if f.name != HANDLER)]


def measured(path):
    """(most cycles, most cycles to the last PWM write, interrupts) of the current loop in a log of interrupts."""
    log = read_recording(path, "log of interrupts")
    current = log["exception"] == EXCEPTION
    if not current.any():
        raise ImageError(f"{path} has no interrupt of the current loop")
    return int(log["cycles"][current].max()), int(log["latency_cycles"][current].max()), int(current.sum())


def largest(bounds):
    return Bound(*(max(getattr(b, name) for b in bounds) for name in ("latency", "whole", "fault")))


def show(bounds, log, tripped):
    """Prints the bounds, {handler: Bound}; 1 if a measured figure is above the largest."""
    found, (whole, latency, count), (trip, *_) = largest(bounds.values()), measured(log), measured(tripped)
    print(f"measured: {count} interrupts\nworst case by the instructions")
    print(f"{'cycles':<40}{'latency':>8}{'whole':>7}{'trips':>7}")
    for name, one in bounds.items():
        print(f"{name:<40}{one.latency:>8}{one.whole:>7}{one.fault:>7}")
    print(f"\n{'of all':<40}{'bound':>7}{'measured':>10}{'above':>8}")
    rows = (("latency: entry to the last PWM write", found.latency, latency), ("whole interrupt", found.whole, whole),
            ("whole interrupt, a sample that trips", found.fault, trip))
    for name, limit, figure in rows:
        print(f"{name:<40}{limit:>7}{figure:>10}{100 * (limit / figure - 1):>7.1f}%")
    wrong = any(figure > limit for _, limit, figure in rows)
    if wrong:
        print("mssfoc: measured above the bound: the bound, or the twin's model, is wrong", file=sys.stderr)
    return int(wrong)


def main(path, log, tripped):
    image = Image(path)
    return show({name: bound(image, default_waits(), name) for name in handlers(image)}, log, tripped)


if __name__ == "__main__":
    if len(sys.argv) != 4:
        raise SystemExit(__doc__)
    try:
        sys.exit(main(*sys.argv[1:]))
    except ImageError as error:
        raise SystemExit(f"mssfoc: {error}") from error
