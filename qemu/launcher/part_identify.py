# SPDX-License-Identifier: MIT
"""PART=identify: what the drive finds out about its motor, against the plant's truth, and how often that is in the interval.

WHAT is seedN: tolerances drawn by N, SPREAD 1, every effect of the plant on. The drive is told what its inverter is and
the rated current; all it is told of the motor besides is wrong (TOLD).

The truth is the plant's at the temperature and the current of the measurement: of resistance, the winding's with the
switches and diodes in its way; of dead time, what a leg loses in a period, in time at the bus voltage, its delays and
constant drops among it; of inductance, the slope of the plant's own flux at the current that stood meanwhile.
"""
import re
from dataclasses import dataclass, replace

import numpy as np

from .drive import twin_items
from .errors import LauncherError
from .part import ON_S, PREAMBLE_S, PartCase, Setup, Verdict, bridge_is_off, first_fault
from .saturation import Saturation

NAME = "identify"
SEEDS = 8
LONGEST_S, SHOW_S = 20.0, 0.3
CURRENT_MAX = 1.1  # of the rated one, on average over 20 ms
TOLD = {"pole_pairs": 1, "resistance_mohm": 1000, "ld_uh": 1000, "lq_uh": 1000, "ld_apparent_uh": 0, "lq_apparent_uh": 0,
        "lq_rest_uh": 0, "flux_uwb": 10000, "inertia_gmm2": 100000}
FULL_DEAD_S = 1e-6  # CONFIG_DEAD_TIME_NS
PWM_HZ = 20e3
# quantity -> target: relative, or in ns
TARGETS = {"resistance": 0.01, "dead time": 10.0, "ld": 0.03, "lq": 0.03}
ABSOLUTE = {"dead time"}
# what cannot be known: reluctance turns these rotors whenever the current changes
REFUSED = {(motor, name) for motor in ("baldor_ecs101m0h7ef4", "thor_pmsyrm") for name in ("resistance", "dead time")}


def plan(motors, options):
    """SEEDS of each motor."""
    return [PartCase(NAME, motor, f"seed{seed}") for motor in motors for seed in range(1, SEEDS + 1)]


def setup(what, drive):
    """The run of one case."""
    match = re.fullmatch(r"seed(\d{1,4})", what)
    if match is None:
        raise LauncherError(f"no case '{what}' of identify; there are: seed1, seed2, ...")
    steps = [{"t_s": ON_S, "console": "identify"}, {"t_s": LONGEST_S, "console": "identify show"},
             {"t_s": LONGEST_S + SHOW_S, "event": "end"},
             {"t_s": 0.05, "after_state": "SWITCHED_ON SWITCH_ON_DISABLED", "console": "identify show"},
             {"t_s": SHOW_S, "after_state": "SWITCHED_ON SWITCH_ON_DISABLED", "event": "end"},
             {"t_s": 0.05, "after_state": "FAULT", "console": "identify show"},
             {"t_s": SHOW_S, "after_state": "FAULT", "event": "end"}]
    scenario = {"key": "part", "title": f"identify, {what}", "preamble_s": PREAMBLE_S, "end_s": LONGEST_S + SHOW_S + 0.1,
                "step": steps}
    return Setup(scenario, judge, {"seed": int(match.group(1)), "spread": 1, "overrides": {"params": dict(TOLD)}})


# ---- what the drive says ------------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Result:
    """A line of `identify show`: value and interval in its unit, or why there is none."""
    value: float = None
    interval: float = None
    refused: str = ""


def results_of(console):
    """{quantity: Result} of the last `identify show`."""
    shown = console.rsplit("identify show", 1)
    found = {}
    for line in shown[-1].splitlines() if len(shown) > 1 else []:
        match = re.match(r"([a-z ]+): (-?[\d.]+) \+-([\d.]+)", line)
        refused = re.match(r"([a-z ]+): refused: (.+)", line)
        if match:
            found[match.group(1)] = Result(float(match.group(2)), float(match.group(3)))
        elif refused:
            found[refused.group(1)] = Result(refused=refused.group(2))
    return found


def time_s(console):
    """How long it says that it took, or None."""
    match = re.search(r"time: ([\d.]+) s", console)
    return None if match is None else float(match.group(1))


# ---- the plant's truth --------------------------------------------------------------------------------------------------

def truth(run):
    """{quantity: value in the drive's unit} of the plant."""
    plant = dict(twin_items(run.drive))
    on = np.flatnonzero(run.trace["gate_live"])
    hot = 1 + plant["motor.copper_tempco_per_k"] * (run.trace["winding_C"][on].mean() - 25)
    dead = 2 * FULL_DEAD_S * PWM_HZ  # share of a period
    switch_v, diode_v = plant.get("inverter.switch_v", 0.0), plant["inverter.diode_v"]
    r_on, r_diode = plant.get("inverter.r_on_ohm", 0.0), plant.get("inverter.diode_ohm", 0.0)
    by_diode = 0.5 if switch_v else dead  # a switch that has a threshold does not carry current back
    lost_v = diode_v * by_diode + switch_v * (1 - by_diode)
    delay_s = plant.get("inverter.turn_on_delay_s", 0.0) - plant.get("inverter.turn_off_delay_s", 0.0)
    d, q = inductances(plant, run, on[-1])
    return {"resistance": 1e3 * (plant["motor.resistance_ohm"] * hot + r_on * (1 - by_diode) + r_diode * by_diode),
            "dead time": 1e9 * (FULL_DEAD_S + delay_s + lost_v / PWM_HZ / plant["inverter.vbus_v"]),
            "ld": d * 1e6, "lq": q * 1e6}


