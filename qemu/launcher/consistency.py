# SPDX-License-Identifier: MIT
"""A motor file that contradicts itself, or its inverter, is refused before anything runs, with both values and what would fit.

Physics ties what a data sheet gives. The tolerances are wide enough for honest sheets (iron, friction, rounding; shipped files
lie within 7 %), and narrow enough for flux in the wrong unit, poles for pole pairs and rms for peak:

    TORQUE      rated_torque_nm and the most torque of rated_current_a, 1.5 p (psi i_q + (L_d - L_q) i_d i_q): a factor of 1.35.
                Inductances are the apparent ones where the file has them
    PUBLISHED   each [check] that follows from [electrical] alone: 20 %
    MAP         flux_wb and that of the full form of [saturation] without current: 10 %
    EMF         of rated speed and vbus_v / sqrt(3): up to 2.5 times. A motor for 48 V on a 24 V supply is slow, not wrong
    DROP        resistance_ohm * rated_current_a and vbus_v / sqrt(3): less
    RISE_K      winding above ambient at rated current by a thermal_resistance_k_w that is given: up to 250 K
    START_S     bare rotor from 0 to rated speed with rated torque: shipped and drawn motors take 3 to 330 ms
    LOSS        heat of rated current by rated torque times rated speed: 1.3 to 340 %
    TAU_S       ld_h by resistance_ohm: 5 us to 190 ms
    REACTANCE   w lq_h rated_current_a at rated speed by vbus_v / sqrt(3): up to 1.3
    SLOW        speed that the bus gives at rated torque by rated_speed_rpm: up to 3.5; beyond SLOW it is only asked about
"""
import math

from .errors import LauncherError
from .rules import FRICTION_BY_RULE, speed_of_bus_rpm
from .saturation import flux_at_rest

TORQUE, PUBLISHED, MAP, EMF, RISE_K = 1.35, 0.2, 0.1, 2.5, 250.0
START_S, LOSS, TAU_S, REACTANCE, SLOW = (2e-4, 5.0), 2e-3, 1e-6, 3.0, 5.0
LEAST_FLUX_WB = 1e-6
RPM = math.pi / 30

# [check] key -> (formula, its value from [electrical])
FOLLOWS = {
    "emf_ll_v_per_krpm": ("sqrt(3) * pole_pairs * flux_wb * 104.7 rad/s",
                          lambda e: math.sqrt(3) * e["pole_pairs"] * e["flux_wb"] * 1000 * RPM),
    "emf_phase_v_per_hz": ("2 pi * flux_wb", lambda e: 2 * math.pi * e["flux_wb"]),
    "open_circuit_flux_wb": ("flux_wb", lambda e: e["flux_wb"]),
    "torque_constant_nm_a": ("3 sqrt(3) / pi * pole_pairs * flux_wb",
                             lambda e: 3 * math.sqrt(3) / math.pi * e["pole_pairs"] * e["flux_wb"]),
    "speed_constant_rpm_v": ("1 / (0.1732 * pole_pairs * flux_wb)",
                             lambda e: 1 / (3 * math.sqrt(3) / math.pi * RPM * e["pole_pairs"] * e["flux_wb"])),
    "resistance_ll_ohm": ("2 * resistance_ohm", lambda e: 2 * e["resistance_ohm"]),
    "inductance_ll_h": ("ld_h + lq_h", lambda e: e["ld_h"] + e["lq_h"]),
}


def check_motor(motor):
    """Raises with the first contradiction of the file as it is: SPREAD and DETUNE come later."""
    _check_torque(motor)
    _check_published(motor)
    _check_map(motor)
    _check_heat(motor)
    _check_units(motor)


def most_torque_nm(pole_pairs, flux_wb, saliency_h, current_a):
    """Of a linear machine at a current, with the best i_d; saliency_h is L_q - L_d."""
    i_d = 0.0
    if saliency_h:
        i_d = (flux_wb - math.hypot(flux_wb, math.sqrt(8) * saliency_h * current_a)) / (4 * saliency_h)
    return 1.5 * pole_pairs * (flux_wb - saliency_h * i_d) * math.sqrt(max(current_a**2 - i_d**2, 0.0))


def _saliency_h(motor):
    electrical, control = motor["electrical"], motor["control"]
    return (control["lq_apparent_h"] or electrical["lq_h"]) - (control["ld_apparent_h"] or electrical["ld_h"])


