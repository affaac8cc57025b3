# SPDX-License-Identifier: MIT
"""A fixed sample of motors by lot: the first eight, never exchanged. Each works, or ends for a reason that is true of its
plant, or stands in expected.toml with the cause. Default on all of them; the other cases of PART=lot on
one."""
import pytest

from launcher.campaign import Case, run_case
from launcher.campaign_table import load_expected, surprises
from launcher.part import PartCase
from launcher.part_lot import cases_of
from launcher.parts import run_part_case
from launcher.verdict import TRUE, WORKS

EXPECTED = load_expected()
LOTS = range(1, 9)
FIRST = 2  # of which the other cases of PART=lot are played


@pytest.mark.parametrize("lot", LOTS)
def test_lot(lot, tmp_path):
    case = Case(f"lot:{lot}", "default", 1)
    outcome = run_case(case, tmp_path)
    unexpected, mended = surprises({case: outcome}, {case: EXPECTED[case]} if case in EXPECTED else {})
    assert not unexpected, f"{case.command} is {outcome['word']}: {outcome.get('cause')}: {unexpected[case]}"
    assert not mended, f"{case.command} works now: take it out of tests/campaign/expected.toml"


# with limits by encoder, friction and power: fixed ones said wrong of each
@pytest.mark.parametrize("motor, scenario", [("lot:19", "power_limit"), ("lot:54", "position"), ("lot:105", "position")])
def test_a_limit_is_relative_to_the_motor(motor, scenario, tmp_path):
    outcome = run_case(Case(motor, scenario, 1), tmp_path)
    assert outcome["word"] == WORKS, outcome.get("cause")


def others():
    cases = cases_of(FIRST)[1:]
    return [pytest.param(case, marks=() if case in cases[:3:2] else pytest.mark.night, id=case.key) for case in cases]


@pytest.mark.parametrize("case", others())
def test_other_case(case, tmp_path):
    outcome = (run_part_case if isinstance(case, PartCase) else run_case)(case, tmp_path)
    assert outcome["word"] in (WORKS, TRUE), f"{case.command} is {outcome['word']}: {outcome['cause']}"
