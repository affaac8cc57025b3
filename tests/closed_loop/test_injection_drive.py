# SPDX-License-Identifier: MIT
"""Without an encoder, by saliency: hand-over to the observer and back under rated load, what is heard of either variant, and
the refusal of a surface motor. The lock from every angle and rated torque at standstill: `make campaign PART=saliency`; the
default course: SCENARIO=sensorless."""
import numpy as np
import pytest
from launcher.kind import Run
from launcher.part import angle_error_deg
from launcher.parts import parse, run_part_case
from launcher.simulate import simulate

BEGIN = [{"t_s": 0.1, "event": "encoder_cut", "args": ["1"]}, {"t_s": 0.15, "console": "set angle_source 1"},
         {"t_s": 0.2, "label": "on", "console": "on"}]

FAST = {"title": "injection, observer, injection", "preamble_s": 0.05, "end_s": "up + 1.8",
        "step": [*BEGIN, {"t_s": "on + 2.0", "label": "started", "hold_for": "OPERATION_ENABLED"},
                 {"t_s": "started + 0.02", "label": "up", "console": "speed 1300"},
                 {"t_s": "up + 0.7", "event": "load_nm", "args": ["rated_torque_Nm"]}, {"t_s": "up + 1.1", "console": "status"},
                 {"t_s": "up + 1.15", "event": "load_nm", "args": ["0"]}, {"t_s": "up + 1.2", "console": "speed 300"},
                 {"t_s": "up + 1.75", "console": "status"}],
        "figure": [{"name": "faults", "kind": "all_faults", "equal": "NONE"}]}


@pytest.mark.parametrize("silent", (0, 1))
def test_the_observer_takes_over_under_load_and_the_injection_comes_back(silent, tmp_path):
    result = simulate(FAST, "thor_pmsyrm", out_dir=tmp_path, detune=f"injection_silent={silent}")
    assert result.passed, result.console[-500:]
    said = [line for line in result.console.splitlines() if "leads" in line]
    assert [line.rpartition(", the ")[2] for line in said] == ["observer leads", "injection leads"]
    run = Run(result.trace, result.console, result.drive, result.enums, result.scenario.names, result.scenario.steps)
    error = angle_error_deg(run, run.window(result.scenario.names["up"], None))
    assert np.sqrt((error**2).mean()) < 5 and np.abs(error).max() < 15


# motor -> dB by which the largest line of its currents is smaller with drawn pulses. A line half as large would be news as well
QUIETER_DB = {"thor_pmsyrm": 15, "baldor_ecs101m0h7ef4": 15}
NEWS_DB = 6


@pytest.mark.parametrize("motor", ["thor_pmsyrm", "baldor_ecs101m0h7ef4"])
def test_drawn_pulses_have_no_tone_and_the_angle_is_as_good(motor, tmp_path):
    """Start, then rated torque by step at standstill; judged by the plant's own currents, 2 kHz to half the sampling rate."""
    tone, silent = (run_part_case(parse(f"saliency:{motor}/hold1/90{more}"), tmp_path) for more in ("", "/silent"))
    assert tone["passed"] and silent["passed"], f"{tone['why']} {silent['why']}"
    line, above = "largest line of a current, mA", "above the noise around it, dB"
    rms = "angle error under load, rms, deg el."
    quieter = 20 * np.log10(tone["figures"][line] / silent["figures"][line])
    assert QUIETER_DB[motor] < quieter < QUIETER_DB[motor] + NEWS_DB
    assert tone["figures"][above] > 30 and silent["figures"][above] < 6
    assert silent["figures"][rms] < 1.2 * tone["figures"][rms]


@pytest.mark.parametrize("motor", ["thor_pmsyrm", "baldor_ecs101m0h7ef4"])
def test_drawn_pulses_lead_through_working_speed_rated_load_and_a_reversal_under_it(motor, tmp_path):
    result = simulate("sensorless", motor, out_dir=tmp_path, detune="injection_silent=1")
    assert {figure.name: figure.value for figure in result.figures.values() if figure.passed is False} == {}
    assert result.figures["field angle error while the observer leads, leads"].value > 60


def test_a_surface_motor_is_refused_by_name_and_goes_by_a_prescribed_field(tmp_path):
    surface = {"title": "too little saliency", "preamble_s": 0.05, "end_s": 2.6,
               "step": [*BEGIN[:2], {"t_s": 0.16, "console": "set injection_mv 4000"}, BEGIN[2],
                        {"t_s": 2.55, "console": "status"}],
               "figure": [{"name": "faults", "kind": "all_faults", "equal": "NONE"}]}
    result = simulate(surface, "teknic_m2310p", out_dir=tmp_path)
    assert result.passed and "too little: injection refused" in result.console
    assert "operation enabled" in result.console and "a prescribed field leads" in result.console
