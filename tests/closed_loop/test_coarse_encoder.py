# SPDX-License-Identifier: MIT
"""Encoders of few counts: they start, and the drive runs with load by them."""
import numpy as np
import pytest

from launcher import simulate
from launcher.drive import load_drive

# motor, counts a turn, where the rotor stands: 16 to 64 counts an electrical turn
CASES = [("teknic_m2310p", 64, 60), ("maxon_ec45flat", 128, 150), ("mjbots_mj5208", 200, 30), ("maxon_ec22", 64, 100),
         ("estun_emj04apb22", 100, 240)]


def play(tmp_path, motor, counts, degrees):
    pole_pairs = load_drive(motor).motor["electrical"]["pole_pairs"]
    overrides = {"motor": {"encoder": {"counts_per_rev": counts},
                           "start": {"initial_angle_rad": float(np.radians(degrees) / pole_pairs)}}}
    rpm = round(0.4 * load_drive(motor, overrides).names()["speed_max_rpm"])
    steps = [{"t_s": 0.12, "console": "on"}, {"t_s": 0.3, "label": "started", "hold_for": "OPERATION_ENABLED"},
             {"t_s": "started + 0.05", "label": "up", "console": f"speed {rpm}"},
             {"t_s": f"up + 0.2 + {rpm} / ramp_rpm_s", "label": "loaded", "event": "load_nm",
              "args": ["0.5 * rated_torque_Nm"]},
             {"t_s": "loaded + 0.4", "event": "end"}]
    return rpm, simulate({"key": "coarse", "end_s": "loaded + 6", "preamble_s": 0.05, "step": steps}, motor=motor,
                         out_dir=tmp_path, spread=0, overrides=overrides)


@pytest.mark.parametrize("motor, counts, degrees", CASES)
def test_it_starts_and_holds_a_load(motor, counts, degrees, tmp_path):
    rpm, result = play(tmp_path, motor, counts, degrees)
    assert not result.trace["fault"].any(), result.console[-300:]
    late = result.trace["t_s"] > result.trace["t_s"][-1] - 0.2
    off = result.trace["angle_fw_rad"] - result.drive.motor["electrical"]["pole_pairs"] * result.trace["theta_mech_rad"]
    assert abs(np.degrees(np.angle(np.mean(np.exp(1j * off[late]))))) < 3
    assert result.trace["speed_rpm"][late].mean() == pytest.approx(rpm, rel=0.01)
    rated_nm = result.drive.motor["rating"]["rated_torque_nm"]
    assert result.trace["load_Nm"][late].mean() == pytest.approx(0.5 * rated_nm, rel=0.1), "it was loaded"


def test_too_few_are_refused_with_those_that_would_do(tmp_path):
    steps = [{"t_s": 0.06, "console": "set encoder_counts 64"}, {"t_s": 0.08, "console": "on"}]
    result = simulate({"key": "coarse", "end_s": 0.12, "preamble_s": 0.05, "step": steps}, motor="hoverboard_350w",
                      out_dir=tmp_path, spread=0)
    assert "encoder_counts is too small for pole_pairs: at least 240, or another angle_source" in result.console
    assert not result.trace["gates"].any()
