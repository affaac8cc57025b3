# SPDX-License-Identifier: MIT
"""The power stage of a lot: for its supply and its motor's current, in proportions of the stages of qemu/inverters.

Voltages times resistances over volts are what stays the same from stage to stage: the drop of a switch at the range of the
sensors, the sag of the supply. So does the time that the bus capacitor could feed the range. One lot in five has a stage that
is 20 % too small: i_max ends at 1.2 times rated current instead of 1.5 (rules.py).
"""
from dataclasses import dataclass

from .lot_draw import digits
from .rules import MAX_SHARE, TRIP_SHARE

FULL, SMALL, SMALL_SHARE = 1.5, 1.2, 0.2
ROOM = 1.02  # the rule rounds down, to three digits
LARGEST_SHUNT_A = 80.0
LARGEST_BASE_OHM = 400.0  # even a supply of a few watts is not softer
MAINS_HZ = {"325 mains": 50.0, "565 mains": 50.0}


@dataclass(frozen=True)
class Family:
    """By the range of the sensors where the name says so: volts dropped, coulomb moved."""
    switch_v: float
    r_on_v: tuple      # r_on * range
    diode_v: float
    diode_ohm_v: float
    coss_nc_a: tuple
    on_ns: tuple
    off_ns: tuple
    limits: tuple      # v_min, v_max, v_range by vbus
    source: str


FET = Family(0.0, (0.03, 0.15), 0.7, 0.1, (1.0, 4.0), (90, 190), (110, 250), (0.75, 1.4, 2.1),
             "proportions of lv24_drv8323, lv24_drv8316 and lv48_traction")
IGBT = Family(0.9, (0.5, 0.9), 1.0, 0.6, (0.8, 1.8), (100, 150), (200, 300), (0.62, 1.28, 1.55),
              "proportions of mv310_10a and _50a")
SIC = Family(0.0, (1.0, 1.8), 2.6, 1.4, (3.5, 6.5), (50, 80), (70, 110), (0.65, 1.32, 1.62),
             "proportions of hv600_sic and _50a")


def family_of(volts):
    return FET if volts <= 100 else IGBT if 300 < volts < 350 else SIC


def volts_of(supply):
    """Of a key of Kind.volts."""
    return float(supply.split()[0])


def usable_v(supply):
    """Of the bus: the mean, behind a rectifier."""
    return volts_of(supply) * (0.955 if supply in MAINS_HZ else 1.0)


def stage(draw, supply, current_a, power_w, entry):
    """The tables of the inverter's file. entry(value, source, **more) makes an entry of them."""
    volts, law = volts_of(supply), family_of(volts_of(supply))
    small = draw.chance("small stage", SMALL_SHARE)
    need_a = ROOM * (SMALL if small else FULL) * current_a / MAX_SHARE / TRIP_SHARE / (1.0 if small else MAX_SHARE)
    range_a = max(digits(need_a * (1.0 if small else draw.log("range", 1.0, 2.2)), 3), 0.1)
    shunt = volts <= 100 and range_a < LARGEST_SHUNT_A and draw.chance("shunt", 0.7)
    fits = "20 % too small: i_max is 1.2 times rated current" if small else "fits: i_max is 1.5 times rated current"
    return {
        "supply": _supply(draw, supply, FULL * current_a * 1.5, power_w, law, entry),
        "bridge": _bridge(draw, law, range_a, entry),
        "sensor": {"i_range_a": entry(range_a, fits), "v_range_v": entry(digits(volts * law.limits[2]), law.source),
                   "shunt": entry(int(shunt), "by lot, up to 80 A and 100 V"), **_sensors(draw, shunt, entry)},
        "protection": {"v_min_v": entry(digits(volts * law.limits[0]), law.source),
                       "v_max_v": entry(digits(volts * law.limits[1]), law.source)}}


