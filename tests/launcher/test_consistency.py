# SPDX-License-Identifier: MIT
"""A motor file that contradicts itself or its inverter is refused, in one line with both values and what would fit; what that
line names does fit. Honest data sheets pass."""
import math
import re

import pytest
from launcher.data import INVERTERS, MOTORS, available
from launcher.drive import load_drive

from rigs.motor_files import SMALLEST, changed, refusal


@pytest.mark.parametrize("name", available(MOTORS))
def test_shipped_motors(name, tmp_path):
    """Untouched they pass, wherever SPREAD and DETUNE put them; with the usual slips they do not."""
    text = (MOTORS / f"{name}.toml").read_text()
    for settings in ({}, {"spread": 1, "seed": 3}, {"detune": "flux_uwb*2 pole_pairs*2"}):
        assert load_drive(changed(text, tmp_path), **settings).motor.name
    for slip in ({"flux_wb": 10}, {"flux_wb": 0.1}, {"flux_wb": 2}, {"pole_pairs": 2}, {"rated_torque_nm": 10},
                 {"rated_torque_nm": 0.1}, {"rated_current_a": 0.1}):
        assert re.search("would fit|one of them is wrong", refusal(changed(text, tmp_path, **slip))), slip


def test_both_values_and_what_would_fit(tmp_path):
    said = refusal(changed(SMALLEST, tmp_path, flux_wb=10))
    assert "rated_torque_nm 0.27 and 1.5 * pole_pairs 4 * flux_wb 0.064 * rated_current_a 7.1 = 2.73 N m" in said
    assert "a factor of 10 apart: flux_wb 0.00634 would fit" in said
    load_drive(changed(SMALLEST, tmp_path, flux_wb=0.00634 / 0.0064))
    assert "flux_wb 0.00317 or pole_pairs 4 (of 8 poles) would fit" in refusal(changed(SMALLEST, tmp_path, pole_pairs=2))


@pytest.mark.parametrize("factor, passes", [(0.75, True), (1.3, True), (1 / math.sqrt(2), False), (math.sqrt(2), False)])
def test_a_sheet_may_be_a_third_off_but_rms_is_no_peak(tmp_path, factor, passes):
    path = changed(SMALLEST, tmp_path, rated_current_a=factor)
    if passes:
        load_drive(path)
    else:
        assert "apart" in refusal(path)


def test_reluctance_counts(tmp_path):
    """Half of this one's torque is reluctance: with its incremental inductances alone it would not fit."""
    text = (MOTORS / "thor_pmsyrm.toml").read_text()
    without = re.sub(r"(?m)^l[dq]_apparent_h.*$", "", text)
    assert "lq_apparent_h of [control], where iron saturates, would fit" in refusal(changed(without, tmp_path))


CHECK = '\n[check]\n{} = {{ value = {}, tolerance_percent = 1, source = "x" }}\n'
THERMAL = '\n[thermal]\nthermal_resistance_k_w = {{ value = {}, source = "x" }}\n'


@pytest.mark.parametrize("key, published, wrong", [
    ("emf_ll_v_per_krpm", 4.64, 2.68), ("emf_phase_v_per_hz", 0.0402, 0.0064), ("open_circuit_flux_wb", 0.0064, 0.064),
    ("torque_constant_nm_a", 0.0423, 0.0846), ("speed_constant_rpm_v", 226, 130), ("resistance_ll_ohm", 0.72, 0.36),
    ("inductance_ll_h", 400e-6, 200e-6)])
def test_what_is_published_of_it(tmp_path, key, published, wrong):
    load_drive(changed(SMALLEST + CHECK.format(key, published), tmp_path))
    said = refusal(changed(SMALLEST + CHECK.format(key, wrong), tmp_path))
    assert f"[check] {key} {wrong:g} and [electrical], " in said and "more than 20 % apart" in said


def test_the_map_has_the_same_magnets(tmp_path):
    """Twice the flux is little of the torque of a machine that lives of reluctance, but the map knows."""
    text = re.sub("(?m)^open_circuit_flux_wb.*$", "", (MOTORS / "baldor_ecs101m0h7ef4.toml").read_text())
    said = refusal(changed(text, tmp_path, flux_wb=0.75))
    assert "flux_wb 0.357" in said and re.search(r"0\.476\d* Wb, are more than 10 % apart: flux_wb 0\.476\d* would fit", said)


