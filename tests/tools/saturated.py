# SPDX-License-Identifier: MIT
"""A saturated machine (qemu/launcher/saturation.py) from its published equations, solved without the twin."""
import math

import numpy as np


def currents(m, d, q):
    """The model, from its published equations."""
    x = math.sqrt((d - m.psi_n_wb)**2 + m.k_q * q * q)
    bridge = m.a_b * x**m.w / (1 + m.a_bp * x**m.w)
    i_d = d * (m.a_d0 + m.a_dd * abs(d)**m.s + m.a_dq / (m.v + 2) * abs(d)**m.u * abs(q)**(m.v + 2))
    i_q = q * (m.a_q0 + m.a_qq * abs(q)**m.t + m.a_dq / (m.u + 2) * abs(d)**(m.u + 2) * abs(q)**m.v)
    return np.array([i_d + bridge * (d - m.psi_n_wb) - m.i_f_a, i_q + m.k_q * bridge * q])


def jacobian(m, psi):
    h = 1e-6 * max(abs(psi[0]), abs(psi[1]), 1e-4)
    return np.array([(currents(m, psi[0] + h, psi[1]) - currents(m, psi[0] - h, psi[1])) / (2 * h),
                     (currents(m, psi[0], psi[1] + h) - currents(m, psi[0], psi[1] - h)) / (2 * h)]).T


def fluxes(m, i_d, i_q, start):
    psi = np.array(start, float)
    for _ in range(100):
        psi -= 0.7 * np.linalg.solve(jacobian(m, psi), currents(m, *psi) - (i_d, i_q))
    assert np.abs(currents(m, *psi) - (i_d, i_q)).max() < 1e-6 * (1 + abs(i_d) + abs(i_q))
    return psi
