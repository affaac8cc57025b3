# SPDX-License-Identifier: MIT
"""Two motors on one core: each turns as it is told, a fault stops one of them, what is the device's concerns both, and their
interrupts keep out of each other's way."""
import numpy as np
import pytest

from launcher import simulate
from launcher.load import CURRENT_LOOP, SECOND_LOOP, load_irqlog
from launcher.trace import load_trace
from rates.builds import OWN_HZ, build_of

FIRST, SECOND = "teknic_m2310p", "maxon_ec22"
PERIOD_S = 1 / OWN_HZ
ON = [{"t_s": 0.25, "label": "on", "console": "on"},
      {"t_s": "on + on_time_s", "label": "started", "hold_for": "OPERATION_ENABLED"}]
TURNS = {"key": "turns", "end_s": "started + 0.8", "preamble_s": 0.05, "step": [
    *ON, {"t_s": "started + 0.05", "console": "speed 1000"}, {"t_s": "started + 0.75", "console": "status"}]}
FAILS = {"key": "fails", "end_s": "started + 0.6", "preamble_s": 0.05, "step": [
    *ON, {"t_s": "started + 0.05", "console": "speed -600"},
    {"t_s": "started + 0.5", "label": "fault", "event": "driver_fault", "args": ["1"]},
    {"t_s": "started + 0.55", "console": "on"}], "expect_refusal": "on: .*fault"}


def play(out_dir, first, second, motor=SECOND):
    build = build_of(OWN_HZ, "mssfoc.elf", "mssfoc.hex", folder="two-axes", AXES=2)
    return simulate(first, FIRST, build=build, out_dir=out_dir, plant="ideal", spread=0, aligned=True,
                    second={"motor": motor, "scenario": second})


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return play(tmp_path_factory.mktemp("two"), TURNS, FAILS)


def test_each_turns_as_it_is_told(run):
    fault_s = run.second.scenario.names["fault"]
    first, second = run.trace.between(fault_s - 0.05, fault_s), run.second.trace.between(fault_s - 0.05, fault_s)
    assert first["speed_rpm"].mean() == pytest.approx(1000, rel=0.005)
    assert second["speed_rpm"].mean() == pytest.approx(-600, rel=0.005)
    assert run.passed and run.second.passed


def test_a_fault_of_one_leaves_the_other_alone(run):
    fault_s, ends_s = run.second.scenario.names["fault"], run.scenario.end_s
    after = run.second.trace.between(fault_s + 2 * PERIOD_S, run.second.scenario.end_s)
    assert not after["gate_live"].any() and after["fault"][-1] != 0
    first = run.trace.between(fault_s, ends_s)
    assert first["gate_live"].all() and not run.trace["fault"].any()
    assert first["speed_rpm"].min() > 990 and first["speed_rpm"].max() < 1010


def test_each_has_its_own_part_of_the_console(run):
    assert "\nfault: gate driver" in run.second.console and "fault: gate" not in run.console
    assert "> speed -600\nok" in run.second.console and "> speed 1000\nok" in run.console
    assert "\nstate: operation enabled" in run.console and "\nstate: " not in run.second.console


def test_the_second_samples_a_quarter_of_a_period_before_the_first(run):
    whole = [load_trace(result.out_dir / "trace.bin")["t_s"] for result in (run, run.second)]
    apart_s = (whole[0][-100:, None] - whole[1][None, -100:]) % PERIOD_S
    np.testing.assert_allclose(apart_s, PERIOD_S / 4, atol=2e-9)


def test_neither_loop_waits_for_the_other(run):
    log, started_s = load_irqlog(run.irqlog), [result.scenario.names["started"] for result in (run, run.second)]
    for exception in (CURRENT_LOOP, SECOND_LOOP):
        rows = (log["exception"] == exception) & (log["t_s"] > max(started_s))
        assert np.diff(log["t_s"][rows]).max() < 1.02 * PERIOD_S
        assert log["start_ns"][rows].max() < 1000 and log["latency_cycles"][rows].min() > 100
    assert run.load.rest_percent > 50 and run.load.second_loop.count == pytest.approx(run.load.current_loop.count, rel=0.01)


def test_sto_and_a_reset_are_of_both(tmp_path):
    plan = {"key": "sto", "end_s": "started + 0.3", "preamble_s": 0.05, "step": ON}
    stops = {**plan, "step": [*ON, {"t_s": "started + 0.1", "label": "sto", "event": "sto", "args": ["A", "1"]},
                              {"t_s": "started + 0.2", "label": "reset", "event": "watchdog_reset"}]}
    result = play(tmp_path, plan, stops)
    sto_s, reset_s = (result.second.scenario.names[name] for name in ("sto", "reset"))
    for one in (result, result.second):
        live = one.trace["gate_live"]
        assert live[np.searchsorted(one.trace["t_s"], sto_s) - 1], "it was on until then"
        assert not one.trace.between(sto_s + 1e-3 + PERIOD_S, one.trace["t_s"][-1])["gate_live"].any()
        after = one.trace.between(sto_s, one.trace["t_s"][-1])["t_s"]
        assert np.diff(after).max() > 20 * PERIOD_S, "the reset ends its samples"
        assert one.trace["t_s"][-1] > reset_s + 0.05, "and they come back"


def test_two_of_a_kind_have_noise_of_their_own(tmp_path):
    plan = {"key": "noise", "end_s": 0.2, "preamble_s": 0.05, "step": []}
    result = play(tmp_path, plan, plan, FIRST)
    first, second = (one.trace.between(0.15, 0.19)["i_q_A"] for one in (result, result.second))
    assert first.std() > 0 and second.std() > 0
    alike = [abs(np.corrcoef(first[10:700], second[10 + late:700 + late])[0, 1]) for late in range(-10, 11)]
    assert max(alike) < 0.3, "the same noise, perhaps some samples later"
