# SPDX-License-Identifier: MIT
"""What a run writes: the CSV says what the recording says; and who moves time on while the core sleeps changes no byte."""
import re

import numpy as np
import pytest

from launcher import LauncherError, simulate
from rigs.played_again import again

END_S = 0.6
PERIODS = END_S * 20000
# typing before the PWM runs, a reset by the watchdog in between, a drive that turns
SCENARIO = {"key": "bytes", "end_s": END_S, "preamble_s": 0.02,
            "step": [{"t_s": 0.12, "console": "on"}, {"t_s": 0.3, "event": "watchdog_reset"},
                     {"t_s": 0.4, "console": "status"}, {"t_s": 0.45, "console": "on"}]}
FILES = ("trace.bin", "irq.bin", "console.txt")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return simulate(SCENARIO, out_dir=tmp_path_factory.mktemp("run"), csv=True)


def contents(folder):
    return {name: (folder / name).read_bytes() for name in FILES}


def test_the_csv_says_what_the_recording_says(run):
    with open(run.out_dir / "trace.csv", encoding="ascii") as file:
        names = file.readline().strip().split(",")
        first = file.readline().strip().split(",")
        file.seek(0)
        rows = np.loadtxt(file, delimiter=",", skiprows=1)
    assert rows.shape == (run.trace.rows, len(names)) and rows.shape[0] > 0.99 * PERIODS
    assert set(names) < set(run.trace)
    for name, text, column in zip(names, first, rows.T):
        decimals = len(text.partition(".")[2])
        np.testing.assert_allclose(column, run.trace[name], rtol=0, atol=0.500001 * 10**-decimals, err_msg=name)
    # a time is the very number that its text stands for
    np.testing.assert_array_equal(rows[:, 0], run.trace["t_s"])
    assert not re.search(r"-0\.0*(,|$)", (run.out_dir / "trace.csv").read_text(), re.MULTILINE)


def test_no_csv_unless_it_is_asked_for(run, tmp_path):
    again(run, tmp_path)
    assert (tmp_path / "trace.csv").read_bytes() == (run.out_dir / "trace.csv").read_bytes()
    result = simulate({**SCENARIO, "end_s": 0.05, "step": []}, out_dir=tmp_path)
    assert result.trace.rows > 900 and not (tmp_path / "trace.csv").exists()


def test_sleeping_alone_changes_no_byte(run, tmp_path):
    alone, by_main_loop = tmp_path / "alone", tmp_path / "main_loop"
    alone.mkdir()
    by_main_loop.mkdir()
    # on its own the core's thread hardly ever waits; for the main loop it does so at each WFI
    assert again(run, alone, "wfi core") < PERIODS / 2
    assert again(run, by_main_loop, "wfi main_loop") > PERIODS
    assert contents(alone) == contents(by_main_loop) == contents(run.out_dir)
    assert b"state" in contents(alone)["console.txt"]


def test_who_shall_wake_is_one_of_two(run, tmp_path):
    with pytest.raises(LauncherError, match="wfi: 'nobody' is neither core nor main_loop"):
        again(run, tmp_path, "wfi nobody")


def test_the_watchdog_s_load_has_26_bits(run, tmp_path):
    with pytest.raises(LauncherError, match="watchdog: 0x4000000 is outside 0...0x3ffffff"):
        again(run, tmp_path, "watchdog 0x4000000")


@pytest.mark.parametrize("line, complaint", (
    ("chip m2s150", "chip: 'm2s150' is neither m2s010 nor m2s025"),
    ("fabric_wired loose", "fabric_wired: 'loose' is none of core_reset_p, m2f, held, no_clock")))
def test_a_chip_and_a_wiring_that_there_are(run, tmp_path, line, complaint):
    with pytest.raises(LauncherError, match=complaint):
        again(run, tmp_path, line)


@pytest.mark.parametrize("what", ["trace", "csv", "irqlog"])
def test_a_full_disk_ends_the_run(run, tmp_path, what):
    with pytest.raises(LauncherError, match="cannot write a recording: No space left on device"):
        again(run, tmp_path, f"{what} /dev/full")
