# SPDX-License-Identifier: MIT
"""Jitter of the current loop: cycles of its interrupt and its start relative to the PWM, over all operating points.

usage: jitter.py      runs qemu/scenarios/operating_points.toml, on MOTOR

Where two interrupts did not take the same number of cycles, the instruction that made the difference is named, by its
source line: from the twin's record of both ways through the handler (irqpath).
"""
import csv
import os
import re
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path += [str(ROOT / "qemu"), str(ROOT / "linker/bounds")]

from disasm import Image, ImageError  # noqa: E402

HANDLER, EXCEPTION = "FabricIrq0_IRQHandler", 50
FEWEST_INTERRUPTS = 100_000
CHAINED_IN, CHAINED_OUT = 1, 2  # bits of the column `chained`
# what the drive does when, by the labels of qemu/scenarios/operating_points.toml
POINTS = (("bridge off", "on - 0.14", "on"), ("zero of the sensors, alignment", "on", "started"),
          ("standstill", "started + 0.05", "slow"), ("slow, both ways", "slow + 0.05", "up"),
          ("working speed", "load - 0.05", "load"), ("working speed, rated load", "back - 0.2", "back"),
          ("reversal under load", "back", "unload - 0.15"), ("working speed backwards, rated load", "unload - 0.1", "unload"),
          ("largest speed, backwards", "fast - 0.1", "fast"), ("full reversal", "fast", "braking - 0.15"),
          ("largest speed, forwards", "braking - 0.1", "braking"), ("torque control", "braking", "stop"),
          ("braking to 0", "stop", "quick"), ("quick stop", "quick", "quick + 0.15"))


@dataclass
class Difference:
    """One instruction that took another number of cycles, or after which another way was taken."""
    address: int
    cycles: int   # more than in the commonest interrupt
    kind: str     # "return", "way" or "cycles"
    after: int = 0  # "way": where the other way went on


def read_ways(path):
    """{cycles of the interrupt: [(address, cycles of the instruction)]} of an irqpath file."""
    ways = {}
    with open(path, encoding="ascii", newline="") as stream:
        for row in csv.DictReader(stream):
            ways.setdefault(int(row["cycles"]), []).append((int(row["address"], 16), int(row["instruction_cycles"])))
    return ways


def differences(common, other):
    """[Difference] between two ways: the branches where they part, and on the common stretches each other count."""
    found, a, b = [], 0, 0
    while a < len(common) and b < len(other):
        (at, cost), (other_at, other_cost) = common[a], other[b]
        if at != other_at:
            a2, b2 = _meet(common, other, a, b)
            found.append(Difference(common[a - 1][0] if a else at, sum(c for _, c in other[b:b2]) - sum(
                c for _, c in common[a:a2]) + other[b - 1][1] - common[a - 1][1], "way", other_at))
            if found[-2:-1] and found[-2].address == found[-1].address:  # the branch's own cycles are in the way's
                found.pop(-2)
            a, b = a2, b2
            continue
        if cost != other_cost:
            last = a == len(common) - 1 and b == len(other) - 1
            found.append(Difference(at, other_cost - cost, "return" if last else "cycles"))
        a, b = a + 1, b + 1
    return found


def _meet(common, other, a, b):
    """The nearest later places at which both ways go on at the same address."""
    seen = {}
    for n in range(b, len(other)):
        seen.setdefault(other[n][0], n)
    for n in range(a, len(common)):
        if common[n][0] in seen:
            return n, seen[common[n][0]]
    return len(common), len(other)


def described(image, ways, counts):
    """Lines that name what makes each duration differ from the commonest one."""
    lines = []
    common = max(counts, key=counts.get)
    for cycles in sorted(set(counts) - {common}):
        if cycles not in ways or common not in ways:
            lines.append(f"  {cycles} cycles, {counts[cycles]} times: no way recorded")
            continue
        parts = differences(ways[common], ways[cycles])
        entry = cycles - common - sum(part.cycles for part in parts)
        lines.append(f"  {cycles} cycles, {counts[cycles]} times; against {common}:")
        if entry:
            lines.append(f"    {entry:+d}  exception entry: tail-chained to the interrupt before")
        where = image.lines_of([part.address for part in parts]) if parts else {}
        for part in parts:
            instruction = image.at(part.address).code[part.address]
            place = " in ".join(f"{name} ({line})" for name, line in where[part.address][:2])
            what = {"return": "exception exit: tail-chains into the next interrupt",
                    "way": f"the way parts after it, to {part.after:#x}", "cycles": "other operands, bus or neighbour"}
            lines.append(f"    {part.cycles:+d}  {part.address:#x} {instruction}: {what[part.kind]}; {place}")
    return lines


