# SPDX-License-Identifier: MIT
"""Without an encoder: its lines are cut, and the plant says where the rotor stands. All motors: `make campaign`,
SCENARIOS=sensorless."""
import pytest
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
