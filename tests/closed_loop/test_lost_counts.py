# SPDX-License-Identifier: MIT
"""An encoder that loses count after count under rated load, while the index's fault only warns: the slip is named before the
field is 30 degrees off, by the plant's truth."""
import numpy as np
import pytest

from launcher import simulate
from launcher.drive import load_drive

MOST_DEG = 30.0
CASES = [  # motor, share of its largest speed, of rated torque, degrees electrical a second
    ("estun_emj04apb22", 0.5, 1.0, 300), ("estun_emj04apb22", 0.5, 1.0, -20), ("teknic_m2310p", 0.25, 1.0, -300),
    ("teknic_m2310p", 0.5, 1.0, 300), ("teknic_m2310p", 1.0, 1.0, -20), ("maxon_ec22", 0.5, 1.0, 300),
    ("hoverboard_350w", 0.5, 1.0, -100)]


def lost(tmp_path, motor, share, load, rate_deg_s, seconds):
    """Runs up, is loaded, and loses counts; (result, the fault found or None, the field's error then in degrees)."""
    names = load_drive(motor, aligned=True).names()
    rpm = round(share * names["speed_max_rpm"])
    up_s = 0.15 + names["on_time_s"]
    loaded_s = up_s + rpm / names["ramp_rpm_s"] + 0.1
    at_s = loaded_s + 0.2 + names["settle_s"]
    count_deg = 360 * names["pole_pairs"] / names["encoder_counts"]
    at_once = max(1, round(abs(rate_deg_s) * 0.001 / count_deg))
    times = np.arange(0, seconds, at_once * count_deg / abs(rate_deg_s)) if rate_deg_s else ()
    counts = at_once if rate_deg_s > 0 else -at_once
    steps = [{"t_s": 0.14, "console": "reaction encoder_counts warn"}, {"t_s": 0.15, "console": "on"},
             {"t_s": up_s, "console": f"speed {rpm}"},
             {"t_s": loaded_s, "event": "load_nm", "args": [f"{load} * rated_torque_Nm"]},
             *({"t_s": at_s + after_s, "event": "encoder_slip", "args": [str(counts)]} for after_s in times)]
    result = simulate({"key": "lost", "end_s": at_s + seconds, "preamble_s": 0.05, "step": steps}, motor, out_dir=tmp_path,
                      aligned=True)
    codes, t_s = result.trace["fault"], result.trace["t_s"]
    found = np.flatnonzero((t_s > at_s) & (codes != 0))
    until = result.trace.between(at_s, t_s[found[0]] - 1e-4 if len(found) else t_s[-1])
    off = until["angle_fw_rad"] - names["pole_pairs"] * until["theta_mech_rad"]
    deg = np.abs(np.degrees((off + np.pi) % (2 * np.pi) - np.pi))
    return result, result.enums["fault"][int(codes[found[0]])] if len(found) else None, float(deg.max())


@pytest.mark.parametrize("motor, share, load, rate_deg_s", CASES)
def test_lost_counts_are_named_before_the_field_is_30_degrees_off(motor, share, load, rate_deg_s, tmp_path):
    result, fault, most_deg = lost(tmp_path, motor, share, load, rate_deg_s, 45 / abs(rate_deg_s))
    assert fault == "FAULT_ENCODER_SLIP" and most_deg < MOST_DEG, most_deg
    assert result.console.count("warning: encoder counts") == 1, "the index was off before, and only warned"
