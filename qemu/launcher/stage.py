# SPDX-License-Identifier: MIT
"""A motor too small or too large for its power stage is refused before anything is played, with what would fit.

The firmware's numbers are relative to the ranges of the sensors, i_range_a and v_range_v, and have so many bits: of each
value there is a least and a largest that a stage can drive (firmware/settings/tuning.c; tests/launcher/test_stage.py
holds the two together). And a current that is a few steps of its sensor cannot be controlled.
"""
import math

from .consistency import check_voltage
from .data import available, load_inverter
from .errors import LauncherError
from .paths import INVERTERS
from .rules import current_bw_by_rule, most_a
from .schema import BY_RULE

BASE_HZ, PWM_HZ = 1250, 20000
KI, KP, REACTANCE, EMF, RESISTANCE = 32767 / 2**17, 131071 / 2**12, 131071 / 2**11, 32767 / 2**12, 32767 / 2**12
STEPS, LEAST_STEPS = 2048, 40  # of the converter over i_range_a, and of rated current at least
LIKE = 2  # buses that a motor may be thought for


def check_stage(motor, inverter):
    """Raises if a value of the motor is beyond what the inverter can drive."""
    for key, value, least, most, ranges in _limits(motor, inverter):
        if least <= value <= most:
            continue
        small = (key == "resistance_ohm") == (value > most) or key == "rated_current_a"
        span = f"at least {least:.3g}" if most == math.inf else f"{least:.3g} to {most:.3g}"
        fitting = [name for name in available(INVERTERS) if _fits(motor, name, inverter["supply"]["vbus_v"])]
        shipped = f", or inverter {' or '.join(fitting)}" if fitting else "; of qemu/inverters none does"
        raise LauncherError(
            f"{motor.where}: the motor is too {'small' if small else 'large'} for inverter {inverter.key}: {key} {value:g},"
            f" where {span} can be driven with {ranges(least, most, value)} would fit{shipped}")


def _limits(motor, inverter):
    """(key, value, least, most, what to say of the ranges)."""
    electrical, control, sensor = motor["electrical"], motor["control"], inverter["sensor"]
    i_range, v_range = sensor["i_range_a"], sensor["v_range_v"]
    bw_hz = current_bw_by_rule(control) if control["current_bw_hz"] is BY_RULE else control["current_bw_hz"]
    loop_hz = PWM_HZ * control["pwm_samples"]
    ohm = v_range / i_range
    w, w_base = 2 * math.pi * bw_hz, 2 * math.pi * BASE_HZ

    def by_current(least, most, value):
        bound = most if value > most else least
        how = "at most" if value > most else "at least"
        return f"i_range_a {i_range:g}, v_range_v {v_range:g}: i_range_a of {how} {i_range * bound / value:.3g}"

    def by_voltage(least, most, value):
        bound = most if value > most else least
        return (f"v_range_v {v_range:g}: v_range_v of {'at least' if value > most else 'at most'}"
                f" {v_range * value / bound:.3g}")

    def by_steps(least, most, value):
        return f"i_range_a {i_range:g}: i_range_a of at most {i_range * value / least:.3g}"

    largest_h = max(electrical["ld_h"], electrical["lq_h"])
    yield ("rated_current_a", motor["rating"]["rated_current_a"], LEAST_STEPS * i_range / STEPS, math.inf, by_steps)
    yield ("resistance_ohm", electrical["resistance_ohm"], 0.5 / 2**17 * loop_hz / w * ohm,
           min(KI * loop_hz / w, RESISTANCE) * ohm, by_current)
    yield ("ld_h" if electrical["ld_h"] == largest_h else "lq_h", largest_h, 0.0, min(KP / w, REACTANCE / w_base) * ohm,
           by_current)
    yield ("flux_wb", electrical["flux_wb"], 0.0, EMF / w_base * v_range, by_voltage)


def _fits(motor, name, vbus_v):
    inverter = load_inverter(name)
    if not vbus_v / LIKE <= inverter["supply"]["vbus_v"] <= vbus_v * LIKE:
        return False
    try:
        check_voltage(motor, inverter)
    except LauncherError:
        return False
    return motor["rating"]["rated_current_a"] <= most_a(inverter) and all(
        least <= value <= most for _, value, least, most, _ in _limits(motor, inverter))
