# SPDX-License-Identifier: MIT
"""Worst-case cycles of the current loop's interrupt, each of its handlers, from the instructions of the linked image.

usage: wcet.py IMAGE.elf [KEY=N ...] [--measured LOG] [--tripped LOG]
       KEY: apb_read, apb_write, ppb, esram, envm_wait, cache, vector: the twin's keys cycles.*, with its defaults
       --measured   a log of interrupts (irqlog) to set beside the bound; fails if the bound is below
       --tripped    the same of a run that ends in a fault of the current loop

The longest way must be free of loops. What only a sample that trips executes is a bound of its own. Cycles of entry and
exit are included; interrupts that are more urgent do not exist; the cache is locked (drivers/mss/cache.h) unless cache=0 or 1.
"""
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
if str(ROOT / "qemu") not in sys.path:
    sys.path.insert(0, str(ROOT / "qemu"))

from addresses import Constants  # noqa: E402
from disasm import Image, ImageError  # noqa: E402
from entries import choices  # noqa: E402
from launcher.recording import read_recording  # noqa: E402
from longest import Longest  # noqa: E402
from timing import REFILL, Costs, Waits, default_waits  # noqa: E402

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


def waits_from(words):
    """The twin's waits, but for the KEY=N given."""
    values = dict(vars(default_waits()))
    for word in words:
        key, equals, number = word.partition("=")
        if not equals or key not in Waits.__dataclass_fields__ or not number.isdigit():
            raise ImageError(f"'{word}' is not KEY=N (keys: {', '.join(Waits.__dataclass_fields__)})")
        values[key] = int(number)
    return Waits(**values)


def largest(bounds):
    return Bound(*(max(getattr(b, name) for b in bounds) for name in ("latency", "whole", "fault")))


def show(bounds, waits, log=None, tripped=None, out=print):
    """Prints the bounds, {handler: Bound}; 1 if a measured figure is above the largest."""
    found = largest(bounds.values())
    names = ("latency: entry to the last PWM write", "whole interrupt", "whole interrupt, a sample that trips")
    figures = [None, None, None]
    if log:
        figures[1], figures[0], count = measured(log)
        out(f"measured: {count} interrupts")
    if tripped:
        figures[2] = measured(tripped)[0]
    settings = ", ".join(f"{key}={int(getattr(waits, key))}" for key in Waits.__dataclass_fields__)
    out(f"worst case by the instructions ({settings})")
    out(f"{'cycles':<40}{'latency':>8}{'whole':>7}{'trips':>7}")
    for name, one in bounds.items():
        out(f"{name:<40}{one.latency:>8}{one.whole:>7}{one.fault:>7}")
    out(f"\n{'of all':<40}{'bound':>7}{'measured':>10}{'above':>8}")
    wrong = 0
    for name, limit, figure in zip(names, (found.latency, found.whole, found.fault), figures):
        text = f"{figure:>10}{100 * (limit / figure - 1):>7.1f}%" if figure else ""
        out(f"{name:<40}{limit:>7}{text}")
        wrong += figure is not None and figure > limit
    if wrong:
        print("mssfoc: measured above the bound: the bound, or the twin's model, is wrong", file=sys.stderr)
    return 1 if wrong else 0


def main(arguments):
    words, logs = [], {}
    arguments = list(arguments)
    image = Image(arguments.pop(0))
    while arguments:
        word = arguments.pop(0)
        if word in ("--measured", "--tripped") and arguments:
            logs[word] = arguments.pop(0)
        else:
            words.append(word)
    waits = waits_from(words)
    bounds = {name: bound(image, waits, name) for name in handlers(image)}
    return show(bounds, waits, logs.get("--measured"), logs.get("--tripped"))


if __name__ == "__main__":
    if len(sys.argv) < 2:
        raise SystemExit(__doc__)
    try:
        sys.exit(main(sys.argv[1:]))
    except ImageError as error:
        raise SystemExit(f"mssfoc: {error}") from error
