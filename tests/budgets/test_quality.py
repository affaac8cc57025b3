# SPDX-License-Identifier: MIT
"""No motor is controlled worse, and no budget of it grows stale, without a change of tests/quality.toml."""
import pytest

from budgets.quality import SEEDS, budget_of, complaints, is_held, judge, load_quality, switched_on_later, verdict_of_runs
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
    found = judge(motor, scenario, QUALITY, EXPECTED, tmp_path)
    assert not found, "\n".join(["quality is not kept:", *found])


FIGURES = [(scenario, name) for scenario, rows in HELD.items() for name in rows]


@pytest.mark.parametrize("scenario, name", FIGURES)
def test_everything_is_held_with_a_reason_and_a_quarter_of_the_motors_notices_a_fifth(scenario, name):
    """However wide the starts of some motors scatter: 20 % worse than the middle of what they measured must not pass."""
    rule = HELD[scenario][name]
    assert set(rule) == {"percent", "better", "reason"} and rule["better"] in ("lower", "higher") and len(rule["reason"]) >= 15
    budgets = [rows[scenario][name] for rows in QUALITY["values"].values() if name in rows.get(scenario, {})]
    middles = [sum(budget) / 2 if isinstance(budget, list) else budget for budget in budgets]
    worse = 1.2 if rule["better"] == "lower" else 0.8
    noticed = [bool(list(complaints("m/s", {name: worse * middle}, {name: budget}, {name: rule})))
               for middle, budget in zip(middles, budgets)]
    assert sum(noticed) >= len(noticed) / 4 > 0, f"{sum(noticed)} of {len(noticed)}"


@pytest.mark.parametrize("later, said", [
    ([10.0] * 3, None),              # one start out of what eight have shown
    ([13.0] * 3, "worse"), ([None] * 3, "worse"),
])
def test_a_start_out_of_its_tolerance_is_judged_with_three_more(monkeypatch, later, said):
    case = Case("m", "default", 1)
    figures = iter([13.0, *later])
    monkeypatch.setattr("budgets.quality.measure", lambda *arguments: ({"dip": next(figures)}, {case: ""}))
    quality = {"held": {"default": {"dip": RULE["dip"]}}, "values": {"m": {"default": {"dip": 10.0}}}}
    found = judge("m", "default", quality, {}, "")
    assert (said is None and not found) or (len(found) == 1 and said in found[0])
    assert next(figures, None) is None, "all of them"


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
