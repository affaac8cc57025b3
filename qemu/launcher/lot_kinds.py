# SPDX-License-Identifier: MIT
"""The kinds of machine that lots are drawn from: docs/lots.md says after which published motors.

Sizes are those of the air gap, from which lot_machine.py works out the rest.
"""
from dataclasses import dataclass

LOW = {"12": 2, "24": 4, "36": 2, "48": 3, "72": 1}
INDUSTRY = {"48": 1, "72": 1, "150": 1, "310": 3, "325 mains": 2, "565 mains": 2, "600": 2}


@dataclass(frozen=True)
class Kind:
    """Pairs are ranges; `volts` are supplies by weight (lot_stage.py), `sensors` what tells the angle, by weight."""
    weight: int
    bore_m: tuple          # diameter of the air gap
    slimness: tuple        # length of the stack over that
    pole_pairs: tuple
    slots: tuple           # a pole and phase: 1 and more is a distributed winding
    speed_m_s: tuple       # of the rotor's surface at rated speed
    volts: dict
    cooling_w_m2k: tuple   # of the outer surface
    sheet_mm: tuple        # thickness of the laminations
    sensors: dict
    outer: bool = False    # the rotor is outside
    slotless: bool = False
    buried: tuple = None   # magnets inside iron: psi / (L_q - L_d), in shares of i_max
    heavier: tuple = (0.45, 1.0)  # inertia, by that of a solid rotor or of the bare ring
    rated: tuple = (0.85, 1.0)    # current, by what the heat allows
    beyond: tuple = (1.2, 2.2)    # largest speed, by rated


KINDS = {
    "servo": Kind(5, (0.018, 0.11), (0.5, 1.8), (2, 3, 4, 4, 5), (0.4, 0.5, 1), (3.5, 11), {**LOW, **INDUSTRY}, (14, 30),
                  (0.35, 0.5), {"encoder": 8, "hall": 1, "none": 1}),
    "interior": Kind(5, (0.05, 0.15), (0.6, 1.5), (2, 3, 3, 4, 5), (0.5, 2, 2, 3), (6, 14), INDUSTRY, (14, 35), (0.35, 0.5),
                     {"encoder": 8, "none": 2}, buried=(0.6, 5), beyond=(1.5, 3)),
    "assisted": Kind(3, (0.06, 0.15), (0.7, 1.6), (2, 2, 3), (2, 3), (6, 14), INDUSTRY, (14, 35), (0.35, 0.5),
                     {"encoder": 8, "none": 2}, buried=(0.12, 0.7), beyond=(1.5, 3.5)),
    "spindle": Kind(3, (0.015, 0.06), (0.8, 2), (1, 2, 2), (1, 2), (12, 40), {**LOW, "150": 1, "310": 2, "325 mains": 1},
                    (20, 60), (0.2, 0.35), {"encoder": 5, "hall": 2, "none": 3}),
    "gimbal": Kind(3, (0.02, 0.08), (0.12, 0.45), (7, 7, 11, 14), (0.29, 0.36, 0.38), (0.25, 1.0), {"12": 3, "24": 2}, (10, 22),
                   (0.2, 0.35), {"encoder": 9, "none": 1}, outer=True, heavier=(1.3, 2.5), rated=(0.4, 1.0)),
    "hub": Kind(3, (0.09, 0.21), (0.12, 0.3), (10, 15, 20, 23), (0.3, 0.36, 0.4), (2.2, 6),
                {"24": 1, "36": 3, "48": 3, "72": 2}, (6, 14), (0.35, 0.5), {"encoder": 4, "hall": 6}, outer=True,
                heavier=(1.3, 2.5)),
    "traction": Kind(4, (0.075, 0.18), (0.4, 1.2), (3, 4, 5, 5), (0.4, 0.5, 2), (8, 18),
                     {"48": 3, "72": 2, "96": 2, "150": 1, "310": 2, "400": 3}, (12, 120), (0.2, 0.35),
                     {"encoder": 7, "hall": 3}, buried=(1, 12), beyond=(1.5, 3.5)),
    "outrunner": Kind(4, (0.022, 0.09), (0.12, 0.5), (5, 7, 7, 8, 14, 21), (0.29, 0.36, 0.4, 0.5), (6, 16), LOW, (12, 35),
                      (0.2, 0.2), {"encoder": 6, "hall": 2, "none": 2}, outer=True, heavier=(1.3, 2.5)),
    "slotless": Kind(3, (0.005, 0.019), (1.5, 3), (1, 1, 2), (1,), (8, 22), {"12": 2, "24": 3, "36": 1, "48": 1}, (14, 25),
                     (0.1, 0.2), {"encoder": 6, "hall": 2, "none": 2}, slotless=True, beyond=(1.3, 2.2)),
}
