# SPDX-License-Identifier: MIT
"""The cycle model against counts made by hand, on the target: sequence by sequence, read by DWT."""
import csv
import re

import pytest

from target.runner import BUILD, CLOSING, run_image

ZERO = {"apb_read": 0, "apb_write": 0, "ppb": 0, "esram": 0, "envm_wait": 0, "cache": 1}
PROFILES = {
    "rules": ZERO,
    "waits": ZERO | {"apb_read": 3, "apb_write": 2, "ppb": 1, "esram": 1},
    "fetch": ZERO | {"envm_wait": 2, "cache": 0},
}
SVC, PENDSV = 11, 14


def run(name, out_dir, extra=()):
    lines = [f"cycles.{key} {value}" for key, value in PROFILES[name].items()]
    return run_image(BUILD / "tests" / "timing" / f"{name}.elf", out_dir, [*lines, *extra])


@pytest.mark.parametrize("name", PROFILES)
def test_sequences(name, tmp_path):
    text = run(name, tmp_path)
    closing = CLOSING.search(text)
    assert closing, f"no closing line:\n{text[-2000:]}"
    assert not (failures := [line for line in text.splitlines() if line.startswith("FAIL")]), "\n".join(failures)
    assert int(closing.group(1)) == len(re.findall(r"(?m)^ok ", text)) > 2


def test_instructions_in_place_of_cycles(tmp_path):
    text = run("rules", tmp_path, ["dwt instructions"])
    assert re.search(r"FAIL the frame: NOP NOP LDR: expected 4 got 3\b", text)
    assert re.search(r"FAIL LDM STM of 4: expected 10 .*got 2\b", text)


def test_interrupt_log(tmp_path):
    run("rules", tmp_path, [f"irqlog {tmp_path / 'irq.csv'}"])
    rows = list(csv.DictReader((tmp_path / "irq.csv").open()))
    by_exception = [(int(r["exception"]), int(r["cycles"]), int(r["instructions"]), int(r["chained"])) for r in rows]
    assert by_exception == [
        (SVC, 12 + 1 + 12, 2, 0),
        (SVC, 12 + 11, 6, 2),
        (PENDSV, 6 + 6 + 12, 2, 1),
    ]
