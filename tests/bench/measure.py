# SPDX-License-Identifier: MIT
"""Runs the benchmark image in QEMU with the twin, and the drive itself in closed loop, and gathers what they cost.

The image is run with DWT's CYCCNT counting cycles, with it counting instructions, and once more for each of the columns cold
and pessimistic. Two rows cannot be had on the target without adding to what is measured, and come from the twin's log of
interrupts in a run of the drive: current_loop.latency (entry, its cycles included, to the last write to the PWM) and
current_loop.interrupt (entry and exit included).
"""
import re
import subprocess
import time

import numpy as np
from elftools.elf.elffile import ELFFile

from launcher.config import twin_config
from launcher.drive import load_drive
from launcher.errors import LauncherError
from launcher.load import cpu_load, load_irqlog
from launcher.paths import build_dir, shown
from launcher.probes import Symbols, make_probes
from launcher.qemu import Image, Qemu, command, escape, run_to_end
from launcher.ranges import defaults, pessimistic
from launcher.recording import read_recording
from launcher.scenario import load_scenario
from rates.builds import OWN_HZ, RATES_HZ, build_of, overrides

MOTOR = "teknic_m2310p"
CLOSING = re.compile(r"(?m)^bench: (\d+) rows\r?\n")
FAULTS = re.compile(r"(?m)^# faults found ([1-9]\d*)")
WALL_S = 300.0
CURRENT_LOOP_EXCEPTION, SLOW_LOOP_EXCEPTION = 16 + 34, 16 + 14  # FabricIrq0, Timer1
ENTRY, TAIL_CHAIN, NS_PER_CYCLE = 12, 6, 10  # docs/timing.md
EXCLUDED_BEFORE_S = 0.45          # start-up and the sensors' zeros, which have a handler of their own
COLD = "cycles.cold 1"
ZERO_WAIT = ("cycles.apb_read 0", "cycles.apb_write 0", "cycles.esram 0", "cycles.cache 1")

TWO_SAMPLES = {"motor": {"control": {"pwm_update": 2, "pwm_samples": 2}}, "inverter": {"sensor": {"shunt": 0}}}

# Both directions, with and without load, standstill and the steps between them; no fault.
CLOSED_LOOP = {
    "key": "bench", "title": "what the benchmark runs in closed loop", "end_s": 3.6, "preamble_s": 0.05,
    "step": [
        {"t_s": 0.15, "console": "on"},
        {"t_s": 0.50, "console": "speed 1500"},
        {"t_s": 0.85, "event": "load_nm", "args": ["rated_torque_Nm"]},
        {"t_s": 1.05, "event": "load_nm", "args": ["0"]},
        {"t_s": 1.15, "console": "speed -1500"},
        {"t_s": 1.80, "event": "load_nm", "args": ["-rated_torque_Nm"]},
        {"t_s": 2.10, "console": "speed 50"},
        {"t_s": 2.70, "console": "speed 3000"},
        {"t_s": 3.45, "console": "status"},
    ],
}


ASKED = ("status", "get all", "nonsense", "fault")

# The same in operation, with a console that never stops answering.
BUSY = {
    "key": "bench_busy", "title": "what the benchmark runs under a busy console", "end_s": 2.0, "preamble_s": 0.05,
    "step": [{"t_s": 0.15, "console": "on"}, {"t_s": 0.50, "console": "speed 1500"},
             *({"t_s": round(0.6 + 0.02 * n, 2), "console": ASKED[n % len(ASKED)]} for n in range(67)),
             {"t_s": 1.95, "console": "status"}],
}


class _BenchImage:
    def __init__(self, build):
        self.hex = build / "bench.hex"
        self.plugin = build / "qemu" / "twin.so"
        for path in (self.hex, self.plugin):
            if not path.is_file():
                raise LauncherError(f"{shown(path)} is missing: run make bench-image twin first")


def measure(build=None, seed=1, settings=()):
    """{row: {"instructions": ..., "cycles_min": ..., ...}, "_meta": {...}}.

    settings   more lines for the twin's configuration: wait states, for example "cycles.apb_read 0"
    """
    rows = {**measure_as_built(build, seed, settings), **measure_variants(build, seed, settings)}
    rows["_meta"] = rows.pop("_meta")
    return with_ends(rows, measure_ends(build, seed, settings))


