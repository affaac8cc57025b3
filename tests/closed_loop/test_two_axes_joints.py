# SPDX-License-Identifier: MIT
"""What one axis goes through must not be seen in the other: its interrupts, its speed. And what only both together can bear."""
import numpy as np
import pytest

from launcher import simulate
from launcher.load import SECOND_LOOP, load_irqlog
from launcher.probes import code_of
from rates.builds import OWN_HZ, build_of
from rigs.steps import event, typed

FIRST, SECOND = "teknic_m2310p", "maxon_ec22"
STEADY_S = 1.6  # from here on axis 2 turns
ENDS_S = 3.0
LATER_NS = 400  # by critical sections of the other's: some 40 cycles, and a bus access that ends first
DIFFERENT = 1 / 200  # share of interrupts that begin as another ends, in the one run or the other: the core goes from one
CHAINED = 27         # into the next, and saves 9 cycles each time. A few cycles of a slow loop decide whether one in 4 ms does


STEADY = {"key": "steady", "title": "turns", "end_s": ENDS_S, "preamble_s": 0.05, "expect_refusal": ".*",
          "step": [typed(0.2, "on"), typed(1.2, "speed 1500"), typed(2.9, "status")]}
STEPS = {
    "nothing": [],
    "on_and_off": [typed(1.7, "on"), typed(2.5, "off"), typed(2.6, "on"), typed(2.7, "off")],
    "fault_and_clear": [typed(0.25, "on"), typed(1.4, "speed 900"), event(1.8, "driver_fault", "1"),
                        event(1.9, "driver_fault", "0"), typed(2.0, "clear"), typed(2.1, "on")],
    "settings": [typed(1.7, "save"), typed(1.8, "load"), typed(1.9, "get all"), typed(2.3, "help"), typed(2.5, "defaults")],
    "moves": [typed(0.25, "on"), typed(1.7, "speed 3000"), typed(2.0, "torque 0.3"), typed(2.2, "pp 8000"),
              typed(2.6, "quickstop")],
    "update": [typed(1.65, "set pwm_update 1"), typed(1.7, "on"), typed(2.4, "off"), typed(2.5, "set pwm_update 0"),
               typed(2.55, "on")],
    "off": [typed(0.25, "on"), typed(1.4, "speed 900"), typed(1.8, "off")],
}


def play(out_dir, steps, second=STEADY, aligned=True, **others):
    build = build_of(OWN_HZ, "mssfoc.elf", "mssfoc.hex", folder="two-axes", AXES=2)
    plan = {**second, "key": "first", "step": steps}
    return simulate(plan, FIRST, build=build, out_dir=out_dir, aligned=aligned, second={"motor": SECOND, "scenario": second},
                    **others)


def of_second(result, steady_s=STEADY_S):
    log = load_irqlog(result.irqlog)
    rows = (log["exception"] == SECOND_LOOP) & (log["t_s"] > steady_s)
    return {name: log[name][rows] for name in ("cycles", "start_ns", "t_s")}


def check_untouched(result, alone, steady_s=STEADY_S):
    seen, count = of_second(result, steady_s), len(alone["cycles"])
    assert len(seen["cycles"]) == count, "no sample more or less"
    differ = np.abs(seen["cycles"] - alone["cycles"])
    assert np.count_nonzero(differ) <= DIFFERENT * count and differ.max() <= CHAINED
    assert seen["cycles"].max() == alone["cycles"].max() and (seen["start_ns"] - alone["start_ns"]).max() <= LATER_NS
    turning = result.second.trace.between(steady_s, result.second.scenario.end_s)
    assert turning["gate_live"].all() and not result.second.trace["fault"].any()
    assert turning["speed_rpm"].min() > 1470 and turning["speed_rpm"].max() < 1530


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    return of_second(play(tmp_path_factory.mktemp("alone"), STEPS["nothing"]))


@pytest.mark.parametrize("what", [what for what in STEPS if what != "nothing"])
def test_the_other_s_interrupt_does_not_see_it(what, alone, tmp_path):
    check_untouched(play(tmp_path, STEPS[what]), alone)


LONG = {**STEADY, "end_s": 6.0, "step": [typed(0.2, "on"), typed(2.6, "speed 1500")]}


@pytest.mark.parametrize("fault_s", (None, 4.0))
def test_the_other_s_interrupt_does_not_see_it_identified(fault_s, tmp_path):
    """Nor that a fault ends it. Nobody has told either where its rotor stands: that would end identify's own start."""
    alone = of_second(play(tmp_path / "alone", [], LONG, aligned=False), 3.0)
    steps = [typed(2.8, "identify"), *([event(fault_s, "driver_fault", "1"), event(fault_s + 0.01, "driver_fault", "0")]
                                      if fault_s else [])]
    result = play(tmp_path / "identify", steps, LONG, aligned=False)
    assert (result.trace.between(3.2, fault_s or 6.0)["gate_live"]).all(), "it is under way"
    check_untouched(result, alone, 3.0)


def test_a_processor_fault_opens_both_bridges(tmp_path):
    result = play(tmp_path, [typed(0.25, "on"), typed(1.4, "speed 900"), event(2.0, "poke_rom", "&drive_step", "0xDE00"),
                             event(2.002, "poke_rom", "&drive_step", "*drive_step")])
    for one in (result, result.second):
        assert one.trace.between(1.9, 2.0)["gate_live"].all()
        assert not one.trace.between(2.0 + 0.6e-3, ENDS_S)["gate_live"].any()
        assert one.trace["fault"][-1] == code_of(one.enums["fault"], "EXCEPTION")


def test_settings_of_both_are_kept(tmp_path):
    envm = tmp_path / "device.envm"
    saved = [typed(0.1, "set ramp_rpm_s 1234"), typed(0.2, "axis 2 set ramp_rpm_s 4321"), typed(0.3, "axis 2 off"),
             typed(0.6, "save"), typed(0.8, "axis 2 save")]
    first = play(tmp_path / "save", saved, envm=envm)
    assert "slot A, save 1" in first.console and "slot A, save 1" in first.second.console
    again = play(tmp_path / "load", [typed(0.02, "get ramp_rpm_s"), typed(0.03, "axis 2 get ramp_rpm_s")], envm=envm)
    assert "ramp_rpm_s = 1234 " in again.console and "ramp_rpm_s = 4321 " in again.second.console
