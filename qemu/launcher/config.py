# SPDX-License-Identifier: MIT
"""The text file that configures the twin for one run (format: qemu/twin, one item a line)."""
from . import aligned
from .drive import preamble, twin_items
from .errors import LauncherError
from .probes import code_of
from .refusals import typed


def twin_config(drive, scenario, seed, probes, files, symbols=None, dumps=(), cycles=None,
                way_of=None, enums=None):
    """The whole file as text.

    `files` has the paths "trace" and "progress", or is empty for a live console; `probes` are the columns read from the
    target's memory; `symbols` resolves the names in poke events; `dumps` are (address, bytes, path) of memory to be kept at
    the end; `cycles` are wait cycles that differ from the twin's defaults;
    `way_of` is (exception, path) of a log of the way through its handler; `enums` are the meanings of columns, which steps that
    wait for a state need.
    """
    lines = [f"# {drive.motor.name} on {drive.inverter.name}; {scenario.title}"]
    lines += [f"{key} {path}" for key, path in files.items()]
    lines += [f"seed {seed}", "console console"]
    lines += [] if drive.motor["encoder"]["fitted"] else ["event 0 encoder_cut 1"]
    steps, late, end_s = scenario.split()
    if end_s is not None:
        lines.append(f"end {end_s:.9g}")
    lines += [f"{key} {value:.12g}" for key, value in twin_items(drive)]
    lines += [f"probe {p.column} 0x{p.address:08x} {p.type} {p.scale:.12g}" for p in probes]
    lines += [f"cycles.{key} {value}" for key, value in (cycles or {}).items()]
    lines += [f"irqpath {way_of[0]} {way_of[1]}"] if way_of else []
    lines += [f"dump 0x{address:08x} {size} {path}" for address, size, path in dumps]
    if scenario.watchdog_s is not None:
        lines.append(f"watchdog {watchdog_load(scenario.watchdog_s)}")
    if scenario.preamble_s is not None:
        lines += [f"event {scenario.preamble_s:.9g} console {text}" for text in preamble(drive)]
    lines += [f"event {_event(step, symbols)}" for step in steps]
    if drive.aligned and aligned.has_encoder(text for _, text in typed(scenario, drive)):
        lines += aligned.lines(symbols, enums)
    lines += [f"after state={_codes(step.after, enums)} {_event(step, symbols)}" for step in late]
    return "\n".join(lines) + "\n"


def watchdog_load(time_s):
    """WDOGLOAD: 26 bits of 64 ticks of the 50 MHz oscillator each."""
    return round(time_s * 50e6 / 64)


def _event(step, symbols):
    if step.kind == "console":
        return f"{step.t_s:.9g} console {step.text}"
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