def measure_as_built(build=None, seed=1, settings=()):
    """All rows of the image as it is, and "_meta"."""
    build = build_dir(build)
    out_dir = build / "bench" / f"run{seed}"
    cycles = read_table(run_image(build, out_dir / "cycles", seed, ["dwt cycles", *settings]))
    instructions = read_table(run_image(build, out_dir / "instructions", seed, ["dwt instructions", *settings]))
    if list(cycles) != list(instructions):
        raise LauncherError("the two runs of the benchmark image gave different rows")
    rows = {name: _row(cycles[name], instructions[name]) for name in cycles}
    for name, row in without_wait(build, out_dir, seed).items():
        if is_library(name, cycles[name]):
            rows[name] = row
        else:
            rows[name]["cycles_without_wait"] = row["cycles_max"]
    rows.update(closed_loop(build, out_dir / "closed_loop", seed, settings))
    rows.update(busy(build, out_dir / "busy", seed, settings))
    return {**rows, "_meta": _meta(build, settings)}


ENDS = {"cold": (COLD,), "pessimistic": (COLD, *pessimistic())}


def measure_ends(build=None, seed=1, settings=()):
    """{row: {"cycles_cold": ..., "cycles_pessimistic": ...}}: each row's largest where every exception finds the cache empty,
    unless it is locked, and where every range of qemu/chips/ranges.toml is at its worst end besides."""
    build = build_dir(build)
    found = {}
    for end, lines in ENDS.items():
        out_dir = build / "bench" / f"run{seed}" / end
        table = read_table(run_image(build, out_dir / "cycles", seed, ["dwt cycles", *settings, *lines]))
        largest = {name: row[""][2] for name, row in table.items() if not is_library(name, row)}
        in_loop = {**closed_loop(build, out_dir / "closed_loop", seed, (*settings, *lines)),
                   **busy(build, out_dir / "busy", seed, (*settings, *lines))}
        largest.update((name, row["cycles_max"]) for name, row in in_loop.items())
        for name, cycles in largest.items():
            found.setdefault(name, {})[f"cycles_{end}"] = cycles
    return found


def with_ends(rows, ends):
    return {name: {**row, **ends.get(name, {})} for name, row in rows.items()}


def measure_variants(build=None, seed=1, settings=()):
    """The rows without wait states, and of the firmware built for these PWM rates."""
    build = build_dir(build)
    out_dir = build / "bench" / f"run{seed}"
    ideal = closed_loop(build, out_dir / "zero_wait", seed, ZERO_WAIT)
    rows = {f"{name}.zero_wait": row for name, row in ideal.items()}
    rows.update(handlers_without_wait(build, out_dir, seed))
    rows.update(at_other_rates(out_dir, seed, settings))
    return rows


def is_library(name, row):
    """Rows that say what arithmetic costs, wherever it stands: with memory that answers at once."""
    return "O2" in row or name.endswith((".registers", "_Lib_Do"))


def without_wait(build, out_dir, seed):
    """All rows of the benchmark image with memory that answers at once: what the code costs, wherever it stands."""
    cycles, instructions = (read_table(run_image(build, out_dir / f"{kind}_library", seed, [f"dwt {kind}", *ZERO_WAIT]))
                            for kind in ("cycles", "instructions"))
    return {name: _row(row, instructions[name]) for name, row in cycles.items()}


def handlers_without_wait(build, out_dir, seed):
    """The rows handler.* of the benchmark image once more, on a bus that does not wait."""
    cycles = read_table(run_image(build, out_dir / "cycles_zero", seed, ["dwt cycles", *ZERO_WAIT]))
    instructions = read_table(run_image(build, out_dir / "instructions_zero", seed, ["dwt instructions", *ZERO_WAIT]))
    return {f"{name}.zero_wait": _row(cycles[name], instructions[name]) for name in cycles if name.startswith("handler.")}


def at_other_rates(out_dir, seed, settings):
    """The current loop's interrupt of the firmware built for each PWM rate, and what share of the core the loops take.

    With two samples a period only from when they are taken.
    """
    rows = {f"rate.{hz}": _share(hz, out_dir / f"rate{hz}", seed, settings, overrides(hz)) for hz in RATES_HZ}
    return {**rows, f"rate.{OWN_HZ}.two": _share(OWN_HZ, out_dir / "two", seed, settings, TWO_SAMPLES, EXCLUDED_BEFORE_S)}


def _share(hz, folder, seed, settings, changed, from_s=0):
    found = closed_loop(build_of(hz, "mssfoc.elf", "mssfoc.hex"), folder, seed, settings, changed)
    log = load_irqlog(folder / "irqlog")
    load = cpu_load({name: column[log["t_s"] >= from_s] for name, column in log.items()}, 1 / hz)
    return {**found["current_loop.interrupt"], "slow_loop_mean": round(load.slow_loop.mean_cycles),
            "load_percent": round(100 - load.rest_percent, 2)}