def _supply(draw, supply, current_a, power_w, law, entry):
    volts, mains = volts_of(supply), supply in MAINS_HZ
    base_ohm, high = min(volts / current_a, LARGEST_BASE_OHM), volts > 100
    hold_s = draw.log("bus", 5e-3, 1.2e-2) if high else draw.log("bus", 0.6e-3, 2e-3)
    sag = draw.log("sag", 0.03, 0.07) if mains else draw.log("sag", 0.01, 0.08)
    inductance = draw.between("leads", 1e-4, 2e-4) * base_ohm if mains else draw.log("leads", 1e-6, 3e-6) * (5 if high else 1)
    table = {"vbus_v": entry(volts, "by lot", spread=0.03),
             "bus_capacitance_f": entry(digits(max(hold_s / base_ohm, 2.2e-6)), law.source, spread=0.2),
             "supply_resistance_ohm": entry(digits(sag * base_ohm), "1 to 8 % of the bus at 2.2 times rated", spread=0.3),
             "supply_sinks": entry(1, "where there is no rectifier"),
             "supply_inductance_h": entry(digits(inductance), law.source),
             "bus_esr_ohm": entry(digits(draw.log("esr", 0.004, 0.02) * base_ohm), law.source, spread=0.5)}
    if mains:
        table |= {"rectifier_hz": entry(MAINS_HZ[supply], "mains"),
                  "chopper_ohm": entry(digits((1.2 * volts)**2 / (draw.between("chopper", 2, 3.5) * power_w), 3),
                                       "2 to 3.5 times rated power"),
                  "chopper_on_v": entry(digits(1.2 * volts), law.source),
                  "chopper_off_v": entry(digits(1.17 * volts), law.source)}
    return table


def _bridge(draw, law, range_a, entry):
    return {"r_on_ohm": entry(digits(draw.log("switch", *law.r_on_v) / range_a), law.source, spread=0.15),
            "switch_v": entry(law.switch_v, law.source),
            "diode_v": entry(law.diode_v, law.source, spread=0.05),
            "diode_ohm": entry(digits(law.diode_ohm_v / range_a), law.source),
            "coss_c": entry(digits(draw.log("charge", *law.coss_nc_a) * range_a * 1e-9), law.source, spread=0.25),
            "turn_on_delay_s": entry(digits(draw.between("on", *law.on_ns) * 1e-9), law.source, spread=0.1),
            "turn_off_delay_s": entry(digits(draw.between("off", *law.off_ns) * 1e-9), law.source, spread=0.1),
            "oc_trip_a": entry(digits(range_a * draw.between("comparators", 1.02, 1.3)), "beyond the range of the sensors"),
            "oc_blanking_s": entry(digits(draw.between("blanking", 1e-6, 4e-6)), "as the shipped stages"),
            "oc_delay_s": entry(3e-7, "as the shipped stages")}


def _sensors(draw, shunt, entry):
    source = "as the shipped stages with " + ("low-side shunts" if shunt else "transducers in the phases")
    amp_hz = draw.log("amplifier", 0.8e6, 1.5e6) if shunt else draw.log("amplifier", 1.2e5, 3e5)
    table = {"amp_hz": entry(digits(amp_hz), source),
             "ring_lsb": entry(digits(draw.between("ring", 8, 30), 2), source),
             "ring_hz": entry(digits(draw.log("ring hz", 3e6, 1e7), 2), source),
             "ring_tau_s": entry(digits(draw.between("ring tau", 1.5e-7, 4e-7), 2), source),
             "edge_noise_lsb": entry(digits(draw.between("edge", 3, 7), 2), source),
             "edge_noise_tau_s": entry(digits(draw.between("edge tau", 3e-7, 8e-7), 2), source),
             "skew_c_s": entry(5e-8, source),
             "i_noise_lsb": entry(digits(draw.between("noise", 0.6, 1.5), 2), source),
             "v_noise_lsb": entry(0.5, source)}
    for k in "abc":
        table[f"i_offset_{k}_lsb"] = entry(digits(draw.between(f"offset {k}", -14, 14), 3), source, spread_abs=6)
        table[f"i_gain_{k}"] = entry(digits(draw.between(f"gain {k}", 0.994, 1.006)), source, spread=0.005)
    return table | {"i_offset_drift_lsb_s": entry(0.02, source, spread=0.9),
                    "i_gain_drift_per_s": entry(1e-5, source, spread=0.9)}