def inductances(plant, run, last):
    """(Ld, Lq) for small changes at the mean current of the last 50 ms before the row."""
    rows = slice(max(0, last - round(0.05 / run.period_s)), last)
    current = np.array([run.trace["i_d_true_A"][rows].mean(), run.trace["i_q_true_A"][rows].mean()])
    machine = Saturation(**{key.removeprefix("motor.sat_"): value for key, value in plant.items() if ".sat_" in key})
    if machine.a_d0 == 0:
        return plant["motor.ld_h"], plant["motor.lq_h"]
    warmer = 1 + plant.get("motor.magnet_tempco_per_k", 0.0) * (run.trace["magnet_C"][rows].mean() - 25)
    machine = with_magnet(machine, warmer)
    inverse = np.linalg.inv(slopes(machine, flux_of(machine, current)))
    return inverse[0, 0], inverse[1, 1]


def flux_of(machine, current):
    """By Newton's method, from the magnets' side of the map: it is monotone."""
    flux = np.array([machine.psi_n_wb or 1e-3, 0.0])
    for _ in range(200):
        flux = flux - np.linalg.solve(slopes(machine, flux), currents(machine, flux) - current)
    return flux


def with_magnet(machine, share):
    """The machine with its flux at no current so many times as large: qemu/twin/motor_map.c, motor_map_magnet()."""
    flux = flux_of(machine, np.zeros(2))[0] * share
    core_a = currents(replace(machine, a_b=0.0, i_f_a=0.0), np.array([flux, 0.0]))[0]
    if not machine.a_b:
        return replace(machine, i_f_a=core_a)
    magnet_a, low, high = machine.i_f_a * share, 0.0, 1e3
    alone = replace(machine, a_d0=0.0, a_dd=0.0, a_dq=0.0, i_f_a=0.0, psi_n_wb=0.0)
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if currents(alone, np.array([middle, 0.0]))[0] < abs(core_a - magnet_a) else (low, middle)
    return replace(machine, i_f_a=magnet_a, psi_n_wb=flux + np.copysign(low, core_a - magnet_a))


def currents(m, flux):
    """The currents of a flux, by the equations in saturation.py."""
    d, q = flux
    x = np.hypot(d - m.psi_n_wb, np.sqrt(m.k_q) * q)
    bridge = m.a_b * x**m.w / (1 + m.a_bp * x**m.w)
    return np.array([
        d * (m.a_d0 + m.a_dd * abs(d)**m.s + m.a_dq / (m.v + 2) * abs(d)**m.u * abs(q)**(m.v + 2))
        + bridge * (d - m.psi_n_wb) - m.i_f_a,
        q * (m.a_q0 + m.a_qq * abs(q)**m.t + m.a_dq / (m.u + 2) * abs(d)**(m.u + 2) * abs(q)**m.v) + m.k_q * bridge * q])


def slopes(machine, flux, step=1e-6):
    """Their derivatives."""
    columns = [(currents(machine, flux + away) - currents(machine, flux - away)) / (2 * step)
               for away in (np.array([step, 0.0]), np.array([0.0, step]))]
    return np.stack(columns, axis=1)


# ---- judgement ----------------------------------------------------------------------------------------------------------

def judge(run):
    """Each value within its target or, where the sensors forbid that, within the interval that it states."""
    fault, found, took = first_fault(run), results_of(run.console), time_s(run.console)
    if fault or not found:
        return Verdict(fault or "no result", f"{fault or 'nothing was shown'}", {})
    right, figures, wrong = truth(run), {"time, s": took}, []
    for name, target in TARGETS.items():
        result = found.get(name, Result(refused="not shown"))
        if result.value is None:
            wrong += [] if (run.drive.motor.path.stem, name) in REFUSED else [f"{name} refused: {result.refused}"]
            continue
        scale, unit = (1.0, "ns") if name in ABSOLUTE else (right[name], "%")
        error, interval = (result.value - right[name]) / scale, result.interval / scale
        figures[f"{name}, {unit}"] = error * (1 if name in ABSOLUTE else 100)
        figures[f"{name}, of its interval"] = error / interval
        if abs(error) > max(target, interval):
            wrong.append(f"{name} {result.value:g} +-{result.interval:g} where {right[name]:.5g} is true")
    wrong += [] if bridge_is_off(run) else ["the bridge is on"]
    wrong += [f"it took {took:.1f} s"] if took is None or took > LONGEST_S else []
    figures["current, of rated"] = largest_a(run) / run.rated("rated_current_a")
    wrong += ["more than the rated current"] if figures["current, of rated"] > CURRENT_MAX else []
    return Verdict("wrong" if wrong else "known", "; ".join(wrong), figures)


def largest_a(run, mean_s=0.02):
    """The largest current, on average over so long."""
    size = np.hypot(run.trace["i_d_true_A"], run.trace["i_q_true_A"])
    rows = max(1, round(mean_s / run.period_s))
    summed = np.cumsum(np.concatenate([[0.0], size]))
    return float(((summed[rows:] - summed[:-rows]) / rows).max())


def summary(outcomes):
    """Lines: of each quantity how far off it is, and how often the truth lies within the interval."""
    lines = ["| quantity | median of |error| | largest | truth within the interval |", "|---|---|---|---|"]
    for name in TARGETS:
        unit = "ns" if name in ABSOLUTE else "%"
        errors = [abs(outcome["figures"][f"{name}, {unit}"]) for outcome in outcomes if f"{name}, {unit}" in outcome["figures"]]
        shares = [abs(outcome["figures"][f"{name}, of its interval"]) <= 1 for outcome in outcomes
                  if f"{name}, of its interval" in outcome["figures"]]
        if errors:
            lines.append(f"| {name} | {np.median(errors):.3g} {unit} | {max(errors):.3g} {unit} | {sum(shares)} of"
                         f" {len(shares)} |")
    return lines