def run_image(build, out_dir, seed, settings):
    """The console's text. Raises if the image does not come to its closing line."""
    qemu, image = Qemu(), _BenchImage(build)
    out_dir.mkdir(parents=True, exist_ok=True)
    config, console, log = (out_dir.resolve() / name for name in ("twin.cfg", "console.txt", "qemu.log"))
    console.unlink(missing_ok=True)
    drive = load_drive(MOTOR)
    text = twin_config(drive, load_scenario({"end_s": 600.0}, drive), seed, [], {"progress": out_dir / "progress"})
    config.write_text(text + "".join(f"{line}\n" for line in settings))
    arguments = command(qemu, image, config, f"file,id=console,path={escape(console)}")
    with open(log, "wb") as stream:
        process = subprocess.Popen(arguments, stdin=subprocess.DEVNULL, stdout=stream, stderr=stream,
                                   env=qemu.environment())
        try:
            said = _until_closing(process, console)
        finally:
            process.kill()
            process.wait()
    if not CLOSING.search(said):
        raise LauncherError(f"the benchmark image did not finish (see {shown(console)} and {shown(log)}): "
                            f"{(log.read_text(errors='replace').strip().splitlines() or ['no message'])[-1]}")
    return said


def _until_closing(process, console):
    limit = time.monotonic() + WALL_S
    while True:
        ended = process.poll() is not None or time.monotonic() > limit
        said = console.read_text(errors="replace") if console.exists() else ""
        if ended or CLOSING.search(said):
            return said
        time.sleep(0.05)


def read_table(text):
    """{row: {"": (min, median, max), "moves": n, "O2": (...), "O3": (...)}} from what the image printed."""
    rows = {}
    for line in text.replace("\r", "").split("\n"):
        words = line.split()
        if len(words) < 4 or words[0].startswith("#") or not words[1].isdigit():
            continue
        row = {"": tuple(map(int, words[1:4]))}
        if len(words) > 4:
            if [words[4], words[6], words[10]] != ["moves", "O2", "O3"] or len(words) != 14:
                raise LauncherError(f"a line of the benchmark's table cannot be read: {line}")
            row.update(moves=int(words[5]), O2=tuple(map(int, words[7:10])), O3=tuple(map(int, words[11:14])))
        rows[words[0]] = row
    if faults := FAULTS.search(text):
        raise LauncherError(f"{faults.group(1)} steps of the slow loop found a fault: they were not in operation")
    count = int(CLOSING.search(text).group(1))
    if count != len(rows) or not rows:
        raise LauncherError(f"the benchmark image printed {len(rows)} rows and says {count}")
    return rows


def _figures(cycles, instructions):
    return {"instructions": instructions[1], "instructions_min": instructions[0], "instructions_max": instructions[2],
            "cycles_min": cycles[0], "cycles_median": cycles[1], "cycles_max": cycles[2]}


def _row(cycles, instructions):
    row = _figures(cycles[""], instructions[""])
    if "moves" in cycles:
        row["moves"] = cycles["moves"]
        for level in ("O2", "O3"):
            row[f"portable_{level}"] = _figures(cycles[level], instructions[level])
    return row


def closed_loop(build, out_dir, seed, settings=(), changed=None):
    """The rows of both loops' interrupts, from the twin's log of a run of the drive."""
    return read_irqlog(_drive(build, out_dir, seed, settings, changed, CLOSED_LOOP))


def closed_loop_of(scenario, build, out_dir, settings=()):
    """The same of another run, which must end in operation."""
    return read_irqlog(_drive(build, out_dir, 1, settings, None, scenario))


def busy(build, out_dir, seed, settings=()):
    """The row current_loop.write: when the compares are written, from the end of the conversion on, whatever delays it."""
    return read_writes(_drive(build, out_dir, seed, settings, None, BUSY), wait_states(settings))


def _drive(build, out_dir, seed, settings, changed, scenario):
    qemu, image, drive = Qemu(), Image(build), load_drive(MOTOR, changed, aligned=True)
    out_dir.mkdir(parents=True, exist_ok=True)
    paths = {name: (out_dir / name).resolve() for name in ("progress", "irqlog", "console", "qemu.log", "twin.cfg")}
    plan = load_scenario(scenario, drive)
    files = {"progress": paths["progress"], "irqlog": paths["irqlog"]}
    symbols = Symbols(image.elf)
    probes, enums = make_probes(symbols, drive)
    text = twin_config(drive, plan, seed, probes, files, symbols, enums=enums)
    paths["twin.cfg"].write_text(text + "".join(f"{line}\n" for line in settings))
    arguments = command(qemu, image, paths["twin.cfg"], f"file,id=console,path={escape(paths['console'])}")
    run_to_end(arguments, qemu.environment(), plan.end_s, paths["progress"], paths["qemu.log"])
    if "state: operation enabled" not in paths["console"].read_text(errors="replace"):
        raise LauncherError(f"the drive was not in operation at the end of the benchmark's run (see {shown(out_dir)})")
    return paths["irqlog"]


