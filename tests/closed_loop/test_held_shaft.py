# SPDX-License-Identifier: MIT
"""A shaft that is held and let go, following error and stall only warning: the reference does not run away from it."""
import numpy as np
import pytest

from launcher import simulate
from launcher.drive import load_drive

RPM = np.pi / 30
TEKNIC, EC45 = "teknic_m2310p", "maxon_ec45flat"


def held(tmp_path, motor, commands, held_s, follows_s, **params):
    """Plays lines at seconds after operation began, the shaft held from one of these times to another; (result, t0, counts)."""
    overrides = {"params": params}
    drive = load_drive(motor, overrides, aligned=True)
    go = 0.2 + drive.on_time_s
    steps = [{"t_s": 0.10 + 0.005 * n, "console": f"reaction {fault} warn"} for n, fault in
             enumerate(("stall", "following_error", "speed_deviation"))] + [{"t_s": 0.15, "console": "on"}]
    steps += [{"t_s": go + at_s, "console": line} for at_s, line in commands]
    steps += [{"t_s": go + at_s, "event": "lock", "args": [on]} for at_s, on in zip(held_s, "10")]
    scenario = {"key": "held", "end_s": go + held_s[1] + follows_s, "preamble_s": 0.05,
                "step": sorted(steps, key=lambda step: step["t_s"])}
    result = simulate(scenario, motor, out_dir=tmp_path, overrides=overrides, aligned=True)
    trace, turn = result.trace, drive.motor["encoder"]["counts_per_rev"]
    assert {result.enums["fault"][int(code)] for code in np.unique(trace["fault"])} == {"FAULT_NONE"}
    counts = np.cumsum(np.r_[0, (np.diff(trace["count_fw"]) + turn // 2) % turn - turn // 2])
    return result, go, counts - counts[np.searchsorted(trace["t_s"], go)], turn


@pytest.mark.parametrize("motor, way, when, params", [
    (TEKNIC, 5, 0.1, {}), (TEKNIC, -5, 0.1, {}), (EC45, 5, 0.1, {}), (TEKNIC, 5, 0.0, {}),
    (TEKNIC, 5, 0.3, {"following_mturn": 300}),
    (TEKNIC, -3, 0.3, {"profile_jerk_ms": 5})])  # while farther from its end than the parameter
def test_the_profile_waits_for_a_shaft_that_is_held(motor, way, when, params, tmp_path):
    """Behind it, within the limits of speed; the end is met to the parameter, and in the end to counts."""
    turn = load_drive(motor).motor["encoder"]["counts_per_rev"]
    result, go, counts, _ = held(tmp_path, motor, [(0.02, f"pp by {way * turn}")], (0.02 + when, 1.0 + when), 2.5, **params)
    trace, limit = result.trace, params.get("following_mturn", 100) * turn / 1000
    on_hold = trace.between(go + 0.02 + when, go + 1.0 + when)
    assert 0.98 * limit < np.abs(on_hold["following_counts"]).max() < limit + 3
    after = trace["t_s"] > go + 1.0 + when
    speed = np.abs(trace["speed_rad_s"][after]) / RPM
    assert speed.max() < result.drive.params["speed_max_rpm"]
    assert np.abs(trace["following_counts"][after]).max() <= limit + 3
    beyond = np.sign(way) * counts[after] - abs(way) * turn
    assert beyond.max() < 5 and abs(beyond[-1]) <= 3
    assert "warning: following error" in result.console and "warning: stall" in result.console


def test_a_shaft_held_at_its_target_and_turned_away_comes_back_along_the_profile(tmp_path):
    """Three turns off by a drive from outside."""
    motor, turn = TEKNIC, 4000
    names = load_drive(motor, aligned=True).names()
    go = 0.2 + names["on_time_s"]
    steps = [{"t_s": 0.10, "console": "reaction following_error warn"}, {"t_s": 0.11, "console": "reaction stall warn"},
             {"t_s": 0.15, "console": "on"}, {"t_s": go, "console": "pp 0"},
             {"t_s": go + 0.1, "event": "spin_rad_s", "args": ["18.85"]}, {"t_s": go + 1.1, "event": "spin", "args": ["off"]}]
    result = simulate({"key": "away", "end_s": go + 3, "preamble_s": 0.05, "step": steps}, motor, out_dir=tmp_path,
                      aligned=True)
    trace = result.trace
    counts = np.cumsum(np.r_[0, (np.diff(trace["count_fw"]) + turn // 2) % turn - turn // 2])
    start = counts[np.searchsorted(trace["t_s"], go + 0.1)]
    back = trace["t_s"] > go + 1.1
    assert counts[back][0] - start > 11000
    assert (counts[back] - start).min() > -20 and abs(counts[-1] - start) <= 3
    assert np.abs(trace["following_counts"][back]).max() <= 0.1 * turn + 3


@pytest.mark.parametrize("rad_s", (20, -45))
def test_one_that_is_turned_too_slowly_is_a_following_error(rad_s, tmp_path):
    """By a drive from outside: the profile waits, but no nearer than the error that is one."""
    turn, go = load_drive(TEKNIC).motor["encoder"]["counts_per_rev"], 0.2 + load_drive(TEKNIC, aligned=True).on_time_s
    steps = [{"t_s": 0.10, "console": "reaction stall warn"}, {"t_s": 0.11, "console": "reaction speed_deviation warn"},
             {"t_s": 0.15, "console": "on"}, {"t_s": go, "console": f"pp by {np.sign(rad_s) * 20 * turn}"},
             {"t_s": go + 0.1, "event": "spin_rad_s", "args": [str(rad_s)]}]
    result = simulate({"key": "slow", "end_s": go + 0.4, "preamble_s": 0.05, "expect_refusal": ".*", "step": steps}, TEKNIC,
                      out_dir=tmp_path, aligned=True)
    assert "FAULT_FOLLOWING_ERROR" in {result.enums["fault"][int(code)] for code in np.unique(result.trace["fault"])}


def test_set_points_of_a_master_are_followed_again_no_faster_than_the_largest_error_asks(tmp_path):
    """The reference is the master's: the drive names the error, and comes behind it by a following_mturn's speed."""
    lines = [(0.02 + 0.01 * n, f"csp {200 * n}") for n in range(60)]
    result, go, counts, turn = held(tmp_path, TEKNIC, lines, (0.15, 0.5), 2.0)
    trace = result.trace
    assert "warning: following error" in result.console
    after = trace["t_s"] > go + 0.5
    gain = 2 * np.pi * load_drive(TEKNIC).params["speed_bw_hz"] / 5
    most_rpm = 300 + gain * 0.1 * 60
    assert (trace["speed_rad_s"][after] / RPM).max() < 1.5 * most_rpm
    assert counts[-1] == pytest.approx(59 * 200, abs=5) and counts[after].max() < 59 * 200 + 20
