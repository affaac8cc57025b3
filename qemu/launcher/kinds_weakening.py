# SPDX-License-Identifier: MIT
"""Kinds of figures: voltage, and a weakened field, against what the plant's own map allows (capability.py)."""
import math

import numpy as np

from .capability import CIRCLE, KEPT, machine_of
from .errors import LauncherError
from .kind import Kind
from .kinds_speed import moving_mean

RECTIFIER_S = 1 / 300  # between two pulses of a rectifier's bus
BUS_SHARE = 0.96       # of v_max, up to which the drive lets the bus rise while it brakes


def _bus_takes_w(run, machine):
    """Braking power that has somewhere to go: the windings, and the chopper where a rectifier takes nothing back."""
    supply, i_max = run.drive.inverter["supply"], run.names["i_max_A"]
    if supply["rectifier_hz"] == 0 or not run.drive.plant.has("supply"):
        return math.inf
    chopper_w = (BUS_SHARE * run.names["v_max_V"]) ** 2 / supply["chopper_ohm"] if supply["chopper_on_v"] else 0.0
    return chopper_w + 1.5 * machine.resistance_ohm * i_max**2


def _torque_of_theory(run, from_s, to_s, braking=0.0):
    window = run.trace.between(from_s, to_s)
    machine = machine_of(run.drive, float(window["winding_C"].mean()))
    rpm, bus_v = float(window["speed_rpm"].mean()), float(window["vbus_V"].mean())
    got_nm = (-1 if braking else 1) * float(window["torque_mean_Nm"].mean())
    most_nm = _bus_takes_w(run, machine) / (abs(rpm) * math.pi / 30) if braking and rpm else math.inf

    def share(of_circle):
        point = machine.most_torque(abs(rpm), of_circle * CIRCLE * bus_v, run.names["i_max_A"], bool(braking))
        if point is None:
            raise LauncherError(f"at {rpm:.0f} rpm no current within i_max is small enough for the bus of {bus_v:.1f} V")
        return 100 * got_nm / min(abs(point.torque_nm), most_nm)

    return share(KEPT), share(1.0)


def _torque_without_wish(run, from_s, to_s):
    return 100 * abs(run.trace.between(from_s, to_s)["torque_mean_Nm"].mean()) / run.rated("rated_torque_nm")


def _reference_rest(run, from_s, to_s):
    window = run.trace.between(from_s, to_s)
    return 100 * max(window[f"i_{axis}_ref_A"].std() for axis in "dq") / run.names["i_max_A"]


def _currents_off(run, from_s, to_s):
    window, i_max = run.trace.between(from_s, to_s), run.names["i_max_A"]
    off = [window[f"i_{axis}_true_A"] - window[f"i_{axis}_ref_A"] for axis in "dq"]
    width = max(1, round(RECTIFIER_S / run.period_s))
    return 100 * max(abs(e.mean()) for e in off) / i_max, 100 * max(np.abs(moving_mean(e, width)).max() for e in off) / i_max


def _fundamental(run, from_s, to_s):
    """The rows' phase voltages are means over a PWM period, which takes a known share of a sine away."""
    window = run.trace.between(from_s, to_s)
    angle = run.electrical_angle(window)
    turns = math.floor(abs(angle[-1] - angle[0]) / (2 * math.pi))
    if turns < 1:
        raise LauncherError("less than an electrical turn in the window")
    rows = int(np.searchsorted(np.abs(angle - angle[0]), 2 * math.pi * turns))
    neutral_v = (window["v_a_V"] + window["v_b_V"] + window["v_c_V"]) / 3
    amplitude_v = 2 * abs(np.mean((window["v_a_V"] - neutral_v)[:rows] * np.exp(-1j * angle[:rows])))
    per_row = abs(angle[rows - 1] - angle[0]) / (rows - 1) / (2 * math.pi)
    return 100 * amplitude_v / np.sinc(per_row) / (2 / math.pi * window["vbus_V"].mean())


def _voltage_reserve(run, from_s, to_s):
    window = run.trace.between(from_s, to_s)
    a, b, c = (window[f"v_{phase}_V"] for phase in "abc")
    amplitude_v = np.hypot((2 * a - b - c) / 3, (b - c) / math.sqrt(3))
    return 100 * (1 - amplitude_v.mean() / (CIRCLE * window["vbus_V"].mean()))


KINDS = {
    "torque_of_theory": Kind(_torque_of_theory, ["from_s", "to_s", "braking?"], "%",
                             "mean air-gap torque by the most that i_max and the bus voltage allow at this speed, by brute"
                             " force over the plant's map; braking also by what chopper and windings take", (
                                 "of the voltage kept to", "of all voltage")),
    "torque_without_wish": Kind(_torque_without_wish, ["from_s", "to_s"], "% of rated",
                                "mean air-gap torque where none is asked for"),
    "reference_rest": Kind(_reference_rest, ["from_s", "to_s"], "% of i_max",
                           "standard deviation of the current references while nothing is asked for anew, the larger axis: a"
                           " limit cycle would show"),
    "currents_off": Kind(_currents_off, ["from_s", "to_s"], "% of i_max",
                         "true currents less their references, the larger axis: mean, and largest mean over 3.3 ms",
                         ("mean", "largest")),
    "voltage_reserve": Kind(_voltage_reserve, ["from_s", "to_s"], "%",
                            "what the mean amplitude of the plant's phase voltage leaves of the most that the mean bus voltage"
                            " gives without weakened field and overmodulation"),
    "fundamental": Kind(_fundamental, ["from_s", "to_s"], "% of six-step's",
                        "fundamental of the plant's phase voltage by that of six-step, 2 / pi of the mean bus voltage"),
}
