# SPDX-License-Identifier: MIT
"""A fixed part of the campaign: scenarios on one motor more, and a drive that is told wrong values. Of the faults every
fourth: `make results` plays them all, and `make campaign` on every motor.

`default` and `current_sweep` run on every motor in tests/budgets/test_quality.py, from the start that the firmware
makes itself. Here it knows where the rotor stands.
"""
import pytest

from launcher.campaign import FAULT_PREFIX, Case, run_case
from launcher.campaign_table import load_expected, surprises
from launcher.data import available
from launcher.paths import MOTORS, SCENARIOS

EXPECTED = load_expected()
STRIDE = 5  # over the motors: each is met about equally often, and neighbours in the list are not
ELSEWHERE = {"field_weakening": "qs138_3kw", "overmodulation": "thor_pmsyrm"}  # not every motor can show these
DETUNED = [Case("teknic_m2310p", "default", 1, detune) for detune in
           ("resistance_mohm*1.3 flux_uwb*0.9", "ld_uh*0.7 lq_uh*0.7", "inertia_gmm2*2")]


def sample():
    motors = available(MOTORS)
    elsewhere = ("default", "current_sweep")
    scenarios = [name for name in available(SCENARIOS) if name not in elsewhere]
    faults = [name for name in scenarios if name.startswith(FAULT_PREFIX)]
    left_out = {*faults} - {*faults[2::4]}
    return DETUNED + [Case(ELSEWHERE.get(scenario, motors[number * STRIDE % len(motors)]), scenario,
                           1 if scenario.startswith(FAULT_PREFIX) else 2) for number, scenario in enumerate(scenarios)
                      if scenario not in left_out]


def starts_anew(scenario):
    """Whether the drive has to find its rotor after the fault: planned for the time that this takes."""
    return "common/recover_reset" in (SCENARIOS / f"{scenario}.toml").read_text()


@pytest.mark.parametrize("case", sample(), ids=lambda case: case.key)
def test_case(case, tmp_path):
    outcome = run_case(case, tmp_path, aligned=not starts_anew(case.scenario))
    unexpected, mended = surprises({case: outcome}, {case: EXPECTED[case]} if case in EXPECTED else {})
    assert outcome["passed"] is not None, f"{case.command} shows nothing: {outcome['error']}"
    assert not unexpected, f"{case.command} fails: {unexpected[case]}"
    assert not mended, f"{case.command} passes now: take it out of tests/campaign/expected.toml"


def test_the_sample_meets_each_scenario_that_is_no_fault():
    rest = {name for name in available(SCENARIOS) if not name.startswith(FAULT_PREFIX)}
    assert {case.scenario for case in sample()} >= rest - {"current_sweep"}
