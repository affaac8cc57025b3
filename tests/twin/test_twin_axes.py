# SPDX-License-Identifier: MIT
"""The lines of a second axis in the twin's configuration, and an image of one motor before a fabric of two."""
import re

import pytest

from launcher import LauncherError, simulate
from launcher.trace import load_trace
from rigs.played_again import again

SCENARIO = {"key": "axes", "end_s": 0.1, "preamble_s": 0.02, "step": []}
LOAD_NM = 0.03


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return simulate(SCENARIO, out_dir=tmp_path_factory.mktemp("run"), plant="ideal", spread=0)


def second(run):
    """The plant of the only axis once more, for a second one."""
    lines = (run.out_dir / "twin.cfg").read_text().splitlines()
    return ["axis 2", *(line for line in lines if re.match(r"(motor|load|inverter|sensor)\.", line))]


def test_a_second_plant_leaves_the_first_as_it_is(run, tmp_path):
    again(run, tmp_path, *second(run), f"trace {tmp_path / 'second.bin'}", f"event 0.05 load_nm {LOAD_NM}")
    for name in ("trace.bin", "console.txt"):
        assert (tmp_path / name).read_bytes() == (run.out_dir / name).read_bytes()
    assert (tmp_path / "second.bin").read_bytes().count(b"\n") == 1, "nobody lets the second carrier run"
    assert re.search(r"speed=.* state=.*; axis 2: speed=.* bus=", (tmp_path / "progress").read_text())


def test_the_lines_behind_axis_1_are_of_the_first_again(run, tmp_path):
    again(run, tmp_path, *second(run), "axis 1", f"event 0.05 load_nm {LOAD_NM}", "event 0.06 end")
    trace = load_trace(tmp_path / "trace.bin")
    assert trace["load_Nm"].max() == LOAD_NM, "a run of two goes on when one of them has ended"
    assert trace["t_s"][-1] > 0.099


@pytest.mark.parametrize("end", ["", "event 0.07 end"])
def test_the_run_ends_when_both_have_ended(run, tmp_path, end):
    again(run, tmp_path, *second(run), "event 0.06 end", "axis 1", *filter(None, [end]))
    assert load_trace(tmp_path / "trace.bin")["t_s"][-1] == pytest.approx(0.07 if end else 0.1, abs=1e-4)


@pytest.mark.parametrize("lines, complaint", [
    (["axis 3"], "axis: '3' is neither 1 nor 2"),
    (["axis 2"], "axis 2: missing key 'motor.pole_pairs'"),
    (["axis 2", "after state=1 0 end"], "after: there is no probe 'state' yet"),
])
def test_what_a_second_axis_needs(run, tmp_path, lines, complaint):
    with pytest.raises(LauncherError, match=complaint):
        again(run, tmp_path, *lines)


def test_the_rtl_has_one_axis(run, tmp_path):
    with pytest.raises(LauncherError, match="axis 2 has C models only"):
        again(run, tmp_path, *second(run), "fabric axis.so")
