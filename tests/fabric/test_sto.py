# SPDX-License-Identifier: MIT
"""Safe torque off with inputs that are tested by pulses: the twin's model and the RTL on the twin's bench, and a drive that
turns at rated load."""
import numpy as np
import pytest
from places import REGISTERS

from launcher import simulate
from rigs.steps import faults
from twin.bench import CLOCK_PS, GATE, PWM, Plant, c

LIVE, STO_A, STO_B, APART = 1, 1 << 10, 1 << 11, 1 << 17
NOW_A, NOW_B = 1 << 13, 1 << 14
TEST, PATIENCE = 100_000, 50_000_000  # clocks
BEHIND_PIN = 3  # clocks: two flip-flops, and one beyond the longest test


class Bench:
    """Times in clocks of the fabric."""
    def __init__(self, rtl):
        self.p = Plant(rtl=REGISTERS / "axis.so" if rtl else None)
        self.clock = 0
        self.run(100_001)  # somewhere in a period, all low sides on

    def run(self, clocks):
        self.clock += clocks
        self.p.to(self.clock * CLOCK_PS)

    def low(self, *inputs, ends=False):
        if not ends:
            self.run(10)  # what was on the bus has taken the RTL ahead
        for name in inputs:
            c.plant_stop(self.p.p, STO_A if name == "A" else STO_B, not ends)

    def high(self, *inputs):
        self.low(*inputs, ends=True)

    def pulse(self, inputs, clocks):
        self.low(*inputs)
        self.run(clocks)
        self.high(*inputs)

    def status(self):
        return self.p.read(GATE.STATUS)


@pytest.fixture(params=["model", "rtl"])
def bench(request):
    return Bench(request.param == "rtl")


@pytest.mark.parametrize("inputs", ["A", "B", "AB"])
def test_a_pulse_of_the_longest_test_passes_and_a_clock_more_stops(bench, inputs):
    for clocks in (1000, TEST, TEST - 1000, TEST):
        bench.pulse(inputs, clocks)
        bench.run(clocks + 10)
        assert bench.p.read(PWM.STATUS) & 1 and bench.status() == LIVE
    bench.pulse(inputs, TEST + 1)
    bench.run(10)
    assert bench.p.gates == 0
    asked = (STO_A if "A" in inputs else 0) | (STO_B if "B" in inputs else 0)
    asks = asked << 3
    assert bench.status() == asked | asks
    bench.p.write(GATE.STATUS, asked)
    assert bench.status() == asked | asks, "still asks: it has not been high for as long"
    bench.run(TEST)
    assert bench.status() == asked
    bench.p.write(GATE.CONTROL, 1)
    assert bench.status() == asked, "a latch keeps it off"
    bench.p.write(GATE.STATUS, asked)
    bench.p.write(GATE.CONTROL, 1)
    assert bench.status() == LIVE


@pytest.mark.parametrize("inputs", ["A", "B"])
def test_the_gates_are_off_a_millisecond_and_three_clocks_after_the_pin(bench, inputs):
    bench.low(inputs)
    bench.run(TEST + BEHIND_PIN - 1)
    assert bench.p.fabric.contents.live
    bench.run(1)
    assert bench.p.gates == bench.p.inverter.gates == 0 and not bench.p.fabric.contents.live


