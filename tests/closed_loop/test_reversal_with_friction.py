# SPDX-License-Identifier: MIT
"""A shaft with friction of 15 % of rated torque turns round, with and without that friction told."""
import numpy as np

from launcher import simulate

FRICTION_NM = 0.15 * 0.2724
OWN_NM = 2.7e-3 + 1.4e-3  # bearings and iron of teknic_m2310p
RAD_S = np.pi / 30
OPERATION_S = 0.5  # of a drive that knows where its rotor stands, switched on at 0.2 s


def largest_error_rpm(folder, told_nm):
    """Of the speed against its ramp, in two reversals."""
    steps = [{"t_s": 0.14, "console": f"set friction_unm {round(1e6 * told_nm)}"},
             {"t_s": 0.15, "event": "load_coulomb", "args": [FRICTION_NM]},
             {"t_s": 0.2, "label": "on", "console": "on"},
             {"t_s": OPERATION_S, "console": "speed 200"},
             {"t_s": OPERATION_S + 0.2, "console": "speed -200"},
             {"t_s": OPERATION_S + 0.45, "console": "speed 200"}]
    run = simulate({"key": "friction", "end_s": OPERATION_S + 0.7, "step": steps}, out_dir=folder, aligned=True)
    window = run.trace.between(OPERATION_S + 0.2, OPERATION_S + 0.7)
    return np.abs(window["speed_rad_s"] / RAD_S - window["speed_ref_rpm"]).max()


def test_a_reversal_with_friction_that_is_told(tmp_path):
    unknown, known, twice = (largest_error_rpm(tmp_path / name, nm) for name, nm in (
        ("unknown", 0), ("known", FRICTION_NM + OWN_NM), ("twice", 2 * (FRICTION_NM + OWN_NM))))
    print(unknown, known, twice)
    assert known < 0.7 * unknown and twice < unknown
