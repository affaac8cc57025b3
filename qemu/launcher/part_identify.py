# SPDX-License-Identifier: MIT
"""PART=identify: what the drive finds out about its motor, against the plant's truth, and how often that is in the interval.

WHAT is seedN: tolerances drawn by N, SPREAD 1, every effect of the plant on; or LOAD/seedN with a load that is there from the
beginning: hoist50 and friction20 as PART=start has them, blocked for a locked shaft. The drive is told what its inverter is,
the rated current and the largest speed; all it is told of the motor and the encoder besides is wrong (TOLD).

The truth is the plant's at the temperature and the current of the measurement: of resistance, the winding's with the
switches and diodes in its way; of dead time, what a leg loses in a period, in time at the bus voltage, its delays and
constant drops among it; of inductance, the slope of the plant's own flux at the current that stood meanwhile.
"""
import math
import re
from dataclasses import dataclass, replace

import numpy as np

from .drive import twin_items
from .errors import LauncherError
from .part import ON_S, PREAMBLE_S, PartCase, Setup, Verdict, bridge_is_off, event, first_fault
from .rules import RPM
from .saturation import Saturation

NAME = "identify"
SEEDS = 8
# one that takes more than HEAVY_S from 0 to rated speed takes longer for ramps and the field's turn: by so many times the rest
LONGEST_S, HEAVY_S, HEAVY, PATIENCE_S, SHOW_S = 20.0, 0.6, 60.0, 75.0, 0.3
SPEED_MAX = 0.4    # of the largest one: a quarter; before the pole pairs are known, what induces 4 % of the bus voltage
CURRENT_MAX = 1.1  # of the rated one, on average over 20 ms
TOLD = {"pole_pairs": 1, "resistance_mohm": 1000, "ld_uh": 1000, "lq_uh": 1000, "ld_apparent_uh": 0, "lq_apparent_uh": 0,
        "lq_rest_uh": 0, "flux_uwb": 10000, "inertia_gmm2": 100000, "encoder_counts": 1024}
FULL_DEAD_S = 1e-6  # CONFIG_DEAD_TIME_NS
PWM_HZ = 20e3
# TURN_MS and what is around it, and what both turns take where the second is slower: firmware/commission/identify_turn.c
FIELD_TURN_S, SOFT_TURN_S, SLOWER, SLOW_TURNS = 3.3, 1.5, 3.7, 0.3
# quantity -> target: relative, or in ns
TARGETS = {"resistance": 0.01, "dead time": 10.0, "ld": 0.03, "lq": 0.03, "flux": 0.01, "inertia": 0.05, "friction": 0.1,
           "viscous friction": 0.1, "offset": 1.0}
ABSOLUTE = {"dead time": "ns", "offset": "deg el."}
# of the map: where it is in shares of the rated current, (i_d, i_q), and which inductance
MAP = {"ld at -1 of rated current in d": (-1, 0, 0), "ld at -1/2 in d": (-1 / 2, 0, 0), "ld at 1/2 in d": (1 / 2, 0, 0),
       "ld at 1 in d": (1, 0, 0), "ld at 1/3 of rated current in q": (0, 1 / 3, 0), "ld at 2/3 in q": (0, 2 / 3, 0),
       "ld at 1 in q": (0, 1, 0), "lq at 1/3 in q": (0, 1 / 3, 1), "lq at 2/3 in q": (0, 2 / 3, 1), "lq at 1 in q": (0, 1, 1)}
TARGETS |= dict.fromkeys(MAP, 0.05)
TORQUE = ("flux in d there", "flux in q there", "ldq by lqq there, in thousandths")
TORQUE_CURRENTS = ("rated current in d for most torque, in mA", "and in q, in mA")
TARGETS |= {"flux in d there": 0.05, "flux in q there": 0.05, "ldq by lqq there, in thousandths": 10.0}
ABSOLUTE |= {"ldq by lqq there, in thousandths": "1/1000"}
STANDING = ("resistance", "dead time", "ld", "lq")
UNRESOLVED = ("friction", "viscous friction")  # where it is little beside what the sensors resolve
DRIVEN = ("LOAD_TOO_HIGH", "OVERSPEED")  # how it may end where a load drives the shaft
LOADS = ("hoist50", "friction20", "blocked")
EXACT = ("pole pairs", "encoder counts", "encoder direction")
# what cannot be known where reluctance turns the rotor whenever the current changes: one inductance twice the other
TURNED = ("resistance", "dead time", "ld at 1/2 in d", "ld at 1 in d")
TURNED_RATIO = 1.9
# and what a rotor hides that rated current turns too quickly: in LATE_S by this share of the fastest speed of identify
OF_INTERVAL = ", of its interval"
LATE_S, LATE_SHARE, SPEED_SHARE = 5e-3, 0.3, 0.25
SWINGS_HZ = 30.0  # three times its speed loop (firmware/commission/identify_numbers.c)
RAMP_SHARE, RAMP_S = 0.2, 5.0  # of the rated current for a reluctant machine's ramps, and their patience
# an interval is one of 95 %, and a run has 25 of them: three may miss by less than a half, within three standard deviations
INTERVALS_MOST, MISSES_MOST = 1.5, 3


