# SPDX-License-Identifier: MIT
"""Motors by lot: `lot:7` names a machine, its power stage and its load that follow from the number 7 alone.

What is drawn has the form of a motor file and of an inverter file, and is checked as they are. docs/lots.md says by which laws.
"""
import functools
import math
import re

from .errors import LauncherError
from .lot_around import angle_sensor, harmonics, load, mechanical, thermal
from .lot_draw import Draw, digits
from .lot_kinds import KINDS
from .lot_machine import OVERLOAD, built
from .lot_stage import family_of, stage, usable_v, volts_of
from .rules import USABLE
from .saturation import flux_at, from_losses, inverse_inductances

PREFIX, MOST = "lot:", 1_000_000
AMPERES_A_VOLT, LARGEST_A = 5.0, 350.0  # of rated current
_NAME = re.compile(r"lot:([1-9]\d{0,6})")
_RANGE = re.compile(r"lot:(\d{1,7})-(\d{1,7})")


def is_lot(name):
    return str(name).startswith(PREFIX)


def number_of(name):
    """7 of lot:7."""
    found = _NAME.fullmatch(str(name))
    if not found or int(found[1]) > MOST:
        raise LauncherError(f"'{name}' is not lot:N with N from 1 to {MOST}")
    return int(found[1])


def lots_of(name):
    """The names of a range: lot:1-3 is lot:1 lot:2 lot:3. One name is itself."""
    found = _RANGE.fullmatch(str(name))
    if not found:
        return [f"{PREFIX}{number_of(name)}"]
    first, last = int(found[1]), int(found[2])
    if not 1 <= first <= last <= MOST:
        raise LauncherError(f"'{name}' is not lot:A-B with 1 <= A <= B <= {MOST}")
    return [f"{PREFIX}{n}" for n in range(first, last + 1)]


def entry(value, source, **more):
    """As a data file has it."""
    return {"value": value, "source": source, **more}


@functools.lru_cache(maxsize=1024)
def lot_files(name):
    """(motor, inverter) as the TOML files of a lot would be read."""
    number = number_of(name)
    draw = Draw(number)
    kind_name = draw.weighted("kind", {key: kind.weight for key, kind in KINDS.items()})
    kind = KINDS[kind_name]
    return files_of(draw, number, kind_name, *supplied(draw, kind))


def supplied(draw, kind):
    """(supply, machine): the drawn supply, or the next higher one at which the current is no more than stages are built for."""
    drawn = volts_of(draw.weighted("supply", kind.volts))
    higher = sorted((supply for supply in kind.volts if volts_of(supply) >= drawn), key=volts_of)
    for supply in higher:
        machine = wound_machine(draw, kind, supply)
        if machine.current_a <= min(AMPERES_A_VOLT * volts_of(supply), LARGEST_A):
            break
    return supply, machine


def wound_machine(draw, kind, supply):
    """The machine of a kind with turns for its supply: 60 to 100 % of what the drive makes of it at the rated point."""
    machine = built(kind, draw)
    share = draw.between("voltage", 0.6, 1.0)
    wanted = share * USABLE * usable_v(supply) / math.sqrt(3) / _voltage(machine)
    whole = max(1, math.floor(wanted))
    turns = min((n / d for n in (whole, whole + 1, round(wanted * math.sqrt(3)) or 1) for d in (1, math.sqrt(3))),
                key=lambda n: abs(math.log(n / wanted)))
    return machine.wound(turns)


def best_d_a(flux_wb, saliency_h, current_a):
    """The i_d with the most torque."""
    if abs(saliency_h) < 1e-9 * flux_wb:
        return 0.0
    return (flux_wb - math.hypot(flux_wb, math.sqrt(8) * saliency_h * current_a)) / (4 * saliency_h)


def _voltage(machine):
    """At the rated point, hot."""
    i_d = best_d_a(machine.flux_wb, machine.lq_h - machine.ld_h, machine.current_a)
    i_q = math.sqrt(machine.current_a**2 - i_d**2)
    w, hot_ohm = machine.speed_rpm * math.pi / 30 * machine.shape.pole_pairs, 1.31 * machine.resistance_ohm
    return math.hypot(hot_ohm * i_d - w * machine.lq_h * i_q, hot_ohm * i_q + w * (machine.flux_wb + machine.ld_h * i_d))


def files_of(draw, number, kind_name, supply, machine):
    """(motor, inverter) of a machine of a kind on a supply."""
    speed = digits(machine.speed_rpm, 3)
    motor, torque_nm = _motor(draw, KINDS[kind_name], supply, machine, speed)
    power_w = torque_nm * speed * math.pi / 30
    title = f"lot {number}: {kind_name}, {machine.shape.bore * 1e3:.0f} mm gap, {power_w:.3g} W, {supply} V"
    motor = {"name": title, "summary": f"drawn by lot: docs/lots.md; {kind_name} machine", "inverter": f"{PREFIX}{number}",
             "documents": {"law": "docs/lots.md", "MODEL": "the [saturation] below"}, **motor}
    law = family_of(volts_of(supply)).source
    inverter = {"name": f"lot {number}: {supply} V stage", "summary": f"drawn by lot for its motor: {law}",
                "documents": {"law": "docs/lots.md"}, **stage(draw, supply, digits(machine.current_a, 3), power_w, entry)}
    return motor, inverter


