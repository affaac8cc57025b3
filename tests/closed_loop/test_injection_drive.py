# SPDX-License-Identifier: MIT
"""Without an encoder, by saliency: hand-over to the observer and back under rated load, and the refusal of a surface motor. The
lock from every angle and rated torque at standstill: `make campaign PART=saliency`; the default course: SCENARIO=sensorless."""
import numpy as np
from launcher.kind import Run
from launcher.part import angle_error_deg
from launcher.simulate import simulate

BEGIN = [{"t_s": 0.1, "event": "encoder_cut", "args": ["1"]}, {"t_s": 0.15, "console": "set angle_source 1"},
         {"t_s": 0.2, "label": "on", "console": "on"}]

FAST = {"title": "injection, observer, injection", "preamble_s": 0.05, "end_s": 2.6,
        "step": [*BEGIN, {"t_s": 0.8, "console": "speed 1300"}, {"t_s": 1.5, "event": "load_nm", "args": ["rated_torque_Nm"]},
                 {"t_s": 1.9, "console": "status"}, {"t_s": 1.95, "event": "load_nm", "args": ["0"]},
                 {"t_s": 2.0, "console": "speed 300"}, {"t_s": 2.55, "console": "status"}],
        "figure": [{"name": "faults", "kind": "all_faults", "equal": "NONE"}]}


def test_the_observer_takes_over_under_load_and_the_injection_comes_back(tmp_path):
    result = simulate(FAST, "thor_pmsyrm", out_dir=tmp_path)
    assert result.passed, result.console[-500:]
    said = [line for line in result.console.splitlines() if "leads" in line]
    assert [line.rpartition(", the ")[2] for line in said] == ["observer leads", "injection leads"]
    run = Run(result.trace, result.console, result.drive, result.enums, result.scenario.names, result.scenario.steps)
    error = angle_error_deg(run, run.window(0.8, None))
    assert np.sqrt((error**2).mean()) < 5 and np.abs(error).max() < 15


def test_a_surface_motor_is_refused_by_name_and_goes_by_a_prescribed_field(tmp_path):
    surface = {"title": "too little saliency", "preamble_s": 0.05, "end_s": 2.6,
               "step": [*BEGIN[:2], {"t_s": 0.16, "console": "set injection_mv 4000"}, BEGIN[2],
                        {"t_s": 2.55, "console": "status"}],
               "figure": [{"name": "faults", "kind": "all_faults", "equal": "NONE"}]}
    result = simulate(surface, "teknic_m2310p", out_dir=tmp_path)
    assert result.passed and "too little: injection refused" in result.console
    assert "operation enabled" in result.console and "a prescribed field leads" in result.console
