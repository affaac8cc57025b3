# SPDX-License-Identifier: MIT
"""The text file that configures the twin for one run (format: qemu/twin, one item a line)."""
from . import aligned
from .drive import preamble, twin_items
from .errors import LauncherError
from .probes import code_of
from .refusals import typed
from .scenario import Step


def twin_config(drive, scenario, seed, probes, files, symbols=None, dumps=(), cycles=None,
                way_of=None, enums=None, second=None):
    """The whole file as text.

    `files` has the paths "trace" and "progress", or is empty for a live console; `probes` are the columns read from the
    target's memory; `symbols` resolves the names in poke events; `dumps` are (address, bytes, path) of memory to be kept at
    the end; `cycles` are wait cycles that differ from the twin's defaults;
    `way_of` is (exception, path) of a log of the way through its handler; `enums` are the meanings of columns, which steps that
    wait for a state need; `second` has the same of axis 2, as an object with drive, plan, probes, files, symbols and enums.
    """
    lines = [f"# {drive.motor.name} on {drive.inverter.name}; {scenario.title}"]
    lines += [f"{key} {path}" for key, path in files.items()]
    lines += [f"seed {seed}", "console console"]
    lines += _wires(drive)
    end_s = scenario.split()[2]
    if end_s is not None:
        lines.append(f"end {max(end_s, second.plan.split()[2]) if second else end_s:.9g}")
    lines += _plant(drive, probes)
    lines += [f"cycles.{key} {value}" for key, value in (cycles or {}).items()]
    lines += [f"irqpath {way_of[0]} {way_of[1]}"] if way_of else []
    lines += [f"dump 0x{address:08x} {size} {path}" for address, size, path in dumps]
    watchdog_s = watchdog_of([scenario, *([second.plan] if second else [])])
    if watchdog_s is not None:
        lines.append(f"watchdog {watchdog_load(watchdog_s)}")
    lines += _events(drive, scenario, symbols, enums, beside_another=second is not None)
    return "\n".join([*lines, *(_second(second) if second else [])]) + "\n"


def _second(axis):
    """The lines of axis 2, behind those of axis 1 and of the device."""
    return ["axis 2", f"# {axis.drive.motor.name} on {axis.drive.inverter.name}; {axis.plan.title}",
            *(f"{key} {path}" for key, path in axis.files.items()), *_wires(axis.drive), *_plant(axis.drive, axis.probes),
            *_events(axis.drive, axis.plan, axis.symbols, axis.enums, True, "axis 2 ")]


def _wires(drive):
    return [] if drive.motor["encoder"]["fitted"] else ["event 0 encoder_cut 1"]


def _plant(drive, probes):
    return [f"{key} {value:.12g}" for key, value in twin_items(drive)] + [
        f"probe {p.column} 0x{p.address:08x} {p.type} {p.scale:.12g}" for p in probes]


def _events(drive, scenario, symbols, enums, beside_another, to=""):
    """What is typed, each line behind `to`, and what happens. Beside another axis each says when it is done."""
    steps, late, end_s = scenario.split()
    if beside_another and not scenario.holds and end_s is not None:
        steps = [*steps, Step(end_s, "end", [])]
    lines = []
    if scenario.preamble_s is not None:
        lines += [f"event {scenario.preamble_s:.9g} console {to}{text}" for text in preamble(drive)]
    lines += [f"event {_event(step, symbols, to)}" for step in steps]
    if drive.aligned and aligned.has_encoder(text for _, text in typed(scenario, drive)):
        lines += aligned.lines(symbols, enums)
    return lines + [f"after state={_codes(step.after, enums)} {_event(step, symbols, to)}" for step in late]


def watchdog_of(scenarios):
    """The time-out that all want who say one; None if nobody does."""
    wanted = {scenario.watchdog_s for scenario in scenarios} - {None}
    if len(wanted) > 1:
        raise LauncherError(f"the device has one watchdog, but the scenarios want {min(wanted):g} and {max(wanted):g} s")
    return next(iter(wanted), None)


def watchdog_load(time_s):
    """WDOGLOAD: 26 bits of 64 ticks of the 50 MHz oscillator each."""
    return round(time_s * 50e6 / 64)


def _event(step, symbols, to):
    if step.kind == "console":
        return f"{step.t_s:.9g} console {to}{step.text}"
    words = [_resolved(word, symbols) for word in step.args]
    return " ".join([f"{step.t_s:.9g}", step.kind] + words)


def _codes(states, enums):
    codes = [code_of((enums or {}).get("state", {}), state) for state in states]
    if -1 in codes:
        raise LauncherError(f"the image has no state '{states[codes.index(-1)]}', for which a step waits")
    return ",".join(str(code) for code in codes)


def _resolved(word, symbols):
    """`&name` is an address in the image, `*name` the first halfword of a function."""
    if word.startswith("&"):
        return f"0x{symbols.address(word[1:]):08x}"
    if word.startswith("*"):
        return f"0x{symbols.code16(word[1:]):04x}"
    return word
