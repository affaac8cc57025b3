# SPDX-License-Identifier: MIT
"""A sample of `make swarm`: nothing is wrong that is not known; and it would find what it looks for."""
import os
import subprocess

import pytest

from rigs.firmware import ROOT
from swarm import bugs, lots, play

SEED, SAMPLE = "1", 120


@pytest.fixture(scope="module")
def programs():
    result = subprocess.run(["make", "-s", "NO_INSTALL=1", "swarm-program"], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return ROOT / os.environ["BUILD"] / "swarm"


def test_nothing_is_wrong_in_a_sample_that_is_not_known(programs):
    found, _ = play.run(SEED, SAMPLE, programs)
    unknown = {what: histories[0] for what, histories in found.items() if not play.known(what)}
    assert not unknown, "\n".join(f"{what}:\n{play.shrunk(text, what, programs)}" for what, (_, text) in unknown.items())


def test_what_was_found_once_is_right(programs):
    lines = [line for line in (ROOT / "tests/swarm/found.txt").read_text().splitlines() if not line.startswith("#")]
    texts = [line.partition(": ")[2].replace("; ", "\n") + "\n" for line in lines]
    wrong = {line: found for line, found in zip(lines, play.play(texts, programs)) if found}
    assert len(texts) > 8 and not wrong


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.night if number >= bugs.OFTEN else ())
                                  for number, name in enumerate(bugs.BUGS)])
def test_what_is_broken_on_purpose_is_found(programs, name, tmp_path):
    number, what = bugs.histories_until_found(name, tmp_path, programs)
    print(f"{name}: history {number}, {what}")
    assert number <= bugs.MOST


def test_a_history_is_the_same_each_time(programs):
    text = lots.history(SEED, 7)
    assert text == lots.history(SEED, 7) != lots.history(SEED, 8)
    assert play.play([text], programs) == play.play([text], programs)


@pytest.mark.parametrize("line, said", (("100 dance", "no such line in a history: '100 dance'; "),
                                        ("set speed_of_light 3", "no such line"), ("axes 3", "no such line")))
def test_a_line_that_is_none_is_named(programs, line, said):
    result = subprocess.run([programs / "swarm1"], input=f"history 1\n{line}\nend 10\n", capture_output=True, text=True)
    assert result.returncode == 2 and said in result.stderr
