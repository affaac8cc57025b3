# SPDX-License-Identifier: MIT
"""A phase lost behind the start's wiring test, whatever the drive does then: the first fault says so, or something else that is
true of it, and the shaft goes no further than it had to. While it aligns and while a voltage pulls: test_start.py; turning by
an encoder: test_supervision.py."""
import numpy as np
import pytest

from launcher import simulate
from launcher.drive import load_drive

ON_S, SPEED_S, LATEST_S = 0.15, 0.05, 3.5
ENCODER, OBSERVER, HALL = range(3)
NAMED = ("OPEN_PHASE",)
LED_ASTRAY = ("OPEN_PHASE", "LOCK_LOST")  # where the phase's current is what shows the rotor
FIELD = ("OPEN_PHASE", "OUT_OF_STEP")     # the rotor has left the field, since that is not turned as it should
MOST_SPEED_SHARE = 0.2  # of the largest speed, by which it changes until the bridge is off
MOST_START_DEG = 90.0   # electrical: a push turns it by up to 45, and what still turns it then is braked


def later(t_s, **what):
    return {"t_s": t_s, "after_state": "OPERATION_ENABLED", **what}


def end_of_fault():
    return {"t_s": 0.02, "after_state": "FAULT", "event": "end"}


def begin(source):
    return [*([{"t_s": 0.06, "event": "encoder_cut", "args": ["1"]}] if source else []),
            {"t_s": 0.13, "console": f"set angle_source {source}"}, {"t_s": ON_S, "console": "on"}]


class Lost:
    """What follows the loss, until the bridge is off."""

    def __init__(self, result, lost_s):
        trace, self.names = result.trace, result.drive.names()
        codes = trace["fault"][trace["fault"] != 0]
        self.fault = result.enums["fault"][int(codes[0])].removeprefix("FAULT_") if len(codes) else "NONE"
        self.still_on = bool(trace["gate_live"][-1] > 0)
        self.operates = bool((trace["state"] == {name: code for code, name in result.enums["state"].items()}[
            "AXIS_OPERATION_ENABLED"]).any())
        before, on = trace["t_s"] < lost_s, (trace["t_s"] >= lost_s) & (trace["gate_live"] > 0)
        self.i_d_share = float(trace["i_d_true_A"][before][-20:].mean() / self.names["i_max_A"])
        self.off_s = float(trace["t_s"][on][-1]) - lost_s
        speed_rpm, angle_rad = trace["speed_rpm"][on], trace["theta_mech_rad"][on]
        self.speed_share = float(np.abs(speed_rpm - speed_rpm[0]).max() / self.names["speed_max_rpm"])
        self.moved_deg = float(np.degrees(np.abs(angle_rad - angle_rad[0]).max() * self.names["pole_pairs"]))
        self.peak_share = float(max(trace[f"i_{phase}_peak_A"][on].max() for phase in "abc") / self.names["i_trip_A"])

    def __repr__(self):
        return (f"{self.fault}, off after {1e3 * self.off_s:.1f} ms, speed {100 * self.speed_share:.0f} %, "
                f"{self.moved_deg:.0f} degrees, peak {self.peak_share:.2f}, i_d {self.i_d_share:.2f}")


def running(tmp_path, motor, source, share, load, phase, braking=False, overrides=None):
    """At a share of the largest speed, with a share of rated torque on the shaft; braking: on the way down from there."""
    drive = load_drive(motor, overrides, aligned=source == ENCODER)
    names = drive.names()
    rpm = round(share * names["speed_max_rpm"])
    ramp_s = names["field_ramp_s"] * rpm / names["work_rpm"] if source == OBSERVER else rpm / names["ramp_rpm_s"]
    loaded_s = SPEED_S + ramp_s + 0.25
    lost_s = loaded_s + 0.2
    steps = [*begin(source), later(SPEED_S, console=f"speed {rpm}"),
             later(loaded_s, event="load_nm", args=[f"{load} * rated_torque_Nm"]),
             *([later(lost_s - 0.03, console="speed 0")] if braking else []),
             later(lost_s, event="phase_open", args=[phase, "1"]), later(lost_s + 0.5, event="end"), end_of_fault()]
    result = simulate({"key": "open", "end_s": LATEST_S + lost_s + 0.5, "preamble_s": 0.05, "step": steps}, motor,
                      out_dir=tmp_path, overrides=overrides, aligned=source == ENCODER)
    operation = next(code for code, name in result.enums["state"].items() if name == "AXIS_OPERATION_ENABLED")
    began = np.flatnonzero(result.trace["state"] == operation)
    return Lost(result, result.trace["t_s"][began[0]] + lost_s)


