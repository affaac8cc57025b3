# SPDX-License-Identifier: MIT
"""Events that wait for a state of the drive, a run that ends by one of them, and a rotor that starts at a given angle."""
import math

import numpy as np
import pytest

from launcher import simulate
from launcher.kind import Run
from launcher.part import late_s
from launcher.probes import code_of

ON, OFF = "OPERATION_ENABLED", "OPERATION_ENABLED SWITCH_ON_DISABLED"
LOAD_NM = 0.05


def late(t_s, states, kind, *args):
    return {"t_s": t_s, "after_state": states, "event": kind, "args": list(args)}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    steps = [{"t_s": 0.1, "console": "on"}, late(0.2, ON, "load_nm", LOAD_NM),
             {"t_s": 0.3, "after_state": ON, "console": "off"}, late(0.05, OFF, "end"), late(0.01, "FAULT", "load_nm", 5)]
    return simulate({"key": "late", "end_s": 8, "preamble_s": 0.05, "step": steps}, "teknic_m2310p",
                    plant="ideal", spread=0, out_dir=tmp_path_factory.mktemp("late"), start_angle=-90)


def first(run, column, value):
    return run.trace["t_s"][np.flatnonzero(run.trace[column] == value)[0]]


def code(run, state):
    return code_of(run.enums["state"], state)


def test_an_event_comes_so_long_after_the_state(run):
    period_s = np.median(np.diff(run.trace["t_s"]))
    began = first(run, "state", code(run, "OPERATION_ENABLED"))
    assert first(run, "load_Nm", LOAD_NM) - began == pytest.approx(0.2 + period_s, abs=1.01 * period_s)
    assert not run.trace["fault"].any() and run.trace["load_Nm"].max() == LOAD_NM, "what waits for another state does not come"


def test_states_count_in_turn_and_the_run_ends_early(run):
    t, state = run.trace["t_s"], run.trace["state"]
    began = first(run, "state", code(run, "OPERATION_ENABLED"))
    assert (state[t < began] == code(run, "SWITCH_ON_DISABLED")).any(), "that state before operation does not count"
    off = t[(t > began) & (state == code(run, "SWITCH_ON_DISABLED"))][0]
    assert t[-1] - off == pytest.approx(0.05, abs=2e-4) and t[-1] < 3


def test_the_rotor_starts_at_the_angle_asked_for(run):
    assert math.degrees(run.trace["theta_mech_rad"][0] * 4) == pytest.approx(270)


def test_the_instants_of_late_steps_are_known_afterwards(run):
    known = Run(run.trace, run.console, run.drive, run.enums, {})
    assert late_s(known, 0.2) == pytest.approx(first(run, "load_Nm", LOAD_NM), abs=6e-5)
