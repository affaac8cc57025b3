# SPDX-License-Identifier: MIT
"""The tables of docs/best-loop.md: what best_loop.py promises at four rates, and how present_loop.py fits what the twin has
measured (tests/campaign/best_loop_twin.toml).

usage: best_loop_page.py        writes the tables; nothing is played
"""
import math
import statistics
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / folder) for folder in ("qemu", "tests/tools", "tests/campaign")]

from launcher.errors import LauncherError  # noqa: E402

import best_loop  # noqa: E402
import best_loop_twin as twin  # noqa: E402
import pages  # noqa: E402
import present_loop  # noqa: E402
from present_loop import ENCODER, HALL, NAMES, OBSERVER  # noqa: E402

PAGE = ROOT / "docs/best-loop.md"
RATES_HZ = (1000, 2000, 4000, 8000)
WITHIN, SOFT_HZ = 0.2, 300  # of what was measured; of a coupling
# Hz of the coupling, load by rotor, dip in ms of a PI with a disk margin of 0.5 as issue 46 was given it, at 1 and 4 kHz
TOLD = ((22, 45, 46, 11), (53, 25, 25, 13), (25, 16, 15, 8.7), (169, 42, 200, 17), (165, 9, 27, 5.0), (234, 70, 393, 25),
        (253, 1.5, 9.4, 1.8), (22, 1, 2.1, 1.0))
TOLD_LATE_S, TOLD_DAMPING = (0.25e-3, 0.2e-3, 0.2e-3, 0.2e-3), 0.03  # at RATES_HZ; of critical, as shipped motors


