# SPDX-License-Identifier: MIT
"""The speed loop on the whole drive: 100 and 10 000 lines from 1 rpm on, no hunting at rest, an inertia told wrongly. The
full plant: uneven edges, eccentricity, cogging, friction, noise."""
import numpy as np
import pytest

from launcher import simulate
from launcher.drive import load_drive

from rigs.steps import rpm, typed

ON_S = 0.15
UP_S = ON_S + load_drive("teknic_m2310p", aligned=True).on_time_s


def play(tmp_path, lines, *steps, end_s, **how):
    changes = {"motor": {"encoder": {"counts_per_rev": 4 * lines}}} if lines else {}
    scenario = {"key": "speed", "end_s": end_s, "preamble_s": 0.05, "step": [{"t_s": ON_S, "console": "on"}, *steps]}
    return simulate(scenario, out_dir=tmp_path, overrides=changes, aligned=True, **how)


def torque_rms_percent(result, window):
    torque = window["torque_Nm"]
    return 100 * np.std(torque) / result.drive.motor["rating"]["rated_torque_nm"]


# lines, rpm, window in s, largest error of the mean (rpm), largest rms of the speed (rpm) and of the torque (% of rated)
CASES = [
    (100, 1, 3.0, 0.15, 6, 3),
    (10000, 1, 1.0, 0.05, 0.3, 2),
    (100, 30, 1.0, 0.6, 7, 3),
    (10000, 30, 0.5, 0.1, 1.2, 2),
    (100, 3000, 0.3, 3, 6, 4),
    (10000, 3000, 0.3, 3, 6, 4),
]


@pytest.mark.parametrize("lines, speed, window_s, mean, ripple, torque", CASES)
def test_few_and_many_lines_from_one_rpm_on(tmp_path, lines, speed, window_s, mean, ripple, torque):
    steady_s = UP_S + 0.6 + speed / 5000
    result = play(tmp_path, lines, typed(UP_S, f"speed {speed}"), end_s=steady_s + window_s)
    window = result.trace.between(steady_s, steady_s + window_s)
    assert {result.enums["state"][int(code)] for code in set(window["state"])} == {"AXIS_OPERATION_ENABLED"}
    assert np.mean(rpm(window)) == pytest.approx(speed, abs=mean)
    assert np.std(rpm(window)) < ripple
    assert torque_rms_percent(result, window) < torque


@pytest.mark.parametrize("lines", [100, 10000])
def test_it_stands_still(tmp_path, lines):
    """After a run, with the load let go: the shaft comes to rest and stays there."""
    result = play(tmp_path, lines, typed(UP_S, "speed 200"), typed(UP_S + 0.3, "speed 0"), end_s=UP_S + 1.4)
    window = result.trace.between(UP_S + 1.0, UP_S + 1.4)
    assert np.abs(rpm(window)).max() < 0.5
    assert torque_rms_percent(result, window) < 1


@pytest.mark.parametrize("factor, largest_dip", [(5, 20), (1, 20)])
def test_an_inertia_five_times_too_large_ends_in_no_limit_cycle(tmp_path, factor, largest_dip):
    load_s = UP_S + 0.8
    result = play(tmp_path, 0, typed(UP_S, "speed 1500"), {"t_s": load_s, "event": "load_nm", "args": [0.2724]},
                  end_s=load_s + 0.5, detune=f"inertia_gmm2*{factor}")
    dip = result.trace.between(load_s, load_s + 0.2)
    steady = result.trace.between(load_s + 0.3, load_s + 0.5)
    assert 100 * (1 - rpm(dip).min() / 1500) < largest_dip
    assert np.mean(rpm(steady)) == pytest.approx(1500, abs=3)
    assert torque_rms_percent(result, steady) < 5
