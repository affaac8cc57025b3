# SPDX-License-Identifier: MIT
"""Magnetic saturation of a data file: the coefficients the twin takes, from the short form, and their tolerances.

Full form: the algebraic model of Hinkkanen et al. (IEEE Trans. Ind. Appl. 2017, doi 10.1109/TIA.2016.2644624), with the
iron bridges of Lelli et al. (ICEM 2024, doi 10.1109/ICEM60801.2024.10700403), or a magnet in series with a linear gap:

    i_d = psi_d [a_d0 + a_dd |psi_d|^S + a_dq/(V+2) |psi_d|^U |psi_q|^(V+2)] + G (psi_d - psi_n) - i_f
    i_q = psi_q [a_q0 + a_qq |psi_q|^T + a_dq/(U+2) |psi_d|^(U+2) |psi_q|^V] + k_q G psi_q
    G = a_b x^W / (1 + a_bp x^W),   x = sqrt((psi_d - psi_n)^2 + k_q psi_q^2)

Short form, for machines of which only a few numbers are known or assumed: the same with S = T = 2, U = V = 0 and no bridges,
a polynomial. Its six coefficients follow from ld_h, lq_h, flux_wb at no current and from three losses at the current at_a:
of L_d (incremental) at i_d = at_a, of L_q (incremental) and of the magnets' flux psi_d at i_q = at_a. The last is what torque
at i_d = 0 loses.
"""
from dataclasses import dataclass, fields, replace

from .errors import LauncherError
from .schema import BY_RULE, MOTOR_TABLES

SHORT = ("loss_d", "loss_q", "loss_flux", "at_a")


@dataclass(frozen=True)
class Saturation:
    """The coefficients, named as in the twin but for the prefix sat_."""
    a_d0: float = 0.0
    a_dd: float = 0.0
    s: float = 0.0
    a_q0: float = 0.0
    a_qq: float = 0.0
    t: float = 0.0
    a_dq: float = 0.0
    u: float = 0.0
    v: float = 0.0
    a_b: float = 0.0
    a_bp: float = 0.0
    w: float = 2.0
    k_q: float = 0.0
    psi_n_wb: float = 0.0
    i_f_a: float = 0.0

    def keys(self):
        """{key of the twin: value}."""
        return {f"sat_{field.name}": getattr(self, field.name) for field in fields(self)}

    def scaled(self, d, q, flux):
        """The map of a machine whose inductances are d and q times as large, with a stronger magnet.

        Flux over each axis is stretched by the root of its factor, and the current divided by it: the energy stays a function
        of the flux, so the map stays reciprocal. The magnet's flux is then scaled to `flux` times its own.
        """
        kd, kq = d ** 0.5, q ** 0.5
        return replace(self, a_d0=self.a_d0 / kd**2, a_dd=self.a_dd / kd**(self.s + 2), a_q0=self.a_q0 / kq**2,
                       a_qq=self.a_qq / kq**(self.t + 2), a_dq=self.a_dq / (kd**(self.u + 2) * kq**(self.v + 2)),
                       a_b=self.a_b / kd**(self.w + 2), a_bp=self.a_bp / kd**self.w, k_q=self.k_q * d / q,
                       psi_n_wb=self.psi_n_wb * flux, i_f_a=self.i_f_a * flux / d)


def saturation_of(table, electrical, rated_current_a, where):
    """The Saturation of a checked [saturation] table, or None when there is none."""
    given = {key: value for key, value in table.items() if value != MOTOR_TABLES["saturation"][key].default}
    short = {key: value for key, value in given.items() if key in SHORT}
    full = {key: value for key, value in given.items() if key not in SHORT}
    if short and full:
        raise LauncherError(f"{where}: give either loss_d, loss_q, loss_flux or the coefficients sat_..., not both")
    if full:
        return _full(full, where)
    losses = [table[key] for key in SHORT[:3]]
    at_a = 1.5 * rated_current_a if table["at_a"] is BY_RULE else table["at_a"]
    return from_losses(electrical, *losses, at_a, where) if any(losses) else None


def _full(given, where):
    machine = Saturation(**{key.removeprefix("sat_"): value for key, value in given.items()})
    if machine.a_d0 <= 0 or machine.a_q0 <= 0:
        raise LauncherError(f"{where}: sat_a_d0 and sat_a_q0 must both be given and positive")
    if machine.w not in (2, 4):
        raise LauncherError(f"{where}: sat_w is 2 or 4")
    if machine.psi_n_wb == 0 and machine.i_f_a == 0:
        raise LauncherError(f"{where}: neither sat_psi_n_wb nor sat_i_f_a: no magnet")
    return machine


