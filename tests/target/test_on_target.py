# SPDX-License-Identifier: MIT
"""The test images of this folder, on the target under QEMU with the twin: every check they report must have passed."""
import re
from pathlib import Path

import pytest

from launcher.config import watchdog_load
from target.runner import BUILD, CLOSING, run_image

IMAGES = sorted(path.stem for path in Path("tests/target").glob("test_*.c") if path.stem != "test_watchdog")
CACHED = ["cycles.cache 1"]  # the images leave the cache off, and some of them look at the time
HOLDS_FABRIC = "test_sysreg"  # and so needs a design in which that bit holds it


def check(name, tmp_path, config_lines=(), chip=""):
    wired = "m2f" if name == HOLDS_FABRIC else ""
    text = run_image(BUILD / "tests" / "target" / f"{name}.elf", tmp_path, [*CACHED, *config_lines], 300, chip, wired)
    closing = CLOSING.search(text)
    assert closing, f"no closing line:\n{text[-2000:]}"
    failures = [line for line in text.splitlines() if line.startswith("FAIL")]
    assert not failures and int(closing.group(2)) == 0, "\n".join(failures)
    assert int(closing.group(1)) > 0 and int(closing.group(1)) == len(re.findall(r"(?m)^ok ", text))
    return text


@pytest.mark.parametrize("name", IMAGES)
def test_image(name, tmp_path):
    check(name, tmp_path)


@pytest.mark.parametrize("name", IMAGES)
def test_image_on_the_larger_device(name, tmp_path):
    check(name, tmp_path, chip="m2s025")


@pytest.mark.parametrize("watchdog_s, ms", [(None, 32212), (0.1, 100)])
def test_the_watchdog_bites_after_the_time_that_the_design_has(watchdog_s, ms, tmp_path):
    """By default the shortest that the user guide allows."""
    lines = [f"watchdog {watchdog_load(watchdog_s)}"] if watchdog_s else []
    assert f"# watchdog: time-out, ms {ms}" in check("test_watchdog", tmp_path, lines)