RUNNING = [  # what it does, motor, the angle's source, share of its largest speed, of rated torque, phase, faults, within ms
    ("stands", "estun_emj04apb22", ENCODER, 0, 0.5, "A", NAMED, 30),
    ("stands by injection", "lot:9", OBSERVER, 0, 0.4, "C", LED_ASTRAY, 30),
    ("turns by injection", "thor_pmsyrm", OBSERVER, 0.1, 0.5, "A", LED_ASTRAY, 30),
    ("observer", "mjbots_mj5208", OBSERVER, 0.4, 0.5, "A", LED_ASTRAY, 60),
    ("field", "dys_be8108", OBSERVER, 0.05, 0.2, "C", FIELD, 60),
    ("Hall switches", "hoverboard_350w", HALL, 0.4, 0.5, "B", NAMED, 30),
]


@pytest.mark.parametrize("motor, source, share, load, phase, faults, within_ms", [
    pytest.param(*case, id=what) for what, *case in RUNNING])
def test_it_is_named_whatever_leads(motor, source, share, load, phase, faults, within_ms, tmp_path):
    seen = running(tmp_path, motor, source, share, load, phase)
    assert seen.fault in faults and not seen.still_on and 1e3 * seen.off_s < within_ms, seen
    assert seen.speed_share < MOST_SPEED_SHARE and seen.peak_share < 1.05, seen


@pytest.mark.parametrize("motor, share, load, phase", [
    ("maxon_ec22", 0.8, -0.5, "C"), ("qs138_3kw", 0.6, 0, "B")])
def test_it_is_named_while_the_drive_brakes(motor, share, load, phase, tmp_path):
    seen = running(tmp_path, motor, ENCODER, share, load, phase, braking=True)
    assert seen.fault == "OPEN_PHASE" and not seen.still_on and seen.off_s < 0.03, seen
    assert seen.speed_share < MOST_SPEED_SHARE and seen.peak_share < 1.05, seen


@pytest.mark.parametrize("motor, rpm, phase, braking", [
    ("abb_m2bj100l", 3236, "B", False), ("estun_emj04apb22", 12000, "A", False),
    ("estun_emj04apb22", 12000, "C", True)])
def test_it_is_named_in_field_weakening(motor, rpm, phase, braking, tmp_path):
    """At twice the base speed or nearly: what the magnets then induce is beyond the bus, and may charge it once all is off."""
    v_min_mv = round(600 * load_drive(motor).inverter["supply"]["vbus_v"])
    params = {"speed_max_rpm": rpm, "overspeed_rpm": round(1.2 * rpm), "v_min_mv": v_min_mv, "emf_beyond_v_max": 1}
    seen = running(tmp_path, motor, ENCODER, 1, 0.1, phase, braking, {"params": params})
    assert seen.i_d_share < -0.1, f"no field weakening: {seen}"
    assert seen.fault == "OPEN_PHASE" and not seen.still_on and seen.off_s < 0.03, seen
    assert seen.speed_share < MOST_SPEED_SHARE and seen.peak_share < 1.05, seen


STARTING = [  # motor, seconds from `on`, phase, found within seconds. The wiring test ends after 0.32 s, the sweep after 0.37
    ("baldor_ecs101m0h7ef4", 0.33, "A", 0.4), ("baldor_ecs101m0h7ef4", 0.25, "C", 0.2), ("lot:9", 0.3, "B", 1.5),
    ("thor_pmsyrm", 0.33, "C", 1.3),
    ("thor_pmsyrm", 0.9, "A", 1.0), ("baldor_ecs101m0h7ef4", 0.6, "B", 1.3)]


@pytest.mark.parametrize("motor, after_s, phase, within_s", STARTING)
def test_it_is_named_before_and_while_injection_looks_for_the_rotor(motor, after_s, phase, within_s, tmp_path):
    """Within the wiring test, while it sweeps, and while pushes search for north."""
    lost_s = ON_S + after_s
    steps = [*begin(OBSERVER), {"t_s": lost_s, "event": "phase_open", "args": [phase, "1"]}, end_of_fault()]
    result = simulate({"key": "open", "end_s": lost_s + within_s + 0.5, "preamble_s": 0.05, "step": steps}, motor,
                      out_dir=tmp_path)
    seen = Lost(result, lost_s)
    assert seen.fault == "OPEN_PHASE" and not seen.still_on and not seen.operates and 0 < seen.off_s < within_s, seen
    assert seen.moved_deg < MOST_START_DEG and seen.peak_share < 1.05, seen
