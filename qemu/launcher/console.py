# SPDX-License-Identifier: MIT
"""`make console`: a running drive, its console in this terminal.  `make debug`: halted, for a debugger.

The live drive runs with -icount sleep=off like every run: with sleep=on QEMU's timers are late by whole PWM periods
whenever the host is, and the firmware rightly sees its loop stop. Real time comes from here instead: QEMU is stopped for a
moment whenever it has run ahead. On a slow machine the motor's time is slower than the clock on the wall.
"""
import os
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

from .can_bus import can_chardev, joins
from .claim import InUse, keep
from .config import twin_config
from .drive import load_drive
from .errors import LauncherError
from .params import check_ranges, ranges_of
from .paths import build_dir, shown
from .probes import Symbols, make_probes
from .qemu import (Image, Qemu, bus_chardev, chip_items, command, envm_files, fabric_files, line_chardev, progress_s,
                   start)
from .scenario import Scenario, load_scenario
from .simulate import SEED_OF_SECOND, check_axes, check_seed, prepare, write

PREAMBLE_S = 0.05
TWINS = 127        # on one CAN bus: its nodes
PACE_S = 0.02      # how often the two times are compared
LEAD_S = 0.1       # how far simulated time may be ahead
TYPED_S = 0.35     # by when the parameters of two axes have been typed
TRY = ("  on     (wait a second)     speed 1500     status     speed 0     off     help\n"
       "To leave: Ctrl-A, then x.\n")
TERMINAL = "stdio,id=console,mux=on,signal=off"


def live_console(motor, seed, build=None, qemu=None, scenario=None, console="", modbus="", can="", second="", **plant):
    """Runs until the user ends it. Returns the exit status of QEMU. `plant`: plant, spread, detune, fabric, sensors, aligned,
    envm, as simulate() has them; `console`, `modbus`, `can`: where they are to be had, pty or tcp:PORT, `can` also on another
    twin's bus (can_bus.py); without `console` it is this terminal. `second` is the motor of axis 2, for an image of two; a
    scenario is the first's."""
    terminal = line_chardev(console, "console", "CONSOLE") if console else TERMINAL
    (drive, _), arguments, environment, progress, _ = prepared(motor, seed, build, qemu, scenario, plant, console=terminal,
                                                          modbus=modbus, can=can, second=second)
    if console:
        where = f"at socket://127.0.0.1:{console[4:]}" if console.startswith("tcp:") else "at the terminal that QEMU names"
        print(f"{drive.motor.name} on {drive.inverter.name}, its console {where}. To end: Ctrl-C.\n", flush=True)
        return _run(arguments, environment, progress)
    seen = sys.stdout.isatty()
    print(f"{drive.motor.name} on {drive.inverter.name}. Its parameters are typed for you; then try:\n{'' if seen else TRY}",
          flush=True)
    return _run(arguments, environment, progress, then=TRY if seen else "")


def debug_session(motor, seed, build=None, qemu=None, scenario=None, port=1234, modbus="", can="",
                  **plant):
    """QEMU halted at the reset vector with a GDB port; prints how to attach."""
    if not 1 <= port <= 65535:
        raise LauncherError(f"port {port} is outside 1..65535")
    _, arguments, environment, *_ = prepared(motor, seed, build, qemu, scenario, plant,
                                            ["-S", "-gdb", f"tcp:127.0.0.1:{port}"], modbus=modbus, can=can)
    elf = shown(build_dir(build) / "mssfoc.elf")
    print(f"Halted at the reset vector. Attach from another terminal:\n"
          f"  gdb-multiarch {elf} -ex 'target remote :{port}' -x qemu/debugger/fabric.py\n"
          "then for example:  break main   continue   print axes[0].loop   fabric PWM   info registers\n"
          "Simulated time stands still while the target is halted, so the motor waits for you.\n"
          "The console is in this terminal. To leave: Ctrl-A, then x.\n", flush=True)
    return _run(arguments, environment)


