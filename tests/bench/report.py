# SPDX-License-Identifier: MIT
"""The benchmark's figures as a table for the terminal, as changes against earlier ones, and as docs/benchmarks.md."""
import json
import sys
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / "tools"))
from compiler import REFERENCE, file_of, nearest, versions_of  # noqa: E402

BASELINE = HERE / "baseline.json"

ROWS = {
    "current_loop.latency": "exception entry to the last write to the PWM, entry's cycles included",
    "current_loop.interrupt": "the whole interrupt, entry and exit included, in closed loop",
    "current_loop.latency.zero_wait": "the same with fabric, peripherals and eSRAM that do not wait",
    "current_loop.interrupt.zero_wait": "likewise: what can be compared with others' figures",
    "current_loop.write": "the conversion's end to the last write to the PWM, under a console that never stops answering: what"
                          " differs is the write's jitter",
    "current_loop.pended": "the interrupt as the target alone sees it: raised by software, with and without",
    "current_loop.stolen": "what an interrupt by the ADC takes from the program below, mean",
    "current_loop.called": "the handler called as a function",
    "handler.assembly": "the same with each handler in the vector: encoder, by hand",
    "handler.encoder_ab": "encoder, in C",
    "handler.forced_ab": "prescribed angle",
    "handler.observer_ab": "the flux observer's angle",
    "handler.injection_ab": "the saliency's angle",
    "handler.hall_ab": "the Hall switches' angle",
    "handler.weakening_ab": "encoder and a weakened field",
    "handler.overmodulating_ab": "the same beyond the circle of voltages",
    **{f"handler.{name}.zero_wait": "likewise, without waits"
       for name in ("assembly", "encoder_ab", "forced_ab", "observer_ab", "injection_ab", "hall_ab", "weakening_ab",
                    "overmodulating_ab")},
    **{f"rate.{hz}": f"the interrupt in closed loop at {hz / 1000:g} kHz" for hz in (8000, 10000, 16000, 20000, 32000, 40000)},
    "rate.20000.two": "the same with two samples a period",
    "current_loop.trip": "called, with a bus voltage below its limit in the sample: cause, latch and snapshot",
    "clarke_q15.registers": "the kernel alone, arguments and results in registers",
    "park_q15.registers": "likewise",
    "invpark_q15.registers": "likewise",
    "invclarke_q15.registers": "likewise",
    "cossin_q15.registers": "likewise, its table's address too",
    "clarke3_q15.registers": "likewise",
    "clarke_bc_q15.registers": "likewise",
    "clarke_ca_q15.registers": "likewise",
    "atan2_q15.registers": "likewise, two tables",
    "magnitude_q15.registers": "likewise, one table",
    "pi_q15_step.registers": "the controller alone, arguments and results in registers",
    "svm_minmax.registers": "likewise",
    "Clarke3_Lib_Do": "three phases, 64-bit sums, portable C",
    "ClarkeBC_Lib_Do": "two sensors, 64-bit sums, portable C",
    "ClarkeCA_Lib_Do": "likewise",
    "SinCos_Lib_Do": "sine and cosine with LIB_TRIG_FRAC bits",
    "Polar_Lib_Do": "length by a root of 32 bits, one bit a turn, and angle",
    "PI_Lib_Do": "PI with anti-windup, every field held to its range first",
    "SVM_Lib_Do": "min-max zero sequence over 32 bits",
    "scope.tick": "what a capture adds to the current loop's interrupt; without one there is nothing",
    "scope.sampled": "the same with the sampler behind it: eight signals, an edge to look for",
    "scope.recorder": "called: eight signals, once a millisecond",
    "speed_loop_measure": "speed in rpm",
    "torque_measure": "energy of the bus, power that goes away",
    "torque_set_limits": "torque limits of voltage, bus and speed",
    "torque_ask": "torque to i_d and i_q",
    "speed_loop_step": "ramp and PI, 64 bit",
    "current_loop_follow": "what changes with the speed and the current: angle ahead, knee of the dead time, gains",
    "thermal_step": "heat of winding and inverter, every fourth step",
    "encoder_watch_step": "encoder against the voltages, the index and its own speed, in its turn",
    "phase_watch_step": "currents that should flow in each phase, every second step",
    "speed_watch_step": "speed beside its reference, limit cycle, every second step",
    "start_learn_index": "where the index stands",
    "drive_step.speed": "state machine with the speed loop",
    "drive_step.torque": "state machine in torque control",
    "profile_step": "a millisecond of a way to a position, within speed, acceleration and jerk",
    "cogging_torque_q15.8": "eight harmonics of the shaft's place",
    "drive_step.position": "state machine in position control, eight harmonics of cogging included",
    "slow_loop.pended": "the whole interrupt in speed control, entry and exit included",
    "slow_loop.interrupt": "the same in closed loop, without those that preempt it",
    "slow_loop.interrupt.zero_wait": "likewise, where no memory and no bus waits: what the instructions take",
    "fault_raise.first": "bridge off, cause latched, snapshot",
    "fault_raise.again": "bridge off; a cause is latched already",
    "console.status": "the answer to `status`, up to its last character in the buffer",
    "console.unknown": "the answer to a command that does not exist",
    "console.interrupt": "UART interrupt that hands 16 characters to the transmitter",
    "tuning_compute": "parameters to gains and thresholds, at `on`",
    "torque_build": "table from torque to currents of a salient machine, at `on`",
    "torque_build.part": "the longest part of it: then the thread serves its lines",
    "interrupt.latency": "request by software to the first reading in the handler",
    "interrupt.round_trip": "entry and exit around an empty handler",
}


