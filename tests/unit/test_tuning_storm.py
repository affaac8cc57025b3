# SPDX-License-Identifier: MIT
"""Random parameters of the whole ranges through tuning, tables and the slow loop, with measurements that make no sense: nothing
overflows, divides by 0 or leaves an array (tuning_storm.c; the library is compiled so that any of it ends the process)."""
from rigs.firmware import HERE, storm

SETS = 1500


def test_whatever_the_tuning_accepts_can_be_driven(tmp_path):
    counts = storm(HERE / "tuning_storm.c", tmp_path, SETS)
    assert counts["undefined"] == 0, f"build and run tuning_storm {SETS} 2463534242: stderr has the lines"
    assert counts["driven"] >= 900 and counts["refused"] > 50 and counts["sets"] == SETS
