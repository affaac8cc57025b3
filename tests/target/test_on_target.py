# SPDX-License-Identifier: MIT
"""The test images of this folder, on the target under QEMU with the twin: every check they report must have passed."""
import re
from pathlib import Path

import pytest

from target.runner import BUILD, CLOSING, run_image

IMAGES = sorted(path.stem for path in Path("tests/target").glob("test_*.c"))
CACHED = ["cycles.cache 1"]  # the images leave the cache off, and some of them look at the time


def check(name, tmp_path, chip=""):
    text = run_image(BUILD / "tests" / "target" / f"{name}.elf", tmp_path, CACHED, 300, chip)
    closing = CLOSING.search(text)
    assert closing, f"no closing line:\n{text[-2000:]}"
    failures = [line for line in text.splitlines() if line.startswith("FAIL")]
    assert not failures and int(closing.group(2)) == 0, "\n".join(failures)
    assert int(closing.group(1)) > 0 and int(closing.group(1)) == len(re.findall(r"(?m)^ok ", text))


@pytest.mark.parametrize("name", IMAGES)
def test_image(name, tmp_path):
    check(name, tmp_path)


@pytest.mark.parametrize("name", IMAGES)
def test_image_on_the_larger_device(name, tmp_path):
    check(name, tmp_path, chip="m2s025")