LOOP_ROWS = ("current_loop.", "handler.")


def baselines():
    """{version of GCC: the last committed figures}."""
    return {version: json.loads(file_of(BASELINE, version).read_text()) for version in versions_of(BASELINE)}


def baseline():
    """Those of the present compiler."""
    return json.loads(nearest(BASELINE).read_text())


def is_row(name):
    return not name.startswith("_")


def table(figures):
    """Lines for the terminal."""
    yield (f"{'':<28}{'':>7}{'nominal':>21}{'':>20}\n{'':<28}{'instr.':>7}{'min':>7}{'median':>7}{'max':>7}{'cold':>8}"
           f"{'pess.':>8}{'C -O2':>8}{'C -O3':>7}{'gain':>7}")
    for name, row in figures.items():
        if is_row(name):
            yield (f"{name:<28}{row.get('instructions', ''):>7}{row['cycles_min']:>7}{row['cycles_median']:>7}"
                   f"{row['cycles_max']:>7}{row.get('cycles_cold', ''):>8}{row.get('cycles_pessimistic', ''):>8}"
                   + _comparison(row))


def _comparison(row):
    if "portable_O2" not in row:
        return ""
    o2, o3 = (row[f"portable_{level}"]["cycles_max"] for level in ("O2", "O3"))
    return f"{o2:>8}{o3:>7}{gain(row):>+6.0f} %"


def gain(row):
    """How much less time than the better of the two portable builds, in per cent of it, worst data."""
    best = min(row["portable_O2"]["cycles_max"], row["portable_O3"]["cycles_max"])
    return 100.0 * (best - row["cycles_max"]) / best


def changes(figures, earlier):
    """One line a figure that is not as it was."""
    for name in sorted(set(figures) | set(earlier)):
        if not is_row(name):
            continue
        if name not in earlier or name not in figures:
            yield f"{name:<28} {'new' if name in figures else 'gone'}"
            continue
        for key in ("instructions", "cycles_min", "cycles_median", "cycles_max", "cycles_cold", "cycles_pessimistic"):
            now, before = figures[name].get(key), earlier[name].get(key)
            if now is not None and before is not None and now != before:
                yield f"{name:<28} {key:<14}{before:>7} -> {now:>6}  {now - before:+d}"


def markdown(known):
    """The text of docs/benchmarks.md, of {version of GCC: figures}."""
    figures = known[REFERENCE]
    return "\n".join([*_opening(figures), *_current_loop(figures), *_rates(figures), *_library(figures),
                      *_others(figures), *_compilers(known), *_peers(), *_method()]) + "\n"


def _opening(figures):
    meta = figures["_meta"]
    waits = ", ".join(f"{name} {value}" for name, value in meta["wait_states"].items())
    return [
        "# Benchmarks", "",
        "Written by `make bench`; what it prints against the last committed figures is the change. Cycles of a Cortex-M3 at"
        " 100 MHz, read from DWT.CYCCNT; in the twin the counter follows the timing model of [timing.md](timing.md),"
        " and where that knows bounds only, the upper one.", "",
        f"{headline(figures)}", "",
        "*nominal*: the device as [silicon.md](silicon.md) has it. *cold*: the largest where each exception finds the cache"
        " empty, but for what start-up has locked in it. *pessimistic*: the largest where every value that is known as a range"
        " is at its worst end besides (`qemu/chips/ranges.toml`).", "",
        f"Compiler: {meta['compiler']}. Firmware: `{' '.join(meta['flags']['firmware'])}`."
        f" Wait states: {waits}.", "",
    ]


def headline(figures):
    """One paragraph, of which tests/tools/front.py makes README's figure."""
    meta, whole, latency = (figures[name] for name in ("_meta", "current_loop.interrupt", "current_loop.latency"))
    worst, period = whole["cycles_pessimistic"], meta["core_hz"] // meta["pwm_hz"]
    ratio = max(whole["cycles_max"], whole["cycles_cold"]) / whole["cycles_median"]
    return (f"**{latency['cycles_pessimistic']} cycles from exception entry to the last PWM write, {worst} for the whole"
            f" interrupt, at worst**: {latency['cycles_pessimistic'] / meta['core_hz'] * 1e6:.2f} and"
            f" {worst / meta['core_hz'] * 1e6:.2f} us, or {100 * worst / period:.1f} % of the core at"
            f" {meta['pwm_hz'] // 1000} kHz. Nominal: {latency['cycles_max']} and {whole['cycles_max']}; the largest, with a"
            f" busy console and a cold cache included, is {ratio:.2f} times the typical.")


