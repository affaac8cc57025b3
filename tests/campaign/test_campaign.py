# SPDX-License-Identifier: MIT
"""The campaign's own arithmetic: which cases, which worst, and that no failure and no success goes unnoticed."""
import csv
import io
import json
import math
import re
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from launcher import campaign, campaign_plot
from launcher.campaign import Case, parse_case, plan, play, run_case
from launcher.campaign_report import report
from launcher.campaign_table import as_csv, as_markdown, badness, load_expected, reasons, rows, surprises
from launcher.errors import LauncherError
from launcher.lot import is_lot

NAMES = st.from_regex(r"[a-z][a-z0-9_]{0,12}", fullmatch=True)
NUMBERS = st.floats(-1e6, 1e6, allow_nan=False)


def figure(value, name="f", **limits):
    entry = {"name": name, "value": value, "unit": "", "min": None, "max": None, "equal": None, **limits}
    low, high = entry["min"], entry["max"]
    holds = value is not None and (low is None or value >= low) and (high is None or value <= high)
    if entry["equal"] is not None:
        holds = value == entry["equal"]
    return {**entry, "passed": holds if limits else None}


def outcome(*figures, error=None):
    return {"passed": error is None and all(f["passed"] is not False for f in figures), "error": error,
            "figures": list(figures)}


@given(NAMES, NAMES, st.integers(0, 2**32 - 1), st.sampled_from(["", "resistance_mohm*1.3", "ld_uh*0.5 lq_uh*0.5"]))
def test_a_key_names_its_case(motor, scenario, seed, detune):
    case = Case(motor, scenario, seed, detune)
    assert parse_case(case.key) == case
    assert f"MOTOR={motor} SCENARIO={scenario} SEED={seed}" in case.command and detune in case.command


@pytest.mark.parametrize("key", ["", "a", "a/b", "a/b/c", "a/b/-1", "a/b/1.5"])
def test_a_damaged_key_is_refused(key):
    with pytest.raises(LauncherError, match="is not MOTOR/SCENARIO/SEED"):
        parse_case(key)


def test_every_motor_meets_every_scenario():
    cases = plan()
    assert len(set(cases)) == len(cases)
    motors, scenarios = {c.motor for c in cases}, {c.scenario for c in cases}
    for scenario in scenarios:
        seeds = 1 if scenario.startswith("fault_") else 8
        assert {(c.motor, c.seed) for c in cases if c.scenario == scenario} == {
            (motor, seed) for motor in motors for seed in range(1, seeds + 1)}


def test_a_choice_is_kept_and_a_wrong_one_refused():
    cases = plan(["teknic_m2310p"], ["idle"], 3, ["", "flux_uwb*0.8"])
    assert [c.key for c in cases][:2] == ["teknic_m2310p/idle/1", "teknic_m2310p/idle/1/flux_uwb*0.8"] and len(cases) == 6
    with pytest.raises(LauncherError, match="no motor 'bogus'; there are: "):
        plan(["bogus"])


@given(NUMBERS, NUMBERS)
def test_the_worse_of_two_is_the_one_nearer_to_its_limit(a, b):
    low, high = sorted((a, b))
    assert badness(figure(low, max=5.0)) <= badness(figure(high, max=5.0))
    assert badness(figure(low, min=5.0)) >= badness(figure(high, min=5.0))


def test_what_could_not_be_measured_is_the_worst():
    assert badness(figure(None, max=1.0)) == math.inf
    assert badness(figure("OVERSPEED", equal="NONE")) == math.inf > badness(figure("NONE", equal="NONE"))


def test_the_table_names_the_worst_case_and_what_repeats_it():
    outcomes = {Case("m", "s", seed): outcome(figure(value, "dip", max=10.0)) for seed, value in enumerate((3.0, 12.0, 4.0))}
    (row,) = rows(outcomes)
    assert (row.worst, row.where.seed, row.failed, row.cases, row.median) == (12.0, 1, 1, 3, 4.0)
    (line,) = list(csv.DictReader(io.StringIO(as_csv([row]))))
    assert line["repeat"] == "make run MOTOR=m SCENARIO=s SEED=1" and line["worst"] == "12"
    page = as_markdown(outcomes, {})
    assert "**1**/3" in page and "NOT EXPECTED" in page and "dip: 12" in page
    assert "| scenario | figure | limit | failed | median | worst | repeat |" in page


