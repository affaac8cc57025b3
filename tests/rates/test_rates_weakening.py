# SPDX-License-Identifier: MIT
"""The field is weakened at every PWM rate: what makes radians of a millisecond, and the circle of voltages, follow it."""
import math

import numpy as np
import pytest

from launcher import simulate
from launcher.capability import machine_of
from launcher.drive import load_drive
from launcher.weakening import weakening_names
from rates.builds import OWN_HZ, RATES_HZ, build_of, overrides

# times the base speed at 20 kHz; what is 1.0 of reactances goes with the rate, so that abb's are too large for 40 kHz
MOTORS = {hz: ("abb_m2bj100l", 2.0) if hz < 40000 else ("teknic_m2310p", 1.3) for hz in RATES_HZ}
PLAN = {"key": "rates_weakening", "theory": "weakening", "end_s": "torque + 0.3", "preamble_s": 0.05, "step": [
    {"t_s": 0.10, "console": "set overspeed_rpm {weak_overspeed_rpm}"},
    {"t_s": 0.11, "console": "set speed_max_rpm {weak_max_rpm}"},
    {"t_s": 0.12, "console": "set emf_beyond_v_max 1"},
    {"t_s": 0.14, "label": "on", "console": "on"},
    {"t_s": "on + on_time_s", "label": "started", "hold_for": "OPERATION_ENABLED"},
    {"t_s": "started + 0.05", "label": "up", "console": "speed {TIMES * base_rpm:.0f}"},
    {"t_s": "up + TIMES * base_rpm / ramp_rpm_s + 0.2", "label": "held", "event": "spin_rad_s",
     "args": ["TIMES * base_rpm * rad_s_per_rpm"]},
    {"t_s": "held + 0.05", "label": "torque", "console": "torque {i_max_A:.3f}"}]}


def plan(times):
    """PLAN with the number in place."""
    return {**PLAN, "step": [{key: [word.replace("TIMES", str(times)) for word in value] if isinstance(value, list)
                              else value.replace("TIMES", str(times)) if isinstance(value, str) else value
                              for key, value in step.items()} for step in PLAN["step"]]}


def circle(hz):
    """Of the bus: dead times and shortest pulses cost the more the higher the rate is."""
    counts = 100e6 / hz
    return (counts - 4 * 100 - 2 * 2 - 4) / counts / math.sqrt(3)


@pytest.mark.parametrize("hz", [hz for hz in RATES_HZ if hz != OWN_HZ])
def test_the_field_is_weakened_at_every_rate(hz, tmp_path):
    motor, times = MOTORS[hz]
    build = build_of(hz, "mssfoc.elf", "mssfoc.hex")
    result = simulate(plan(times), motor=motor, out_dir=tmp_path, build=build, plant="full", spread=0, aligned=True,
                      overrides=overrides(hz))
    assert not result.trace["fault"].any()
    end_s = result.scenario.names["torque"] + 0.3
    window, names = result.trace.between(end_s - 0.1, end_s), weakening_names(load_drive(motor))
    machine = machine_of(result.drive, float(window["winding_C"].mean()))
    voltage_v = 31 / 32 * circle(hz) * float(window["vbus_V"].mean())
    most = machine.most_torque(2 * names["base_rpm"], voltage_v, result.drive.params["i_max_ma"] / 1000)
    assert float(window["torque_mean_Nm"].mean()) >= 0.92 * most.torque_nm
    i_max_a = result.drive.names()["i_max_A"]
    assert np.abs(window["i_d_true_A"] - window["i_d_ref_A"]).mean() < 0.1 * i_max_a
