# SPDX-License-Identifier: MIT
"""What a motor can do at a speed: the most torque that a current and a voltage allow, by brute force over the plant's own map.

No formula of field weakening is used, and nothing of the firmware: of all flux linkages on a grid those that need neither more
current nor more voltage than there is are left, and the one with the most torque wins. With psi as the unknown both the current
(the map gives it as a function of flux) and the voltage, v = R i + j w psi, are explicit.
"""
import math
from dataclasses import dataclass, replace

import numpy as np

from .drive import twin_items
from .saturation import Saturation

REFERENCE_C = 25.0
GRID = 241       # points an axis, twice: the whole plane, then around the best point
FINER = 12       # by which the second grid is smaller
RPM = math.pi / 30

# Of the bus: the largest phase voltage, firmware/settings/rates.h. tests/unit/test_weakening.py holds it against the image's.
PWM_COUNTS, DEAD_COUNTS, MIN_PULSE_COUNTS, ROUNDING_COUNTS = 5000, 100, 2, 4
KEPT = 31 / 32  # of the circle, by the drive: firmware/control/weakening.h
CIRCLE = (PWM_COUNTS - 4 * DEAD_COUNTS - 2 * MIN_PULSE_COUNTS - ROUNDING_COUNTS) / PWM_COUNTS / math.sqrt(3)


@dataclass(frozen=True)
class Point:
    """The best operating point: torque in N m (air gap), currents in A, flux linkages in Wb."""
    torque_nm: float
    i_d_a: float
    i_q_a: float
    psi_d_wb: float
    psi_q_wb: float


@dataclass(frozen=True)
class Machine:
    """A motor at one temperature: its map, or inductances and flux where there is none."""
    pole_pairs: float
    resistance_ohm: float
    flux_wb: float
    ld_h: float
    lq_h: float
    saturation: object = None

    def currents(self, psi_d, psi_q):
        """The map: currents of flux linkages, arrays or numbers."""
        m = self.saturation
        if m is None:
            return (psi_d - self.flux_wb) / self.ld_h, psi_q / self.lq_h
        d, q = np.abs(psi_d), np.abs(psi_q)
        i_d = psi_d * (m.a_d0 + m.a_dd * d**m.s + m.a_dq / (m.v + 2) * d**m.u * q**(m.v + 2)) - m.i_f_a
        i_q = psi_q * (m.a_q0 + m.a_qq * q**m.t + m.a_dq / (m.u + 2) * d**(m.u + 2) * q**m.v)
        off = psi_d - m.psi_n_wb
        x = (off**2 + m.k_q * psi_q**2) ** (m.w / 2)
        bridge = m.a_b * x / (1 + m.a_bp * x)
        return i_d + bridge * off, i_q + m.k_q * bridge * psi_q

    def most_torque(self, speed_rpm, voltage_v, current_a, braking=False):
        """The best Point within voltage and current at a speed, or None where no current is small enough to stand it."""
        flux = np.hypot(self.flux_wb, 1.0 * current_a * max(self.ld_h, self.lq_h)) + self._saturated_reach(current_a)
        centre, half, best = (0.0, 0.0), flux, None
        for _ in range(3):
            d, q = np.meshgrid(centre[0] + np.linspace(-half, half, GRID), centre[1] + np.linspace(-half, half, GRID))
            found = self._best(d, q, speed_rpm, voltage_v, current_a, -1 if braking else 1)
            if found is not None:
                best, centre = found
                half /= FINER
            else:
                half /= 3
        return best

    def _saturated_reach(self, current_a):
        """Flux beyond what the inductances in the file say: those at rated current are smaller than those of little current."""
        if self.saturation is None:
            return 0.0
        psi = self.flux_wb
        while min(abs(self.currents(psi, 0.0)[0]), abs(self.currents(0.0, psi)[1])) < current_a:
            psi *= 1.2
        return psi

    def _best(self, d, q, speed_rpm, voltage_v, current_a, sign):
        i_d, i_q = self.currents(d, q)
        w = speed_rpm * RPM * self.pole_pairs
        voltage = np.hypot(self.resistance_ohm * i_d - w * q, self.resistance_ohm * i_q + w * d)
        allowed = (np.hypot(i_d, i_q) <= current_a) & (voltage <= voltage_v)
        torque = np.where(allowed, sign * (d * i_q - q * i_d), -np.inf)
        n = int(torque.argmax())
        if not np.isfinite(torque.flat[n]):
            return None
        flux = float(d.flat[n]), float(q.flat[n])
        return Point(1.5 * self.pole_pairs * sign * float(torque.flat[n]), float(i_d.flat[n]), float(i_q.flat[n]), *flux), flux


def machine_of(drive, winding_c=None):
    """The plant of this very drive (PLANT, SPREAD, SEED); winding and magnets warm, or at the reference temperature."""
    items = {key.partition(".")[2]: value for key, value in twin_items(drive) if key.startswith("motor.")}
    winding_c = REFERENCE_C if winding_c is None else winding_c
    warm_k = items.get("ambient_c", REFERENCE_C) + items.get("magnet_share", 0.5) * (
        winding_c - items.get("ambient_c", REFERENCE_C)) - REFERENCE_C
    share = 1 + items.get("magnet_tempco_per_k", 0.0) * warm_k
    resistance = items["resistance_ohm"] * (1 + items.get("copper_tempco_per_k", 0.0) * (winding_c - REFERENCE_C))
    machine = Machine(items["pole_pairs"], resistance, items["flux_wb"], items["ld_h"], items["lq_h"])
    if items.get("sat_a_d0", 0) == 0:
        return replace(machine, flux_wb=machine.flux_wb * share)
    machine = replace(machine, saturation=Saturation(**{key.removeprefix("sat_"): value for key, value in items.items()
                                                         if key.startswith("sat_")}))
    return _with_magnet(machine, share)


def _with_magnet(machine, share):
    """As motor_map_magnet() of the twin: remanence is `share` times that at the reference temperature."""
    cold = machine.saturation
    warm = replace(machine, saturation=replace(cold, i_f_a=cold.i_f_a * share, psi_n_wb=cold.psi_n_wb * share))
    return replace(warm, flux_wb=_root(lambda x: warm.currents(x, 0.0)[0], 0.0, 10 * machine.flux_wb))


def _root(function, low, high):
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if function(middle) < 0 else (low, middle)
    return (low + high) / 2


def base_speed_rpm(machine, voltage_v, current_a):
    """The highest speed at which the voltage still carries the most torque that the current makes."""
    most = machine.most_torque(0.0, math.inf, current_a).torque_nm
    return _last(lambda rpm: _torque(machine, rpm, voltage_v, current_a) >= 0.999 * most)


def top_speed_rpm(machine, voltage_v, current_a, torque_nm):
    """The highest speed at which a torque can be had, within the voltage and the current."""
    return _last(lambda rpm: _torque(machine, rpm, voltage_v, current_a) >= torque_nm)


def _torque(machine, rpm, voltage_v, current_a):
    point = machine.most_torque(rpm, voltage_v, current_a)
    return -math.inf if point is None else point.torque_nm


def _last(holds, limit_rpm=1e5):
    low, high = 0.0, 100.0
    while holds(high) and high < limit_rpm:
        low, high = high, 2 * high
    for _ in range(12):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low
