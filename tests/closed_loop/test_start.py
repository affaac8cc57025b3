# SPDX-License-Identifier: MIT
"""A start on the plant: it finds the encoder's offset within 3 degrees, or stays off and names what it found."""
import numpy as np
import pytest

from launcher import simulate
from launcher.drive import load_drive

from rigs.steps import faults

ON_S = 0.12


def play(tmp_path, end_s, motor="teknic_m2310p", events=(), typed=(), angle_deg=60):
    """`events` before the drive is switched on; `typed` parameters."""
    pole_pairs = load_drive(motor).motor["electrical"]["pole_pairs"]
    steps = [{"t_s": 0.06, "event": kind, "args": args} for kind, args in events]
    steps += [{"t_s": 0.06 + 0.004 * n, "console": f"set {line}"} for n, line in enumerate(typed)]
    steps += [{"t_s": ON_S, "console": "on"}, {"t_s": end_s - 0.03, "console": "fault"}]
    return simulate({"key": "start", "end_s": end_s, "preamble_s": 0.05, "step": sorted(steps, key=lambda step: step["t_s"])},
                    motor=motor, out_dir=tmp_path, spread=0,
                    overrides={"motor": {"start": {"initial_angle_rad": float(np.radians(angle_deg) / pole_pairs)}}})


def electrical(result):
    return result.drive.motor["electrical"]["pole_pairs"] * result.trace["theta_mech_rad"]


def operating(result):
    names = {name: code for code, name in result.enums["state"].items()}
    return np.flatnonzero(result.trace["state"] == names["AXIS_OPERATION_ENABLED"])


def error_deg(result):
    """Field's angle against the magnets', just after operation has begun."""
    rows = operating(result)[20:60]
    off = result.trace["angle_fw_rad"][rows] - electrical(result)[rows]
    return float(np.degrees(np.angle(np.mean(np.exp(1j * off)))))


def turns_away(result):
    angle = electrical(result)
    return float(np.abs(angle - angle[0]).max() / (2 * np.pi))


@pytest.mark.parametrize("angle_deg", [0, 90, 180, 270])
def test_the_offset_is_found(angle_deg, tmp_path):
    result = play(tmp_path, 2.1, angle_deg=angle_deg)
    assert not faults(result) and abs(error_deg(result)) < 3
    assert turns_away(result) < 2.6, "docs/design.md states the bound"


@pytest.mark.parametrize("kind, share", [("load_hoist", 0.2), ("load_coulomb", 0.5)])
def test_it_is_found_under_load(kind, share, tmp_path):
    torque = str(share * load_drive("teknic_m2310p").motor["rating"]["rated_torque_nm"])
    result = play(tmp_path, 4.8, events=[(kind, [torque])], angle_deg=300)
    assert not faults(result) and abs(error_deg(result)) < 3


