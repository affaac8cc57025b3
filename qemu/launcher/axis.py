# SPDX-License-Identifier: MIT
"""One motor of a run: what its drive is told, what is to happen to it, and what the twin writes of it."""
import numpy as np

from .errors import LauncherError
from .kind import Run
from .load import CURRENT_LOOP
from .params import check_ranges, ranges_of
from .paths import shown
from .probes import add_belief, code_of, make_probes
from .scenario import load_scenario
from .trace import add_truth, load_trace

ENDS_S = 1e-6  # behind the last row of an axis that ends before the run


class Axis:
    """Axis `number`, from 0, whose variables `symbols` has; its files are in `folder`."""

    def __init__(self, number, drive, scenario, symbols, folder):
        self.number, self.drive, self.scenario, self.symbols, self.folder = number, drive, scenario, symbols, folder
        self.plan = load_scenario(scenario, drive)
        check_ranges(drive, ranges_of(symbols))
        self.probes, self.enums = make_probes(symbols, drive)
        self.files = {}  # {item of the twin's configuration: path}

    def finished(self, console, log, why, others):
        """The Run, from what the twin has written; `why` is where QEMU's own words are. Another axis may have gone on for
        longer, which is no part of this one's scenario."""
        trace = load_trace(self.files["trace"])
        self.plan = as_held(self.plan, self.scenario, self.drive, trace, self.enums)
        if trace["t_s"][-1] < self.plan.end_s - 2e-3 and not self.plan.may_end_early:
            raise LauncherError(f"the run ended at {trace['t_s'][-1]:.4f} s instead of {self.plan.end_s:g} s"
                                f" (see {shown(why)})")
        check_numbers(trace)
        if others:
            trace = trace.between(0, self.plan.end_s + ENDS_S)
        add_truth(trace, self.drive.motor["electrical"]["pole_pairs"])
        add_belief(trace)
        starts_s = log["t_s"][log["exception"] == CURRENT_LOOP + self.number]
        return Run(trace, console, self.drive, self.enums, self.plan.names, self.plan.steps, starts_s)


def as_held(plan, scenario, drive, trace, enums):
    """The plan with the instants at which its holds were over. The twin sees a state when the row after its own begins."""
    held_s = {}
    for hold in plan.holds:
        row = 0
        for state in hold.states:
            found = np.flatnonzero(trace["state"][row:] == code_of(enums["state"], state))
            if len(found) == 0:
                break
            row += int(found[0])
        else:
            held_s[hold.label] = float(trace["t_s"][min(row + 1, len(trace["t_s"]) - 1)])
    return load_scenario(scenario, drive, held_s) if held_s else plan


def check_numbers(trace):
    """A plant that has left the numbers is a defect of the twin: no figure of such a run means anything."""
    bad = np.flatnonzero(~np.isfinite(trace["i_a_A"] + trace["speed_rad_s"] + trace["vbus_V"]))
    if len(bad):
        raise LauncherError(f"the simulated plant has no numbers any more from {trace['t_s'][bad[0]]:.6f} s on")