def table(heads, rows):
    lines = [heads, ["---"] + ["--:"] * (len(heads) - 1), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def predicted(names):
    """{name: (drive, shaft, today's Figures)} of those that can be set up."""
    found = {}
    for name in names:
        try:
            drive, shaft, share = twin.plant_of(name)
            found[name] = drive, shaft, present_loop.figures_of(drive, shaft, share)
        except LauncherError:
            continue
    return found


# ---- against the twin ------------------------------------------------------------------------------------------------

def source_of(drive):
    return drive.motor["control"]["angle_source"]


def coupling(shaft):
    return "rigid" if shaft.is_rigid else f"{shaft.resonance_hz:.0f} Hz"


def fits(found, measured, sources):
    """[(name, shaft, (predicted, measured) of dip in ms, of the crossover in Hz, of the margin in degrees)] where the model is
    stable and the drive has answered with its own gains."""
    rows = []
    for name, (drive, shaft, today) in found.items():
        seen = measured.get(name, {})
        if source_of(drive) in sources and math.isfinite(today.dip_s) and "dip_ms" in seen and not seen["warned"]:
            crossover, margin = present_loop.first_crossover(drive, shaft, today.gains)
            rows.append((name, shaft, (1e3 * today.dip_s, seen["dip_ms"]), (crossover, seen["crossover_hz"]),
                         (margin, seen["margin_deg"])))
    return rows


def fit_table(found, measured):
    """Of shipped motors, and of lots on a coupling."""
    return table(("machine", "coupling", "dip, ms: model / twin", "ratio", "crossover, Hz", "margin, degrees"),
                 [(name, coupling(shaft), f"{dip[0]:.2f} / {dip[1]:.2f}", f"{dip[0] / dip[1]:.2f}",
                   f"{hz[0]:.0f} / {hz[1]:.0f}", f"{deg[0]:.0f} / {deg[1]:.0f}")
                  for name, shaft, dip, hz, deg in fits(found, measured, (ENCODER,)) if not shaft.is_rigid])


def spoken(rows):
    """Median and worst ratio, how many lie within WITHIN."""
    ratios = {what: [row[place][0] / row[place][1] for row in rows] for what, place in
              (("dip", 2), ("crossover", 3), ("margin", 4))}
    parts = []
    for what, values in ratios.items():
        worst = max(values, key=lambda value: abs(math.log(value)))
        near = sum(abs(value - 1) <= WITHIN for value in values)
        parts.append(f"{what}: median {statistics.median(values):.2f}, worst {worst:.2f}, {near} of {len(values)} within 20 %")
    return "; ".join(parts)


def fit_summary(found, measured):
    lines = []
    for words, sources, chosen in (("encoder, rigid", (ENCODER,), True), ("encoder, on a coupling", (ENCODER,), False),
                                   ("no encoder, by lag alone", (HALL, OBSERVER), None)):
        rows = [row for row in fits(found, measured, sources) if chosen in (None, row[1].is_rigid)]
        lines.append(f"- {words}: model by twin, {spoken(rows)}")
    return "\n".join(lines) + "\n"


def told(seen):
    return seen.get("ended") or ("warned of an oscillation" if seen["warned"] else "")


def swing_table(found, measured):
    """Machines with an encoder of which the model, or the drive, says that they swing."""
    rows, right = [], {True: [], False: []}
    for name, (drive, shaft, today) in found.items():
        swings, seen = not math.isfinite(today.dip_s), measured.get(name)
        if source_of(drive) != ENCODER or not seen:
            continue
        right[swings].append(bool(told(seen)) is swings)
        if swings or told(seen):
            ring = f"{present_loop.ring_hz(drive, shaft, today.gains):.0f} Hz" if swings else ""
            rows.append((name, coupling(shaft), "swings" if swings else "stable", ring, told(seen) or "runs",
                         f"{seen['swing_hz']:.0f} Hz" if "swing_hz" in seen else ""))
    counts = [f"{sum(right[swings])} of {len(right[swings])}" for swings in (True, False)]
    return table(("machine", "coupling", "model", "at, as sampled", "drive", "largest swing in the twin"), rows) + (
        f"\nOf those that the model calls unstable {counts[0]} swing, of those that it calls stable {counts[1]} do not.\n")


# ---- what rates promise ----------------------------------------------------------------------------------------------

def told_table():
    rows, gains = [], []
    for hz, ratio, one, four in TOLD:
        reduced, w = ratio / (1 + ratio), 2 * math.pi * hz
        shaft = best_loop.Shaft(1.0, ratio, w * w * reduced, 2 * TOLD_DAMPING * w * reduced)
        dips = [best_loop.best(shaft, *at).dip_s for at in zip(RATES_HZ, TOLD_LATE_S)]
        gains.append((one / four, dips[0] / dips[2]))
        rows.append((f"{hz} Hz, {ratio:g} x", f"{one:g}", f"{four:g}", *(f"{1e3 * dip:.3g}" for dip in dips)))
    heads = ("coupling, load by rotor", "section 9, 1 kHz", "4 kHz", *(f"here, {rate // 1000} kHz" for rate in RATES_HZ))
    told_gain, gain = (statistics.median(column) for column in zip(*gains))
    return table(heads, rows) + f"\n4 kHz divides the dip by {told_gain:.1f} there, {gain:.1f} here (median).\n"


def promise(drive, shaft, source):
    """Figures at RATES_HZ; None where no gain leaves the margin."""
    found = []
    for rate in RATES_HZ:
        try:
            found.append(present_loop.best_of(drive, shaft, rate, source))
        except best_loop.NoGain:
            found.append(None)
    return found


def shown(shaft, best):
    """Dip, margin, bandwidth."""
    return f"{1e3 * best.dip_s:.2g} / {best.phase_margin_deg:.0f} / {best.bandwidth_hz(shaft):.0f}" if best else "none"


def promise_table(found):
    rows = []
    for name, (drive, shaft, today) in found.items():
        for source in (ENCODER, HALL, OBSERVER):
            cells = [shown(shaft, best) for best in promise(drive, shaft, source)]
            now = f"{1e3 * today.dip_s:.2g}" if source == ENCODER and math.isfinite(today.dip_s) else ""
            lag = 1e3 * present_loop.sensor_lag_s(drive, source, RATES_HZ[2])
            rows.append((f"{name}, {coupling(shaft)}", NAMES[source], f"{lag:.2g}", now, *cells))
    return table(("motor", "sensor", "its lag", "dip today", *(f"{rate // 1000} kHz" for rate in RATES_HZ)), rows)


def lots_table(lots):
    """Medians over lots with their own sensor, dip in ms, and of what a doubled rate divides it by."""
    classes = {}
    for drive, shaft, _ in lots.values():
        source = source_of(drive)
        soft = f"below {SOFT_HZ} Hz" if shaft.resonance_hz < SOFT_HZ else f"of {SOFT_HZ} Hz or more"
        kind = f"{NAMES[source]}, {'rigid' if shaft.is_rigid else 'a coupling ' + soft}"
        classes.setdefault(kind, []).append(promise(drive, shaft, source))
    rows = []
    for kind in sorted(classes):
        dips = [[1e3 * best.dip_s if best else math.inf for best in by_rate] for by_rate in classes[kind]]
        columns = list(zip(*dips))
        medians = [statistics.median(column) for column in columns]
        gains = [statistics.median(a / b for a, b in zip(*two) if math.isfinite(a)) for two in zip(columns, columns[1:])]
        rows.append((kind, str(len(dips)), *(f"{value:.2g}" for value in medians), *(f"{gain:.2f}" for gain in gains)))
    return table(("lots 1 to 40", "n", *(f"{rate // 1000} kHz" for rate in RATES_HZ), "1 to 2", "2 to 4", "4 to 8"), rows)


def evidence():
    """(what was recorded, machines by the model, which of them are shipped, which are lots)."""
    found = predicted(twin.SHIPPED + twin.LOTS)
    shipped, lots = ({name: found[name] for name in names if name in found} for names in (twin.SHIPPED, twin.LOTS))
    return twin.record(), found, shipped, lots


BLOCKS = {"fit": lambda seen, found, shipped, lots: fit_summary(found, seen) + "\n" + fit_table(found, seen),
          "swings": lambda seen, found, shipped, lots: swing_table(found, seen),
          "told": lambda seen, found, shipped, lots: told_table(),
          "promise": lambda seen, found, shipped, lots: promise_table(shipped),
          "lots": lambda seen, found, shipped, lots: lots_table(lots)}


if __name__ == "__main__":
    known = evidence()
    for block, made in BLOCKS.items():
        pages.replace_block(PAGE, block, made(*known))
