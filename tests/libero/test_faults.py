# SPDX-License-Identifier: MIT
"""Both boards' projects are found right; a fault put into the generator's data or into what it wrote is named."""
import copy
import os
import re
import shutil
import tomllib
from pathlib import Path

import check
import pytest
from libero import board as boards
from libero import project

BUILD = check.demands.ROOT / os.environ["BUILD"]
SYSTEM = project.toml("system.toml")
FAULTS = tomllib.loads(Path(__file__).with_name("faults.toml").read_text(encoding="utf-8"))
NAMES = {kind: [name for name, *_ in rows] for kind, rows in FAULTS.items()}
WRITTEN, READ = {}, {}


def written(board, system=SYSTEM):
    """The project's files; those of an unchanged board once."""
    if system is not SYSTEM:
        return project.project(board, BUILD, system)
    if board["name"] not in WRITTEN:
        WRITTEN[board["name"]] = project.project(board, BUILD, system)
    return dict(WRITTEN[board["name"]])


def found(folder, files, board):
    """What the checker says of these files."""
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    shutil.copy(BUILD / "mssfoc.hex", folder / "mssfoc.hex")
    return check.findings(board, folder, read(files, folder))


def read(files, folder):
    """The sources as yosys reads them, once for the same text; None for those with a fault."""
    text = "".join(files[name] for name in sorted(files) if name.startswith("hdl/"))
    if text not in READ:
        try:
            READ[text] = check.wiring.wrapper(folder)
        except check.Wrong:
            READ[text] = None
    return READ[text]


@pytest.mark.parametrize("name", [path.stem for path in sorted(boards.BOARDS.glob("*.toml"))])
def test_a_board_has_no_findings(tmp_path, name):
    board = boards.load(name)
    assert found(tmp_path, written(board), board) == []


def test_two_axes(tmp_path):
    """The kit's second bridge: every vector is twice as wide, and the bus and the interrupts know it."""
    board = copy.deepcopy(boards.load("sk1"))
    board["axes"] = 2
    second = {f"pin_{side}[{3 + n}]": f"A1_PWM_{phase}{side[0].upper()}"
              for n, phase in enumerate("UVW") for side in ("high", "low")}
    board["wired"] |= second
    board["tied"] |= {"pin_a[1]": 0, "pin_b[1]": 0}
    board["unused"]["nets"] = [net for net in board["unused"]["nets"] if net not in second.values()]
    board["open"] = {key: why for key, why in board["open"].items() if key != "pin_chopper"} | {"pin_chopper[1]": "none"}
    board["wired"]["pin_chopper[0]"] = "A0_RUNNING_LED"
    board["unused"]["nets"].remove("A0_RUNNING_LED")
    files = project.project(board, BUILD)
    assert found(tmp_path, files, board) == []
    assert ".irq(irq[1:0])" in files["hdl/fabric_board.v"] and "#(.AXES(2), .IN_EN(3))" in files["hdl/fabric_board.v"]


@pytest.mark.parametrize("name, path, value, said", FAULTS["generator"], ids=NAMES["generator"])
def test_a_fault_in_the_generators_data_is_found(tmp_path, name, path, value, said):
    system = copy.deepcopy(SYSTEM)
    *path, last = path
    inner = system
    for key in path:
        inner = inner[key]
    inner[last] = value
    board = boards.load("creative")
    findings = found(tmp_path, written(board, system), board)
    assert any(said in line for line in findings), findings


@pytest.mark.parametrize("name, file, old, new, said", FAULTS["output"], ids=NAMES["output"])
def test_a_fault_in_what_is_written_is_found(tmp_path, name, file, old, new, said):
    board = boards.load("creative")
    files = written(board)
    files[file], changes = re.subn(old, new, files[file])
    assert changes, "the fault changes nothing"
    findings = found(tmp_path, files, board)
    assert any(said in line for line in findings), findings


