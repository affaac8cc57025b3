# SPDX-License-Identifier: MIT
"""[control] by rule: what a motor file leaves out follows from its ratings and from the inverter. And what hangs on the shaft:

    friction_coulomb_nm  of [mechanical]: 1 % of rated torque, which bearings have. A shaft without any turns for ever once it
                   was turned, and `on` waits for one that stands still

    inertia_ratio  so much that rated torque takes 100 ms from standstill to rated speed. Rated load that comes at once takes
                   0.27 N m / 7e-6 kgm2, 370 rpm a millisecond, from the bare rotor of docs/motors.md's smallest file,
                   and no speed loop at 1 kHz is quick enough for that

    i_max_a        1.5 times rated current, at most 85 % of i_trip_a as it is told
    i_trip_a       1.4 times i_max_a, before that limit; at most 95 % of the sensors' range and of the comparators' threshold
    i_align_a      70 % of rated current: far above friction and cogging; at most half of psi / (L_q - L_d), since beyond all of
                   it reluctance turns the magnets away from the current; at most i_max_a
    speed_max_rpm  the least of max_speed_rpm, of what the bus gives at rated torque, of 980 Hz electrical (the firmware's
                   speeds end at 1187 Hz, over-speed is 1.2 times this) and of 26000 rpm
    overspeed_rpm  1.2 times speed_max_rpm
    ramp_rpm_s     0 to speed_max_rpm in 0.8 s, or with half of rated torque if that takes longer
    stop_max_s     60
    current_bw_hz  1000 where voltages act at the valley, 1300 at both ends, 2000 at once (pwm_update 0, 1, 2); with two
                   samples a period 2000 at both ends, 4000 at once
    speed_bw_hz    60, or what firmware/settings/margins.h allows if that is less: a phase margin of 45 degrees at this
                   current_bw_hz, and 10 i_max_a for a count of the encoder within a millisecond

The bus gives 85 % of vbus/sqrt(3): dead time takes 8 %, the rest is for control and for a supply that sags. Rated torque takes
the EMF, the resistive drop of a winding at 105 degC (1.31 times) and the voltage of L_q, the apparent one where the file has
it, with i_d = 0. Three digits are kept.
"""
import math

from .schema import BY_RULE

USABLE = 0.85
TRIP_SHARE, MAX_SHARE = 0.95, 0.85  # i_trip_a of what the inverter lets pass, i_max_a of i_trip_a
HOT = 1.31
SPEED_SHARE_OF_TRIP = 1.2
LARGEST_HZ, LARGEST_RPM = 980.0, 26000.0
CURRENT_BW_HZ = {1: (1000.0, 1300.0, 2000.0), 2: (2000.0, 2000.0, 4000.0)}  # by pwm_samples and pwm_update
RPM = math.pi / 30
FRICTION_SHARE, FRICTION_BY_RULE = 0.01, "by rule: 1 % of rated torque"
START_S = 0.1  # of the motors that are shipped: 84 to 530 ms


def control_by_rule(motor, inverter):
    """{key: value} of a whole [control] table."""
    rated_a, rating = motor["rating"]["rated_current_a"], motor["rating"]
    trip_a, max_a = currents_by_rule(motor, inverter)
    speed = min(rating["max_speed_rpm"], speed_of_bus_rpm(motor, inverter), LARGEST_RPM,
                LARGEST_HZ * 60 / motor["electrical"]["pole_pairs"])
    speed = _three_digits(speed)
    electrical = motor["electrical"]
    saliency_h = max(electrical["lq_h"] - electrical["ld_h"], 1e-12)
    align_a = min(0.7 * rated_a, 0.5 * electrical["flux_wb"] / saliency_h, max_a)
    inertia = motor["mechanical"]["inertia_kgm2"] * (1 + motor["load"]["inertia_ratio"])
    slope = min(speed / 0.8, 0.5 * rating["rated_torque_nm"] / inertia / RPM)
    return {"i_max_a": max_a, "i_trip_a": trip_a, "i_align_a": _told_a(align_a), "speed_max_rpm": speed,
            "overspeed_rpm": math.ceil(SPEED_SHARE_OF_TRIP * speed), "ramp_rpm_s": _three_digits(slope),
            "stop_max_s": 60.0, "current_bw_hz": current_bw_by_rule(motor["control"]),
            "speed_bw_hz": speed_bw_by_rule(motor, inertia, max_a)}