def test_the_bus_carries_it(tmp_path):
    """A torque reckoned from the same wrong flux agrees with it; the voltage does not."""
    said = refusal(changed(SMALLEST, tmp_path, flux_wb=10, rated_torque_nm=10))
    assert "flux_wb 0.064 * pole_pairs 4 induces 80.4 V a phase, but vbus_v 24 of inverter lv24_drv8323 gives 13.9 V" in said
    load_drive(changed(SMALLEST, tmp_path, flux_wb=2, rated_torque_nm=2))  # one for 48 V is slow on 24 V
    said = refusal(changed(SMALLEST, tmp_path, resistance_ohm=10))
    assert "resistance_ohm 3.6 * rated_current_a 7.1 = 25.6 V" in said and "less than 1.95 ohm would fit" in said


def test_the_winding_outlives_its_rating(tmp_path):
    load_drive(changed(SMALLEST + THERMAL.format(3.7), tmp_path))
    said = refusal(changed(SMALLEST + THERMAL.format(37), tmp_path))
    assert "= 27.2 W and thermal_resistance_k_w 37 heat the winding by 1.01e+03 K" in said
    assert "thermal_resistance_k_w 3.7 would give 100 K" in said


def test_a_motor_too_large_for_its_inverter(tmp_path):
    """Refused before it runs; the current that the line names fits, and so does the inverter."""
    large = {"rated_current_a": 4, "rated_torque_nm": 4, "resistance_ohm": 0.1}
    said = refusal(changed(SMALLEST, tmp_path, **large))
    found = re.search(r"rated_current_a 28\.4 is too much for inverter lv24_drv8323, which leaves (\S+) A"
                      r" \(range \S+ A, comparators \S+ A\): an inverter with (\S+) A of both, or rated_current_a \1"
                      r" with rated_torque_nm (\S+) would fit", said)
    assert found, said
    left_a, both_a, torque_nm = map(float, found.groups())
    drive = load_drive(changed(SMALLEST, tmp_path, rated_current_a=left_a / 7.1, rated_torque_nm=torque_nm / 0.27,
                               resistance_ohm=0.1))
    assert drive.params["i_max_ma"] == round(1000 * left_a)
    stage = (INVERTERS / "lv24_drv8323.toml").read_text()
    for key in ("i_range_a", "oc_trip_a"):
        stage = re.sub(rf"(?m)^({key}\s*= {{ value = )[^,]+", rf"\g<1>{both_a}", stage)
    (tmp_path / "stage.toml").write_text(stage)
    assert load_drive(changed(SMALLEST.replace("lv24_drv8323", "stage.toml"), tmp_path, **large)).params["i_max_ma"] >= 28400


@pytest.mark.parametrize("current_a", [0.47, 0.5, 7.1, 12.3, 15.55, 18.9])
def test_currents_by_rule_are_what_the_firmware_takes(tmp_path, current_a):
    """i_max of the i_trip that is told, in whole mA (firmware/settings/tuning.c: 85 %), i_align up to i_max."""
    share = current_a / 7.1
    told = load_drive(changed(SMALLEST, tmp_path, rated_current_a=share, rated_torque_nm=share,
                              resistance_ohm=min(1, 1 / share))).params
    assert told["i_max_ma"] <= told["i_trip_ma"] * 85 // 100 and told["i_align_ma"] <= told["i_max_ma"]


@pytest.mark.parametrize("control, complaint", [
    ("i_max_a = { value = 5, source = 'x' }", "i_max_a 5 is below rated_current_a 7.1, which scenarios ask for"),
    ("i_align_a = { value = 11, source = 'x' }", "i_align_a 11 is above i_max_a 10.6"),
    ("i_trip_a = { value = 8, source = 'x' }", "i_max_a 6.8 is below rated_current_a 7.1")])
def test_limits_that_exclude_each_other(tmp_path, control, complaint):
    assert complaint in refusal(changed(f"{SMALLEST}\n[control]\n{control}\n", tmp_path))
