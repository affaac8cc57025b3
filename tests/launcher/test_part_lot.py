# SPDX-License-Identifier: MIT
"""PART=lot: which cases a lot has, what is counted, and that what is done is not done again."""
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from launcher import campaign
from launcher.part import PartCase
from launcher.part_lot import COUNT, WORDS, cases_of, plan, report

ROOT = Path(__file__).resolve().parents[2]
WITH_ENCODER, WITHOUT = 2, 101  # of the fixed lots


def test_a_lot_has_five_cases_and_what_needs_an_encoder_only_where_there_is_one():
    names = {number: [case.key for case in cases_of(number)] for number in (WITH_ENCODER, WITHOUT)}
    assert names[WITH_ENCODER] == ["lot:2/default/1", "lot:2/low_speed/1", "sensorless:lot:2/start/274/free",
                                   "start:lot:2/free/274", "identify:lot:2/seed1"]
    assert names[WITHOUT] == ["lot:101/default/1", "lot:101/low_speed/1", "sensorless:lot:101/start/157/free"]


def test_a_plan_goes_lot_by_lot_and_is_the_same_every_night():
    cases = plan(41, 4)
    assert cases == plan(41, 4) and cases == [case for number in range(41, 45) for case in cases_of(number)]
    assert COUNT == 200 and plan(1000001, 4) == []


def outcome(word, cause=""):
    return {"word": word, "cause": cause, "truth": "it is so" if word == "true reason" else ""}


def test_the_number_is_how_many_are_wrong_and_a_listed_one_is_no_failure():
    cases = cases_of(WITH_ENCODER)
    outcomes = dict(zip(cases, (outcome(word, "the cause") for word in (*WORDS, "works"))))
    lines = []
    page, status = report(outcomes, {}, lines.append)
    assert status == 1 and "5 runs, 1 wrong (20.0 %), 0 of them listed" in lines[0]
    wrong = next(case for case, found in outcomes.items() if found["word"] == "wrong")
    assert f"| `{wrong.command}` | wrong | the cause |" in page and page.count("the cause") == 3
    assert report(outcomes, {wrong: "known"}, lines.append)[1] == 0
    counted = re.search(r"^\| works \|(.*)\|$", page, re.M)[1].split("|")
    assert sum(map(int, counted[:-1])) == int(counted[-1]) == 2


def test_what_is_done_is_not_done_again(tmp_path, monkeypatch):
    """Ended after its third case, it goes on with the fourth; results of another build are none."""
    played, cases = [], plan(WITH_ENCODER, 1)
    monkeypatch.setattr(campaign, "fingerprint", lambda build, motors=(): "thisbuild")

    def some(_parallel, missing, folder, *_):
        for case in missing:
            if len(played) == 3:
                raise KeyboardInterrupt
            played.append(case)
            campaign.keep(case, outcome("works"), folder)
    monkeypatch.setattr(campaign, "_run_parallel", some)
    monkeypatch.setattr(campaign.shutil, "which", lambda _: "parallel")
    with pytest.raises(KeyboardInterrupt):
        campaign.play(cases, tmp_path)
    first, played[:] = list(played), []
    _, outcomes = campaign.play(cases, tmp_path)
    assert first + played == cases and len(first) == 3 and list(outcomes) == cases
    monkeypatch.setattr(campaign, "fingerprint", lambda build, motors=(): "another")
    played[:] = []
    with pytest.raises(KeyboardInterrupt):
        campaign.play(cases, tmp_path)
    assert played == cases[:3]


@pytest.mark.parametrize("arguments, complaint", [
    (["--from", "0"], "FROM '0' is not a whole number from 1 to 1000000"), (["--from", "x"], "FROM 'x'"),
    (["--lots", "0"], "N '0' is not a whole number from 1 to 10000")])
def test_wrong_numbers(arguments, complaint):
    answer = subprocess.run([sys.executable, "qemu/run.py", "campaign", "--part", "lot", *arguments], cwd=ROOT,
                            capture_output=True, text=True, timeout=60, check=False)
    assert answer.returncode == 2 and complaint in answer.stderr and len(answer.stderr.splitlines()) == 1


def test_results_hold_json(tmp_path):
    case = PartCase("start", "lot:2", "free/274")
    campaign.keep(case, outcome("works"), tmp_path)
    assert json.loads((tmp_path / "start--lot--2--free--274.json").read_text())["word"] == "works"
