# SPDX-License-Identifier: MIT
"""Recordings of Hall edges: what is told of the estimate is true of a rotor whose course is known; what is none is refused."""
import gzip
import os
import subprocess

import numpy as np
import pytest

from recordings import play
from rigs.firmware import ROOT, built
from rigs.hall_rotor import IDEAL
from unit.cinterface import Library

HZ = 30000


@pytest.fixture(scope="module")
def c():
    return Library(built("firmware.so"))


def recorded(folder, turns, late_s=0.0, states=IDEAL, name="one"):
    """What a logger keeps of switches on this course of electrical turns, one a sample; rising edges come late by `late_s`."""
    sector = np.floor(turns * 6).astype(int)
    pins = np.array([[state >> pin & 1 for pin in range(3)] for state in states])[sector % 6]
    for pin in range(3):
        line = pins[:, pin].copy()
        for n in np.flatnonzero(np.diff(line)) + 1:
            if line[n]:
                pins[n:n + round(late_s * HZ), pin] = 0
    shown = pins @ (1, 2, 4)
    changes = [0, *(np.flatnonzero(np.diff(shown)) + 1)]
    with gzip.open(folder / f"{name}.csv.gz", "wt") as file:
        file.write(f"# samples {len(turns)} at {HZ} Hz\nsample,state\n" + "".join(f"{n},{shown[n]}\n" for n in changes))
    return play.read(folder / f"{name}.csv.gz")


def steady(hz, seconds=2.0, rises_s=0.5):
    """From rest, in a while, to this speed."""
    at_s = np.arange(round(seconds * HZ)) / HZ
    return 0.01 + np.cumsum(hz * np.minimum(at_s / rises_s, 1)) / HZ


def there_and_back(hz, seconds=3.0):
    return 0.01 + hz * seconds / np.pi * (1 - np.cos(np.pi * np.arange(round(seconds * HZ)) / HZ / seconds * 2)) / 2


@pytest.mark.parametrize("hz", (4, -4, 20, -20, 150))
def test_a_steady_rotor_is_followed_but_for_what_nothing_has_told_yet(c, tmp_path, hz):
    place, speed, bias = play.errors(c, recorded(tmp_path, steady(hz)))
    assert place < 1.1 and speed < 6 * abs(hz) and (abs(hz) == 4) == (bias is None)
    assert bias is None or bias < 0.015  # just behind the rise


def test_of_a_rotor_that_turns_back_the_true_place_is_told(c, tmp_path):
    recording = recorded(tmp_path, course := there_and_back(20))
    ring = play.ring_of(recording)
    truth = play.Truth(*play.falling_edges(recording, ring))
    at_s = np.arange(len(course)) / HZ
    known = truth.known(at_s)
    forward = ring in [IDEAL[n:] + IDEAL[:n] for n in range(6)]
    shift = truth.place(at_s)[known] - (1 if forward else -1) * course[known] * 6
    assert np.ptp(shift) < 2.1  # at a reversal a straight line may miss what lies between two edges
    assert np.median(np.abs(shift - np.median(shift))) < 0.05


def test_late_rising_edges_are_no_error_of_the_rotor(c, tmp_path):
    prompt = play.errors(c, recorded(tmp_path, steady(80), name="prompt"))
    late = play.errors(c, recorded(tmp_path, steady(80), late_s=5e-4, name="late"))
    assert late[2] < prompt[2] + 0.001 and late[1] < 1.1 * prompt[1] and late[0] < prompt[0] + 80 * 6 * 5e-4


def test_a_rotor_at_rest_between_two_pushes_is_not_taken_to_turn_round(c, tmp_path):
    """It slows down, rests in the middle of a sector, and goes on the same way: no edge has shown that it turned."""
    slows = np.cumsum(np.clip(np.linspace(20, -5, HZ), 0, None)) / HZ
    rests = np.full(HZ // 10, slows[-1])
    goes = slows[-1] + np.cumsum(np.clip(np.linspace(0, 20, HZ), 0, None)) / HZ
    _, speed, _ = play.errors(c, recorded(tmp_path, 0.01 + np.concatenate((slows, rests, goes))))
    assert speed < 6 * 20 * 1.01
    recording = play.read(tmp_path / "one.csv.gz")
    ring = play.ring_of(recording)
    _, _, step_s, speeds = play.estimate(c, recording, ring)
    way = np.sign(np.median(speeds[step_s < 0.5]))
    assert (way * speeds > -1).all(), (way * speeds).min()


def test_the_ring_is_any(c, tmp_path):
    inverted = tuple(7 - state for state in IDEAL)
    swapped = (1, 3, 2, 6, 4, 5)
    whole = [play.errors(c, recorded(tmp_path, steady(30), states=states)) for states in (inverted, swapped)]
    assert all(place < 1.1 and bias < 0.015 for place, _, bias in whole), whole


def ran(folder):
    return subprocess.run(["make", "-s", "recordings", f"RECORDINGS={folder}"], cwd=ROOT, capture_output=True, text=True,
                          check=False, env={**os.environ, "NO_INSTALL": "1"})


def test_the_command_has_a_row_for_each(c, tmp_path):
    recorded(tmp_path, steady(30), name="b")
    recorded(tmp_path, there_and_back(8), name="a")
    done = ran(tmp_path)
    rows = [line.split("|") for line in done.stdout.splitlines()[2:]]
    assert done.returncode == 0 and [row[1].strip() for row in rows] == ["a", "b"]
    place, speed, bias = play.errors(c, play.read(tmp_path / "b.csv.gz"))
    assert [float(cell) for cell in rows[1][3:6]] == pytest.approx([place, speed, 100 * bias], abs=0.051)


HEAD = "# samples 100 at 30000 Hz\nsample,state\n"


@pytest.mark.parametrize("text, says", (
    ("", "its first line"), ("sample,state\n1,2\n", "its first line"), ("# samples 5 at 0 Hz\n0,1\n1,3\n", "its first line"),
    (HEAD, "at least two"), (HEAD + "0,1\n3,9\n", "from 0 to 7"), (HEAD + "0,1\n5,x\n", "sample,state"),
    (HEAD + "7,1\n5,3\n", "do not grow"), (HEAD + "0,1\n100,3\n", "beyond the 100"),
    (HEAD + "0,1\n5,3\n9,1\n", "ring of six"), (HEAD + "".join(f"{n},{n % 8}\n" for n in range(90)), "ring of six")))
def test_what_is_no_recording_is_refused_in_one_line(tmp_path, text, says):
    (tmp_path / "x.csv").write_text(text)
    done = ran(tmp_path)
    lines = [line for line in done.stderr.splitlines() if line.startswith("mssfoc: ")]
    assert done.returncode != 0 and len(lines) == 1 and says in lines[0] and "x" in lines[0] and "Traceback" not in done.stderr


def test_a_folder_without_any_is_refused(tmp_path):
    (tmp_path / "broken.csv.gz").write_bytes(b"no gzip")
    for folder, says in ((tmp_path, "broken.csv.gz cannot be read"), (tmp_path / "none", "no folder with recordings"),
                         ("", "''")):
        done = ran(folder)
        assert done.returncode != 0 and says in done.stderr and "Traceback" not in done.stderr
