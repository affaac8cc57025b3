# SPDX-License-Identifier: MIT
"""What is beyond a limit matters while the bridge is on: before, it raises no fault; at the first sample, it is found."""
import numpy as np
import pytest

from launcher import simulate

from rigs.steps import faults

ON_S = 0.15
ZERO_MEASURED_S = 0.4e-3  # before the gates open: the sensors' zero is known, one that is off now stays off

BEYOND = {
    "a current": [("sensor_add", ["A", "i_trip_A + 1"])],
    "the sum of the currents": [("sensor_add", ["A", "0.4 * i_trip_A"])],
    "bus high": [("supply_v", ["v_max_V + 2"])],
    "bus low": [("supply_v", ["v_min_V - 2"])],
}


def events(t_s, kinds):
    return [{"t_s": t_s, "event": kind, "args": args} for kind, args in kinds]


def play(tmp_path, end_s, *steps):
    steps = sorted([step for part in steps for step in part], key=lambda step: step["t_s"])
    return simulate({"key": "switch_on", "end_s": end_s, "preamble_s": 0.05, "step": steps}, out_dir=tmp_path,
                    plant="ideal", spread=0)


def typed(*lines):
    return [{"t_s": t_s, "console": text} for t_s, text in lines]


def state_at(result, t_s):
    return result.enums["state"][int(result.trace.between(t_s, t_s + 200e-6)["state"][0])]


def live_s(result):
    """When the trace shows the gates open."""
    return result.trace["t_s"][result.trace["gate_live"] > 0]


@pytest.fixture(scope="module")
def opens_s(tmp_path_factory):
    """The first row with the gates open, when nothing is wrong."""
    result = play(tmp_path_factory.mktemp("undisturbed"), 0.4, typed((ON_S, "on")))
    live = live_s(result)
    assert not faults(result) and len(live) == np.count_nonzero(result.trace["t_s"] >= live[0])
    return float(live[0])


@pytest.mark.parametrize("case", [*BEYOND, "an overrun"])
def test_nothing_is_wrong_while_the_bridge_is_off(case, tmp_path):
    """Before the first switching on, when no limit is set, and after one, when they are; then the drive starts as ever."""
    begin = BEYOND.get(case, [("irq_block", ["1"])])
    end = [("sensor_add", ["A", "0"]), ("supply_v", ["vbus_V"]), ("irq_block", ["0"])]
    result = play(tmp_path, 2.9, events(0.12, begin), events(0.14, end), typed((ON_S, "on"), (2.15, "off")),
                  events(2.17, begin), events(2.25, end), typed((2.32, "on")))
    assert not faults(result)
    for from_s, to_s in ((0.0, ON_S), (2.152, 2.32)):
        assert not result.trace.between(from_s, to_s)["gates"].any()
        assert state_at(result, to_s - 1e-3) == "AXIS_SWITCH_ON_DISABLED"
    assert state_at(result, 2.14) == state_at(result, 2.89) == "AXIS_OPERATION_ENABLED"


# parameters of a first switching on, those of a second, and what is beyond the limits of the first alone
TWO_LIMITS = {
    "a current": (["i_max_ma 1000", "i_align_ma 1000", "i_trip_ma 1300"], "i_trip_ma 20000", ("sensor_add", ["A", "-1.5"])),
    "the sum of the currents": ([], "i_trip_ma 20000", ("sensor_add", ["A", "-4.5"])),
    "bus high": ([], "v_max_mv 45000", ("supply_v", ["v_max_V + 2"])),
    "bus low": ([], "v_min_mv 15000", ("supply_v", ["v_min_V - 2"])),
}


@pytest.mark.parametrize("case", TWO_LIMITS)
def test_the_limits_are_those_of_the_last_switching_on(case, opens_s, tmp_path):
    first, second, (kind, args) = TWO_LIMITS[case]
    again_s = 0.25 + ON_S
    again_opens_s = 0.25 + opens_s
    lines = [(0.12 + 0.005 * n, "set " + line) for n, line in enumerate(first)]
    lines += [(ON_S, "on"), (0.282, "off"), (0.36, "set " + second), (again_s, "on")]
    event_s = again_opens_s - ZERO_MEASURED_S if kind == "sensor_add" else 0.38
    result = play(tmp_path, again_opens_s + 0.02, typed(*lines), events(event_s, [(kind, args)]))
    live = result.trace.between(again_opens_s + 0.002, again_opens_s + 0.02)["gate_live"]  # a low bus: tables made twice
    assert live.all(), result.console[-400:]
    assert not faults(result)


# what is wrong, how long before the gates open it begins, and how many samples it takes to be found
CAUSES = {
    "OVERCURRENT": (BEYOND["a current"], ZERO_MEASURED_S, 1),
    "CURRENT_SUM": (BEYOND["the sum of the currents"], ZERO_MEASURED_S, 2),
    "OVERVOLTAGE": (BEYOND["bus high"], 0.05, 1),
    "UNDERVOLTAGE": (BEYOND["bus low"], 0.05, 1),
    "ENCODER": ([("encoder_cut", ["1"])], 0.05, 1),
    "LOOP_STOPPED": ([("irq_block", ["1"])], 0.05, 1),
}