def _motor(draw, kind, supply, machine, speed):
    """(tables of the motor's file, rated torque)."""
    electrical = {"pole_pairs": machine.shape.pole_pairs, "resistance_ohm": digits(machine.resistance_ohm),
                  "ld_h": digits(machine.ld_h), "lq_h": digits(machine.lq_h), "flux_wb": digits(machine.flux_wb)}
    current_a, max_rpm = digits(machine.current_a, 3), digits(speed * draw.between("beyond", *kind.beyond), 3)
    losses, saturation = _saturation(draw, kind, electrical, current_a)
    torque_nm, apparent = _rated(electrical, saturation, current_a)
    table = {key: entry(value, "by lot") for key, value in losses.items()}
    if assists(kind) and saturation:
        table, apparent["lq_rest"] = _coefficients(saturation), electrical["lq_h"]
        electrical |= _at_rated(saturation, electrical["flux_wb"], current_a)
    sensor, angle_source = angle_sensor(draw, kind, machine.shape.pole_pairs, max_rpm, entry)
    return {
        "electrical": _electrical(electrical), "saturation": table,
        "harmonics": harmonics(draw, kind, entry),
        "iron": {"iron_hysteresis_nm": entry(digits(machine.hysteresis_nm), "law: teeth and yoke", spread=0.3),
                 "iron_eddy_nms": entry(digits(machine.eddy_nms), "law: teeth and yoke", spread=0.3)},
        "mechanical": mechanical(draw, kind, machine, torque_nm, entry), "thermal": thermal(machine, entry),
        "rating": {"rated_current_a": entry(current_a, f"law: {machine.rise_k:.0f} K of the winding at rated speed, or less"),
                   "rated_torque_nm": entry(torque_nm, "MODEL: the most of rated current"),
                   "rated_speed_rpm": entry(speed, "law: speed of the rotor's surface, iron at most half of the heat"),
                   "max_speed_rpm": entry(max_rpm, "by lot")},
        **sensor, "start": {"initial_angle_rad": entry(0.4, "arbitrary; SEED draws it")},
        "load": load(draw, machine, torque_nm, entry),
        "control": _control(kind, supply, angle_source, apparent)}, torque_nm


def _control(kind, supply, angle_source, apparent):
    """What the rules leave to the user."""
    control = {"angle_source": entry(angle_source, "follows from the sensor")} if angle_source else {}
    if kind.buried and apparent["lq"] > apparent["ld"]:
        control |= {f"{axis}_apparent_h": entry(digits(apparent[axis]), "MODEL: flux over current at rated current and torque")
                    for axis in ("ld", "lq")}
    if "lq_rest" in apparent:
        control["lq_rest_h"] = entry(apparent["lq_rest"], "MODEL: incremental, without current")
    if kind.buried and angle_source == 1:
        control["injection_v"] = entry(digits(0.2 * volts_of(supply), 3), "rule of docs/motors.md: a fifth of the bus")
    return control


def _electrical(electrical):
    return {"pole_pairs": entry(electrical["pole_pairs"], "by lot"),
            "resistance_ohm": entry(electrical["resistance_ohm"], "law: copper of the slots", spread=0.07),
            "ld_h": entry(electrical["ld_h"], "law: gap, magnets, leakage", spread=0.1),
            "lq_h": entry(electrical["lq_h"], "law: as before", spread=0.1, like="ld_h"),
            "flux_wb": entry(electrical["flux_wb"], "law: field in the gap", spread=0.04)}


def assists(kind):
    """Whether magnets only help reluctance: iron saturates by the motor's own current, and its file has the whole map."""
    return kind.buried is not None and kind.buried[1] < 1


def _coefficients(saturation):
    return {key: entry(value, "MODEL: by lot") for key, value in saturation.keys().items() if value and key != "sat_w"}


def _at_rated(saturation, flux_wb, current_a):
    """Incremental inductances at rated current with i_d = 0, which drives are told of such machines."""
    g_dd, g_dq, g_qq = inverse_inductances(saturation, *flux_at(saturation, 0.0, current_a, flux_wb))
    share = 1 / (g_dd * g_qq - g_dq**2)
    return {"ld_h": digits(g_qq * share), "lq_h": digits(g_dd * share)}


def _saturation(draw, kind, electrical, current_a):
    """({key of the short form: share}, Saturation): as much of what is drawn as the polynomial can give this magnet."""
    if kind.slotless:
        return {}, None
    most = {"loss_d": (0.03, 0.12), "loss_q": (0.4, 0.8) if assists(kind) else (0.08, 0.35), "loss_flux": (0.01, 0.05)}
    drawn = {key: draw.between(key, *limits) for key, limits in most.items()}
    for less in (1.0, 0.8, 0.6, 0.4, 0.2, 0.1):
        losses = {key: digits(less * value, 3) for key, value in drawn.items()}
        try:
            return losses, from_losses(electrical, *losses.values(), OVERLOAD * current_a, "lot")
        except LauncherError:
            continue
    return {}, None


def _rated(electrical, saturation, current_a):
    """(most torque of rated current, {axis: flux over current there}) of the map."""
    from .capability import Machine

    machine = Machine(*(electrical[key] for key in ("pole_pairs", "resistance_ohm", "flux_wb", "ld_h", "lq_h")), saturation)
    best = machine.most_torque(0.0, math.inf, current_a)
    ld_h = (best.psi_d_wb - electrical["flux_wb"]) / best.i_d_a if abs(best.i_d_a) > 0.05 * current_a else electrical["ld_h"]
    return digits(best.torque_nm), {"ld": ld_h, "lq": best.psi_q_wb / best.i_q_a}

