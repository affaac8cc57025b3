# SPDX-License-Identifier: MIT
"""A drive that runs while a test talks to it, its bus at a terminal: for programs that know nothing of the twin.

Simulated time runs no faster than the clock on the wall, as in `make console`; no verdict depends on either.
"""
import contextlib
import re
import socket
import subprocess
import threading
import time

from launcher.can_bus import can_chardev
from launcher.config import twin_config
from launcher.console import LEAD_S, PACE_S, live_axis
from launcher.drive import load_drive
from launcher.paths import build_dir
from launcher.probes import Symbols
from launcher.qemu import Image, Qemu, bus_chardev, command, escape, line_chardev, progress_s, reason, start, tail
from launcher.scenario import Scenario, Step
from launcher.simulate import prepare, write

from closed_loop.whole_frames import whole_frames

PATIENCE_S = 600  # only what hangs takes so long, on a busy machine, too


def until(holds, told, patience_s=PATIENCE_S):
    end_s = time.monotonic() + patience_s
    while not holds():
        assert time.monotonic() < end_s, f"never, in {patience_s:g} s: {told}"
        time.sleep(0.05)


def _pace(process, progress, over):
    """Stops QEMU for a moment where it has run ahead."""
    import signal
    began = time.monotonic()
    while not over.wait(PACE_S):
        ahead = progress_s(progress) - (time.monotonic() - began)
        if ahead > LEAD_S and process.poll() is None:
            process.send_signal(signal.SIGSTOP)
            over.wait(ahead)
            process.send_signal(signal.SIGCONT)
        elif ahead < -LEAD_S:
            began -= ahead


def _terminal(output):
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        found = re.search(r"redirected to (\S+) \(label bus\)", output.read_text(errors="replace"))
        if found:
            return found.group(1)
        time.sleep(0.05)
    raise AssertionError(f"QEMU named no terminal: {output.read_text(errors='replace')}")


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@contextlib.contextmanager
def live(out_dir, motor="teknic_m2310p"):
    """(terminal of its bus, progress file) of a running drive, whose parameters have been typed."""
    with _running(out_dir, motor, *bus_chardev("pty")) as (files, output), whole_frames(_terminal(output)) as terminal:
        yield terminal, files["progress"]


@contextlib.contextmanager
def live_can(out_dir, *typed, motor="teknic_m2310p", join=None):
    """(port that speaks socketcand, files) of a running drive, at whose console these lines have been typed; with `join` it is
    on the bus of another one, at that port."""
    port = join or free_port()
    options, items = can_chardev(f"join:{port}" if join else f"tcp:{port}")
    with _running(out_dir, motor, options, items, typed) as (files, _):
        yield port, files


@contextlib.contextmanager
def live_everything(out_dir, console, modbus, can, *typed, motor="teknic_m2310p", **two):
    """A running drive with its console and both buses at ports of this machine; of two motors: second=, build=."""
    bus_options, bus_items = bus_chardev(f"tcp:{modbus}")
    can_options, can_items = can_chardev(f"tcp:{can}")
    with _running(out_dir, motor, [*bus_options, *can_options], {**bus_items, **can_items}, typed,
                  line_chardev(f"tcp:{console}", "console", "CONSOLE"), **two) as (files, _):
        yield files


@contextlib.contextmanager
def _running(out_dir, motor, options, items, typed=(), console=None, second="", build=None):
    how = {"plant": "full", "spread": 0}
    drive, build = load_drive(motor, **how), build_dir(build)
    image, qemu = Image(build), Qemu()
    symbols = Symbols(image.elf)
    files = prepare(out_dir)
    typed_s = 0.6 if second else 0.2  # the parameters of two take longer
    steps = [Step(typed_s + 0.02 * n, "console", [], text) for n, text in enumerate(typed)]
    plan = Scenario("live", "live", None, 0.05, steps, [])
    other = live_axis(second, 1, symbols, "model", build, how) if second else None
    config, output = out_dir / "twin.cfg", out_dir / "qemu.log"
    write(config, twin_config(drive, plan, 1, [], {"progress": files["progress"], "bus_log": files["bus_log"],
                                                      "can_log": files["can_log"], **items}, symbols, second=other))
    arguments = command(qemu, image, config, console or f"file,id=console,path={escape(files['console'])}", options)
    over = threading.Event()
    with open(output, "wb") as stream:
        process = start(arguments, qemu.environment(), stdin=subprocess.DEVNULL, stdout=stream, stderr=stream)
        pacer = threading.Thread(target=_pace, args=(process, files["progress"], over), daemon=True)
        try:
            pacer.start()
            while progress_s(files["progress"]) < typed_s + 0.1 + 0.02 * len(typed):  # parameters have been typed
                assert process.poll() is None, output.read_text()
                time.sleep(0.05)
            yield files, output
        finally:
            over.set()
            ended = process.poll()
            process.kill()
            process.wait()
        assert ended is None, f"the drive was gone before the test let it go: {reason(ended)}{tail(output, 40)}"
