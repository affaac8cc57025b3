# SPDX-License-Identifier: MIT
"""Identify on the plant: an open phase ends it, by name; what it finds is true, and the drive runs by it.

The campaign judges the values of all motors, and with loads.
"""
import re

import numpy as np

from launcher import simulate
from launcher.kind import Run
from launcher.part_identify import EXACT, MAP, TOLD, off, results_of, truth


def play(tmp_path, end_s, *steps):
    steps = [{"t_s": 0.12, "console": "identify"}, *steps, {"t_s": end_s - 0.1, "console": "identify show"},
             {"t_s": end_s - 0.05, "console": "on"}]
    return simulate({"key": "identify", "end_s": end_s, "preamble_s": 0.05, "step": steps}, out_dir=tmp_path, spread=0)


def test_a_phase_that_is_open_is_named_before_anything_is_measured(tmp_path):
    result = play(tmp_path, 0.9, {"t_s": 0.13, "event": "phase_open", "args": ["B", "1"]})
    assert re.search("ended in step 'pulses' by a fault: open phase", result.console)
    rated_a = result.drive.motor["rating"]["rated_current_a"]
    assert np.hypot(result.trace["i_d_true_A"], result.trace["i_q_true_A"]).max() < rated_a


def test_the_drive_runs_by_what_it_has_found(tmp_path):
    """Told nothing that is right of motor and encoder."""
    steps = [{"t_s": 0.12, "console": "identify"}, {"t_s": 0.2, "label": "began", "hold_for": "SWITCHED_ON"},
             {"t_s": "began + 16.2", "console": "identify show"}, {"t_s": "began + 16.25", "console": "identify use"},
             {"t_s": "began + 16.3", "console": "on"}, {"t_s": "began + 18.8", "console": "speed 1500"},
             {"t_s": "began + 19.5", "event": "end"}]
    result = simulate({"key": "identify", "end_s": "began + 19.6", "preamble_s": 0.05, "step": steps}, out_dir=tmp_path,
                      motor="teknic_m2310p", overrides={"params": dict(TOLD)})
    run = Run(result.trace, result.console, result.drive, result.enums, result.scenario.names, result.scenario.steps)
    found, right = results_of(result.console), truth(run)
    assert all(found[name].value == right[name] for name in EXACT)
    for name in ("flux", "inertia", "friction", "offset", *MAP):
        assert abs(off(name, found[name].value, right[name])) <= found[name].interval, (name, found[name], right[name])
    assert found["flux"].interval < 0.03 * right["flux"] and found["inertia"].interval < 0.06 * right["inertia"]
    assert found["offset"].interval < 1.5 and "\n8 parameters changed" in result.console
    late = result.trace["t_s"] > result.trace["t_s"][-1] - 0.1
    assert result.trace["fault"][-1] == 0 and abs(result.trace["speed_rpm"][late].mean() - 1500) < 15
