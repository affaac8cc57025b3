# SPDX-License-Identifier: MIT
"""Runs a bare-metal image under QEMU with the twin until it prints its closing line."""
import os
import re
import subprocess
import time
from pathlib import Path

from launcher.config import twin_config
from launcher.drive import load_drive
from launcher.qemu import Qemu, chip_items, command, escape, start
from launcher.scenario import load_scenario

BUILD = Path(os.environ.get("BUILD", "build"))
CLOSING = re.compile(r"(?m)^(\d+) passed, (\d+) failed\r?\n")


class _Image:
    def __init__(self, elf):
        self.hex = Path(elf).resolve()
        self.plugin = (BUILD / "qemu" / "twin.so").resolve()


def _end(process):
    """In order, so that what the twin recorded reaches its files; by force if it does not heed that."""
    process.terminate()
    try:
        process.wait(timeout=30)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def run_image(elf, out_dir, config_lines=(), wall_s=120, chip=""):
    """The console's text up to the closing line (or the time limit), with QEMU's own messages behind it.

    config_lines   more lines for the twin's configuration
    chip           the device (launcher.simulate)
    """
    qemu, out_dir = Qemu(), Path(out_dir).resolve()
    config, console = out_dir / "twin.cfg", out_dir / "console.txt"
    plan = load_scenario({"end_s": 600.0}, drive := load_drive("teknic_m2310p"))
    text = twin_config(drive, plan, 1, [], {"progress": out_dir / "progress", **chip_items(chip, "")})
    config.write_text(text + "".join(line + "\n" for line in config_lines))
    arguments = command(qemu, _Image(elf), config, f"file,id=console,path={escape(console)}")
    with open(out_dir / "qemu.log", "wb") as log:
        process = start(arguments, qemu.environment(), stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        try:
            limit = time.monotonic() + wall_s
            while process.poll() is None and time.monotonic() < limit:
                if console.exists() and CLOSING.search(console.read_text(errors="replace")):
                    break
                time.sleep(0.05)
        finally:
            _end(process)
    said = console.read_text(errors="replace") if console.exists() else ""
    return said + (out_dir / "qemu.log").read_text(errors="replace")
