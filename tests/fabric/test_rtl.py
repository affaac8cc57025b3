# SPDX-License-Identifier: MIT
"""The quick part of `make fabric`: lint, two small proofs, a fault that breaks one, the twin's models in lockstep."""
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER))

import lint  # noqa: E402
import lockstep  # noqa: E402
import mutate  # noqa: E402
import places  # noqa: E402
import prove  # noqa: E402
import synthesis  # noqa: E402

# filters, a multiplier and a table: adc_benches.py holds them against exact arithmetic
SIMULATED = {"adc_multiply", "adc_curve", "sinc3", "sinc3_comb"}
# the plant's arithmetic: plant_exact.py, likewise
SIMULATED |= {f"plant/plant{name}" for name in ("", "_core", "_legs", "_memory", "_multiply", "_channel", "_noise")}


def test_no_tool_warns():
    assert lint.findings() == []


def test_a_warning_is_noticed(tmp_path):
    (tmp_path / "fabric.v").write_text("module fabric #(parameter AXES = 1) (input wire a, output wire b);\n"
                                       "    assign b = c;\nendmodule\n", encoding="utf-8")
    assert {tool for tool, _ in lint.findings(tmp_path)} == {"verilator", "iverilog", "yosys"}


@pytest.mark.parametrize("top", ["apb_slave", "chopper"])
def test_a_small_proof(top):
    prove.prove(top, prove.load()[top])


def test_a_fault_is_refuted():
    fault = next(fault for fault in mutate.load() if fault[0] == "apb_slave")
    assert mutate.refuted(fault, prove.load()) == "base case"


def test_every_fault_has_its_place():
    proofs, faults = prove.load(), mutate.load()
    assert len(faults) >= 40 and len(set(faults)) == len(faults)
    for name, old, new, top in faults:
        assert mutate.mutated(name, old, new) and top in proofs


def test_every_module_is_proved_or_stands_below_a_proof():
    proved = {name for proof in prove.load().values() for name in proof["files"]}
    stand_ins = {name for name in proved if name.startswith("formal/")}
    modules = {path.relative_to(places.RTL).with_suffix("").as_posix() for path in places.RTL.glob("**/*.v")}
    modules = {name for name in modules if not name.startswith("formal/")}
    assert modules == (proved - stand_ins) | SIMULATED


@pytest.mark.parametrize("change, said", [({"CFG": 106}, ["pwm CFG: 106, allowed 105"]), ({"CFG": 105}, []), ({"CFG": 95}, []),
                                          ({"CFG": 94}, ["pwm CFG: 94, far below its budget of 100; tighten it"]),
                                          ({"SLE": 11}, ["pwm SLE: 11, allowed 10"])])
def test_budgets_hold_both_ways(change, said):
    budget = {"CFG": 100, "ARI1": 10, "SLE": 10, "MACC": 0}
    assert list(synthesis.complaints("pwm", {**budget, "levels": 6, **change}, {"pwm": budget})) == said


def test_a_seventh_level_is_told():
    budget = {"CFG": 100, "ARI1": 10, "SLE": 10, "MACC": 0}
    assert "at most 6" in next(synthesis.complaints("pwm", {**budget, "levels": 7}, {"pwm": budget}))


def test_lockstep_with_the_twin():
    """In `make fabric` ten times as long. The program is made by `make lockstep`, of which `make test` takes care."""
    code, text, hits = lockstep.play(places.REGISTERS / "lockstep" / "lockstep", 1000000, seed=2)
    assert code == 0, text
    assert int(text.split("no difference in ")[1].split()[0]) >= 1000000
    every, writable = map(len, lockstep.offsets())
    assert f"{every} of {every} read, {writable} of {writable} written" in lockstep.registers_line(text)
    assert len(list(lockstep.coverage_lines(hits))) <= 3    # the longer run must take them all


def test_lockstep_of_an_axis_that_follows():
    """The same with axis 1 of 2 and a carrier to follow, of which the model knows only what it was some time ago."""
    code, text, _ = lockstep.play(places.REGISTERS / "lockstep" / "lockstep1", 1000000, seed=2)
    assert code == 0, text
    assert int(text.split(" starts with the leader")[0].split()[-1]) > 50