def test_the_picture_has_a_dot_a_run_and_each_motors_limits_across_its_own():
    case = {(motor, seed): Case(motor, scenario, seed) for motor, scenario, seed in (
        ("m", "s", 1), ("m", "s", 2), ("n", "s", 3), ("n", "other", 4))}
    outcomes = dict(zip(case.values(), (
        outcome(figure(3.0, "dip", min=1.0, max=10.0)), outcome(figure(12.0, "dip", min=1.0, max=10.0)),
        outcome(figure(4, "dip", max=8.0), figure("NONE", "fault", equal="NONE")), outcome(figure(9.0, "dip")))))
    panels, axis = campaign_plot._panels("s", outcomes), MagicMock()  # pylint: disable=protected-access
    assert list(panels) == [("dip", "")] and [motor for motor, _ in panels["dip", ""]] == ["m", "m", "n"]
    campaign_plot._panel(axis, "dip", panels["dip", ""], ["m", "n"])  # pylint: disable=protected-access
    dots = [(*call.args, call.kwargs["color"]) for call in axis.scatter.call_args_list]
    assert dots == [([-0.125, 0.125], [3.0, 12.0], [campaign_plot.BLUE, campaign_plot.RED]), ([1.0], [4], [campaign_plot.BLUE])]
    assert [call.args for call in axis.plot.call_args_list] == [
        ([-0.4, 0.4], [1.0, 1.0]), ([-0.4, 0.4], [10.0, 10.0]), ([0.6, 1.4], [8.0, 8.0])]
    assert list(axis.set_xticks.call_args.args[0]) == [0, 1] and axis.set_xticks.call_args.args[1] == ["m", "n"]


def test_no_failure_and_no_success_is_a_surprise_without_being_said():
    good, bad, lost = outcome(figure(1.0, max=2.0)), outcome(figure(3.0, max=2.0)), outcome(error="QEMU aborted")
    cases = [Case("m", "s", n) for n in range(4)]
    outcomes = dict(zip(cases, (good, bad, lost, good)))
    unexpected, mended = surprises(outcomes, {cases[1]: "known", cases[3]: "known", Case("x", "y", 1): "not run"})
    assert list(unexpected) == [cases[2]] and reasons(lost) == "QEMU aborted"
    assert list(mended) == [cases[3]]


def test_the_shipped_list_is_whole():
    known = {(case.motor, case.scenario) for case in plan()}
    for case, cause in load_expected().items():
        assert (case.motor, case.scenario) in known or is_lot(case.motor), f"{case.key} names nothing that there is"
        assert len(cause.split()) > 3, f"{case.key} has no cause"


def test_what_a_motor_cannot_play_neither_fails_nor_passes(tmp_path, capsys):
    apart, good = outcome(error="M: no field weakening: too strong"), outcome(figure(1.0, max=2.0))
    apart["passed"] = None
    cases = [Case("m", "s", 1), Case("m", "s", 2), Case("n", "s", 1)]
    outcomes = dict(zip(cases, (apart, apart, good)))
    assert surprises(outcomes, {}) == ({}, {}) and list(surprises(outcomes, {cases[0]: "known"})[1]) == [cases[0]]
    page = as_markdown(outcomes, {})
    assert page.startswith("# Campaign: 1 runs, 0 failed") and page.count("- s: M: no field weakening: too strong") == 1
    assert re.search(r"(?m)^\| s \| +\| 0/1 \|$", page)
    assert report(outcomes, tmp_path, print) == 0
    assert "1 runs: 1 as they should be" in (said := capsys.readouterr().out) and "2 more do not apply" in said