def plan(motors, options):
    """SEEDS of each motor, and one with each load."""
    whats = [f"seed{seed}" for seed in range(1, SEEDS + 1)] + [f"{load}/seed1" for load in LOADS]
    return [PartCase(NAME, motor, what) for motor in motors for what in whats]


def setup(what, drive):
    """The run of one case."""
    match = re.fullmatch(r"(?:(hoist|friction|blocked)(\d{0,3})/)?seed(\d{1,4})", what)
    if match is None:
        raise LauncherError(f"no case '{what}' of identify; there are: seed1, seed2, ..., hoist50/seed1, friction20/seed1,"
                            " blocked/seed1, ...")
    load, percent, seed = match.groups()
    torque_nm = drive.names()["rated_torque_Nm"] * float(percent or 0) / 100
    loads = {None: [], "blocked": [event("lock", "1")], "hoist": [event("load_hoist", f"{torque_nm:.9g}")],
             "friction": [event("load_coulomb", f"{torque_nm:.9g}")]}[load]
    steps = [*({"t_s": 0.0, **one} for one in loads), {"t_s": ON_S, "console": "identify"},
             {"t_s": PATIENCE_S, "console": "identify show"}, {"t_s": PATIENCE_S + SHOW_S, "event": "end"},
             {"t_s": 0.05, "after_state": "SWITCHED_ON SWITCH_ON_DISABLED", "console": "identify show"},
             {"t_s": SHOW_S, "after_state": "SWITCHED_ON SWITCH_ON_DISABLED", "event": "end"},
             {"t_s": 0.05, "after_state": "FAULT", "console": "identify show"},
             {"t_s": SHOW_S, "after_state": "FAULT", "event": "end"}]
    scenario = {"key": "part", "title": f"identify, {what}", "preamble_s": PREAMBLE_S, "end_s": PATIENCE_S + SHOW_S + 0.1,
                "step": steps}
    return Setup(scenario, lambda run: judge(run, load, torque_nm),
                 {"seed": int(seed), "spread": 1, "overrides": {"params": dict(TOLD)}})


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
        match = re.match(r"([-a-zA-Z0-9 ,/]+): (-?[\d.]+)(?: \+-([\d.]+)|, exactly)", line)
        refused = re.match(r"([-a-zA-Z0-9 ,/]+): refused: (.+)", line)
        if match:
            found[match.group(1)] = Result(float(match.group(2)), float(match.group(3) or 0))
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
    on = standing_rows(run)
    hot = 1 + plant["motor.copper_tempco_per_k"] * (run.trace["winding_C"][on].mean() - 25)
    dead = 2 * FULL_DEAD_S * PWM_HZ  # share of a period
    switch_v, diode_v = plant.get("inverter.switch_v", 0.0), plant["inverter.diode_v"]
    r_on, r_diode = plant.get("inverter.r_on_ohm", 0.0), plant.get("inverter.diode_ohm", 0.0)
    by_diode = 0.5 if switch_v else dead  # a switch that has a threshold does not carry current back
    lost_v = diode_v * by_diode + switch_v * (1 - by_diode)
    delay_s = plant.get("inverter.turn_on_delay_s", 0.0) - plant.get("inverter.turn_off_delay_s", 0.0)
    d, q = inductances(plant, run, on[-1])
    pairs, counts = plant["motor.pole_pairs"], plant["sensor.encoder_counts"]
    index = np.floor(plant["sensor.index_angle_rad"] / (2 * np.pi) % 1 * counts) + 0.5  # the middle of its first count
    iron = (magnets(plant, run) / magnets(plant, run, 0))**(plant.get("motor.iron_flux_power") or 2)
    hysteresis_nm, hysteresis_nms = hysteresis(plant, run.drive.params["speed_max_rpm"] * np.pi / 30)
    return map_truth(plant, run) | {
            "resistance": 1e3 * (plant["motor.resistance_ohm"] * hot + r_on * (1 - by_diode) + r_diode * by_diode),
            "dead time": 1e9 * (FULL_DEAD_S + delay_s + lost_v / PWM_HZ / plant["inverter.vbus_v"]),
            "ld": d * 1e6, "lq": q * 1e6,
            "pole pairs": pairs, "encoder counts": counts, "encoder direction": 1,
            "offset": pairs * 360 * index / counts % 360,
            "flux": 1e6 * magnets(plant, run),
            "inertia": 1e6 * (plant["motor.inertia_kgm2"] + plant.get("load.inertia_kgm2", 0)),
            "friction": 1e3 * (plant["motor.friction_coulomb_nm"] + iron * hysteresis_nm
                               + plant.get("load.coulomb_nm", 0)),
            "viscous friction": 1e6 * (plant["motor.friction_viscous_nms"] + iron * (plant.get("motor.iron_eddy_nms", 0)
                                       + hysteresis_nms) + plant.get("load.viscous_nms", 0))}