def could_differ(image):
    """Lines for every instruction of the handler whose cycles may depend on data, whether they did or not."""
    function = image.functions[HANDLER]
    chosen = [i for i in function.code.values()
              if i.flow == "branch" or re.match(r"(s|u)(div|mull|mlal)$", i.mnemonic)
              or (i.conditional and re.match(r"(ldr|str|ldm|stm|pop|push|ml[as]$)", i.mnemonic))]
    where = image.lines_of([i.address for i in chosen])
    for i in chosen:
        name, line = where[i.address][0]
        yield f"  {i.address:#x} {i!s:<16} {name} ({line})"


def masks(image):
    """Names of the functions that hold interrupts back."""
    return sorted({f.name for f in image.functions_at.values() for i in f.code.values() if i.mnemonic == "cpsid"})


def spread(values):
    return f"{values.min():.0f}...{values.max():.0f}"


def histogram(values, unit):
    counts = Counter(values.astype(int).tolist())
    return [f"  {value:>6} {unit:<7}{count:>8}  {'#' * max(1, round(50 * count / len(values)))}"
            for value, count in sorted(counts.items())]


def points(names):
    """[(name, start, end)] of POINTS in seconds; `names` are those of the scenario."""
    from launcher.expression import number

    return [(name, number(start, names), number(end, names)) for name, start, end in POINTS]


def by_point(log, trace, limit, names):
    """Table rows of the operating points."""
    rows = [f"{'operating point':<36}{'interrupts':>10}{'cycles':>12}{'start / ns':>14}{'|v| of limit':>14}"]
    voltage = 100 * np.hypot(trace["v_d_V"], trace["v_q_V"]) / (limit * np.maximum(trace["vbus_fw_V"], 1e-9))
    for name, start, end in points(names):
        inside = (log["t_s"] >= start) & (log["t_s"] < end)
        if not inside.any():
            raise ImageError(f"no interrupt at the operating point '{name}'")
        during = (trace["t_s"] >= start) & (trace["t_s"] < end)
        rows.append(f"{name:<36}{inside.sum():>10}{spread(log['cycles'][inside]):>12}"
                    f"{spread(log['start_pwm_ns'][inside]):>14}{voltage[during].max():>12.0f} %")
    return rows


def current_loop_only(log):
    chosen = log["exception"] == EXCEPTION
    return {name: values[chosen] for name, values in log.items()}


def report(image, log, trace, ways, limit, names, out=print):
    """Prints everything there is to say about one run."""
    intrinsic = log["cycles"][log["chained"] == 0]
    out(f"{len(log['t_s'])} interrupts of the current loop")
    for line in by_point(log, trace, limit, names):
        out(line)
    out(f"cycles, entry and exit included: {spread(log['cycles'])}; {spread(intrinsic)} where no other interrupt adjoins")
    for line in histogram(log["cycles"], "cycles"):
        out(line)
    out(f"start, ns from the PWM period's start to the first instruction: {spread(log['start_pwm_ns'])}")
    for line in histogram(10 * np.round(log["start_pwm_ns"] / 10), "ns"):
        out(line)
    out(f"start, ns from the interrupt's rise: {spread(log['start_ns'])}. Sooner than the usual: tail-chained. Later: by the"
        f" instruction or the entry of another\nexception that the core ends first, or where interrupts are held back: in"
        f" {', '.join(masks(image))}")
    counts = Counter(log["cycles"].astype(int).tolist())
    out("what makes the difference:" if len(counts) > 1 else "no interrupt differs from another")
    for line in described(image, ways, counts):
        out(line)
    out(f"instructions of {HANDLER} whose cycles could depend on data:")
    for line in could_differ(image):
        out(line)


def main():
    from launcher import simulate
    from launcher.load import load_irqlog

    motor = os.environ.get("MOTOR")
    build = Path(os.environ.get("BUILD", "build"))
    image = Image(build / "mssfoc.elf")
    options = {"motor": motor} if motor else {}
    result = simulate("operating_points", out_dir=build / "jitter", way_of=EXCEPTION, plant="ideal",
                      spread=0, **options)
    if not result.passed:
        raise ImageError("the run misses a limit of its scenario: its timing would be that of a fault")
    log = current_loop_only(load_irqlog(result.irqlog))
    if len(log["t_s"]) < FEWEST_INTERRUPTS:
        raise ImageError(f"{len(log['t_s'])} interrupts, fewer than {FEWEST_INTERRUPTS}")
    report(image, log, result.trace, read_ways(build / "jitter" / "irqpath.csv"), 1 / np.sqrt(3), result.scenario.names)
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except ImageError as error:
        raise SystemExit(f"mssfoc: {error}") from error
