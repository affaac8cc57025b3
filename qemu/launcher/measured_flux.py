# SPDX-License-Identifier: MIT
"""psi_d(i_d) as others have measured it (qemu/motors/measured/psi_d.toml), beside the models of the motors that are shipped."""
import tomllib
from dataclasses import dataclass

import numpy as np

from .paths import MOTORS

DATA = MOTORS / "measured" / "psi_d.toml"


@dataclass(frozen=True)
class Measured:
    """One motor's points; `motor` is ours, or empty; `within` a share of the flux at rest, or None where nothing is held."""
    name: str
    i_d_a: tuple
    psi_d_wb: tuple
    motor: str = ""
    within: float | None = None
    why: str = ""

    @property
    def at_rest_wb(self):
        return self.psi_d_wb[self.i_d_a.index(0)]

    def deviations(self, psi_d_wb):
        """Of a model's flux at these currents, as shares of the measured flux at rest."""
        return (np.asarray(psi_d_wb) - self.psi_d_wb) / self.at_rest_wb


def measured():
    """Every motor of the data file."""
    tables = tomllib.loads(DATA.read_text()).items()
    return [Measured(name, tuple(table["i_d_a"]), tuple(psi / 1000 for psi in table["psi_d_mwb"]), table.get("motor", ""),
                     table.get("within"), table.get("why", "")) for name, table in tables]


def measured_of(motor):
    """The points of one of our motors, or None."""
    return next((points for points in measured() if points.motor == motor), None)


def polynomial(points):
    """(largest deviation, exponent S) of the d axis i_d = a_d0 psi + a_dd psi^(S+1) - i_f, a_d0 and a_dd not negative, that is
    nearest to a motor's points."""
    psi = np.array(points.psi_d_wb) / points.at_rest_wb
    fluxes = np.linspace(0, 1.5, 15_001)
    found = []
    for s in range(2, 9):
        for straight in np.linspace(0.02, 1, 50):  # share of a_d0 in the current at rest
            def shape(x, s=s, straight=straight):
                return straight * x + (1 - straight) * x ** (s + 1)
            (scale, i_f_a), *_ = np.linalg.lstsq(np.column_stack([shape(psi), -np.ones_like(psi)]), points.i_d_a, rcond=None)
            fitted = np.interp(points.i_d_a, scale * shape(fluxes) - i_f_a, fluxes)
            found.append((abs(points.deviations(fitted * points.at_rest_wb)).max(), s))
    return min(found)


def flux_table(fluxes):
    """Lines for all motors, and how many are beyond what they are held to. `fluxes`: {motor of ours: psi_d at the points}."""
    lines = ["psi_d over i_d <= 0 as measured (qemu/motors/measured/psi_d.toml); deviations in % of the flux at rest",
             f"  {'':<14}{'to A':>7}{'at rest mWb':>13}{'polynomial':>17}{'our model':>11}{'allowed':>9}"]
    beyond = 0
    for points in measured():
        best, s = polynomial(points)
        line = f"  {points.name:<14}{min(points.i_d_a):>7.1f}{1000 * points.at_rest_wb:>13.3f}{100 * best:>10.2f}%, S={s}"
        if points.motor in fluxes:
            ours = abs(points.deviations(fluxes[points.motor])).max()
            line += f"{100 * ours:>10.2f}%"
            if points.within is None:
                line += f"{'-':>9}  {points.motor}: {points.why}"
            else:
                beyond += ours > points.within
                line += f"{100 * points.within:>8g}%  {'FAIL' if ours > points.within else 'PASS'}  {points.motor}"
        lines.append(line)
    return lines, beyond