def hysteresis(plant, largest_rad_s):
    """(Coulomb part, viscous part) of its drag: the line through it at a twentieth and two fifths of the largest speed, between
    which identify measures."""
    w = np.array([0.05, 0.4]) * largest_rad_s
    power, given_rad_s = plant.get("motor.iron_hysteresis_power", 0), plant.get("motor.iron_hysteresis_rad_s", 1)
    slow_nm, quick_nm = plant.get("motor.iron_hysteresis_nm", 0) * (w / given_rad_s)**power
    slope = (quick_nm - slow_nm) / (w[1] - w[0])
    return slow_nm - slope * w[0], slope


def map_truth(plant, run):
    """Of the map, and of the point that the drive has chosen for most torque."""
    rated, found = run.rated("rated_current_a"), results_of(run.console)
    machine, on = machine_of(plant), np.flatnonzero(run.trace["gate_live"])
    warmer = 1 + plant.get("motor.magnet_tempco_per_k", 0.0) * (run.trace["magnet_C"][on[-1]] - 25)
    machine = with_magnet(machine, warmer) if machine.a_d0 else None
    there = [found[name].value for name in TORQUE_CURRENTS if name in found and found[name].value is not None]
    right = {name: 1e6 * at(plant, machine, rated * d, rated * q)[1][axis, axis] for name, (d, q, axis) in MAP.items()}
    if len(there) == 2:
        flux, inductance = at(plant, machine, *(1e-3 * ma for ma in there))
        right |= dict(zip(TORQUE, (1e6 * flux[0], 1e6 * flux[1], 1e3 * inductance[0, 1] / inductance[1, 1])))
    return right


def at(plant, machine, i_d, i_q):
    """(flux, matrix of inductances for small changes) of a current. machine: None where nothing saturates."""
    if machine is None:
        inductance = np.diag([plant["motor.ld_h"], plant["motor.lq_h"]])
        return inductance @ (i_d, i_q) + (plant["motor.flux_wb"], 0.0), inductance
    flux = flux_of(machine, np.array([i_d, i_q]))
    return flux, np.linalg.inv(slopes(machine, flux))


def magnets(plant, run, share=1):
    """Flux without current at the end, or as cold as share 0 has it, 25 degC."""
    on = np.flatnonzero(run.trace["gate_live"])
    warmer = 1 + share * plant.get("motor.magnet_tempco_per_k", 0.0) * (run.trace["magnet_C"][on[-1]] - 25)
    machine = machine_of(plant)
    return plant["motor.flux_wb"] * warmer if machine.a_d0 == 0 else flux_of(with_magnet(machine, warmer), np.zeros(2))[0]


def machine_of(plant):
    """The plant's map."""
    return Saturation(**{key.removeprefix("motor.sat_"): value for key, value in plant.items() if ".sat_" in key})


