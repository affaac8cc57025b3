# SPDX-License-Identifier: MIT
"""Currents from isolated modulators, bit by bit at the RTL's pins (SENSORS=amc1306 FABRIC=rtl): the same image drives the motor
as with the converters; a short trips the fast path, whatever the comparators do; the same seed gives the same run."""
import numpy as np
import pytest

from launcher import LauncherError, simulate
from launcher.probes import code_of

SHORT_S, END_S = 0.5, 0.53
STEPS = [{"t_s": 0.1, "console": "on"}, {"t_s": 0.3, "console": "speed 300"},
         {"t_s": SHORT_S, "event": "short", "args": ["AB", "0.05"]}]
NO_COMPARATORS = {"inverter": {"bridge": {"oc_trip_a": 5000.0}}}


def play(folder, sensors="amc1306", motor="teknic_m2310p", seed=1, overrides=NO_COMPARATORS, **settings):
    plan = {"key": "modulators", "end_s": END_S, "preamble_s": 0.03, "step": STEPS}
    return simulate(plan, motor, seed, folder, overrides=overrides, fabric="rtl", aligned=True, sensors=sensors, **settings)


def regulated(result):
    """Rows in which it turns, and nothing has happened yet."""
    t_s = result.trace["t_s"]
    return (t_s > 0.32) & (t_s < SHORT_S)


def current_noise_a(result):
    """What the drive takes for i_d and i_q, less the truth at the trigger, but for its mean: modulators look later than that,
    by half their window, in which the ripple goes on."""
    rows = regulated(result)
    return [float(np.std((result.trace[f"i_{axis}_A"] - result.trace[f"i_{axis}_true_A"])[rows])) for axis in "dq"]


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("modulators")
    return {"modulators": play(folder / "m"), "again": play(folder / "a"), "other": play(folder / "o", seed=2),
            "converters": play(folder / "c", "")}


def test_it_drives(runs):
    for name in ("modulators", "other", "converters"):
        trace, rows = runs[name].trace, regulated(runs[name])
        assert set(trace["state"][rows]) == {code_of(runs[name].enums["state"], "OPERATION_ENABLED")}
        assert np.ptp(trace["speed_rad_s"]) > 20 and np.ptp(trace["i_a_A"][rows]) > 1


def test_currents_are_seen_better_than_by_the_converters(runs):
    """Measured: 2.3 and 2.7 mA; 11 and 11 mA of the converters, whose step is 11.5 mA."""
    print({name: current_noise_a(run) for name, run in runs.items()})
    for of_modulators, of_converters in zip(current_noise_a(runs["modulators"]), current_noise_a(runs["converters"])):
        assert 0 < of_modulators < 0.5 * of_converters


def test_the_fast_path_stops_a_short(runs):
    """No comparator trips at 5000 A. Of the bridge, no row after the next has a gate on."""
    trace = runs["modulators"].trace
    faults = {int(code) for code in trace["fault"][trace["t_s"] > SHORT_S + 0.01]}
    assert faults == {code_of(runs["modulators"].enums["fault"], "OVERCURRENT_HARDWARE")}
    live = np.flatnonzero(trace["gate_live"] > 0)
    assert trace["t_s"][live[-1]] < SHORT_S + 5e-3
    assert "over-current (hardware)" in runs["modulators"].console


def test_a_run_is_its_seed(runs):
    first, again, other = (runs[name].trace for name in ("modulators", "again", "other"))
    for column in first:
        assert np.array_equal(first[column], again[column], equal_nan=True), column
    rows = regulated(runs["modulators"])
    assert not np.array_equal(first["i_q_A"][rows], other["i_q_A"][: len(rows)][rows])


def test_the_models_have_none(tmp_path):
    with pytest.raises(LauncherError, match=r"isolated modulators .* need FABRIC=rtl: the C models have none"):
        simulate("idle", out_dir=tmp_path, sensors="amc1306")


def test_untold_the_drive_finds_no_sensors(tmp_path):
    """Nothing is fitted at the converters' inputs."""
    overrides = {"params": {"modulator_osr": 0}}
    result = play(tmp_path, overrides=overrides)
    assert code_of(result.enums["fault"], "CURRENT_OFFSET") in set(result.trace["fault"].astype(int))
