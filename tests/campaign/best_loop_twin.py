# SPDX-License-Identifier: MIT
"""What the twin measures of today's speed loop, into best_loop_twin.toml: `make best-loop-twin`. docs/best-loop.md holds
present_loop.py against it. Six motors on a coupling and lots 1 to 40, one after the other, load_step.toml, seed 1.

The speed after a step T of the load is P T / s times the loop's sensitivity 1 / (1 + L), and P is known: so L, its crossover
and its margin follow from the trace of one step.
"""
import json
import math
import os
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "qemu"), str(ROOT / "tests/campaign")]

from launcher import simulate  # noqa: E402
from launcher.data import motors_named, read_toml  # noqa: E402
from launcher.drive import load_drive  # noqa: E402
from launcher.errors import LauncherError  # noqa: E402
from launcher.spread import drawn  # noqa: E402

import best_loop  # noqa: E402
import present_loop  # noqa: E402

HERE = ROOT / "tests/campaign"
SCENARIO, RECORD = HERE / "load_step.toml", HERE / "best_loop_twin.toml"
SHIPPED = ("abb_m2bj100l", "estun_emj04apb22", "maxon_ec45flat", "qs138_3kw", "teknic_m2310p", "thor_pmsyrm")
LOTS = tuple(f"lot:{n}" for n in range(1, 41))
SEED = 1
BEFORE_S, AFTER_S = 0.1, 0.25   # looked at
HZ = np.geomspace(5, 200, 150)  # where the loop is: there the sampling folds little
BLOCK_S, SWINGS_HZ = 0.064, 80  # in which a swing is looked for, and above what
WARNED = "warning: oscillation"


def plant_of(name):
    """(drive, the Shaft as drawn, the torque of a current by what the drive was told of it)."""
    drive = load_drive(name, spread=1, seed=SEED)
    plant = drawn(drive.motor, SEED, 1)
    return drive, present_loop.shaft_of(plant), present_loop.torque_share(drive, plant)


def measured(t_s, speed_rad_s, load_nm, shaft):
    """{dip_ms, ripple_ms, margin_deg, crossover_hz} of the first step of a load; times as best_loop tells a dip."""
    step = int(np.argmax(np.abs(load_nm - load_nm[0]) > 0))
    torque_nm = load_nm[step] - load_nm[0]
    before = speed_rad_s[(t_s >= t_s[step] - BEFORE_S) & (t_s < t_s[step])]
    after = slice(step, int(np.searchsorted(t_s, t_s[step] + AFTER_S)))
    off = speed_rad_s[after] - before.mean()
    unit_ms = 1e3 * shaft.total_kgm2 / torque_nm
    crossover, margin = best_loop.crossovers(HZ, loop_of(t_s[after] - t_s[step], off / torque_nm, shaft))[0]
    return {"dip_ms": np.abs(off).max() * unit_ms, "ripple_ms": np.ptp(before) / 2 * unit_ms, "margin_deg": margin,
            "crossover_hz": crossover}


def swing_hz(t_s, speed_rad_s):
    """The frequency of the largest swing of the speed, of the loudest block."""
    size = round(BLOCK_S / (t_s[1] - t_s[0]))
    blocks = speed_rad_s[:len(t_s) // size * size].reshape(-1, size)
    ramp = np.linspace(-1, 1, size)
    flat = blocks - blocks.mean(axis=1, keepdims=True) - np.outer(blocks @ ramp / (ramp @ ramp), ramp)
    spectra, hz = np.abs(np.fft.rfft(flat * np.hanning(size), 4 * size)), np.fft.rfftfreq(4 * size, t_s[1] - t_s[0])
    spectra[:, hz < SWINGS_HZ] = 0
    return float(hz[spectra.max(axis=0).argmax()])


def loop_of(t_s, off_rad_s, shaft):
    """The open loop at HZ, from the deviation after a step of 1 N m."""
    s = 2j * math.pi * HZ
    spectrum = np.exp(-np.outer(s, t_s)) @ off_rad_s * (t_s[1] - t_s[0])
    rates = shaft.rates()
    n = len(rates) - 2
    falls = np.linalg.solve(s[:, None, None] * np.eye(n) - rates[:n, :n], np.tile(rates[:n, -1:], (len(s), 1, 1)))[:, 1, 0]
    return falls / s / spectrum - 1


def played(name, folder):
    """What a run gives: figures, or why there are none; `swing_hz` where it ended, or the drive said that it swings."""
    try:
        _, shaft, _ = plant_of(name)
        result = simulate(SCENARIO, motor=name, seed=SEED, aligned=True, out_dir=folder)
    except LauncherError as error:
        return {"ended": "not set up: " + str(error).split("\n")[0]}
    trace, found = result.trace, {"warned": WARNED in result.console}
    if found["warned"] or not result.passed:
        swing = swing_hz(trace["t_s"], trace["speed_rad_s"])  # 0 if it never turned
        found |= {"swing_hz": swing} if swing else {}
    if not result.passed:
        return found | {"ended": str(result.figures["faults"].value)}
    return found | measured(trace["t_s"], trace["speed_rad_s"], trace["load_Nm"], shaft)


def record():
    """{name: what was recorded}."""
    return read_toml(RECORD) if RECORD.exists() else {}


def text_of(found):
    lines = ["# SPDX-License-Identifier: MIT", "# Written by `make best-loop-twin`: load_step.toml, seed 1, SPREAD 1"]
    for name, values in found.items():
        cells = (f"{key} = {value:.4g}" if isinstance(value, float) else f"{key} = {json.dumps(value)}"
                 for key, value in values.items())
        lines.append(f'"{name}" = {{ {", ".join(cells)} }}')
    return "\n".join(lines) + "\n"


def main():
    """Plays what MOTORS names, or all, and keeps of the record what is not played."""
    folder = ROOT / os.environ.get("BUILD", "build") / "best-loop"
    found = record()
    for name in motors_named(os.environ.get("MOTORS", "").split()) or SHIPPED + LOTS:
        found[name] = played(name, folder)
        print(name, found[name], flush=True)
        RECORD.write_text(text_of({name: found[name] for name in sorted(found, key=(SHIPPED + LOTS).index)}))


if __name__ == "__main__":
    main()