def from_losses(electrical, loss_d, loss_q, loss_flux, at_a, where):
    """The polynomial machine with these losses, or one line that says which of them it cannot have."""
    ld_h, lq_h, flux_wb = electrical["ld_h"], electrical["lq_h"], electrical["flux_wb"]
    a_d0, a_dd = _d_axis(ld_h, flux_wb, loss_d, at_a, where)
    i_f = a_d0 * flux_wb + a_dd * flux_wb**3
    d_axis = Saturation(a_d0=a_d0, a_dd=a_dd, s=2.0, t=2.0, i_f_a=i_f)
    weak_wb = (1 - loss_flux) * flux_wb
    missing_a = i_f - a_d0 * weak_wb - a_dd * weak_wb**3  # what the cross-coupling must make up for

    def machine(psi_q):
        a_dq = 2 * missing_a / (weak_wb * psi_q**2)
        a_q0 = 1 / lq_h - a_dq / 2 * flux_wb**2
        a_qq = (at_a / psi_q - a_q0 - a_dq / 2 * weak_wb**2) / psi_q**2
        return replace(d_axis, a_q0=a_q0, a_qq=a_qq, a_dq=a_dq)

    def excess(psi_q):
        """Incremental L_q beyond what is wanted."""
        g_dd, g_dq, g_qq = inverse_inductances(machine(psi_q), weak_wb, psi_q)
        return g_dd / (g_dd * g_qq - g_dq**2) - (1 - loss_q) * lq_h

    # The flux at at_a lies between that of the lost and of the full inductance. The largest root has the weakest curvature.
    grid = [lq_h * at_a * (1.1 - 0.01 * n) for n in range(95)]
    for upper, lower in zip(grid, grid[1:]):
        if (excess(upper) > 0) != (excess(lower) > 0):
            found = machine(_bisect(excess, lower, upper))
            if found.a_q0 > 0 and found.a_qq > -1e-9 * found.a_q0 / flux_wb**2 and _monotone(found, flux_wb, lq_h * at_a):
                return replace(found, a_qq=max(found.a_qq, 0.0))
    raise LauncherError(f"{where}: the short form cannot lose {loss_q:g} of lq_h with {loss_flux:g} of the flux at {at_a:g} A:"
                        " change loss_q or loss_flux, or give the coefficients")


def _d_axis(ld_h, flux_wb, loss_d, at_a, where):
    """(a_d0, a_dd): 1/ld_h at the magnet's flux, and loss_d less of it at at_a."""
    def inductance(a_dd):
        a_d0 = 1 / ld_h - 3 * a_dd * flux_wb**2

        def beyond(psi):
            return a_d0 * (psi - flux_wb) + a_dd * (psi**3 - flux_wb**3) - at_a
        psi = _bisect(beyond, flux_wb, flux_wb + ld_h * at_a)
        return 1 / (a_d0 + 3 * a_dd * psi**2)

    most = 0.999 / (3 * ld_h * flux_wb**2)
    largest = 1 - inductance(most) / ld_h
    if loss_d > largest:
        raise LauncherError(f"{where}: loss_d {loss_d:g} at {at_a:g} A is more than the short form can give this magnet"
                            f" (at most {largest:.2g})")
    a_dd = _bisect(lambda a: inductance(a) - (1 - loss_d) * ld_h, 0.0, most) if loss_d else 0.0
    return 1 / ld_h - 3 * a_dd * flux_wb**2, a_dd


def inverse_inductances(m, psi_d, psi_q):
    """(G_dd, G_dq, G_qq) of the polynomial machine: derivatives of the currents after the fluxes."""
    return (m.a_d0 + 3 * m.a_dd * psi_d**2 + m.a_dq / 2 * psi_q**2, m.a_dq * psi_d * psi_q,
            m.a_q0 + 3 * m.a_qq * psi_q**2 + m.a_dq / 2 * psi_d**2)


def flux_at(m, i_d, i_q, flux_wb):
    """(psi_d, psi_q) of the polynomial machine at a current, from its flux without current."""
    psi_d, psi_q = flux_wb, 0.0
    for _ in range(100):
        g_dd, g_dq, g_qq = inverse_inductances(m, psi_d, psi_q)
        off_d = i_d + m.i_f_a - psi_d * (m.a_d0 + m.a_dd * psi_d**2 + m.a_dq / 2 * psi_q**2)
        off_q = i_q - psi_q * (m.a_q0 + m.a_qq * psi_q**2 + m.a_dq / 2 * psi_d**2)
        share = 1 / (g_dd * g_qq - g_dq**2)
        psi_d, psi_q = psi_d + share * (g_qq * off_d - g_dq * off_q), psi_q + share * (g_dd * off_q - g_dq * off_d)
    return psi_d, psi_q


def flux_at_rest(m):
    """The flux in d without current, of any machine."""
    def current(psi):
        off = abs(psi - m.psi_n_wb) ** m.w
        return psi * (m.a_d0 + m.a_dd * psi**m.s) + m.a_b * off / (1 + m.a_bp * off) * (psi - m.psi_n_wb) - m.i_f_a
    return _bisect(current, 0.0, MOTOR_TABLES["electrical"]["flux_wb"].high)


def inverse_at_rest(m, flux_wb):
    """(1 / L_d, 1 / L_q), incremental, without current, where the flux is `flux_wb` in d: of any machine, bridges included."""
    off = abs(flux_wb - m.psi_n_wb) ** m.w
    bridge = m.a_b * off / (1 + m.a_bp * off)
    cross = m.a_dq / (m.u + 2) * flux_wb ** (m.u + 2) if m.v == 0 else 0.0
    return (m.a_d0 + (m.s + 1) * m.a_dd * flux_wb**m.s + bridge * (1 + m.w / (1 + m.a_bp * off)),
            m.a_q0 + cross + m.k_q * bridge)


def _monotone(m, flux_wb, reach_wb):
    """Whether current determines flux for every flux within twice the reach of at_a."""
    for n in range(-20, 21):
        for k in range(21):
            g_dd, g_dq, g_qq = inverse_inductances(m, flux_wb + n / 10 * reach_wb, k / 10 * reach_wb)
            if g_dd <= 0 or g_dd * g_qq <= g_dq**2:
                return False
    return True


def _bisect(function, low, high):
    rises = function(high) > function(low)
    for _ in range(200):
        middle = (low + high) / 2
        exact = middle in (low, high)  # no number lies between them: what follows changes nothing
        if (function(middle) > 0) == rises:
            high = middle
        else:
            low = middle
        if exact:
            break
    return (low + high) / 2
