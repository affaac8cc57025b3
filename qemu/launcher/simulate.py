# SPDX-License-Identifier: MIT
"""One run from data files to figures: the launcher's heart, and the interface for tests."""
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .claim import claim
from .config import twin_config
from .data import load_motor
from .drive import load_drive
from .errors import LauncherError
from .figures import measure
from .kind import Run
from .load import CURRENT_LOOP, cpu_load, load_irqlog
from .params import check_ranges, ranges_of
from .paths import build_dir, shown
from .probes import Symbols, add_belief, code_of, make_probes
from .qemu import (CAN_DESIGN, Image, Qemu, can_chardev, chip_items, command, envm_files, escape, fabric_files,
                   run_to_end)
from .refusals import NAME, judge, typed
from .scenario import load_scenario
from .trace import add_truth, load_trace

DEFAULT_MOTOR = "teknic_m2310p"
DEFAULT_SCENARIO = "default"
SEED_MAX = 2**32 - 1


@dataclass
class Result:
    """What a run gives: `trace` (column -> array), `console` (text), `figures` (name -> Figure), `load` (Load or None),
    `irqlog` (path of the log of interrupts), and what it was."""
    trace: object
    console: str
    figures: dict
    enums: dict
    drive: object
    scenario: object
    seed: int
    out_dir: Path
    qemu: object
    symbols: object
    load: object
    irqlog: Path
    claim: object  # of out_dir: no other process writes there while this is kept

    @property
    def passed(self):
        """Whether every figure with a limit keeps it."""
        return all(figure.passed is not False for figure in self.figures.values())


def check_seed(seed):
    """An integer 0...2^32-1 from a number or text."""
    try:
        value = int(str(seed), 0)
    except ValueError as error:
        raise LauncherError(f"SEED '{seed}' is not a whole number") from error
    if not 0 <= value <= SEED_MAX:
        raise LauncherError(f"SEED {seed} is outside 0..{SEED_MAX}")
    return value


