# SPDX-License-Identifier: MIT
"""One run from data files to figures: the launcher's heart, and the interface for tests."""
import math
from dataclasses import dataclass
from pathlib import Path

from .axis import Axis
from .can_bus import can_chardev, joins
from .claim import claim
from .config import twin_config
from .data import load_motor
from .drive import load_drive
from .errors import LauncherError
from .figures import measure
from .load import cpu_load, load_irqlog
from .paths import build_dir, shown
from .probes import Symbols
from .qemu import CAN_DESIGN, Image, Qemu, chip_items, command, envm_files, escape, fabric_files, run_to_end
from .refusals import NAME, judge, typed
from .transcript import of_axis

DEFAULT_MOTOR = "teknic_m2310p"
DEFAULT_SCENARIO = "default"
SEED_MAX = 2**32 - 1
SECOND_FOLDER = "axis2"
SEED_OF_SECOND = 2**31  # the other bits of it are the same: two motors of a kind differ in what is drawn of them


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
    second: object = None  # the Result of axis 2, if there is one

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
             wired="", can="", second=None):
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
    can        where the CAN bus is to be had (can_bus.py), not join:PORT; without it the bus is a scenario's events
    dumps      {file name: (address, bytes)}: memory of the target, written to that file in out_dir when the run ends
    cycles     {"apb_read": 3, ...}: wait cycles of the buses, where not the twin's defaults (qemu/twin/cycles_keys.c)
    way_of     an exception whose way through its handler goes to irqpath.csv, once for each duration (qemu/twin/irqpath.h)
    sensors    name of a file in qemu/sensors, or path to one, laid over the inverter's; empty: as the inverter's file says
    fabric     model, the twin's C models, or rtl, the verilated RTL
    envm       file of what the device keeps while it is off, the settings: read at first, if there is one, and written
    envm_model {"program_s": 0.01, ...}: how its eNVM behaves, where not as the twin's defaults (qemu/twin/envm.c)
    chip       m2s010 or m2s025 (default: $CHIP or m2s010); wired: how its design has the fabric's reset (qemu/twin/chip.h)
    csv        whether the trace is to be had as text as well, in trace.csv
    second     {"motor": ..., "scenario": ...} of axis 2, for an image of two: Result.second is what came of it. All else holds
               for both but for overrides, start_angle and dumps, and its files go to axis2/ in out_dir
    show       called as it goes, with the simulated seconds done and planned: a late start makes a run longer
    """
    seed = check_seed(seed)
    if joins(can):
        raise LauncherError(f"CAN '{can}' is of make console and make debug: a run keeps no pace with the drives on that bus")
    out_dir = Path(out_dir) if out_dir else build_dir(build) / "run"
    how = {"plant": plant, "spread": spread, "detune": detune, "aligned": aligned, "sensors": sensors}
    drive = load_drive(motor, with_start_angle(overrides, motor, start_angle), seed=seed, **how)
    build, checked_qemu = build_dir(build), Qemu(qemu)
    image = Image(build)
    symbols = Symbols(image.elf)
    check_axes(symbols, 2 if second else 1)
    axes = [Axis(0, drive, scenario, symbols, out_dir)]
    if second:
        other = load_drive(second["motor"], seed=seed ^ SEED_OF_SECOND, **how)
        axes.append(Axis(1, other, second["scenario"], symbols.of_axis(1), out_dir / SECOND_FOLDER))
    plans = [axis.plan for axis in axes]
    items = {**fabric_files(fabric, build, *(axis.drive for axis in axes)), **envm_files(envm)}
    held = claim(out_dir)
    files = prepare_all(out_dir, axes, csv)
    config = out_dir / "twin.cfg"
    kept = [(address, size, (out_dir / name).resolve()) for name, (address, size) in (dumps or {}).items()]
    can_options, can_items = can_chardev(can, build)
    by_can = any(step.kind.startswith("can") for plan in plans for step in plan.steps)
    written = {**axes[0].files, **{key: files[key] for key in ("progress", "irqlog", "bus_log", "can_log")}, **items,
               **(can_items or (CAN_DESIGN if by_can else {})), **chip_items(chip, wired),
               **{f"envm.{key}": value for key, value in (envm_model or {}).items()}}
    way = (way_of, (out_dir / "irqpath.csv").resolve()) if way_of else None
    write(config, twin_config(drive, plans[0], seed, axes[0].probes, written, symbols, kept, cycles, way, axes[0].enums,
                              *axes[1:]))
    console = f"file,id=console,path={escape(files['console'])}"
    run_to_end(command(checked_qemu, image, config, console, can_options), checked_qemu.environment(),
               max(plan.end_s for plan in plans), files["progress"], files["log"], show)
    text = files["console"].read_text(errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    log = load_irqlog(files["irqlog"])
    runs = [axis.finished(of_axis(text, axis.number) if second else text, log, files["log"], second) for axis in axes]
    load = cpu_load(log, runs[0].pwm_period_s)
    results = [Result(run.trace, run.console, figures_of(axis.plan, run), axis.enums, axis.drive, axis.plan, seed, axis.folder,
                      checked_qemu, axis.symbols, load, files["irqlog"], held) for axis, run in zip(axes, runs)]
    results[0].second = results[1] if second else None
    return results[0]


def check_axes(symbols, wanted):
    """An image of two motors does not start with one, and the other way round."""
    if symbols.axes == wanted:
        return
    image = shown(symbols.path)
    if wanted == 2:
        raise LauncherError(f"{image} drives one motor, but two are named: make AXES=2 builds an image for two")
    raise LauncherError(f"{image} drives two motors, but one is named: MOTOR=\"a b\" names two, make AXES=1 builds an image"
                        " for one")


def figures_of(plan, run):
    """What the scenario measures, and whether the drive has refused anything."""
    figures = measure(plan, run)
    figures[NAME] = judge(plan, run, typed(plan, run.drive))
    return figures


def with_start_angle(overrides, motor, degrees):
    """The overrides with the rotor at this electrical angle; as they are if it is None."""
    if degrees is None:
        return overrides
    angle_rad = math.radians(degrees % 360) / load_motor(motor)["electrical"]["pole_pairs"]
    of_motor = (overrides or {}).get("motor", {})
    return {**(overrides or {}), "motor": {**of_motor, "start": {"initial_angle_rad": angle_rad}}}


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


def prepare_all(out_dir, axes, csv):
    """The same for each axis in its own folder, and for what an earlier run has left of a second one."""
    files = prepare(out_dir)
    for axis in axes:
        of_axis = prepare(axis.folder) if axis.number else files
        axis.files = {key: of_axis[key] for key in ("trace", *(["csv"] if csv else []))}
    if len(axes) == 1 and (out_dir / SECOND_FOLDER).is_dir():
        prepare(out_dir / SECOND_FOLDER)
    return files


def write(path, text):
    try:
        Path(path).write_text(text)
    except OSError as error:
        raise LauncherError(f"cannot write {shown(path)}: {error.strerror}") from error