def prepared(motor, seed, build, qemu, scenario, plant, extra=(), console=TERMINAL, live=False, modbus="",
             can="", out_dir=None, second=""):
    """What starts a drive that runs until it is ended: ((drive, the other one or None), command line, environment,
    progress file, pipe of live events).

    live    events come by the pipe, and nobody types the motor's parameters; otherwise there is no pipe
    modbus, can  where the buses are to be had
    second  the motor of axis 2, for an image of two
    """
    seed = check_seed(seed)
    plant = dict(plant)
    fabric, envm, chip = plant.pop("fabric", "model"), plant.pop("envm", ""), plant.pop("chip", "")
    drive = load_drive(motor, seed=seed, **plant)
    if scenario:
        plan = replace(load_scenario(scenario, drive), end_s=None)
    else:
        plan = Scenario("live", "live console", None, None if live else PREAMBLE_S, [], [])
    build = build_dir(build)
    checked, image = Qemu(qemu), Image(build)
    out_dir = Path(out_dir) if out_dir else build / ("scope" if live else "console")
    symbols = Symbols(image.elf)
    check_axes(symbols, 2 if second else 1)
    check_ranges(drive, ranges_of(symbols))
    other = live_axis(second, seed, symbols, fabric, build, plant, live) if second else None
    can_options, can_items = can_chardev(can, build)
    out_dir = _kept(out_dir, can)
    files = prepare(out_dir)
    config = out_dir / "twin.cfg"
    probes, enums = make_probes(symbols, drive) if plan.late or plan.holds or drive.aligned else ([], None)
    pipe = _new_pipe(out_dir) if live else None
    bus_options, bus_files = bus_chardev(modbus)
    written = {"progress": files["progress"], **({"live": pipe} if live else {}), **fabric_files(fabric, build, drive),
               **envm_files(envm), **chip_items(chip), **bus_files, **can_items}
    write(config, twin_config(drive, plan, seed, probes, written, symbols, enums=enums, second=other))
    line = command(checked, image, config, console, [*bus_options, *can_options, *extra])
    return (drive, other and other.drive), line, checked.environment(), files["progress"], pipe


def live_axis(motor, seed, symbols, fabric, build, plant, live=False):
    """Axis 2 of a live drive: its motor's parameters are typed, too, where the first one's are."""
    drive = load_drive(motor, seed=seed ^ SEED_OF_SECOND, **plant)
    check_ranges(drive, ranges_of(symbols))
    fabric_files(fabric, build, drive, drive)  # refuses a fabric that has one axis only
    plan = Scenario("live", "live console", None, None if live else PREAMBLE_S, [], [])
    own = symbols.of_axis(1)
    probes, enums = make_probes(own, drive) if drive.aligned else ([], None)
    return SimpleNamespace(drive=drive, plan=plan, probes=probes, files={}, symbols=own, enums=enums)


def _kept(out_dir, can):
    """The folder, claimed; of a twin that joins another's bus the first of several that is free."""
    if joins(can):
        for number in range(2, TWINS + 1):
            try:
                keep(folder := out_dir.with_name(f"{out_dir.name}-{number}"))
                return folder
            except InUse:
                continue
    keep(out_dir)
    return out_dir


def _new_pipe(folder):
    path = (folder / "events").resolve()
    path.unlink(missing_ok=True)
    os.mkfifo(path)
    return path


def _run(arguments, environment, progress=None, then=""):
    """then   said when the parameters have been typed: before that they would push it off a terminal"""
    process = start(arguments, environment)
    try:
        return process.wait() if progress is None else _keep_pace(process, progress, then)
    except KeyboardInterrupt:
        return 130
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGCONT)
            process.terminate()
            process.wait()
        if sys.stdout.isatty():
            print()


def _keep_pace(process, progress, then=""):
    """Lets simulated time run no faster than the clock on the wall. What it falls behind is not made up for."""
    start = time.monotonic()
    while process.poll() is None:
        time.sleep(PACE_S)
        at_s = progress_s(progress)
        if then and at_s > TYPED_S:
            print("\r\n" + then.replace("\n", "\r\n") + "> ", end="", flush=True)  # the terminal is QEMU's: raw
            then = ""
        ahead = at_s - (time.monotonic() - start)
        if ahead > LEAD_S:
            process.send_signal(signal.SIGSTOP)
            time.sleep(ahead)
            process.send_signal(signal.SIGCONT)
        elif ahead < -LEAD_S:
            start += -ahead
    return process.returncode