# what is wrong -> the fault, what `fault` says it found, how long it may take
WRONG = {
    "phase A open": (dict(events=[("phase_open", ["A", "1"])]), "OPEN_PHASE", "phase 1:", 0.5),
    "phase C open": (dict(events=[("phase_open", ["C", "1"])]), "OPEN_PHASE", "phase 3:", 0.5),
    "sensor A reversed": (dict(events=[("sensor_gain", ["A", "-1"])]), "SENSOR_SIGN", "phase 1:", 1.0),
    "sensor B reversed": (dict(events=[("sensor_gain", ["B", "-1"])]), "SENSOR_SIGN", "phase 2:", 1.0),
    "sensor C reversed": (dict(events=[("sensor_gain", ["C", "-1"])]), "SENSOR_SIGN", "phase 3:", 1.0),
    **{f"sensors {order}": (dict(events=[("sensor_order", [order])]), "SENSORS_EXCHANGED",
                            f"A, B, C show the currents of {digits}:", 1.0)
       for order, digits in (("BAC", 213), ("ACB", 132), ("CBA", 321), ("BCA", 231), ("CAB", 312))},
    "turned from outside": (dict(events=[("spin_rad_s", ["1"])]), "ROTOR_TURNING", "of 4000 counts", 1.5),
    "blocked": (dict(events=[("lock", ["1"])]), "ROTOR_BLOCKED", "0 counts in an electrical turn, instead of 1000", 4.0),
    "encoder dead": (dict(events=[("encoder_freeze", ["1"])]), "ENCODER_DEAD", "0 counts", 4.0),
    "phases A and B": (dict(events=[("phase_swap", ["AB"])]), "ENCODER_DIRECTION", "instead of 1000", 2.0),
    "phases C and A": (dict(events=[("phase_swap", ["CA"])]), "ENCODER_DIRECTION", "instead of 1000", 2.0),
    "five pole pairs": (dict(typed=["pole_pairs 5"]), "POLE_PAIRS", "pole_pairs 4 would fit, or else encoder_counts 5000",
                        4.0),
    "2 % more counts": (dict(typed=["encoder_counts 4080"]), "ENCODER_COUNTS", "encoder_counts 4000 would fit", 4.0),
    "2 % fewer counts": (dict(typed=["encoder_counts 3920"]), "ENCODER_COUNTS", "encoder_counts 4000 would fit", 4.0),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_named_and_the_drive_stays_off(case, tmp_path):
    wrong, fault, found, end_s = WRONG[case]
    result = play(tmp_path, end_s, **wrong)
    assert faults(result) == ["FAULT_" + fault], result.console[-600:]
    assert f"found: {found}" in result.console or found in result.console.partition("found: ")[2].partition("\n")[0]
    assert not operating(result).size and not result.trace["gates"][-20:].any()
    rated_rpm = result.drive.motor["rating"]["rated_speed_rpm"]
    assert case == "turned from outside" or np.abs(result.trace["speed_rpm"]).max() < 0.25 * rated_rpm


@pytest.mark.parametrize("motor, source, sensors, params", [
    ("hoverboard_350w", 2, "", {}), ("thor_pmsyrm", 0, "", {}),
    ("teknic_m2310p", 0, "amc1306", {}), ("teknic_m2310p", 0, "", {"low_side_shunts": 1}), ("estun_emj04apb22", 0, "", {})])
def test_exchanged_sensors_are_named_with_each_source_and_scheme(motor, source, sensors, params, tmp_path):
    steps = [{"t_s": 0.0, "event": "sensor_order", "args": ["CBA"]}, {"t_s": ON_S, "console": "on"},
             {"t_s": ON_S + 1.1, "console": "fault"}]
    result = simulate({"key": "start", "end_s": ON_S + 1.2, "preamble_s": 0.05, "step": steps}, motor=motor, out_dir=tmp_path,
                      spread=0, sensors=sensors, fabric="rtl" if sensors else "model",
                      overrides={"motor": {"control": {"angle_source": float(source)}}, "params": params})
    assert faults(result) == ["FAULT_SENSORS_EXCHANGED"] and "show the currents of 321" in result.console, result.console[-600:]
    assert not operating(result).size and not result.trace["gates"][-20:].any() and turns_away(result) < 0.5


def test_exchanged_sensors_trip_where_the_current_is_regulated_to_zero_before_they_are_looked_at(tmp_path):
    """Without an encoder, before the wiring's test: docs/faults.md says which name they have then."""
    steps = [{"t_s": 0.0, "event": "sensor_order", "args": ["CBA"]}, {"t_s": ON_S, "console": "on"}]
    result = simulate({"key": "start", "end_s": ON_S + 0.7, "preamble_s": 0.05, "step": steps}, motor="maxon_ec45flat",
                      out_dir=tmp_path, spread=0, overrides={"motor": {"control": {"angle_source": 1.0}}})
    assert faults(result) == ["FAULT_OVERCURRENT"], result.console[-600:]
    assert not operating(result).size and not result.trace["gates"][-20:].any() and turns_away(result) < 0.5


@pytest.mark.parametrize("motor, phase, after_s", [("maxon_ec45flat", "A", 0.1), ("estun_emj04apb22", "C", 0.3),
                                                   ("mjbots_mj5208", "B", 0.2)])
def test_a_phase_that_is_lost_while_the_rotor_is_aligned_is_named(motor, phase, after_s, tmp_path):
    """The wiring was right; a plug comes off later. The field turns it up within half of its turn."""
    lost_s = ON_S + 0.4 + after_s
    steps = [{"t_s": ON_S, "console": "on"}, {"t_s": lost_s, "event": "phase_open", "args": [phase, "1"]}]
    result = simulate({"key": "start", "end_s": lost_s + 1, "preamble_s": 0.05, "step": steps}, motor=motor, out_dir=tmp_path,
                      spread=0)
    assert faults(result) == ["FAULT_OPEN_PHASE"], result.console[-300:]
    assert not operating(result).size and not result.trace["gates"][-20:].any()


@pytest.mark.parametrize("command", ["on", "identify"])
@pytest.mark.parametrize("after_s", [0.05, 0.2, 0.6])
def test_a_quick_stop_ends_what_has_begun_and_nothing_goes_on(command, after_s, tmp_path):
    """While the sensors' zeros, the wiring or pulses, and the pull are under way."""
    stop_s = ON_S + after_s
    steps = [{"t_s": ON_S, "console": command}, {"t_s": stop_s, "console": "quickstop"}]
    result = simulate({"key": "start", "end_s": stop_s + 0.3, "preamble_s": 0.05, "step": steps}, motor="estun_emj04apb22",
                      out_dir=tmp_path, spread=0)
    assert result.console.replace("\r", "").partition("> quickstop\n")[2].startswith("ok"), result.console[-200:]
    then = result.trace["t_s"] > stop_s + 0.01
    live = result.trace["gate_live"] > 0
    assert not faults(result) and not live[then].any() and not operating(result).size
    assert live[~then].any() == (after_s > 0.15), "the bridge was on"
    assert {result.enums["state"][int(code)] for code in set(result.trace["state"][then])} == {"AXIS_SWITCH_ON_DISABLED"}


def test_with_the_index_the_offset_outlives_an_encoder_fault(tmp_path):
    """It turns past the index, the cable is pulled, it is turned past the index again: no alignment, same offset."""
    typed = [(ON_S, "on"), (2.3, "speed 300"), (2.8, "speed 0"), (3.1, "off"), (3.12, "on"), (3.65, "clear"), (4.15, "on")]
    steps = [{"t_s": t_s, "console": line} for t_s, line in typed]
    steps += [{"t_s": 3.6, "event": "encoder_cut", "args": ["1"]}, {"t_s": 3.61, "event": "encoder_cut", "args": ["0"]},
              {"t_s": 3.7, "event": "spin_rad_s", "args": ["30"]}, {"t_s": 4.0, "event": "spin_rad_s", "args": ["0"]},
              {"t_s": 4.1, "event": "spin", "args": ["off"]}]
    result = simulate({"key": "start", "end_s": 4.8, "preamble_s": 0.05, "step": sorted(steps, key=lambda step: step["t_s"])},
                      out_dir=tmp_path, plant="ideal", spread=0)
    assert faults(result) == ["FAULT_ENCODER"]
    again = operating(result)[result.trace["t_s"][operating(result)] > 4.15]
    assert again.size and result.trace["t_s"][again[0]] < 4.15 + 0.45, "it did not align anew: what it remembers is confirmed"
    off = result.trace["angle_fw_rad"][again[20:60]] - electrical(result)[again[20:60]]
    assert abs(np.degrees(np.angle(np.mean(np.exp(1j * off))))) < 3


@pytest.mark.parametrize("motor, source, command, phase, after_s, within_s", [
    ("maxon_ec45flat", 1, "on", "A", 0.33, 0.1), ("mjbots_mj5208", 0, "identify", "B", 1.7, 0.35),
    ("qs138_3kw", 1, "on", "A", 0.33, 1.3)])  # half a percent of the bus pulls it
def test_a_phase_that_is_lost_is_named_where_a_voltage_pulls_and_while_it_is_identified(motor, source, command, phase, after_s,
                                                                                          within_s, tmp_path):
    lost_s = ON_S + 0.4 + after_s
    steps = [{"t_s": ON_S, "console": command}, {"t_s": lost_s, "event": "phase_open", "args": [phase, "1"]}]
    result = simulate({"key": "start", "end_s": lost_s + within_s + 0.3, "preamble_s": 0.05, "step": steps}, motor=motor,
                      out_dir=tmp_path, spread=0, overrides={"motor": {"control": {"angle_source": float(source)}}})
    assert faults(result) == ["FAULT_OPEN_PHASE"], result.console[-300:]
    live = result.trace["t_s"][result.trace["gate_live"] > 0]
    assert lost_s < live[-1] < lost_s + within_s and not operating(result).size
