# SPDX-License-Identifier: MIT
"""An encoder that fails while the motor turns, and a drive that is to carry on: speed, angle, current by the plant's truth."""
import re

import numpy as np
import pytest

from rigs.loaded_run import Outcome
from rigs.loaded_run import play as supervised

TEKNIC, HOVERBOARD, THOR = "teknic_m2310p", "hoverboard_350w", "thor_pmsyrm"
CHOICES = [f"reaction {cause} carry" for cause in ("encoder", "encoder_slip", "encoder_dead", "encoder_counts")]
SPEED_BAND = 8.0       # percent of the largest speed, at any time
SPEED_LATER = 2.0      # and from 0.1 s on
SETTLED_S = 0.015      # from the fault: then the hand-over is a few milliseconds ago
ANGLE_PEAK_DEG = 15.0  # from then on
OVERSHOOT = 0.03       # of i_trip, within the sample period in which it is passed
WATCH_S = 0.25


def play(tmp_path, motor, share, load, happens, later=(), watch_s=WATCH_S):
    """As in test_supervision.py, where the drive may carry on."""
    return supervised(tmp_path, motor, share, load, happens, CHOICES, until_s=watch_s, later=later, judge=Carried)[1]


class Carried(Outcome):
    """With the angle, and what the console said."""

    def __init__(self, result, names, rpm, at_s):
        super().__init__(result, names, rpm, at_s)
        trace, self.console = result.trace, result.console
        later = trace["t_s"] >= at_s + SETTLED_S
        electrical = names["pole_pairs"] * trace["theta_mech_rad"][later]
        off = np.degrees((trace["angle_fw_rad"][later] - electrical + np.pi) % (2 * np.pi) - np.pi)
        self.angle_deg = float(np.abs(off).max())
        self.leads = bool((trace["observer_leads"][later] > 0.5).all())
        late = trace["t_s"] >= at_s + 0.1
        error = np.abs(trace["speed_rad_s"][late] * 30 / np.pi - rpm)
        self.late_percent = 100 * float(error.max(initial=0.0)) / names["speed_max_rpm"]
        self.last_rpm = float(trace["speed_rad_s"][-1]) * 30 / np.pi

    def __repr__(self):
        return f"{super().__repr__()}, later {self.late_percent:.1f} %, angle {self.angle_deg:.1f}, on {self.still_on}"


CASES = [
    # motor, speed, load, what happens, warnings
    (TEKNIC, 1.0, 0.5, ("encoder_cut", 1), "encoder"),
    (TEKNIC, 1.0, 0.5, ("encoder_freeze", 1), "encoder dead"),
    (TEKNIC, 1.0, 0.5, ("encoder_slip", 180), "encoder slip"),
    (TEKNIC, 0.5, 1.0, ("encoder_slip", -90), "encoder slip"),
    (TEKNIC, 0.5, 1.0, ("encoder_slip", 18), "encoder counts"),
    (HOVERBOARD, 1.0, 0.5, ("encoder_freeze", 1), "encoder dead"),
    (THOR, 0.5, 1.0, ("encoder_slip", 90), "encoder slip"),
    ("qs138_3kw", 1.0, 0.5, ("encoder_freeze", 1),
     "oscillation, encoder dead"),  # its coupling rings as it speeds up, before anything fails: the plant's truth
]


@pytest.mark.parametrize("motor, share, load, happens, said", CASES)
def test_the_observer_carries_on(motor, share, load, happens, said, tmp_path):
    seen = play(tmp_path, motor, share, load, happens)
    assert seen.fault == "NONE" and seen.still_on and seen.leads, seen
    assert ", ".join(re.findall("warning: (.*)", seen.console.replace("\r", ""))) == said
    assert seen.error_percent <= SPEED_BAND and seen.late_percent <= SPEED_LATER, seen
    assert seen.angle_deg <= ANGLE_PEAK_DEG and seen.peak_share <= 1 + OVERSHOOT, seen


@pytest.mark.parametrize("happens, fault", ((("encoder_cut", 1), "ENCODER"), (("encoder_freeze", 1), "ENCODER_DEAD"),
                                            (("encoder_slip", 90), "ENCODER_SLIP")))
def test_below_the_observers_reach_it_is_off_by_the_encoders_name(happens, fault, tmp_path):
    seen = play(tmp_path, TEKNIC, 0.1, 1.0, happens, watch_s=0.06)
    assert seen.fault == fault and not seen.still_on and "warning:" not in seen.console, seen


def test_it_turns_round_without_the_encoder_and_does_not_go_back_to_it_before_it_works(tmp_path):
    """Through zero on a prescribed field, with status; then `on` begins with an encoder whose lines are open."""
    later = [(0.1, {"console": "status"}), (0.15, {"console": "speed -2000"}), (1.09, {"console": "status"}),
             (1.1, {"console": "speed 0"}), (2.0, {"console": "off"}), (2.1, {"console": "on"})]
    seen = play(tmp_path, TEKNIC, 0.5, 0.1, ("encoder_cut", 1), later, watch_s=2.4)
    said = seen.console.replace("\r", "")
    one_way, other_way = said.split("> status\n")[1:]
    for status, rpm in ((one_way, 2000), (other_way, -2000)):
        assert "the observer leads" in status and "warning: encoder\n" in status
        assert abs(float(re.search(r"speed: (\S+) rpm", status)[1]) - rpm) < 20
    assert "fault:" not in said.split("> on\n")[1].replace("fault: none", "")
    assert seen.fault == "ENCODER" and not seen.still_on and "fault: encoder;" in said.split("> on\n")[2]