def read_irqlog(path):
    """Whole interrupts of the current loop, which nothing can preempt; those chained to another's end are shorter. And of the
    slow loop, without those that preempt it."""
    log = read_recording(path, "log of interrupts")
    inside = log["t_s"] >= EXCLUDED_BEFORE_S
    wanted = (log["exception"] == CURRENT_LOOP_EXCEPTION) & (log["chained"] == 0) & inside
    whole, latency, instructions = (log[name][wanted].astype(int).tolist()
                                    for name in ("cycles", "latency_cycles", "instructions"))
    if not whole:
        raise LauncherError(f"{shown(path)} has no interrupt of the current loop")
    counted = _spread(instructions)
    return {"current_loop.latency": {"interrupts": len(whole), **_cycles(latency)},
            "current_loop.interrupt": {"interrupts": len(whole), "instructions": counted[1],
                                       "instructions_min": counted[0], "instructions_max": counted[2],
                                       **_cycles(whole)},
            **_slow_loop(log, inside & (log["exception"] == SLOW_LOOP_EXCEPTION))}


def _slow_loop(log, wanted):
    cycles, instructions = (log[name][wanted].astype(int).tolist() for name in ("cycles", "instructions"))
    if not cycles:
        return {}
    counted = _spread(instructions)
    return {"slow_loop.interrupt": {"interrupts": len(cycles), "instructions": counted[1], "instructions_min": counted[0],
                                    "instructions_max": counted[2], **_cycles(cycles)}}


def read_writes(path, waits):
    """Cycles from the interrupt's rise to the last write of the PWM, of all interrupts of the current loop in operation."""
    log = read_recording(path, "log of interrupts")
    wanted = (log["exception"] == CURRENT_LOOP_EXCEPTION) & (log["latency_cycles"] > 0) & (log["t_s"] >= EXCLUDED_BEFORE_S)
    entry = np.where(log["chained"].astype(int) & 1, TAIL_CHAIN, ENTRY + waits["vector"] + waits["esram"])
    written = (log["start_ns"] / NS_PER_CYCLE + log["latency_cycles"] - entry)[wanted].astype(int).tolist()
    if not written:
        raise LauncherError(f"{shown(path)} has no interrupt of the current loop that writes the PWM")
    return {"current_loop.write": {"interrupts": len(written), **_cycles(written)}}


def _spread(values):
    ordered = sorted(values)
    return ordered[0], ordered[len(ordered) // 2], ordered[-1]


def _cycles(values):
    low, median, high = _spread(values)
    return {"cycles_min": low, "cycles_median": median, "cycles_max": high}


def _meta(build, settings):
    """What the figures hold for. The compiler's own record in the image says how it was called."""
    producers = {}
    for name, source in (("firmware", "firmware/system/handlers.c"), ("library", "lib/trig.c"),
                         ("portable_O2", "tests/bench/kernels_o2.c"), ("portable_O3", "tests/bench/kernels_o3.c")):
        producers[name] = producer(build / "bench.elf", source)
    return {"compiler": " ".join(producers["firmware"].split()[:4]),
            "flags": {name: _flags(text) for name, text in producers.items()},
            "core_hz": 100_000_000, "pwm_hz": 20_000, "wait_states": wait_states(settings)}


def wait_states(settings):
    """The timing model's parameters: the twin's defaults, and what `settings` makes of them."""
    values = defaults()
    for line in settings:
        key, value = line.split()
        values[key.removeprefix("cycles.")] = int(value)
    return values


def producer(elf_path, source):
    """DW_AT_producer of a source file: compiler, version and options."""
    with open(elf_path, "rb") as stream:
        for unit in ELFFile(stream).get_dwarf_info().iter_CUs():
            top = unit.get_top_DIE()
            if top.attributes["DW_AT_name"].value.decode() == source:
                return top.attributes["DW_AT_producer"].value.decode()
    raise LauncherError(f"{shown(elf_path)} has no debug information of {source}")


def _flags(text):
    dropped = ("-ffile-prefix-map", "-g")
    return [word for word in text.split() if word.startswith("-") and not word.startswith(dropped)]