def test_a_line_that_chatters_stops_and_tests_with_pauses_never_do(bench):
    for _ in range(12):
        bench.pulse("A", TEST)
        bench.run(TEST)
    assert bench.status() == LIVE
    for _ in range(4):  # low for three quarters of the time, never longer than a test
        bench.pulse("A", TEST * 3 // 4)
        bench.run(TEST // 4)
    assert bench.p.gates == 0 and bench.status() & STO_A


def test_one_input_alone_for_half_a_second_is_kept_until_both_have_asked(bench):
    bench.low("A")
    bench.run(TEST + BEHIND_PIN + PATIENCE)
    assert bench.status() == STO_A | NOW_A
    bench.run(1)
    assert bench.status() == APART | STO_A | NOW_A
    bench.high("A")
    bench.run(TEST + 10)
    bench.p.write(GATE.STATUS, STO_A | APART)
    bench.p.write(GATE.CONTROL, 1)
    assert bench.status() == APART, "alike again, but the other has not been seen to work"
    bench.low("A", "B")
    bench.run(TEST + 10)
    bench.high("A", "B")
    bench.run(TEST + 10)
    bench.p.write(GATE.STATUS, STO_A | STO_B | APART)
    bench.p.write(GATE.CONTROL, 1)
    assert bench.status() == LIVE


def test_a_reset_begins_anew_with_the_pins_as_they_are(bench):
    bench.low("A", "B")
    bench.run(TEST + 10)
    c.plant_reset_fabric(bench.p.p)
    bench.run(TEST)
    assert bench.status() == 0, "the filter, too"
    bench.run(10)
    assert bench.status() == STO_A | STO_B | NOW_A | NOW_B


# ---- a drive that turns ----

QUIET_S, EVERY_S = 0.05, 0.02


def drive(folder, fabric, pulses):
    """At the working speed under rated load; pulses: [(inputs, seconds)], one each 20 ms from `loaded` + 50 ms on."""
    steps = []
    for n, (inputs, long_s) in enumerate(pulses):
        for which in inputs:
            begins = f"loaded + {QUIET_S + EVERY_S * n}"
            steps += [{"t_s": begins, "label": f"low_{n}", "event": "sto", "args": [which, "1"]} if which == inputs[0] else
                      {"t_s": begins, "event": "sto", "args": [which, "1"]},
                      {"t_s": f"{begins} + {long_s}", "event": "sto", "args": [which, "0"]}]
    plan = {"key": "sto", "end_s": f"loaded + {QUIET_S + EVERY_S * len(pulses) + 0.02}", "preamble_s": 0.05,
            "step": [{"t_s": 0.15, "label": "on", "console": "on"},
                     {"t_s": "on + on_time_s", "label": "started", "hold_for": "OPERATION_ENABLED"},
                     {"t_s": "started + 0.02", "label": "up", "console": "speed {work_rpm}"},
                     {"t_s": "up + ramp_time_s + 0.5 * settle_s", "label": "load", "event": "load_nm",
                      "args": ["rated_torque_Nm"]},
                     {"t_s": "load + 0.75 * settle_s", "label": "loaded"}, *steps]}
    return simulate(plan, out_dir=folder, fabric=fabric)


def ripple_a(result, from_s, to_s):
    """Of the current's length, which turning does not change: the deviation from its mean."""
    rows = result.trace.between(from_s, to_s)
    alpha, beta = rows["i_a_A"], (rows["i_b_A"] - rows["i_c_A"]) / 3**0.5
    return float(np.std(np.hypot(alpha, beta)))


@pytest.mark.parametrize("fabric", ["model", "rtl"])
def test_tests_of_the_inputs_are_not_seen_in_the_current(tmp_path, fabric):
    """Pulses of 0.1, 0.5 and 0.9 ms on one input and on both; then 1.5 ms on one, which stops in the stated time."""
    pulses = [(inputs, long_s) for inputs in ("A", "B", "AB") for long_s in (0.1e-3, 0.5e-3, 0.9e-3)] + [("A", 1.5e-3)]
    result = drive(tmp_path, fabric, pulses)
    at = [result.scenario.names[f"low_{n}"] for n in range(len(pulses))]
    live = result.trace["gate_live"] > 0
    since = (result.trace["t_s"] > at[0] - QUIET_S + 1e-3) & (result.trace["t_s"] < at[-1] + 0.9e-3)
    assert live[since].all() and faults(result) == ["FAULT_STO_A"]
    quiet = [ripple_a(result, at[0] - 0.04 + 0.002 * n, at[0] - 0.038 + 0.002 * n) for n in range(19)]
    tested = [ripple_a(result, t_s - 0.1e-3, t_s + 1.9e-3) for t_s in at[:-1]]
    assert max(tested) < 1.05 * max(quiet) and abs(np.mean(tested) / np.mean(quiet) - 1) < 0.1, (tested, quiet)
    last_live_s = result.trace["t_s"][live][-1]
    assert at[-1] + 0.9e-3 < last_live_s <= at[-1] + 1.0001e-3
    assert not result.trace.between(at[-1] + 1.0001e-3, at[-1] + 0.02)["gates"].any()


def test_inputs_that_differ_are_named_and_kept_until_both_have_asked(tmp_path):
    """One is switched for 0.6 s; then both are, as they should be."""
    asks = [(0.1, "A", "1"), (0.7, "A", "0"), (0.8, "A", "1"), (0.8, "B", "1"), (0.81, "A", "0"), (0.81, "B", "0")]
    steps = [{"t_s": t_s, "event": "sto", "args": [which, on]} for t_s, which, on in asks]
    steps += [{"t_s": t_s, "console": "clear"} for t_s in (0.75, 0.85)]
    result = simulate({"key": "sto", "end_s": 0.9, "preamble_s": 0.05, "expect_refusal": "input",
                       "step": sorted(steps, key=lambda step: step["t_s"])}, out_dir=tmp_path)
    assert faults(result) == ["FAULT_STO_A", "FAULT_STO_APART"]
    text = result.enums["fault"]
    assert text[int(result.trace.between(0.55, 0.56)["fault"][0])] == "FAULT_STO_A"
    for at_s, cause in ((0.61, "FAULT_STO_APART"), (0.79, "FAULT_STO_APART"), (0.89, "FAULT_NONE")):
        assert text[int(result.trace.between(at_s, at_s + 1e-3)["fault"][0])] == cause