@pytest.mark.parametrize("cause", CAUSES)
def test_what_is_wrong_when_the_gates_open_is_found_at_once(cause, opens_s, tmp_path):
    kinds, before_s, samples = CAUSES[cause]
    result = play(tmp_path, opens_s + 0.02, typed((ON_S, "on")), events(opens_s - before_s, kinds))
    live = live_s(result)
    assert faults(result) == ["FAULT_" + cause]
    assert live[0] == pytest.approx(opens_s, abs=1e-6) and len(live) == samples
    assert state_at(result, opens_s + 0.01) == "AXIS_FAULT"


@pytest.mark.parametrize("first, second", [("ENCODER", "OVERCURRENT"), ("ENCODER", "UNDERVOLTAGE"),
                                           ("OVERCURRENT", "OVERVOLTAGE"), ("OVERCURRENT", "UNDERVOLTAGE")])
def test_of_two_causes_in_a_sample_the_first_of_the_list_is_reported(first, second, opens_s, tmp_path):
    steps = [events(opens_s - CAUSES[cause][1], CAUSES[cause][0]) for cause in (first, second)]
    assert faults(play(tmp_path, opens_s + 0.02, typed((ON_S, "on")), *steps)) == ["FAULT_" + first]


@pytest.mark.parametrize("cause", ["ENCODER", "OVERCURRENT"])
def test_a_latch_comes_before_what_the_sample_after_it_shows(cause, tmp_path):
    both = [("driver_fault", ["1"]), *CAUSES[cause][0]]
    assert faults(play(tmp_path, 1.56, typed((ON_S, "on")), events(1.55, both))) == ["FAULT_GATE_DRIVER"]


def test_a_latch_while_switching_on_keeps_the_gates_shut(opens_s, tmp_path):
    result = play(tmp_path, opens_s + 0.02, typed((ON_S, "on")), events(opens_s - 0.05, [("driver_fault", ["1"])]))
    assert faults(result) == ["FAULT_GATE_DRIVER"]
    assert not result.trace["gates"].any()


@pytest.mark.parametrize("which", "AB")
def test_each_input_of_safe_torque_off_cuts_the_bridge_by_itself_and_is_named(which, opens_s, tmp_path):
    """A millisecond later, which a test of the input may take: no row of the trace after it shows a gate on. It stays so until
    cleared, which needs an input that has been quiet for as long."""
    stop_s, free_s = opens_s + 0.01, opens_s + 0.03
    result = play(tmp_path, opens_s + 0.06, typed((ON_S, "on"), (free_s - 0.01, "clear"), (free_s + 0.01, "clear")),
                  events(stop_s, [("sto", [which, "1"])]), events(free_s, [("sto", [which, "0"])]))
    assert faults(result) == [f"FAULT_STO_{which}"]
    off_s = stop_s + 1.0001e-3
    assert stop_s + 0.9e-3 < live_s(result)[-1] <= off_s and not result.trace.between(off_s, opens_s + 0.06)["gates"].any()
    assert state_at(result, free_s + 0.005) == "AXIS_FAULT" and state_at(result, opens_s + 0.055) == "AXIS_SWITCH_ON_DISABLED"


def test_an_input_that_asks_to_stop_keeps_the_gates_shut(tmp_path):
    result = play(tmp_path, 0.4, typed((ON_S, "on")), events(0.1, [("sto", ["B", "1"])]))
    assert faults(result) == ["FAULT_STO_B"] and not result.trace["gates"].any()


def test_a_latch_is_found_while_the_bridge_is_off(tmp_path):
    result = play(tmp_path, 0.12, events(0.1, [("driver_fault", ["1"])]))
    assert faults(result) == ["FAULT_GATE_DRIVER"]


def test_behind_an_encoder_that_was_cut_while_the_bridge_was_off_it_aligns_anew(tmp_path):
    """The gates open 0.13 s after `on`; an alignment takes 1.6 s more, an aligned drive is ready at once."""
    cut = events(2.15, [("encoder_cut", ["1"])]) + events(2.16, [("encoder_cut", ["0"])])
    result = play(tmp_path, 4.3, typed((ON_S, "on"), (2.12, "off"), (2.2, "on")), cut)
    assert faults(result) == [] and "error" not in result.console
    assert state_at(result, 2.7) == "AXIS_SWITCHED_ON", "it does not align anew"
    assert state_at(result, 4.29) == "AXIS_OPERATION_ENABLED"


def test_an_encoder_that_is_still_cut_is_a_fault_of_the_next_switching_on(tmp_path):
    cut = events(2.15, [("encoder_cut", ["1"])])
    result = play(tmp_path, 2.6, typed((ON_S, "on"), (2.12, "off"), (2.2, "on")), cut)
    assert faults(result) == ["FAULT_ENCODER"] and state_at(result, 2.59) == "AXIS_FAULT"


def test_conversions_that_end_are_missed_within_two_steps_of_the_slow_loop(tmp_path):
    """ADC.CONTROL is cleared: no overrun, no interrupt, nothing that the fabric or the current loop could find."""
    stop_s = 1.55
    poke = {"t_s": stop_s, "event": "poke", "args": ["0x50000100", "0"]}
    result = play(tmp_path, 1.6, typed((ON_S, "on")), [poke])
    assert faults(result) == ["FAULT_LOOP_STOPPED"]
    assert stop_s < live_s(result)[-1] < stop_s + 2e-3
