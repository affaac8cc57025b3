# SPDX-License-Identifier: MIT
"""The jitter report names the instruction that makes two interrupts differ: on ways with known differences, and on a run."""
import os
from collections import Counter
from pathlib import Path

import disasm
import jitter
import numpy as np
import pytest

BUILD = Path(os.environ.get("BUILD", "build"))
COMMON = [(0x10, 1), (0x12, 2), (0x14, 1), (0x16, 1), (0x18, 1), (0x1A, 16)]


def test_equal_ways_do_not_differ():
    assert jitter.differences(COMMON, COMMON) == []


def test_an_instruction_with_other_operands():
    other = [*COMMON[:2], (0x14, 5), *COMMON[3:]]
    assert jitter.differences(COMMON, other) == [jitter.Difference(0x14, 4, "cycles")]


def test_a_tail_chained_return():
    assert jitter.differences(COMMON, [*COMMON[:-1], (0x1A, 4)]) == [jitter.Difference(0x1A, -12, "return")]


def test_a_branch_taken():
    # 0x12 is not taken in the common way (1 cycle) and taken in the other (2), which leaves out 0x14 and 0x16
    common = [(0x10, 1), (0x12, 1), (0x14, 1), (0x16, 3), (0x18, 1), (0x1A, 16)]
    other = [(0x10, 1), (0x12, 2), (0x18, 1), (0x1A, 16)]
    found = jitter.differences(common, other)
    assert found == [jitter.Difference(0x12, 1 - 4, "way", 0x18)]
    assert sum(part.cycles for part in found) == sum(c for _, c in other) - sum(c for _, c in common)


def test_a_longer_way_round():
    other = [(0x10, 1), (0x12, 2), (0x30, 1), (0x32, 2), (0x16, 1), (0x18, 9), (0x1A, 16)]
    found = jitter.differences(COMMON, other)
    assert [(part.address, part.kind) for part in found] == [(0x12, "way"), (0x18, "cycles")]
    assert sum(part.cycles for part in found) == 3 - 1 + 8


def test_the_source_line_is_named(make_image):
    path, _ = make_image("unsigned work2(unsigned n);\nint work(int n) { return n; }\n"
                         "unsigned work2(unsigned n)\n{\n    n += 3;\n    return 1000u / n;\n}\n"
                         "void Fast2(void) { volatile unsigned n = 5; n = work2(n); }\n")
    image = disasm.Image(path)
    divide = next(i for i in image.functions["work2"].code.values() if i.mnemonic == "udiv")
    ways = {30: [(divide.address, 4), (divide.end, 14)], 37: [(divide.address, 11), (divide.end, 14)]}
    text = "\n".join(jitter.described(image, ways, Counter({30: 90, 37: 10})))
    assert "37 cycles, 10 times; against 30" in text
    assert f"+7  {divide.address:#x} udiv" in text and "code.c:7" in text and "work2" in text


def test_a_duration_without_a_recorded_way_is_said(make_image):
    image = disasm.Image(make_image("int work(int n) { return n; }")[0])
    assert "no way recorded" in jitter.described(image, {}, Counter({30: 9, 31: 1}))[0]


def test_histogram_counts_everything():
    lines = jitter.histogram(np.array([7.0] * 98 + [9.0] * 2), "cycles")
    assert [line.split()[:3] for line in lines] == [["7", "cycles", "98"], ["9", "cycles", "2"]]
    assert lines[0].count("#") == 49 and lines[1].count("#") == 1


def test_points_lie_in_the_scenario_and_do_not_overlap():
    from launcher.drive import load_drive
    from launcher.scenario import load_scenario

    plan = load_scenario("operating_points", load_drive("teknic_m2310p"))
    points = jitter.points(plan.names)
    ends = [0.0, *(end for _, _, end in points)]
    assert all(before <= start < end for before, (_, start, end) in zip(ends, points)) and ends[-1] <= plan.end_s
    assert plan.end_s * 20000 > jitter.FEWEST_INTERRUPTS


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    from launcher import simulate
    from launcher.load import load_irqlog

    folder = tmp_path_factory.mktemp("jitter")
    result = simulate({"key": "short", "end_s": 0.4, "preamble_s": 0.02, "step": [{"t_s": 0.12, "console": "on"}]},
                      out_dir=folder, way_of=jitter.EXCEPTION, plant="ideal", spread=0)
    return jitter.current_loop_only(load_irqlog(result.irqlog)), jitter.read_ways(folder / "irqpath.csv")


def test_ways_of_a_run_add_up(run):
    log, ways = run
    assert set(ways) == set(log["cycles"].astype(int))
    for cycles, way in ways.items():
        chained = log["chained"][log["cycles"] == cycles].astype(int)
        entry = {cycles - sum(cost for _, cost in way)}
        # the vector comes over the stack's bus: cycles.vector and cycles.esram
        assert entry <= {6, 12 + 2 + 1} and (entry == {6}) == bool(chained[0] & jitter.CHAINED_IN)
        assert len(way) in set(log["instructions"][log["cycles"] == cycles].astype(int))


def test_each_handler_of_the_current_loop_takes_the_same_number_of_cycles_every_time(run):
    """The one by hand until `on`, then the one in C that turns the field during the start."""
    log, _ = run
    alone = log["cycles"][log["chained"] == 0]
    changes = np.flatnonzero(np.diff(alone)) + 1
    assert len(alone) > 7000 and len(changes) == 1 and 2000 < changes[0] < 6000
