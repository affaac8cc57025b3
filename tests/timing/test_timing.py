# SPDX-License-Identifier: MIT
"""The cycle model, read by DWT on the target: against counts made by hand, and against published silicon."""
import re

import pytest

from launcher.load import load_irqlog

from cases import HAND_COUNTED, PUBLISHED, TOLERANCE, measured, run, sequences

SVC, PENDSV = 11, 14


@pytest.mark.parametrize("name", HAND_COUNTED)
def test_sequences(name, tmp_path):
    agree, differ = sequences(run(name, tmp_path))
    print(f"{name}: {len(agree)} sequences counted by hand exact, {len(differ)} not")
    assert not differ, "\n".join(differ)
    assert len(agree) > 2


def test_published_silicon(tmp_path):
    found = measured(run("published", tmp_path))
    for case in PUBLISHED:
        print(f"{case.name:24} model {found[case.name]}, silicon {case.cycles:g}: {case.source}")
        assert abs(found[case.name] / case.cycles - 1) <= TOLERANCE, (case, found[case.name])


def test_instructions_in_place_of_cycles(tmp_path):
    text = run("rules", tmp_path, ["dwt instructions"])
    assert re.search(r"FAIL the frame: NOP NOP LDR: expected 4 got 3\b", text)
    assert re.search(r"FAIL LDM STM of 4: expected 10 .*got 2\b", text)


def test_interrupt_log(tmp_path):
    run("rules", tmp_path, [f"irqlog {tmp_path / 'irq.bin'}"])
    log = load_irqlog(tmp_path / "irq.bin")
    assert list(zip(*(log[key] for key in ("exception", "cycles", "instructions", "chained")))) == [
        (SVC, 12 + 1 + 10, 2, 0),
        (SVC, 12 + 11, 6, 2),
        (PENDSV, 6 + 6 + 10, 2, 1),
    ]
