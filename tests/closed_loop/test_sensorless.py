# SPDX-License-Identifier: MIT
"""Without an encoder: its lines are cut, and the plant says where the rotor stands. All motors: `make campaign`,
SCENARIOS=sensorless."""
import numpy as np
import pytest
from launcher.drive import load_drive
from launcher.kind import Run
from launcher.part import angle_error_deg, operation_s
from launcher.parts import parse, run_part_case
from launcher.simulate import simulate

WRONG = "resistance_mohm*1.3 flux_uwb*0.85"


def failed(result):
    return {figure.name: figure.value for figure in result.figures.values() if figure.passed is False}


@pytest.mark.parametrize("motor, detune", (("teknic_m2310p", ""), ("estun_emj04apb22", WRONG)))
def test_working_speed_load_and_reversal_under_load(motor, detune, tmp_path):
    result = simulate("sensorless", motor, out_dir=tmp_path, detune=detune)
    assert not failed(result)
    assert result.figures["field angle error while the observer leads, leads"].value > 60


def test_a_rotor_too_slow_for_short_pulses_is_caught_by_its_voltages(tmp_path):
    """Currents of 0 are regulated, and what that takes is the EMF: beyond noise only as a mean of several samples."""
    outcome = run_part_case(parse("sensorless:rctimer_gbm5208/flying/20"), tmp_path)
    assert outcome["passed"] and outcome["outcome"] == "caught", outcome["why"]


LOSES = {"title": "the observer leads, and then the bus gives way",
         "end_s": "lost + 0.06", "preamble_s": 0.05,
         "step": [{"t_s": 0.1, "event": "encoder_cut", "args": ["1"]}, {"t_s": 0.15, "console": "set angle_source 1"},
                  {"t_s": 0.2, "label": "on", "console": "on"},
                  {"t_s": "on + 2.0", "label": "started", "hold_for": "OPERATION_ENABLED"},
                  {"t_s": "started + 0.1", "label": "up", "console": "speed {work_rpm}"},
                  {"t_s": "up + field_ramp_s + 0.5", "label": "status", "console": "status"},
                  {"t_s": "status + 0.2", "label": "lost", "event": "lock", "args": ["1"]}],
         "figure": [{"name": "faults", "kind": "all_faults"}]}


def test_a_rotor_that_is_stopped_is_missed_within_20_ms(tmp_path):
    result = simulate(LOSES, "teknic_m2310p", out_dir=tmp_path)
    t, live = result.trace["t_s"], result.trace["gate_live"] > 0.5
    lost = result.scenario.names["lost"]
    assert live[t < lost][-1] and not live[t > lost + 0.02].any(), result.figures["faults"].value
    assert result.figures["faults"].value in ("LOCK_LOST", "OVERCURRENT", "SPEED_DEVIATION")
    assert "the observer leads" in result.console


def blocked(hold):
    """The shaft is held as soon as the field is to turn; or not."""
    held = [{"t_s": 0.05, "after_state": "OPERATION_ENABLED", "event": "lock", "args": ["1"]}] if hold else []
    return {"title": "a prescribed field, and the rotor is held", "end_s": 2.1, "preamble_s": 0.05,
            "step": [{"t_s": 0.1, "event": "encoder_cut", "args": ["1"]}, {"t_s": 0.15, "console": "set angle_source 1"},
                     {"t_s": 0.2, "console": "on"}, *held,
                     {"t_s": 0.1, "after_state": "OPERATION_ENABLED", "console": "speed {low_rpm}"}],
            "figure": [{"name": "faults", "kind": "all_faults"}]}


@pytest.mark.parametrize("hold, fault", ((True, "OUT_OF_STEP"), (False, "NONE")))
def test_a_rotor_that_does_not_follow_the_field_is_missed(hold, fault, tmp_path):
    result = simulate(blocked(hold), "teknic_m2310p", out_dir=tmp_path)
    assert result.figures["faults"].value == fault


@pytest.mark.parametrize("motor, share", (("lot:125", 0.4), ("qs138_3kw", -0.5)))
def test_a_turning_rotor_is_caught_though_its_encoder_was_used_until_now(motor, share, tmp_path):
    """The encoder is plugged and has told the speed until `set angle_source 1`, just before `on`."""
    names = load_drive(motor).names()
    rpm = share * names["rated_speed_rpm"]
    turning = {"title": "the encoder is given up, and on", "preamble_s": 0.05, "end_s": 0.9,
               "step": [{"t_s": 0.0, "event": "spin_rad_s", "args": [f"{rpm * np.pi / 30:.9g}"]},
                        {"t_s": 0.15, "console": "status"}, {"t_s": 0.17, "console": "set angle_source 1"},
                        {"t_s": 0.172, "console": "on"}, {"t_s": 0.173, "event": "spin", "args": ["off"]},
                        {"t_s": 0.1, "after_state": "OPERATION_ENABLED", "console": f"speed {rpm:.0f}"}],
               "figure": [{"name": "faults", "kind": "all_faults", "equal": "NONE"}]}
    result = simulate(turning, motor, out_dir=tmp_path)
    assert result.passed and "done: operation enabled" in result.console, result.console[-300:]
    run = Run(result.trace, result.console, result.drive, result.enums, result.scenario.names, result.scenario.steps)
    t, live = result.trace["t_s"], result.trace["gate_live"] > 0.5
    began = operation_s(run)
    assert began - t[live][0] < 0.05 and (result.trace["observer_leads"][t > began + 0.001] > 0.5).all()
    assert np.abs(angle_error_deg(run, run.window(began + 0.01, None))).max() < 15
    assert np.abs(result.trace["speed_rpm"][t > 0.8] / rpm - 1).max() < 0.05