def test_a_motor_that_cannot_play_says_so_before_the_run(tmp_path):
    outcome_of = run_case(Case("maxon_ec22", "field_weakening", 1), tmp_path, qemu="/usr/bin/qemu-system-arm")
    assert outcome_of["passed"] is None and "no field weakening: psi / L_d" in outcome_of["error"]


@pytest.mark.parametrize("text, complaint", [
    ("[[cause]]\ntext = 'why it fails'\n", "has 'text' and 'cases'"),
    ("[[cause]]\ntext = ''\ncases = []\n", "has 'text' and 'cases'"),
    ("[[cause]]\ntext = 'why'\ncases = ['a/b/1', 'a/b/1']\n", "stands there twice"),
    ("[[cause]]\ntext = 'why'\ncases = ['a/b']\n", "is not MOTOR/SCENARIO/SEED"),
    ("[[cause]\n", "expected.toml"),
])
def test_a_damaged_list_is_refused(text, complaint, tmp_path):
    path = tmp_path / "expected.toml"
    path.write_text(text)
    with pytest.raises(LauncherError, match=complaint):
        load_expected(path)


def test_a_run_that_cannot_be_made_is_a_failure_with_its_reason(tmp_path):
    case = Case("teknic_m2310p", "idle", 1)
    run_case(case, tmp_path, qemu="no-such-qemu")
    kept = json.loads(case.file(tmp_path).read_text())
    assert not kept["passed"] and "no-such-qemu" in kept["error"]


def test_what_gnu_parallel_is_told(tmp_path, monkeypatch):
    """As many runs at a time as asked, else as many as processors; on other machines paths from the repository."""
    told, cases = [], [Case("m", "s", 1), Case("n", "s", 2)]
    monkeypatch.setattr(campaign.subprocess, "Popen",
                        lambda command, **_: told.append(command) or SimpleNamespace(wait=lambda: 0))
    monkeypatch.setattr(campaign.os, "isatty", lambda _: False)
    campaign._run_parallel("parallel", cases, tmp_path, tmp_path / "b", None, None, None)  # pylint: disable=protected-access
    campaign._run_parallel("parallel", cases, tmp_path, "b", "q", 3, None)  # pylint: disable=protected-access
    head = ["parallel", "--will-cite", "--joblog", f"{tmp_path}/joblog", "-a", f"{tmp_path}/jobs.txt"]
    worker = ["qemu/run.py", "case", "{}", "--cases", str(tmp_path), "--build"]
    assert (tmp_path / "jobs.txt").read_text() == "m/s/1\nn/s/2\n"
    assert told[0][:6] == head and told[0][7:] == [*worker, f"{tmp_path}/b"]
    assert told[1][:8] == [*head, "-j", "3"] and told[1][9:] == [*worker, "b", "--qemu", "q"]
    with pytest.raises(LauncherError, match="needs BUILD inside the repository"):
        campaign._run_parallel("parallel", cases, tmp_path, tmp_path, None, None, "far")  # pylint: disable=protected-access
    monkeypatch.setattr(campaign.subprocess, "Popen", lambda *_, **__: SimpleNamespace(wait=lambda: 101))
    with pytest.raises(LauncherError, match="GNU parallel ended with status 101"):
        campaign._run_parallel("parallel", cases, tmp_path, "b", None, None, None)  # pylint: disable=protected-access


def test_a_campaign_goes_on_where_it_stopped():
    cases = plan(["teknic_m2310p", "maxon_ec45flat"], ["idle"], 1)
    folder, outcomes = play(cases)
    assert set(outcomes) == set(cases) and all(outcome["figures"] for outcome in outcomes.values())
    files = {case: case.file(folder) for case in cases}
    before = files[cases[0]].stat().st_mtime_ns
    expected = files[cases[1]].read_text()
    files[cases[1]].unlink()
    play(cases)
    assert files[cases[0]].stat().st_mtime_ns == before
    assert files[cases[1]].read_text() == expected
