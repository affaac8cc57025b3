# SPDX-License-Identifier: MIT
"""A drive that runs while a test talks to it, its bus at a terminal: for programs that know nothing of the twin.

Simulated time runs no faster than the clock on the wall, as in `make console`; no verdict depends on either.
"""
import contextlib
import re
import subprocess
import threading
import time

from launcher.config import twin_config
from launcher.console import LEAD_S, PACE_S
from launcher.drive import load_drive
from launcher.paths import build_dir
from launcher.probes import Symbols
from launcher.qemu import Image, Qemu, bus_chardev, command, escape, progress_s, start
from launcher.scenario import Scenario
from launcher.simulate import prepare, write

PATIENCE_S = 60


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


@contextlib.contextmanager
def live(out_dir, motor="teknic_m2310p"):
    """(terminal of its bus, progress file) of a running drive, whose parameters have been typed."""
    drive, build = load_drive(motor, plant="full", spread=0), build_dir()
    image, qemu = Image(build), Qemu()
    files, options = prepare(out_dir), bus_chardev("pty")
    plan = Scenario("live", "live", None, 0.05, [], [])
    config, output = out_dir / "twin.cfg", out_dir / "qemu.log"
    write(config, twin_config(drive, plan, 1, [], {"progress": files["progress"], "bus_log": files["bus_log"], **options[1]},
                              Symbols(image.elf)))
    arguments = command(qemu, image, config, f"file,id=console,path={escape(files['console'])}", options[0])
    over = threading.Event()
    with open(output, "wb") as stream:
        process = start(arguments, qemu.environment(), stdin=subprocess.DEVNULL, stdout=stream, stderr=stream)
        pacer = threading.Thread(target=_pace, args=(process, files["progress"], over), daemon=True)
        try:
            terminal = _terminal(output)
            pacer.start()
            while progress_s(files["progress"]) < 0.3:  # parameters have been typed
                assert process.poll() is None, output.read_text()
                time.sleep(0.05)
            yield terminal, files["progress"]
        finally:
            over.set()
            process.kill()
            process.wait()