def simulate(scenario=DEFAULT_SCENARIO, motor=DEFAULT_MOTOR, seed=1, out_dir=None, build=None, qemu=None, overrides=None,
             show=None, dumps=None, cycles=None, way_of=None, plant="full", spread=1, detune="", csv=False,
             start_angle=None, fabric="model", aligned=False, sensors="", envm="", envm_model=None, chip="",
             wired="", can=""):
    """Plays a scenario and measures it.

    scenario   name of a file in qemu/scenarios, path to one, or a dict of the same form
    motor      name of a file in qemu/motors, or path to one
    seed       of all noise, of the tolerances and of the start angle: the same seed gives the same trace to the byte
    plant      which effects the plant has (effects.py); spread: how far its parameters scatter (spread.py), 0 is nominal
    detune     what the firmware is told wrongly (params.py)
    start_angle  electrical degrees from phase A to the rotor's d axis at first, whatever the seed draws
    aligned    whether the firmware knows where the rotor stands, so that its start is short (aligned.py)
    out_dir    where twin.cfg, trace.bin, irq.bin, console.txt and qemu.log go (default: run/ of the build folder)
    overrides  {"motor": {table: {key: value}}, "inverter": {...}, "params": {"i_max_ma": 5000}}
    can        where the CAN bus is to be had (qemu.py); without it the bus is a scenario's events
    dumps      {file name: (address, bytes)}: memory of the target, written to that file in out_dir when the run ends
    cycles     {"apb_read": 3, ...}: wait cycles of the buses, where not the twin's defaults (qemu/twin/cycles_keys.c)
    way_of     an exception whose way through its handler goes to irqpath.csv, once for each duration (qemu/twin/irqpath.h)
    sensors    name of a file in qemu/sensors, or path to one, laid over the inverter's; empty: as the inverter's file says
    fabric     model, the twin's C models, or rtl, the verilated RTL
    envm       file of what the device keeps while it is off, the settings: read at first, if there is one, and written
    envm_model {"program_s": 0.01, ...}: how its eNVM behaves, where not as the twin's defaults (qemu/twin/envm.c)
    chip       m2s010 or m2s025 (default: $CHIP or m2s010); wired: how its design has the fabric's reset (qemu/twin/chip.h)
    csv        whether the trace is to be had as text as well, in trace.csv
    show       called as it goes, with the simulated seconds done and planned: a late start makes a run longer
    """
    seed = check_seed(seed)
    drive = load_drive(motor, with_start_angle(overrides, motor, start_angle), plant, spread, seed, detune, aligned, sensors)
    plan = load_scenario(scenario, drive)
    build = build_dir(build)
    checked_qemu = Qemu(qemu)
    image = Image(build)
    symbols = Symbols(image.elf)
    check_ranges(drive, ranges_of(symbols))
    probes, enums = make_probes(symbols, drive)
    out_dir = Path(out_dir) if out_dir else build / "run"
    held = claim(out_dir)
    files = prepare(out_dir)
    config = out_dir / "twin.cfg"
    kept = [(address, size, (out_dir / name).resolve()) for name, (address, size) in (dumps or {}).items()]
    written = {key: files[key] for key in ("trace", "progress", "irqlog", "bus_log", "can_log", *(["csv"] if csv else []))}
    written.update(fabric_files(fabric, build, drive))
    written.update(envm_files(envm))
    can_options, can_items = can_chardev(can)
    written.update(can_items or (CAN_DESIGN if any(step.kind.startswith("can") for step in plan.steps) else {}))
    written.update(chip_items(chip, wired))
    written.update({f"envm.{key}": value for key, value in (envm_model or {}).items()})
    way = (way_of, (out_dir / "irqpath.csv").resolve()) if way_of else None
    write(config, twin_config(drive, plan, seed, probes, written, symbols, kept, cycles, way, enums))
    console = f"file,id=console,path={escape(files['console'])}"
    run_to_end(command(checked_qemu, image, config, console, can_options), checked_qemu.environment(), plan.end_s,
               files["progress"], files["log"], show)
    trace = load_trace(files["trace"])
    plan = as_held(plan, scenario, drive, trace, enums)
    if trace["t_s"][-1] < plan.end_s - 2e-3 and not plan.may_end_early:
        raise LauncherError(f"the run ended at {trace['t_s'][-1]:.4f} s instead of {plan.end_s:g} s"
                            f" (see {shown(files['log'])})")
    check_numbers(trace)
    add_truth(trace, drive.motor["electrical"]["pole_pairs"])
    add_belief(trace)
    text = files["console"].read_text(errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    log = load_irqlog(files["irqlog"])
    finished = Run(trace, text, drive, enums, plan.names, plan.steps, log["t_s"][log["exception"] == CURRENT_LOOP])
    figures = measure(plan, finished)
    figures[NAME] = judge(plan, finished, typed(plan, drive))
    load = cpu_load(log, finished.pwm_period_s)
    return Result(trace, text, figures, enums, drive, plan, seed, out_dir, checked_qemu, symbols, load, files["irqlog"], held)


def as_held(plan, scenario, drive, trace, enums):
    """The plan with the instants at which its holds were over. The twin sees a state when the row after its own begins."""
    held_s = {}
    for hold in plan.holds:
        row = 0
        for state in hold.states:
            found = np.flatnonzero(trace["state"][row:] == code_of(enums["state"], state))
            if len(found) == 0:
                break
            row += int(found[0])
        else:
            held_s[hold.label] = float(trace["t_s"][min(row + 1, len(trace["t_s"]) - 1)])
    return load_scenario(scenario, drive, held_s) if held_s else plan


def with_start_angle(overrides, motor, degrees):
    """The overrides with the rotor at this electrical angle; as they are if it is None."""
    if degrees is None:
        return overrides
    angle_rad = math.radians(degrees % 360) / load_motor(motor)["electrical"]["pole_pairs"]
    of_motor = (overrides or {}).get("motor", {})
    return {**(overrides or {}), "motor": {**of_motor, "start": {"initial_angle_rad": angle_rad}}}


def check_numbers(trace):
    """A plant that has left the numbers is a defect of the twin: no figure of such a run means anything."""
    bad = np.flatnonzero(~np.isfinite(trace["i_a_A"] + trace["speed_rad_s"] + trace["vbus_V"]))
    if len(bad):
        raise LauncherError(f"the simulated plant has no numbers any more from {trace['t_s'][bad[0]]:.6f} s on")


def prepare(out_dir):
    """Makes the folder and clears what an earlier run left, so that nothing old can pass for a result."""
    files = {"trace": out_dir / "trace.bin", "csv": out_dir / "trace.csv", "progress": out_dir / "progress",
             "console": out_dir / "console.txt", "log": out_dir / "qemu.log", "irqlog": out_dir / "irq.bin",
             "bus_log": out_dir / "bus.txt", "can_log": out_dir / "can.txt"}
    try:
        out_dir.mkdir(parents=True, exist_ok=True)
        for name in [*files.values(), out_dir / "report.json", out_dir / "run.png"]:
            name.unlink(missing_ok=True)
    except OSError as error:
        raise LauncherError(f"cannot write to {shown(out_dir)}: {error.strerror}") from error
    return {key: path.resolve() for key, path in files.items()}


def write(path, text):
    try:
        Path(path).write_text(text)
    except OSError as error:
        raise LauncherError(f"cannot write {shown(path)}: {error.strerror}") from error