def currents_by_rule(motor, inverter):
    """(i_trip_a, i_max_a): what the file gives, otherwise the rule."""
    rated_a, control = motor["rating"]["rated_current_a"], motor["control"]
    trip_a, max_a = control["i_trip_a"], control["i_max_a"]
    wanted_a = 1.5 * rated_a if max_a is BY_RULE else max_a
    if trip_a is BY_RULE:
        trip_a = _told_a(min(1.4 * wanted_a, TRIP_SHARE * carried_a(inverter)))
    return trip_a, _told_a(min(wanted_a, MAX_SHARE * trip_a)) if max_a is BY_RULE else max_a


def carried_a(inverter):
    """What sensors and comparators of an inverter let pass."""
    return min(inverter["sensor"]["i_range_a"], inverter["bridge"]["oc_trip_a"])


def inertia_ratio_by_rule(motor):
    rating, rotor_kgm2 = motor["rating"], motor["mechanical"]["inertia_kgm2"]
    wanted_kgm2 = START_S * rating["rated_torque_nm"] / (rating["rated_speed_rpm"] * RPM)
    return _three_digits(max(wanted_kgm2 / rotor_kgm2 - 1, 0.0))


def friction_by_rule(motor):
    return FRICTION_SHARE * motor["rating"]["rated_torque_nm"]


def current_bw_by_rule(control):
    return CURRENT_BW_HZ[int(control["pwm_samples"])][int(control["pwm_update"])]


def speed_bw_by_rule(motor, inertia_kgm2, i_max_a):
    """At the [control] values that the file has, and those of the rule where it has none."""
    electrical, control = motor["electrical"], motor["control"]
    current_bw_hz = current_bw_by_rule(control) if control["current_bw_hz"] is BY_RULE else control["current_bw_hz"]
    count_rad_s = 2 * math.pi / motor["encoder"]["counts_per_rev"] * 1000
    torque_nm = 10 * i_max_a * 1.5 * electrical["pole_pairs"] * electrical["flux_wb"]
    resolved_hz = torque_nm / (2 * math.pi * inertia_kgm2 * count_rad_s)
    mean_ms = control["torque_mean_s"] * 1e3
    largest = max((hz for hz in range(1, 201) if speed_margin_deg(hz, current_bw_hz, mean_ms) >= 45), default=1)
    return float(max(1, min(60, largest, math.floor(0.99 * resolved_hz))))


def speed_margin_deg(speed_bw_hz, current_bw_hz, mean_ms=1):
    """Of the speed loop, as firmware/settings/margins.h derives it: 1 kHz slow loop, 20 kHz samples."""
    crossover_hz, delay_s = 1.0291 * speed_bw_hz, (1 + 0.05 + 0.125 + (mean_ms - 1) / 2) * 1e-3
    return 90 - 13.66 - math.degrees(math.atan(crossover_hz / current_bw_hz)) - 360 * crossover_hz * delay_s


def speed_of_bus_rpm(motor, inverter):
    """The speed at which rated torque, with i_d = 0, takes USABLE of the bus: a quadratic in the electrical speed."""
    electrical = motor["electrical"]
    available_v = USABLE * inverter["supply"]["vbus_v"] / math.sqrt(3)
    i_q = motor["rating"]["rated_torque_nm"] / (1.5 * electrical["pole_pairs"] * electrical["flux_wb"])
    drop_v, lq_h = HOT * electrical["resistance_ohm"] * i_q, motor["control"]["lq_apparent_h"] or electrical["lq_h"]
    a = electrical["flux_wb"] ** 2 + (lq_h * i_q) ** 2
    b, c = electrical["flux_wb"] * drop_v, drop_v ** 2 - available_v ** 2
    if c >= 0:
        return 0.0
    return (math.sqrt(b * b - a * c) - b) / a / electrical["pole_pairs"] / RPM


def most_a(inverter):
    """The largest i_max_a, by rule, that an inverter leaves."""
    return _told_a(MAX_SHARE * _told_a(TRIP_SHARE * carried_a(inverter)))


def _told_a(value):
    """As the drive can be told it, in whole mA."""
    return math.floor(1000 * _three_digits(value) + 1e-9) / 1000


def _three_digits(value):
    """Rounded down, so that a limit stays one."""
    if value <= 0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.floor(value / unit + 1e-9) * unit:.6g}")
