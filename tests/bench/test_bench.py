# SPDX-License-Identifier: MIT
"""The host side of the benchmark: what it reads, refuses, compares and writes."""
from pathlib import Path

import numpy as np
import pytest

from bench.measure import read_irqlog, read_table
from bench.report import REFERENCE, ROWS, baselines, changes, gain, is_row, markdown
from launcher.errors import LauncherError

TABLE = """# a remark
one                            10     11     12
two   1 2 3  moves   4  O2 5 6 7  O3  8  9 10
bench: 2 rows
"""


def test_table():
    assert read_table(TABLE.replace("\n", "\r\n")) == {
        "one": {"": (10, 11, 12)}, "two": {"": (1, 2, 3), "moves": 4, "O2": (5, 6, 7), "O3": (8, 9, 10)}}


@pytest.mark.parametrize("damage, complaint", [
    (("bench: 2", "bench: 3"), "says 3"),
    (("O3", "O4"), "cannot be read"),
    (("  9 10", "  9"), "cannot be read"),
    (("one  ", "two  "), "says 2"),
    (("a remark", "faults found 12"), "12 steps of the slow loop found a fault"),
])
def test_a_damaged_table_is_refused(damage, complaint):
    with pytest.raises(LauncherError, match=complaint):
        read_table(TABLE.replace(*damage))


def test_log_of_interrupts(tmp_path):
    log = tmp_path / "irqlog"
    head = b"t_s,exception,cycles,instructions,latency_cycles,chained\n"
    rows = [(0.001, 50, 9, 9, 9, 0), (2.02, 50, 700, 500, 600, 0), (2.03, 30, 99, 9, 0, 0), (2.04, 50, 694, 500, 594, 1),
            (2.05, 50, 702, 501, 602, 0), (2.06, 50, 701, 500, 601, 0)]
    log.write_bytes(head + np.array(rows, "<f8").tobytes())
    found = read_irqlog(log)
    assert found["current_loop.interrupt"] == {
        "interrupts": 3, "instructions": 500, "instructions_min": 500, "instructions_max": 501,
        "cycles_min": 700, "cycles_median": 701, "cycles_max": 702}
    assert found["current_loop.latency"]["cycles_max"] == 602
    assert found["slow_loop.interrupt"]["cycles_max"] == 99
    log.write_bytes(head + np.array(rows[2], "<f8").tobytes())
    with pytest.raises(LauncherError, match="no interrupt of the current loop"):
        read_irqlog(log)


def test_changes():
    before = {"same": {"cycles_max": 5}, "slower": {"cycles_max": 10}, "old": {"cycles_max": 1}, "_meta": {"a": 1}}
    now = {"same": {"cycles_max": 5}, "slower": {"cycles_max": 12}, "new": {"cycles_max": 1}, "_meta": {"a": 2}}
    found = [line.split() for line in changes(now, before)]
    assert found == [["new", "new"], ["old", "gone"], ["slower", "cycles_max", "10", "->", "12", "+2"]]


def test_gain_is_against_the_better_build():
    row = {"cycles_max": 45, "portable_O2": {"cycles_max": 60}, "portable_O3": {"cycles_max": 50}}
    assert gain(row) == 10.0


def test_committed_document_is_made_of_the_committed_figures():
    assert Path("docs/benchmarks.md").read_text() == markdown(baselines()), "edited by hand? run make bench"


def test_the_readme_has_the_pessimistic_figure():
    page = Path("README.md").read_text()
    figures = baselines()[REFERENCE]
    worst = figures["current_loop.interrupt"]["cycles_pessimistic"]
    assert f"**{worst} cycles** with an encoder" in page, "run make bench"


def test_every_row_is_explained():
    unexplained = [name for figures in baselines().values() for name, row in figures.items()
                   if is_row(name) and "portable_O2" not in row and name not in ROWS]
    assert not unexplained
