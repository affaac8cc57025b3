# SPDX-License-Identifier: MIT
"""No motor is controlled worse, and no budget of it grows stale, without a change of tests/quality.toml."""
import pytest

from budgets.quality import (SEEDS, budget_of, complaints, is_held, load_quality, measure, switched_on_later,
                             verdict_of_runs)
from budgets.update_quality import written
from launcher.campaign import Case
from launcher.campaign_table import load_expected
from launcher.data import MOTORS, available

QUALITY = load_quality()
HELD = QUALITY["held"]
EXPECTED = load_expected()


@pytest.mark.parametrize("motor, scenario", [
    (motor, scenario) for motor in available(MOTORS) for scenario in HELD if is_held(motor, scenario)])
def test_quality(motor, scenario, tmp_path):
    measured, verdicts = measure(motor, scenario, HELD[scenario], tmp_path, EXPECTED)
    values = QUALITY["values"].get(motor, {}).get(scenario, {})
    known = {name: value for name, value in measured.items() if value is not None or name in values}
    found = [*verdict_of_runs(verdicts, EXPECTED), *complaints(f"{motor}/{scenario}", known, values, HELD[scenario])]
    assert not found, "\n".join(["quality is not kept:", *found])


def test_everything_is_held_with_a_reason_and_notices_a_fifth():
    for scenario, rows in HELD.items():
        for name, rule in rows.items():
            where = f"{scenario}: {name}"
            assert set(rule) == {"percent", "better", "reason"} and rule["better"] in ("lower", "higher"), where
            assert 0 < rule["percent"] < 20 / 1.2, f"{where}: a drive 20 % worse must not pass"
            assert len(rule["reason"]) >= 15, where


def test_every_motor_is_held_unless_all_its_runs_are_known_to_fail():
    motors = set(available(MOTORS))
    assert set(QUALITY["values"]) <= motors
    for motor in motors:
        for scenario in HELD:
            fails = all(Case(motor, scenario, seed) in EXPECTED for seed in SEEDS[scenario])
            assert (scenario in QUALITY["values"].get(motor, {})) == (is_held(motor, scenario) and not fails), (
                f"{motor}/{scenario}")


def test_the_file_is_as_the_update_writes_it():
    assert written(QUALITY) == open("tests/quality.toml", encoding="utf-8").read()


RULE = {"dip": {"percent": 10, "better": "lower", "reason": "a test"},
        "margin": {"percent": 10, "better": "higher", "reason": "a test"}}


@pytest.mark.parametrize("name, now, said", [
    ("dip", 10.0, None), ("dip", 10.9, None), ("dip", 9.1, None), ("dip", 12.0, "dip: 12, budget 10 +-10 % (+20 %), worse"),
    ("dip", 8.0, "better: tighten the budget"), ("margin", 8.0, "margin: 8, budget 10 +-10 % (-20 %), worse"),
    ("margin", 12.0, "better: tighten the budget"), ("dip", None, "was not measured"),
])
def test_both_ways(name, now, said):
    found = list(complaints("m/s", {name: now}, {name: 10.0}, RULE))
    assert (said is None and not found) or (len(found) == 1 and said in found[0])


def test_a_figure_that_a_start_moves_is_held_at_both_ends():
    def found(now):
        return [text.rsplit(", ", maxsplit=1)[1] for text in complaints("m/s", {"dip": now}, {"dip": [0.4, 1.8]}, RULE)]
    assert found(0.37) == found(1.0) == found(1.97) == []
    assert found(1.99) == ["worse"] and found(0.35) == ["better: tighten the budget"]


@pytest.mark.parametrize("starts, budget", [([9.8, 10.0, 10.2], 10.0), ([9.6, 10.0, 10.4], [9.6, 10.4]), ([3.0], 3.0),
                                            ([-10.0, -9.0], [-10.0, -9.0])])
def test_what_starts_do_not_move_is_a_number(starts, budget):
    assert budget_of(starts, 10) == budget


@pytest.mark.parametrize("scenario", SEEDS)
def test_a_later_start_is_the_same_scenario(scenario):
    now, later = switched_on_later(scenario, 0), switched_on_later(scenario, 0.01)
    assert (now is None) == (later is None) == (scenario in ("field_weakening", "overmodulation"))
    if now:
        assert later["step"][0].pop("t_s") == pytest.approx(now["step"][0].pop("t_s") + 0.01)
        assert later == now


def test_values_and_figures_belong_together():
    assert "without a budget" in next(complaints("m/s", {"dip": 1.0}, {}, RULE))
    assert "was not measured" in next(complaints("m/s", {}, {"dip": 1.0}, RULE))
    assert "does not know it" in next(complaints("m/s", {}, {"other": 1.0}, RULE))
    assert "budget is zero" in next(complaints("m/s", {"dip": 1.0}, {"dip": 0.0}, RULE))


def test_expected_failures_are_strict():
    case, other = Case("m", "s", 1), Case("m", "s", 2)
    assert not list(verdict_of_runs({case: "no field", other: ""}, {case: "known"}))
    assert "fails: no field" in next(verdict_of_runs({case: "no field"}, {}))
    assert "holds its limits now" in next(verdict_of_runs({case: ""}, {case: "known"}))
