# SPDX-License-Identifier: MIT
"""Runs the test images of this folder on the target under QEMU with the twin, and counts what they report."""
import os
import re
import signal
import subprocess
import time
from pathlib import Path

import pytest

from launcher.config import twin_config
from launcher.drive import load_drive
from launcher.qemu import Qemu, command, escape
from launcher.scenario import load_scenario

BUILD = Path(os.environ.get("BUILD", "build"))
IMAGES = sorted(path.stem for path in Path("tests/target").glob("test_*.c"))
WALL_S = 120


class TestImage:
    __test__ = False

    def __init__(self, name):
        self.hex = BUILD / "tests" / "target" / f"{name}.elf"
        self.plugin = BUILD / "qemu" / "twin.so"


def run_image(name, out_dir):
    """The console's text up to the closing line, or up to the time limit."""
    drive = load_drive("teknic_m2310p")
    plan = load_scenario({"end_s": 600.0}, drive)
    config, console = out_dir / "twin.cfg", out_dir / "console.txt"
    config.write_text(twin_config(drive, plan, 1, [], {"progress": out_dir / "progress"}))
    arguments = command(Qemu(), TestImage(name), config, f"file,id=console,path={escape(console)}")
    with open(out_dir / "qemu.log", "wb") as log:
        process = subprocess.Popen(arguments, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        try:
            limit = time.monotonic() + WALL_S
            while process.poll() is None and time.monotonic() < limit:
                if console.exists() and re.search(r"(?m)^\d+ passed, \d+ failed\r?$", console.read_text(errors="replace")):
                    break
                time.sleep(0.05)
        finally:
            process.send_signal(signal.SIGKILL)
            process.wait()
    return console.read_text(errors="replace") + (out_dir / "qemu.log").read_text(errors="replace")


@pytest.mark.parametrize("name", IMAGES)
def test_image(name, tmp_path):
    text = run_image(name, tmp_path)
    closing = re.search(r"(?m)^(\d+) passed, (\d+) failed\r?$", text)
    assert closing, f"no closing line:\n{text[-2000:]}"
    failures = [line for line in text.splitlines() if line.startswith("FAIL")]
    assert not failures and int(closing.group(2)) == 0, "\n".join(failures)
    assert int(closing.group(1)) > 0 and int(closing.group(1)) == len(re.findall(r"(?m)^ok ", text))
