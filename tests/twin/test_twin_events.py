# SPDX-License-Identifier: MIT
"""What scenarios can do to the machine, seen in the trace of a run whose drive stays off: a stranger spins the shaft, turns
of the winding are shorted, and each kind of load stops it in its own way."""
import numpy as np
import pytest

from launcher import LauncherError, simulate
from launcher.scenario import event_args

SPEED = 200.0  # rad/s
HOIST, FAN, COULOMB = 0.2, 1e-5, 0.1
EVENTS = [
    (0.01, "spin_rad_s", SPEED), (0.03, "winding_short", "A", 0.3, 0.01), (0.05, "winding_short", "A", 0.3, "off"),
    (0.07, "load_hoist", HOIST), (0.08, "spin", "off"), (0.18, "load_hoist", 0),
    (0.20, "spin_rad_s", SPEED), (0.21, "load_fan", FAN), (0.21, "spin", "off"), (0.23, "load_fan", 0),
    (0.24, "spin_rad_s", SPEED), (0.25, "load_coulomb", COULOMB), (0.25, "spin", "off"),
]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    steps = [{"t_s": t_s, "event": kind, "args": [str(value) for value in values]} for t_s, kind, *values in EVENTS]
    scenario = {"key": "loads", "end_s": 0.26, "preamble_s": 0.002, "step": steps}
    return simulate(scenario, motor="teknic_m2310p", out_dir=tmp_path_factory.mktemp("loads"), plant="ideal", spread=0)


def inertia(run):
    motor = run.drive.motor
    return motor["mechanical"]["inertia_kgm2"] * (1 + motor["load"]["inertia_ratio"])


def slowing(run, start_s, end_s):
    """Torque against the motion, from the slope of the speed."""
    part = run.trace.between(start_s, end_s)
    slope = np.polyfit(part["t_s"] - part["t_s"][0], part["speed_rad_s"], 1)[0]
    return -inertia(run) * slope, part["speed_rad_s"].mean()


def test_shorted_turns_brake_and_show_no_current(run):
    whole = 0.035 + 3 * np.pi / (4 * SPEED)  # of the pulsation, twice the electrical frequency
    before, during, after = (run.trace.between(a, b) for a, b in ((0.02, 0.029), (0.035, whole), (0.051, 0.069)))
    assert np.abs(before["torque_Nm"]).max() < 1e-6 and np.abs(after["torque_Nm"]).max() < 1e-6
    electrical = run.drive.motor["electrical"]
    emf_v = 0.3 * 4 * SPEED * electrical["flux_wb"]
    heat_w = emf_v**2 / 2 / (0.01 + 0.3 * electrical["resistance_ohm"])  # the loop's inductance takes a little
    assert -during["torque_Nm"].mean() * SPEED == pytest.approx(heat_w, rel=0.03)
    assert max(np.abs(during[f"i_{phase}_A"]).max() for phase in "abc") < 1e-6


def test_hoist_stops_and_is_held(run):
    torque_nm, _ = slowing(run, 0.085, 0.12)
    assert torque_nm == pytest.approx(HOIST, rel=0.05)
    held = run.trace.between(0.16, 0.179)
    assert np.all(held["speed_rad_s"] == 0) and held["load_Nm"] == pytest.approx(HOIST)


def test_fan_and_coulomb(run):
    torque_nm, speed = slowing(run, 0.212, 0.215)
    assert torque_nm == pytest.approx(FAN * speed**2, rel=0.05)
    torque_nm, _ = slowing(run, 0.252, 0.259)
    assert torque_nm == pytest.approx(COULOMB, rel=0.05)


@pytest.mark.parametrize("turned_rad_s", (0, 7, -20))
def test_a_drive_that_is_told_its_offset_knows_it_to_a_count(tmp_path, turned_rad_s):
    """Even of a shaft that somebody has turned since its counter began."""
    steps = [{"t_s": t_s, "event": kind, "args": args} for t_s, kind, args in (
        (0.01, "spin_rad_s", [str(turned_rad_s)]), (0.2, "spin_rad_s", ["0"]), (0.22, "spin", ["off"]))]
    scenario = {"key": "told", "end_s": 0.5, "preamble_s": 0.002, "step": [*steps, {"t_s": 0.25, "console": "on"}]}
    run = simulate(scenario, motor="teknic_m2310p", out_dir=tmp_path, plant="ideal", spread=0, aligned=True)
    row = run.trace.between(0.49, 0.5)
    off_rad = (row["angle_fw_rad"] - 4 * row["theta_mech_rad"] + np.pi) % (2 * np.pi) - np.pi
    assert abs(off_rad).max() < 2 * np.pi * 4 / run.drive.motor["encoder"]["counts_per_rev"]


@pytest.mark.parametrize("kind, args", [
    ("winding_short", ["A", "0.1"]), ("winding_short", ["D", "0.1", "1"]), ("winding_short", ["A", "off", "1"]),
    ("load_fan", ["off"]), ("load_hoist", []), ("load_coulomb", ["1", "2"])])
def test_wrong_arguments(kind, args):
    with pytest.raises(LauncherError):
        event_args(kind, args, {})