def _line(*cells):
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def _cells(row):
    return (row.get("instructions", ""), row["cycles_min"], row["cycles_median"], row["cycles_max"])


def _ends(row):
    return row.get("cycles_cold", ""), row.get("cycles_pessimistic", "")


ENDS_HEAD = (_line("row", "instructions", "nominal: min", "median", "max", "cold", "pessimistic", "what"),
             "|---|--:|--:|--:|--:|--:|--:|---|")


def _current_loop(figures):
    yield from ("## The current loop", "", *ENDS_HEAD)
    for name in [name for name in ROWS if name.startswith(LOOP_ROWS)]:
        yield _line(f"`{name}`", *_cells(figures[name]), *_ends(figures[name]), ROWS[name])
    yield ""


def _rates(figures):
    yield from ("## PWM rates", "", "The firmware built for each rate (`make PWM_HZ=n`), in closed loop; the core's share of"
                " all interrupts together. With two samples a period (`pwm_samples`) from when they are taken.", "",
                _line("PWM", "current loop, cycles", "of the period", "slow loop, mean cycles", "core's share"),
                "|--:|--:|--:|--:|--:|")
    for name, row in figures.items():
        if name.startswith("rate."):
            hz, _, two = name.removeprefix("rate.").partition(".")
            share = 100 * row["cycles_max"] * int(hz) * (2 if two else 1) / figures["_meta"]["core_hz"]
            what = f"{int(hz) / 1000:g} kHz{', two samples a period' if two else ''}"
            yield _line(what, row["cycles_max"], f"{share:.1f} %", row["slow_loop_mean"], f"{row['load_percent']:.1f} %")
    yield ""


def _library(figures):
    yield from ("## The library, beside its portable C", "",
                "One call, BL and return included, arguments from memory and results to memory. min and max are over typical"
                " and extreme data, the median over typical data. inlined: the median less a call that moves the same words"
                " and computes nothing, which is about what remains in the current loop. C: the same source with"
                " `LIB_PORTABLE`, worst data; gain: against the better of the two. These rows, and those of the library below,"
                " are with memory that answers at once: where code stands is its user's choice.", "",
                _line("function", "instructions", "min", "median", "max", "inlined", "C -O2", "C -O3", "gain"),
                "|---|--:|--:|--:|--:|--:|--:|--:|--:|")
    for name, row in figures.items():
        if is_row(name) and "portable_O2" in row:
            portable = (row[f"portable_{level}"]["cycles_max"] for level in ("O2", "O3"))
            yield _line(f"`{name}`", *_cells(row), row["cycles_median"] - row["moves"], *portable, f"{gain(row):+.0f} %")
    yield ""


def _others(figures):
    yield from ("## The rest", "", *ENDS_HEAD)
    for name in ROWS:
        if name in figures and not name.startswith((*LOOP_ROWS, "rate.")):
            yield _line(f"`{name}`", *_cells(figures[name]), *_ends(figures[name]), ROWS[name])
    yield ""


def _compilers(known):
    names = [name for name in known[REFERENCE]
             if is_row(name) and len({_worst(figures, name) for figures in known.values()}) > 1]
    if not names:
        return
    yield from ("## Other compilers", "", "All of the above is GCC 12's. Where another makes a difference, worst data:", "",
                _line("row", *(figures["_meta"]["compiler"].removeprefix("GNU C11 ") for figures in known.values())),
                "|---|" + "--:|" * len(known))
    for name in names:
        yield _line(f"`{name}`", *(_worst(figures, name) for figures in known.values()))
    yield ""


def _worst(figures, name):
    return figures.get(name, {}).get("cycles_max", "")


def _peers():
    with open(HERE / "peers.toml", "rb") as stream:
        peers = tomllib.load(stream)
    yield from ("## What others take", "",
                "Cycles of one call on mid-range data, by the same timing rules at zero wait states, GCC 12.2 -O2 [-O3]; each"
                " source at the commit given. They differ in what they do: word length, rounding, saturation.", "",
                _line("", *peers["columns"]), "|---|" + "---|" * len(peers["columns"]))
    for peer in peers["peer"]:
        yield _line(peer["name"], *peer["cycles"])
    yield ""


def _method():
    return [
        "## How it is measured", "",
        "`build/bench.elf` is an ordinary image: flash it, open the console (115200 8N1), and it prints its table; it needs the"
        " fabric's design, no motor, and leaves the bridge off. Each call stands between two readings of CYCCNT with"
        " interrupts masked; what the readings cost is measured around one NOP and taken off. Data are the same every time:"
        " 255 typical vectors and every combination of corners, so figures are too.", "",
        "`current_loop.latency` and `current_loop.interrupt` come from the twin, which logs every interrupt of a run in closed"
        " loop: on the target they could be had only by adding to what is measured. `current_loop.pended` and `.stolen` come"
        " from the target and say the same as `.interrupt` by other means.", "",
        "Budgets for these figures, for flash, RAM and stack stand in `tests/budgets.toml`, and `make test ALL=1` holds them"
        " both ways.",
    ]