def _check_torque(motor):
    electrical, rating, saliency_h = motor["electrical"], motor["rating"], _saliency_h(motor)
    pairs, flux_wb, current_a = electrical["pole_pairs"], electrical["flux_wb"], rating["rated_current_a"]
    rated_nm, made_nm = rating["rated_torque_nm"], most_torque_nm(pairs, flux_wb, saliency_h, current_a)
    if 1 / TORQUE <= rated_nm / made_nm <= TORQUE:
        return
    reluctance = " with reluctance" if saliency_h else ""
    raise LauncherError(
        f"{motor.where}: [rating] rated_torque_nm {rated_nm:g} and 1.5 * pole_pairs {pairs} * flux_wb {flux_wb:g} *"
        f" rated_current_a {current_a:g}{reluctance} = {made_nm:.3g} N m are a factor of"
        f" {max(rated_nm / made_nm, made_nm / rated_nm):.2g} apart: {' or '.join(_fitting(motor, rated_nm, made_nm))} would fit"
        " (one phase of a star, peak values)")


def _fitting(motor, rated_nm, made_nm):
    """What would make rated torque of rated current, if all else is right."""
    electrical, current_a, saliency_h = motor["electrical"], motor["rating"]["rated_current_a"], _saliency_h(motor)
    pairs = electrical["pole_pairs"]
    flux_wb = flux_that_makes(rated_nm, pairs, saliency_h, current_a)
    found = [f"flux_wb {flux_wb:.3g}"] if flux_wb else []
    if pairs % 2 == 0 and 1 / TORQUE <= 2 * rated_nm / made_nm <= TORQUE:
        found.append(f"pole_pairs {pairs // 2} (of {pairs} poles)")
    if saliency_h and made_nm < rated_nm < 3 * made_nm:
        found.append("ld_apparent_h and lq_apparent_h of [control], where iron saturates,")
    return found or [f"rated_torque_nm {made_nm:.3g}"]


def flux_that_makes(torque_nm, pole_pairs, saliency_h, current_a):
    """Or None, if reluctance alone makes more."""
    low, high = LEAST_FLUX_WB, torque_nm / (1.5 * pole_pairs * current_a)
    if most_torque_nm(pole_pairs, low, saliency_h, current_a) > torque_nm:
        return None
    for _ in range(60):
        middle = (low + high) / 2
        more = most_torque_nm(pole_pairs, middle, saliency_h, current_a) > torque_nm
        low, high = (low, middle) if more else (middle, high)
    return high


def _check_published(motor):
    for key, (formula, value_of) in FOLLOWS.items():
        value = value_of(motor["electrical"])
        published = motor.checks[key].value if key in motor.checks else value
        if abs(value / published - 1) > PUBLISHED:
            raise LauncherError(f"{motor.where}: [check] {key} {published:g} and [electrical], {formula} = {value:.4g}, are"
                                f" more than {100 * PUBLISHED:g} % apart: one of them is wrong")


def _check_map(motor):
    machine, flux_wb = motor.saturation(), motor["electrical"]["flux_wb"]
    if machine is None or flux_wb <= LEAST_FLUX_WB:
        return
    at_rest_wb = flux_at_rest(machine)
    if abs(flux_wb - at_rest_wb) > MAP * at_rest_wb:
        raise LauncherError(f"{motor.where}: [electrical] flux_wb {flux_wb:g} and the flux of [saturation] without current,"
                            f" {at_rest_wb:.4g} Wb, are more than {100 * MAP:g} % apart: flux_wb {at_rest_wb:.4g} would fit")


def _check_heat(motor):
    resistance_ohm, current_a = motor["electrical"]["resistance_ohm"], motor["rating"]["rated_current_a"]
    loss_w, k_w = 1.5 * resistance_ohm * current_a**2, motor["thermal"]["thermal_resistance_k_w"]
    if "thermal_resistance_k_w" in motor.sources["thermal"] and loss_w * k_w > RISE_K:
        raise LauncherError(
            f"{motor.where}: 1.5 * resistance_ohm {resistance_ohm:g} * rated_current_a {current_a:g}^2 = {loss_w:.3g} W and"
            f" thermal_resistance_k_w {k_w:g} heat the winding by {loss_w * k_w:.3g} K, beyond any insulation:"
            f" thermal_resistance_k_w {100 / loss_w:.2g} would give 100 K")


