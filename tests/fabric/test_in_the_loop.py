# SPDX-License-Identifier: MIT
"""The verilated RTL in the twin: the image drives the motor as with the C models, within bounds docs/fabric.md explains."""
import numpy as np
import pytest

from launcher import LauncherError, simulate
from launcher.probes import code_of

END_S, ON_S, SPEED_S = 2.35, 0.15, 2.0
STEPS = [{"t_s": ON_S, "console": "on"}, {"t_s": SPEED_S, "console": "speed 1000"}]
# What a row may differ by: while the start feels for the rotor, which friction holds and lets go, and then. Measured: 4.1 A and
# 5.8 rad/s and 0.024 rad, then 0.03 A and 0.02 rad/s.
STARTING = {"i_a_A": 6.0, "i_b_A": 6.0, "i_c_A": 6.0, "vbus_V": 0.08, "speed_rad_s": 9.0, "theta_mech_rad": 0.04,
            "torque_Nm": 0.25, "winding_C": 0.02}
RUNNING = {"i_a_A": 0.15, "i_b_A": 0.15, "i_c_A": 0.15, "vbus_V": 0.01, "speed_rad_s": 0.2, "theta_mech_rad": 0.02,
           "torque_Nm": 0.01, "winding_C": 0.02}


# drivers with an input and an enable for each leg, which make the firmware's dead time of 1 us themselves
IN_EN = {"inverter": {"bridge": {"in_en": 1, "turn_on_delay_s": 1.12e-6, "turn_off_delay_s": 0.12e-6}}}


def play(folder, fabric, end_s=END_S, sensors="", overrides=None, spread=1):
    steps = [step for step in STEPS if step["t_s"] < end_s]
    plan = {"key": "loop", "end_s": end_s, "preamble_s": 0.05, "step": steps}
    return simulate(plan, out_dir=folder, fabric=fabric, sensors=sensors, overrides=overrides, spread=spread)


@pytest.fixture(scope="module", params=[None, IN_EN], ids=["gates", "in_en"])
def both(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("loop")
    return play(folder / "model", "model", overrides=request.param), play(folder / "rtl", "rtl", overrides=request.param)


def test_the_console_says_the_same(both):
    model, rtl = both
    assert rtl.console == model.console and "ok" in rtl.console


def test_the_trace_is_the_models_within_bounds(both):
    model, rtl = both
    assert len(model.trace["t_s"]) == len(rtl.trace["t_s"]) > 1000
    running = model.trace["t_s"] > SPEED_S
    assert set(model.trace["state"][running]) == {code_of(model.enums["state"], "OPERATION_ENABLED")}
    for rows, bounds in ((running, RUNNING), (~running, STARTING)):
        for column, bound in bounds.items():
            assert np.max(np.abs(model.trace[column] - rtl.trace[column])[rows]) <= bound, column


def test_a_driver_s_own_dead_time_is_as_good_as_the_fabric_s(tmp_path):
    """The same switches at the same instants, but for the first after each start; the phases' voltages are no others."""
    bare = {"inverter": {"bridge": {**IN_EN["inverter"]["bridge"], "in_en": 0, "turn_on_delay_s": 0.12e-6}}}
    gates, in_en = (play(tmp_path / str(n), "model", overrides=of, spread=0) for n, of in enumerate((bare, IN_EN)))
    running = gates.trace["t_s"] > SPEED_S
    for column, bound in RUNNING.items():
        assert np.max(np.abs(gates.trace[column] - in_en.trace[column])[running]) <= bound, column
    assert np.ptp(in_en.trace["i_a_A"]) > 5


def test_it_moves(both):
    """So that the bounds mean something."""
    _, rtl = both
    assert np.ptp(rtl.trace["i_a_A"]) > 5 and np.ptp(rtl.trace["speed_rad_s"]) > 90


def test_rows_are_late_by_the_bus_alone(both):
    model, rtl = both
    late_s = rtl.trace["t_s"] - model.trace["t_s"]
    assert np.ptp(late_s) < 1e-9 and 0 < late_s[0] < 100e-9


@pytest.mark.parametrize("sensors", ["", "amc1306"])
def test_clocks_at_once_are_what_they_are_one_by_one(tmp_path, monkeypatch, sensors):
    """The library itself compares all of its state behind each stretch, and ends the run on a difference."""
    quick = play(tmp_path / "quick", "rtl", 0.2, sensors)
    monkeypatch.setenv("MSSFOC_EVERY_CLOCK", "1")
    checked = play(tmp_path / "checked", "rtl", 0.2, sensors)
    for column in quick.trace:
        assert np.array_equal(quick.trace[column], checked.trace[column], equal_nan=True), column


def test_another_word_is_refused(tmp_path):
    with pytest.raises(LauncherError, match="FABRIC 'fpga' is neither model, .* nor rtl"):
        play(tmp_path, "fpga")


def test_without_the_library(tmp_path, monkeypatch):
    from launcher import qemu
    monkeypatch.setitem(qemu.FABRICS, "rtl", ["fabric/none.so"])
    with pytest.raises(LauncherError, match=r"none.so is missing: run make axis first"):
        play(tmp_path, "rtl")
