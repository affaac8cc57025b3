# SPDX-License-Identifier: MIT
"""How far a motor's field can be weakened, and which cannot: names for scenarios with theory = "weakening"."""
import functools
import math

from .capability import CIRCLE, KEPT, base_speed_rpm, machine_of, top_speed_rpm
from .drive import twin_items
from .errors import DoesNotApply

SALIENT = 1.3                        # of apparent inductances: from here on a rotor counts as an interior one
TIMES = {False: 2.0, True: 3.0}      # the base speed at most, of surface and of interior magnets
WARM_C = 80.0                        # the winding: the plant's own map, with the tolerances of its seed
LEFT = 0.35                          # of the most torque: as far as theory has so much
NEAR = 0.97                          # of that speed: of its last 3 % a percent of bus or flux takes a third of the torque
FLUX_SHARE = 0.15                    # of the magnets' flux that i_max takes away at least: else resistance sets the speed
WORTH = 1.3                          # times the base speed at least
MOST_HZ, MOST_RPM = 980.0, 26000.0   # electrical and mechanical, as rules.py has them
RECTIFIED = 0.955                    # mean of a six-pulse bus by its peak
SAGGED = 0.65                        # of the reach: there the flux limit is still within it with 70 % of the bus
MAX_SHARE, OVER_SHARE = 1.05, 1.15   # speed_max_rpm and overspeed_rpm, by the speed


def weakening_names(drive):
    """base_rpm and weak_x; weak_rpm, weak_sag_rpm, weak_max_rpm, weak_overspeed_rpm.

    DoesNotApply names the motor that cannot, and why.
    """
    return _names(drive.motor.name, machine_of(drive, WARM_C), _usable_v(drive), drive.params["i_max_ma"] / 1000)


def overmodulation_names(drive):
    """The same where the voltage may leave its circle."""
    if drive.inverter["sensor"]["shunt"] != 0:
        raise DoesNotApply(f"{drive.motor.name}: no overmodulation: low-side shunts, as on {drive.inverter.name}, do not see "
                            "a phase that stays high")
    return weakening_names(drive)


def _usable_v(drive):
    """Of this very plant's supply."""
    items = dict(twin_items(drive))
    return KEPT * CIRCLE * items["inverter.vbus_v"] * (RECTIFIED if items.get("inverter.rectifier_hz") else 1.0)


@functools.lru_cache(maxsize=32)
def _names(name, machine, usable_v, i_max_a):
    base = base_speed_rpm(machine, usable_v, i_max_a)
    most = machine.most_torque(0.0, math.inf, i_max_a)
    reach = top_speed_rpm(machine, usable_v, i_max_a, LEFT * most.torque_nm)
    limit = min(MOST_HZ * 60 / machine.pole_pairs, MOST_RPM)
    times = TIMES[_salient(machine, most)]
    rpm = math.floor(min(times * base, NEAR * reach, limit))
    taken = i_max_a * machine.ld_h / machine.flux_wb
    if taken < FLUX_SHARE or reach < WORTH * base:
        raise DoesNotApply(f"{name}: no field weakening: psi / L_d is {machine.flux_wb / machine.ld_h:.3g} A, of which i_max "
                            f"{i_max_a:g} A takes {100 * taken:.0f} % away: {100 * LEFT:.0f} % of the most torque end at "
                            f"{reach / base:.2f} times the base speed of {base:.0f} rpm")
    if limit < WORTH * base:
        raise DoesNotApply(f"{name}: no field weakening: its base speed is {base:.0f} rpm, and the firmware's speeds end at "
                            f"{limit:.0f} rpm, {limit / 60 * machine.pole_pairs:.0f} Hz electrical")
    return {"base_rpm": base, "weak_x": rpm / base, "weak_rpm": rpm, "weak_sag_rpm": min(rpm, SAGGED * reach),
            "weak_max_rpm": math.ceil(MAX_SHARE * rpm),
            "weak_overspeed_rpm": math.ceil(OVER_SHARE * rpm)}


def _salient(machine, point):
    """By the map where there is one: flux by current, at the most torque."""
    if machine.saturation is None:
        return machine.lq_h > SALIENT * machine.ld_h
    return abs(point.i_d_a) > 0.2 * abs(point.i_q_a)