def test_a_board_that_samples_nothing_cannot_turn_a_gate_on(tmp_path):
    board = boards.load("sk1")
    files = written(board)
    files["hdl/fabric_board.v"] = files["hdl/fabric_board.v"].replace(".pin_sto_b_n(1'b0)", ".pin_sto_b_n(1'b1)")
    assert "a board that samples nothing must hold both STO inputs at 0" in found(tmp_path, files, board)


@pytest.mark.parametrize("name, old, new, said", [
    ("creative", "#(.AXES(1))", "#(.AXES(1), .IN_EN(1))", "the fabric is told IN_EN 1, and the board's legs are gates"),
    ("sk1", ", .IN_EN(1)", "", "the fabric is told IN_EN 0, and the board's legs are in_en")])
def test_legs_of_another_kind_are_found(tmp_path, name, old, new, said):
    """Enables at gates would turn on both sides of a leg."""
    board = boards.load(name)
    files = written(board)
    assert found(tmp_path / "right", files, board) == [] and old in files["hdl/fabric_board.v"]
    files["hdl/fabric_board.v"] = files["hdl/fabric_board.v"].replace(old, new)
    assert found(tmp_path / "wrong", files, board) == [said]


def test_the_project_refuses_a_second_run_and_another_folder(tmp_path):
    board = boards.load("creative")
    assert found(tmp_path, written(board), board) == []
    (tmp_path / "libero").mkdir()
    assert "is there already; delete it" in check.findings(board, tmp_path)[0]
    (tmp_path / "libero").rmdir()
    (tmp_path / "elsewhere").mkdir()
    with pytest.raises(check.recording.Failed, match="in the folder of project.tcl"):
        check.recording.play("../project.tcl", tmp_path / "elsewhere", check.KNOWN["command"])


def test_states_of_the_gates_while_programming_are_loaded_if_there(tmp_path):
    board = boards.load("creative")
    (tmp_path / "gates.ios").write_text("")
    assert found(tmp_path, written(board), board) == []
    calls = check.recording.play("project.tcl", tmp_path, check.KNOWN["command"])
    assert [Path(call.one("-params").removeprefix("ios_file:")).name for call in calls
            if call.name == "configure_tool" and call.one("-name") == "IO_PROGRAMMING_STATE"] == ["gates.ios"]


def test_the_kits_project_says_that_it_samples_nothing(tmp_path):
    files = written(boards.load("sk1"))
    said = [line for line in files["project.tcl"].splitlines() if line.startswith(("puts", "# to check"))]
    assert "samples nothing" in said[0] and "D21 and C22" in said[1]


def test_the_page_lists_what_is_not_confirmed(tmp_path):
    page = (check.demands.ROOT / "docs/libero.md").read_text(encoding="utf-8")
    for name in ("creative", "sk1"):
        found(tmp_path / name, written(boards.load(name)), boards.load(name))
        marked, to_check = check.public.marks(tmp_path / name)
        assert [fact for fact in marked if fact not in page] == []
        assert marked and any("Microchip still offers" in line for line in to_check)
        assert any("AD7356" in line for line in to_check) == (name == "creative")


def test_each_demand_on_the_mss_and_the_nets_is_made(tmp_path):
    board = boards.load("creative")
    assert found(tmp_path, written(board), board) == []
    calls = check.recording.play("project.tcl", tmp_path, check.KNOWN["command"])
    design = check.wiring.read(calls, check.KNOWN, check.wiring.wrapper(tmp_path))
    for block, name, _, without in check.demands.MSS:
        other = design._replace(mss=copy.deepcopy(design.mss))
        other.mss[block][name] = "another"
        assert [line for line in check.demands.of_mss(other) if line.startswith(f"MSS {block} {name} ") and without in line]
    for pins, what in check.demands.TOGETHER:
        for pin in pins:
            cut = design._replace(nets=[[there for there in net if there != pin] for net in design.nets])
            assert [line for line in check.demands.of_nets(cut) if what in line]
