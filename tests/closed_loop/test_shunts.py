# SPDX-License-Identifier: MIT
"""Shunts below the low sides near the end of the modulator's circle, where a low side conducts for too short a time to be seen:
the fabric replaces such a phase by the other two. With a short dead time, in which no diode helps, and slow amplifiers."""
import math

import numpy as np
import pytest

from launcher import simulate
from launcher.drive import load_drive
from launcher.signals import distortion_percent
from rates.builds import OWN_HZ, build_of
from rigs.steps import faults

MOTOR = "hoverboard_350w"  # its amplifiers settle in 1.2 us
DEAD_TIME_NS, DEAD_COUNTS, HALF_COUNTS, SETTLE_COUNTS = 300, 30, 2500, 90
TOLD = {"speed_max_rpm": 847, "overspeed_rpm": 927, "emf_beyond_v_max": 1}
ON_S, RPM = 0.15, 555


def play(tmp_path, shunts, event=None):
    """Rated current at a speed that needs nearly all of the bus; the event comes 0.1 s before the end."""
    overrides = {"params": {**TOLD, "low_side_shunts": shunts}}
    drive = load_drive(MOTOR, overrides, aligned=True)
    up_s = ON_S + drive.on_time_s + 0.1
    held_s = up_s + RPM / drive.names()["ramp_rpm_s"] + 0.2
    steps = [{"t_s": ON_S, "console": "on"}, {"t_s": up_s, "console": f"speed {RPM}"},
             {"t_s": held_s, "event": "spin_rad_s", "args": [str(RPM * math.pi / 30)]},
             {"t_s": held_s + 0.02, "console": f"torque {drive.names()['rated_current_A']}"}]
    if event is not None:
        steps.append({"t_s": held_s + 0.2, "event": event[0], "args": list(event[1:])})
    plan = {"key": "shunts", "end_s": held_s + 0.3, "preamble_s": 0.05, "step": steps, "figure": []}
    build = build_of(OWN_HZ, "mssfoc.elf", "mssfoc.hex", DEAD_TIME_NS=DEAD_TIME_NS)
    result = simulate(plan, motor=MOTOR, out_dir=tmp_path, build=build, overrides=overrides, aligned=True)
    return result, held_s


def test_what_a_shunt_does_not_see_is_reconstructed(tmp_path):
    result, held_s = play(tmp_path, 1)
    window = result.trace.between(held_s + 0.1, held_s + 0.3)
    duty = np.stack([window[f"duty_{phase}"] for phase in "abc"])
    blind = ((1 - duty) * HALF_COUNTS - DEAD_COUNTS / 2 < SETTLE_COUNTS).sum(0)
    assert 0.2 < np.mean(blind == 1) < 0.8 and blind.max() == 1
    angle = result.drive.motor["electrical"]["pole_pairs"] * window["theta_mech_rad"]
    assert not faults(result)
    assert max(distortion_percent(window[f"i_{phase}_A"], angle) for phase in "abc") < 1.9


def test_without_that_the_sum_of_what_is_seen_stops_the_drive(tmp_path):
    result, _ = play(tmp_path, 0)
    assert faults(result) == ["FAULT_CURRENT_SUM"]


@pytest.mark.parametrize("phase", "ABC")
def test_a_wrong_sensor_is_still_found_by_the_sum(tmp_path, phase):
    """The samples in which all three phases are seen tell, two of them in a row: within a third of an electrical turn."""
    trip_a = load_drive(MOTOR).params["i_trip_ma"] / 1000
    result, held_s = play(tmp_path, 1, ("sensor_add", phase, str(0.4 * trip_a)))
    failed = result.trace["t_s"][np.flatnonzero(result.trace["fault"])[0]] - held_s - 0.2
    third_s = 60 / RPM / result.drive.motor["electrical"]["pole_pairs"] / 3
    assert faults(result) == ["FAULT_CURRENT_SUM"] and 0 < failed < third_s