def standing_rows(run):
    """The rows in which the bridge is on and the standstill part measures: until the field begins to turn, if it does."""
    on, taken = np.flatnonzero(run.trace["gate_live"]), taken_s(run)
    if taken is None and "ended in step 'turn'" in run.console:
        taken = run.trace["t_s"][on[-1]]
    turn_s = FIELD_TURN_S + (SOFT_TURN_S if is_doubled(run.drive) else 0)
    turn_s *= SLOWER if taken is not None and field_turns_slowly(run, taken) else 1
    return on if taken is None else on[run.trace["t_s"][on] < taken - turn_s]


def field_turns_slowly(run, taken):
    """Whether its way back, before the rotor's frame was taken, was that of a turn that is done again."""
    window = run.window(taken - 1.0, taken - 0.5)
    along = np.unwrap(np.arctan2(window["i_b_A"] - window["i_c_A"], math.sqrt(3) * window["i_a_A"]))
    return abs(along[-1] - along[0]) / (2 * np.pi) < SLOW_TURNS


def taken_s(run):
    """When the rotor's frame was taken, or None: the firmware knew no offset before."""
    rows = np.flatnonzero(run.trace["angle_offset_q32"] != run.trace["angle_offset_q32"][0])
    return None if len(rows) == 0 else float(run.trace["t_s"][rows[0]])


def inductances(plant, run, last):
    """(Ld, Lq) for small changes at the mean current of the last 50 ms before the row."""
    rows = slice(max(0, last - round(0.05 / run.period_s)), last)
    current = np.array([run.trace["i_d_true_A"][rows].mean(), run.trace["i_q_true_A"][rows].mean()])
    machine = machine_of(plant)
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
    """The machine with so many times the remanence: qemu/twin/motor_map.c, motor_map_magnet()."""
    return replace(machine, i_f_a=machine.i_f_a * share, psi_n_wb=machine.psi_n_wb * share)


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

def judge(run, load=None, torque_nm=0.0):
    """Each value within its target or, where the sensors forbid that, within the interval that it states; none is guessed.

    load   what hinders the shaft: what may be refused then, or must be
    """
    fault, found, took = first_fault(run), results_of(run.console), time_s(run.console)
    if load == "hoist" and fault in DRIVEN:
        return Verdict(fault, "" if bridge_is_off(run) else "the bridge is on", {})
    if fault or not found:
        return Verdict(fault or "no result", f"{fault or 'nothing was shown'}", {})
    right, figures = truth(run), {"time, s": took}
    right["friction"] += 1e3 * torque_nm if load == "friction" else 0.0
    wrong = [line for name in (*TARGETS, *EXACT)
             if (line := judge_one(name, found.get(name), right.get(name), load, run, figures))]
    missed = [name for name, share in figures.items() if name.endswith(OF_INTERVAL) and abs(share) > 1]
    wrong += [f"{len(missed)} values outside of their intervals"] if len(missed) > MISSES_MOST else []
    wrong += [] if bridge_is_off(run) else ["the bridge is on"]
    heavy_s = max(0.0, run.drive.names()["t_mech_s"] - HEAVY_S)
    late = took is None or took > min(LONGEST_S + HEAVY * heavy_s, PATIENCE_S - 1)
    wrong += ["it did not end" if took is None else f"it took {took:.1f} s"] if late else []
    figures["current, of rated"] = largest_a(run) / run.rated("rated_current_a")
    figures["speed, of the largest"] = fastest_rpm(run) / run.drive.params["speed_max_rpm"]
    if load != "hoist":  # which drives the shaft as it likes, and what turns induces
        wrong += ["more than the rated current"] if figures["current, of rated"] > CURRENT_MAX else []
        wrong += ["faster than it may"] if figures["speed, of the largest"] > SPEED_MAX else []
    return Verdict("wrong" if wrong else "known", "; ".join(wrong), figures)


