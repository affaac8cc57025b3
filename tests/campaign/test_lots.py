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
STRIDE, FIRST = 6, 2  # of these in `make test`
SLOW = (4, 5, 6, 7)


@pytest.mark.parametrize("lot", [
    pytest.param(lot, marks=() if lot % STRIDE == FIRST else pytest.mark.long if lot in SLOW else pytest.mark.rest)
    for lot in LOTS])
def test_lot(lot, tmp_path):
    case = Case(f"lot:{lot}", "default", 1)
    outcome = run_case(case, tmp_path)
    unexpected, mended = surprises({case: outcome}, {case: EXPECTED[case]} if case in EXPECTED else {})
    assert not unexpected, f"{case.command} is {outcome['word']}: {outcome.get('cause')}: {unexpected[case]}"
    assert not mended, f"{case.command} works now: take it out of tests/campaign/expected.toml"


# with limits by encoder, friction and power: fixed ones said wrong of each
RELATIVE = [("lot:19", "power_limit", pytest.mark.rest), ("lot:54", "position", pytest.mark.rest),
            ("lot:105", "position", pytest.mark.long)]


@pytest.mark.parametrize("motor, scenario", [pytest.param(*case, marks=mark) for *case, mark in RELATIVE])
def test_a_limit_is_relative_to_the_motor(motor, scenario, tmp_path):
    outcome = run_case(Case(motor, scenario, 1), tmp_path)
    assert outcome["word"] == WORKS, outcome.get("cause")


def others():
    """The other cases of PART=lot, of the first lot that is met in `make test`."""
    cases = cases_of(FIRST)[1:]
    return [pytest.param(case, marks=() if case in cases[:3:2] else pytest.mark.long, id=case.key) for case in cases]


@pytest.mark.parametrize("case", others())
def test_other_case(case, tmp_path):
    outcome = (run_part_case if isinstance(case, PartCase) else run_case)(case, tmp_path)
    assert outcome["word"] in (WORKS, TRUE), f"{case.command} is {outcome['word']}: {outcome['cause']}"
