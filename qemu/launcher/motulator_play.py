# SPDX-License-Identifier: MIT
"""A drive of motulator's (Aalto University, MIT licence), played with everything it has: the saturation of the machine,
switching by comparison with a carrier, a six-pulse rectifier with choke and capacitor, two masses with load. Runs in an
environment of its own; motulator_check.py gives it the machine and plays the switch states it prints on the twin.

    PYTHON motulator_play.py < MACHINE.json > PLAYED.json

The saturation's equations are written down here once more, from the papers (motor_map.h names them).
"""
import functools
import json
import math
import sys

import numpy as np
from motulator.common.model import CarrierComparison, _simulation
from motulator.common.utils import abc2complex
from motulator.drive import model
from motulator.drive.utils import SynchronousMachinePars, TwoMassMechanicalSystemPars
from scipy.integrate import solve_ivp
from scipy.optimize import root

BANDWIDTH_RAD_S = 2 * math.pi * 150  # of the currents' loop, which only has to stay calm
_simulation.solve_ivp = functools.partial(solve_ivp, rtol=1e-8, atol=1e-8)


def current_of(c, psi):
    """Current of a flux linkage."""
    d, q = np.real(psi), np.imag(psi)
    ad, aq = np.abs(d), np.abs(q)
    i_d = d * (c["a_d0"] + c["a_dd"] * ad**c["s"] + c["a_dq"] / (c["v"] + 2) * ad**c["u"] * aq**(c["v"] + 2)) - c["i_f_a"]
    i_q = q * (c["a_q0"] + c["a_qq"] * aq**c["t"] + c["a_dq"] / (c["u"] + 2) * ad**(c["u"] + 2) * aq**c["v"])
    x_w = np.sqrt((d - c["psi_n_wb"])**2 + c["k_q"] * q**2)**c["w"]
    bridges = c["a_b"] * x_w / (1 + c["a_bp"] * x_w)
    return i_d + bridges * (d - c["psi_n_wb"]) + 1j * (i_q + c["k_q"] * bridges * q)


def flux_of(c, current, start):
    """Flux linkage of a current."""
    def off(x):
        i = current_of(c, complex(*x)) - current
        return [i.real, i.imag]
    found = root(off, [start.real, start.imag], tol=1e-12)
    return complex(*found.x)


class Carrier:
    """The comparison with the carrier; keeps what it gave."""

    def __init__(self, played, load_nm):
        self.compare, self.played, self.load_nm, self.t_s = CarrierComparison(return_complex=False), played, load_nm, 0.0

    def __call__(self, period_s, duties):
        times, states = self.compare(period_s, duties)
        for time, state in zip(times, states):
            if time > 0:
                mask = sum(int(on) << k for k, on in enumerate(state))
                self.played["sequence"].append([float(time), mask, self.load_nm(self.t_s)])
        self.t_s += period_s
        return times, abc2complex(states.T)


class Currents:
    """Leads the currents through the commands, and keeps a sample of every period."""

    def __init__(self, machine, played):
        self.m, self.played = machine, played

    def wanted(self, t_s):
        return complex(*next(i for until_s, *i in reversed(self.m["commands"]) if t_s >= until_s))

    def __call__(self, drive):
        m, psi, speed = self.m, drive.machine.state.psi_s, drive.mechanics.state.w_M.real
        self.played["samples"].append([len(self.played["sequence"]), drive.t0, drive.machine.i_s.real, drive.machine.i_s.imag,
                                       float(drive.machine.tau_M), float(speed), float(np.real(drive.mechanics.state.w_L)),
                                       float(drive.converter.u_dc)])
        target = self.targets(self.wanted(drive.t0))
        w = m["pole_pairs"] * speed
        u = m["resistance_ohm"] * drive.machine.i_s + 1j * w * psi + BANDWIDTH_RAD_S * (target - psi)
        u = u * drive.machine.state.exp_j_theta_m * np.exp(1.5j * w * m["period_s"])
        phases = np.array([(u * np.exp(-2j * math.pi / 3 * k)).real for k in range(3)])
        phases -= (phases.max() + phases.min()) / 2
        return m["period_s"], np.clip(0.5 + phases / drive.converter.u_dc, 0, 1)

    @functools.lru_cache
    def targets(self, current):
        return flux_of(self.m["saturation"], current, complex(self.m["flux_wb"], 0.01))

    def post_process(self):
        """Nothing of the control is looked at."""


def main():
    m = json.load(sys.stdin)
    played = {"sequence": [], "samples": []}
    c = m["saturation"]
    flux_wb = flux_of(c, 0j, complex(m["flux_wb"], 0)).real
    machine = model.SynchronousMachine(SynchronousMachinePars(n_p=m["pole_pairs"], R_s=m["resistance_ohm"], psi_f=flux_wb),
                                       i_s=functools.partial(current_of, c), psi_s0=flux_wb)
    shaft = m["shaft"]
    mechanics = model.TwoMassMechanicalSystem(
        TwoMassMechanicalSystemPars(J_M=shaft["motor_kgm2"], J_L=shaft["load_kgm2"], K_S=shaft["stiffness_nm_rad"],
                                    C_S=shaft["damping_nms"],
                                    B_L=lambda w: shaft["viscous_nms"] + shaft["fan_nms2"] * np.abs(w)))
    supply = m["supply"]
    converter = model.FrequencyConverter(supply["capacitance_f"], supply["inductance_h"], supply["mains_v"], supply["hz"])
    drive = model.Drive(converter, machine, mechanics)
    load_nm = lambda t_s: m["load_nm"] if t_s >= m["load_from_s"] - m["period_s"] / 2 else 0.0
    carrier = Carrier(played, load_nm)
    drive.pwm = carrier
    # the load changes where a period begins, in both
    mechanics.tau_L = lambda t_s: load_nm(carrier.t_s - m["period_s"])
    mechanics.state.w_M, mechanics.state.exp_j_theta_M = 0j, complex(1)
    _simulation.Simulation(drive, Currents(m, played)).simulate(m["duration_s"])
    json.dump(played, sys.stdout)


if __name__ == "__main__":
    main()
