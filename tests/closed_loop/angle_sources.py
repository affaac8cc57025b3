# SPDX-License-Identifier: MIT
"""A drive that turns under load, whose angle another source is to tell from some instant on: speed, angle, current by the
plant's truth."""
import numpy as np

from launcher import simulate
from launcher.drive import load_drive

SETTLED_S = 0.015  # from the hand-over on
LATE_S = 0.1


class Seen:
    """What follows the label `at`. `handed_s`: when the angle's source was another one."""

    def __init__(self, result, names, rpm):
        trace, at_s = result.trace, result.scenario.names["at"]
        t = trace["t_s"]
        self.names, self.console = names, result.console.replace("\r", "")
        self.fault = result.figures["faults"].value
        self.still_on = bool(trace["gate_live"][-1] > 0.5)
        after = t >= at_s
        self.trace = {name: column[after] for name, column in trace.items()}
        t = self.trace["t_s"]
        self.since_s = t - at_s
        watched = self.trace["observer_margin"]
        changed = np.flatnonzero((watched > 0) != (watched[0] > 0))
        self.handed_s = float(self.since_s[changed[0]]) if changed.size else 0.0
        self.speed_off = np.abs(self.trace["speed_rad_s"] * 30 / np.pi - rpm) * 100 / names["speed_max_rpm"]
        self.told_off = np.abs(self.trace["speed_fw_rpm"] - self.trace["speed_rad_s"] * 30 / np.pi) * 100
        self.told_off /= names["speed_max_rpm"]
        off = self.trace["angle_fw_rad"] - names["pole_pairs"] * self.trace["theta_mech_rad"]
        self.angle_off = np.abs(np.degrees((off + np.pi) % (2 * np.pi) - np.pi))
        self.peak_share = float(max(np.abs(self.trace[f"i_{phase}_A"]).max() for phase in "abc") / names["i_trip_A"])

    def most(self, column, from_s=0.0):
        return float(column[self.since_s >= from_s].max(initial=0.0))

    @property
    def settled_deg(self):
        return self.most(self.angle_off, self.handed_s + SETTLED_S)

    @property
    def off_ms(self):
        """For how long the gates were off."""
        return 1e3 * float(np.diff(self.since_s)[self.trace["gate_live"][:-1] < 0.5].sum())

    def __repr__(self):
        return (f"{self.fault}, on {self.still_on}, handed over after {1e3 * self.handed_s:.1f} ms, "
                f"gates off {self.off_ms:.1f} ms, speed {self.most(self.speed_off):.1f} % then "
                f"{self.most(self.speed_off, LATE_S):.2f} %, told {self.most(self.told_off):.1f} %, "
                f"angle {self.settled_deg:.1f}, peak {self.peak_share:.2f}")


def play(tmp_path, motor, share, load, steps, source, lines=(), watch_s=0.25, seed=1, overrides=None):
    """Runs up to a share of the largest speed by that source, loads the shaft with a share of rated torque; what follows may
    name the label `at`."""
    aligned = source == 0
    names = load_drive(motor, overrides, aligned=aligned).names()
    rpm = round(share * names["speed_max_rpm"])
    first = [f"set angle_source {source}", *lines]
    before = [{"t_s": 0.1 + 0.001 * n, "console": line} for n, line in enumerate(first)]
    before += [{"t_s": 0.15, "label": "on", "console": "on"},
               {"t_s": "on + 1.5", "label": "started", "hold_for": "OPERATION_ENABLED"},
               {"t_s": "started + 0.01", "label": "up", "console": f"speed {rpm}"},
               {"t_s": f"up + {abs(rpm) / names['ramp_rpm_s'] + 0.2}", "label": "loaded", "event": "load_nm",
                "args": [f"{load} * rated_torque_Nm"]},
               {"t_s": "loaded + 0.15", "label": "at", "console": ""}]
    plan = {"title": "sources of the angle", "preamble_s": 0.05, "end_s": f"at + {watch_s}", "step": [*before, *steps],
            "figure": [{"name": "faults", "kind": "all_faults"}]}
    return Seen(simulate(plan, motor, out_dir=tmp_path, seed=seed, overrides=overrides, aligned=aligned), names, rpm)