def judge_one(name, result, right, load, run, figures):
    """What is wrong with a value, or an empty line."""
    if result is None:
        return f"{name} is not shown"
    if result.value is None:
        return "" if may_be_refused(name, result.refused, load, run) else f"{name} refused: {result.refused}"
    if load == "blocked" and name not in STANDING:
        return f"{name} guessed: the shaft is locked"
    if load == "blocked" and name in ("ld", "lq"):
        return ""  # the rotor does not stand where the current pulls it: what they saturate by is another matter
    if name in EXACT:
        return "" if result.value == right else f"{name} {result.value:g} is not {right:g}"
    scale, unit = (1.0, ABSOLUTE[name]) if name in ABSOLUTE else (right, "%")
    error, interval = off(name, result.value, right) / scale, result.interval / scale
    figures[f"{name}, {unit}"] = error * (1 if name in ABSOLUTE else 100)
    figures[f"{name}{OF_INTERVAL}"] = error / interval
    too_far = abs(error) > max(TARGETS[name], INTERVALS_MOST * interval)
    return f"{name} {result.value:g} +-{result.interval:g} where {right:.5g} is true" if too_far else ""


def may_be_refused(name, reason, load, run):
    """What reluctance, the sensors or a load hide."""
    if load == "blocked":
        return name not in ("ld", "lq")
    if load == "hoist":
        return True
    if load == "friction" and "holds it back" in reason:  # what lets flux be known turns a reluctant rotor no longer
        return is_doubled(run.drive)
    if name in MAP and "ripple and dead time" in reason:
        return name.startswith("ld") and "in q" in name
    if name not in STANDING and is_true_of_turning(reason, name, run.drive):
        return True
    if name in TORQUE:
        return "no current in d" in reason and not is_doubled(run.drive)
    return (name in TURNED and is_doubled(run.drive)) or (name in UNRESOLVED and "too small for the sensors" in reason)


def is_true_of_turning(reason, name, drive):
    """Whether what keeps a turning rotor's values from being known is so on this plant."""
    light = "turns the rotor too quickly" in reason and name in (*MAP, *TORQUE, "inertia") and is_light(drive)
    swings = re.search("speed swings|differ by more|holds it back", reason) and is_elastic(drive)
    return light or bool(swings) or ("holds it back" in reason and is_held_back(drive))


def is_doubled(drive):
    """Whether without current one inductance is about twice the other: what identify calls a reluctance machine."""
    by_d, by_q = drive.inverse_at_rest
    return by_d > TURNED_RATIO * by_q


def is_elastic(drive):
    """Whether the load follows a ramp late: what it swings with on its coupling is near the speed loop of identify."""
    stiffness = drive.motor["load"]["stiffness_nm_rad"]
    return bool(drive.swing_s) and math.sqrt(stiffness / drive.load_inertia_kgm2) < 2 * math.pi * SWINGS_HZ


def is_held_back(drive):
    """Whether the little current with which a reluctant machine may be turned drives its ramps in time."""
    if not is_doubled(drive):
        return False
    motor, turns = drive.motor, drive.torque_per_ampere * drive.motor["rating"]["rated_current_a"] * RAMP_SHARE
    holds = (motor["mechanical"]["friction_coulomb_nm"] + motor["load"]["coulomb_nm"] + motor["iron"]["iron_hysteresis_nm"])
    way_rad_s = 2 * SPEED_SHARE * drive.params["speed_max_rpm"] * RPM
    return (turns - holds) * RAMP_S < drive.inertia_kgm2 * way_rad_s


def is_light(drive):
    """Whether rated current turns it through a third of the speeds of identify before it has reversed."""
    inertia = drive.motor["mechanical"]["inertia_kgm2"] if is_elastic(drive) else drive.inertia_kgm2
    late_rpm = drive.torque_per_ampere * drive.motor["rating"]["rated_current_a"] / inertia * LATE_S / RPM
    return late_rpm > LATE_SHARE * SPEED_SHARE * drive.params["speed_max_rpm"]


def fastest_rpm(run):
    """Of the shaft, on average over a millisecond."""
    return float(np.abs(run.trace["speed_rpm"]).max())


def off(name, value, right):
    """By how much a value is off; angles the shorter way round."""
    return (value - right + 180) % 360 - 180 if name == "offset" else value - right


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
        unit = ABSOLUTE.get(name, "%")
        errors = [abs(outcome["figures"][f"{name}, {unit}"]) for outcome in outcomes if f"{name}, {unit}" in outcome["figures"]]
        shares = [abs(outcome["figures"][f"{name}, of its interval"]) <= 1 for outcome in outcomes
                  if f"{name}, of its interval" in outcome["figures"]]
        if errors:
            lines.append(f"| {name} | {np.median(errors):.3g} {unit} | {max(errors):.3g} {unit} | {sum(shares)} of"
                         f" {len(shares)} |")
    return lines