def _check_units(motor):
    """Milli and micro, g cm2 and kg cm2: of a value that is thousands of times off others tell."""
    electrical, rating, inertia_kgm2 = motor["electrical"], motor["rating"], motor["mechanical"]["inertia_kgm2"]
    rated_rad_s, current_a = rating["rated_speed_rpm"] * RPM, rating["rated_current_a"]
    start_s = inertia_kgm2 * rated_rad_s / rating["rated_torque_nm"]
    if not START_S[0] <= start_s <= START_S[1]:
        least, most = (limit / start_s * inertia_kgm2 for limit in START_S)
        raise LauncherError(
            f"{motor.where}: [mechanical] inertia_kgm2 {inertia_kgm2:g}: rated_torque_nm {rating['rated_torque_nm']:g} takes"
            f" {start_s:.3g} s to bring the bare rotor to rated_speed_rpm {rating['rated_speed_rpm']:g}: {least:.2g} to"
            f" {most:.2g} kg m2 would fit (1 kg cm2 is 1e-4, 1 g cm2 is 1e-7 kg m2)")
    resistance_ohm, power_w = electrical["resistance_ohm"], rating["rated_torque_nm"] * rated_rad_s
    loss_w = 1.5 * resistance_ohm * current_a**2
    if loss_w < LOSS * power_w:
        raise LauncherError(
            f"{motor.where}: 1.5 * resistance_ohm {resistance_ohm:g} * rated_current_a {current_a:g}^2 = {loss_w:.3g} W of"
            f" {power_w:.3g} W at rated speed and torque: no winding loses so little; at least"
            f" {resistance_ohm * LOSS * power_w / loss_w:.2g} ohm would fit")
    for key in ("ld_h", "lq_h"):
        if electrical[key] < TAU_S * resistance_ohm:
            raise LauncherError(
                f"{motor.where}: {key} {electrical[key]:g} by resistance_ohm {resistance_ohm:g} is"
                f" {electrical[key] / resistance_ohm * 1e6:.2g} us: no winding is so quick; at least"
                f" {TAU_S * resistance_ohm:.2g} H or at most {electrical[key] / TAU_S:.3g} ohm would fit")


def check_voltage(motor, inverter):
    """Raises if the bus cannot be the one that the ratings are meant for."""
    electrical, rating, bus_v = motor["electrical"], motor["rating"], inverter["supply"]["vbus_v"]
    phase_v, drop_v = bus_v / math.sqrt(3), electrical["resistance_ohm"] * rating["rated_current_a"]
    emf_v = electrical["flux_wb"] * electrical["pole_pairs"] * rating["rated_speed_rpm"] * RPM
    gives = f"vbus_v {bus_v:g} of inverter {inverter.key} gives {phase_v:.3g} V"
    if drop_v >= phase_v:
        raise LauncherError(
            f"{motor.where}: resistance_ohm {electrical['resistance_ohm']:g} * rated_current_a {rating['rated_current_a']:g} ="
            f" {drop_v:.3g} V, but {gives} a phase: less than {phase_v / rating['rated_current_a']:.3g} ohm would fit")
    reactive_v = electrical["lq_h"] * rating["rated_current_a"] * electrical["pole_pairs"] * rating["rated_speed_rpm"] * RPM
    if reactive_v > REACTANCE * phase_v:
        raise LauncherError(
            f"{motor.where}: at rated_speed_rpm {rating['rated_speed_rpm']:g} lq_h {electrical['lq_h']:g} * rated_current_a"
            f" {rating['rated_current_a']:g} * pole_pairs {electrical['pole_pairs']} takes {reactive_v:.3g} V a phase, but"
            f" {gives}: at most {electrical['lq_h'] * REACTANCE * phase_v / reactive_v:.2g} H would fit")
    if emf_v > EMF * phase_v:
        raise LauncherError(
            f"{motor.where}: at rated_speed_rpm {rating['rated_speed_rpm']:g} flux_wb {electrical['flux_wb']:g} * pole_pairs"
            f" {electrical['pole_pairs']} induces {emf_v:.3g} V a phase, but {gives}: a bus of"
            f" {emf_v * math.sqrt(3):.3g} V, {rating['rated_speed_rpm'] * phase_v / emf_v:.3g} rpm or flux_wb"
            f" {electrical['flux_wb'] * phase_v / emf_v:.2g} would fit")


def asked_about(motor, inverter):
    """Lines for the report: what no contradiction decides."""
    rated_rpm, bus_rpm = motor["rating"]["rated_speed_rpm"], speed_of_bus_rpm(motor, inverter)
    lines = []
    if bus_rpm > SLOW * rated_rpm:
        lines.append(f"rated_speed_rpm {rated_rpm:g}: the bus of {inverter.key} gives {bus_rpm:.3g} rpm at rated torque; is it"
                     f" in rpm? From rad/s it were {rated_rpm / RPM:.4g}")
    if motor.sources["mechanical"].get("friction_coulomb_nm") == FRICTION_BY_RULE:
        lines.append(f"friction_coulomb_nm {motor['mechanical']['friction_coulomb_nm']:.3g} by rule, 1 % of rated torque: the"
                     " file has none")
    return lines
