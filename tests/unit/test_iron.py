# SPDX-License-Identifier: MIT
"""How well q's inductance, as tune_iron() has it over the current, follows machines whose iron is known."""
import math

import numpy as np
import pytest
from launcher.data import load_motor

from rigs.motor_numbers import compute, shipped
from tools.saturated import fluxes, jacobian


def mtpa(told, i_a):
    """(i_d, i_q) of the firmware's MTPA: firmware/settings/mtpa.h, of a machine with more inductance in q."""
    psi_wb, difference_h = told["flux_uwb"] * 1e-6, (told["lq_apparent_uh"] - told["ld_apparent_uh"]) * 1e-6
    i_d_a = (psi_wb - math.hypot(psi_wb, math.sqrt(8) * difference_h * i_a)) / (4 * difference_h)
    return i_d_a, math.sqrt(i_a**2 - i_d_a**2)


def believed_h(told, tuning, i_q_a):
    """L_q as follow_iron() takes it."""
    i_q15 = round(i_q_a * 32768e3 / told["i_range_ma"])
    stiffness_q15 = tuning.iron_rest_q15 + ((i_q15 * i_q15 >> 15) * tuning.iron_grows_q10 >> 10)
    return told["lq_uh"] * 1e-6 * 32768 / stiffness_q15


@pytest.mark.parametrize("name", ["thor_pmsyrm", "baldor_ecs101m0h7ef4"])
def test_qs_inductance_follows_the_iron_along_mtpa(c, name):
    """Within 11 % of the incremental inductance up to 1.2 times rated current, as the comment of tune_iron() says."""
    told, motor = shipped(name), load_motor(name)
    tuning, machine = compute(c, told)[2], motor.saturation()
    psi, worst = (motor["electrical"]["flux_wb"], 0.0), 0.0
    for share in np.linspace(0, 1.2, 49)[1:]:
        i_d_a, i_q_a = mtpa(told, share * motor["rating"]["rated_current_a"])
        psi = fluxes(machine, i_d_a, i_q_a, psi)
        l_q_h = np.linalg.inv(jacobian(machine, psi))[1, 1]
        worst = max(worst, abs(believed_h(told, tuning, i_q_a) / l_q_h - 1))
    assert 0.09 < worst < 0.11
