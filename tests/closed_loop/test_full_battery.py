# SPDX-License-Identifier: MIT
"""A supply that stands just below v_max_mv: braking is what the windings burn, and nothing is burnt for nothing. Currents,
torque and bus are the plant's."""
import numpy as np
import pytest

from launcher import simulate
from launcher.drive import load_drive

RPM = np.pi / 30
TEKNIC = "teknic_m2310p"


class Run:
    """On at such a supply, up to a share of the largest speed, and half a second later a command, with so much of rated torque
    driving the shaft from a quarter of a second before it on."""

    def __init__(self, tmp_path, motor, of_v_max, sinks, then, after_s, speed=1.0, source=0, hoist=0.0, **overrides):
        aligned = source == 0
        self.names = load_drive(motor, overrides, aligned=aligned).names()
        run_s = 0.05 + speed * self.names["speed_max_rpm"] / self.names["ramp_rpm_s"]
        on, self.rpm = "OPERATION_ENABLED", round(speed * self.names["speed_max_rpm"])
        steps = [{"t_s": 0.10, "event": "supply_v", "args": [f"{of_v_max} * v_max_V"]},
                 {"t_s": 0.11, "event": "supply_sinks", "args": [str(sinks)]},
                 {"t_s": 0.12, "console": f"set angle_source {source}"}, {"t_s": 0.15, "console": "on"},
                 {"t_s": 0.05, "after_state": on, "console": f"speed {self.rpm}"},
                 {"t_s": run_s + 0.5, "after_state": on, "event": "load_nm", "args": [f"{-hoist} * rated_torque_Nm"]},
                 {"t_s": run_s + 0.8, "after_state": on, "console": then},
                 {"t_s": run_s + 0.8 + after_s, "after_state": on, "event": "end"}]
        self.result = simulate({"key": "battery", "end_s": 8 + after_s, "preamble_s": 0.05, "step": steps}, motor,
                               out_dir=tmp_path, aligned=aligned, overrides=overrides)
        trace = self.trace = self.result.trace
        code = {name: number for number, name in self.result.enums["state"].items()}[f"AXIS_{on}"]
        self.then_s = trace["t_s"][np.flatnonzero(trace["state"] == code)[0]] + run_s + 0.8
        self.steady = trace.between(self.then_s - 0.75 if hoist == 0 else self.then_s - 0.2, self.then_s)
        self.v_max = self.result.drive.params["v_max_mv"] / 1000

    def whole(self):
        """Nothing is wrong, ever, and in operation the bus is below v_max."""
        faults = {self.result.enums["fault"][int(code)] for code in np.unique(self.trace["fault"])}
        running = self.trace.between(self.then_s - 1, self.trace["t_s"][-1])
        assert faults == {"FAULT_NONE"} and running["vbus_V"].max() < self.v_max
        assert "warning: bus at " in self.result.console

    def powers(self, part):
        """(what the shaft gives, what the windings burn of it), W, in the mean."""
        ohm = self.result.drive.params["resistance_mohm"] / 1000
        burnt = ohm * sum(part[f"i_{phase}_A"] ** 2 for phase in "abc")
        return -np.mean(part["torque_Nm"] * part["speed_rad_s"]), np.mean(burnt)


@pytest.mark.parametrize("motor, source, of_v_max, sinks", [
    (TEKNIC, 0, 0.97, 1), (TEKNIC, 0, 0.97, 0), (TEKNIC, 0, 0.99, 1), (TEKNIC, 0, 0.995, 0), ("maxon_ec45flat", 0, 0.98, 0),
    ("hoverboard_350w", 2, 0.97, 1), ("maxon_ec45flat", 1, 0.975, 1)])
def test_at_steady_speed_nothing_is_burnt_and_a_stop_burns_what_it_returns(motor, source, of_v_max, sinks, tmp_path):
    run = Run(tmp_path, motor, of_v_max, sinks, "quickstop", 0.25, source=source)
    run.whole()
    assert abs(run.steady["i_d_ref_A"].mean()) < 0.02 * run.names["rated_current_A"]
    stop = run.trace.between(run.then_s + 0.03, run.then_s + 0.25)
    fast = stop["speed_rad_s"] / RPM > 0.3 * run.rpm
    assert fast.any()
    returned, burnt = run.powers({name: stop[name][fast] for name in ("i_a_A", "i_b_A", "i_c_A", "torque_Nm", "speed_rad_s")})
    assert returned > 0.02 * run.names["rated_torque_Nm"] * run.rpm * RPM
    if of_v_max < 0.985:  # nearer to v_max what is returned follows what is burnt more slowly
        assert 0.5 * returned < burnt < 1.3 * returned
