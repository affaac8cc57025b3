# SPDX-License-Identifier: MIT
"""Both boards' projects are checked and found right; and a fault put into the generator's data or into what it wrote is named."""
import copy
import os
import re
import shutil
from pathlib import Path

import check
import pytest
from libero import board as boards
from libero import project

BUILD = check.demands.ROOT / os.environ["BUILD"]
SYSTEM = project.toml("system.toml")
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
    second = {f"pin_{side}[{3 + n}]": f"A1_PWM_{phase}{side[0].upper()}" for n, phase in enumerate("UVW") for side in ("high", "low")}
    board["wired"] |= second
    board["tied"] |= {"pin_a[1]": 0, "pin_b[1]": 0}
    board["unused"]["nets"] = [net for net in board["unused"]["nets"] if net not in second.values()]
    files = project.project(board, BUILD)
    assert found(tmp_path, files, board) == []
    assert ".irq(irq[1:0])" in files["hdl/fabric_board.v"] and "#(.AXES(2))" in files["hdl/fabric_board.v"]


# in what generates: path in system.toml, value, what is found
GENERATOR = {
    "clock ratio": (("mss", "block", "CCC", "FIC32_0_DIVISOR"), "2", "FIC32_0_DIVISOR is 2: BOARD_FIC0_HZ"),
    "another ratio": (("mss", "block", "CCC", "FCLK_PCLK1_DIVISOR"), "2", "FCLK_PCLK1_DIVISOR is 2: BOARD_APB1_HZ"),
    "frequency": (("mss", "block", "CCC", "FCLK_FREQ"), "142.0", "FCLK_FREQ is 142.0: drivers/board.h"),
    "misspelled parameter": (("mss", "block", "CM3", "MPU_USE"), "true", "no public script has: MSS CM3 MPU_USE"),
    "misspelled watchdog": (("mss", "block", "WATCHDOG", "WDOG_LOADS"), "1", "no public script has: MSS WATCHDOG WDOG_LOADS"),
    "parameter of a core": (("instance", "CCC_0", "params", "PLL_OUT"), "1", "no public script has: Actel:SgCore:FCCC:2.0.201 PLL_OUT"),
    "value of a core": (("instance", "CCC_0", "params", "INIT"), "00", "no public script has: Actel:SgCore:FCCC:2.0.201 INIT"),
    "core": (("core", "OSC"), ["Actel:SgCore:OSC:9.9.9", "SgCore"], "no public script has: core Actel:SgCore:OSC:9.9.9"),
    "no MPU": (("mss", "block", "CM3", "MPU_USED"), "false", "MPU_USED is not true: fault `stack guard`"),
    "no interrupt": (("mss", "block", "INTR", "F2H_INTERRUPT_USED"), "false", "there is no pin MSS_0:MSS_INT_F2M"),
    "lock not used": (("mss", "block", "CCC", "FAB_PLL_LOCK_IS_USED"), "0", "there is no pin MSS_0:MCCC_CLK_BASE_PLL_LOCK"),
    "lost lock unseen": (("mss", "block", "CCC", "MPLL_LOCK_LOST_EN"), "false", "MPLL_LOCK_LOST_EN is not true"),
    "no reset of the fabric": (("mss", "block", "RESET", "FPGA_RESET_N_USED"), "false", "there is no pin MSS_0:MSS_RESET_N_M2F"),
    "watchdog too short": (("mss", "block", "WATCHDOG", "WDOG_LOAD"), "0x1312D", "WDOG_LOAD 0x1312D is below 0x1800000"),
    "watchdog interrupts": (("mss", "block", "WATCHDOG", "WDOG_MODE"), "MODE_INTERRUPT", "WDOG_MODE is not MODE_RESET"),
    "region": (("mss", "block", "FIC32_0", "USE_FAB_REGION_1"), "false", "0x5000_0000 does not lead to the fabric"),
    "lock not wired": (("nets", "lock"), ["CCC_0:LOCK", "fabric_board_0:pin_clock_ok"], "open: MSS_0:MCCC_CLK_BASE_PLL_LOCK"),
    "reset from M2F": (("nets", "reset"), ["MSS_0:MSS_RESET_N_M2F", "fabric_board_0:rst_n"], "not on one net: CORERESETP_0:MSS_HPMS_READY"),
    "port left open": (("nets", "mss_runs"), ["CORERESETP_0:FIC_2_APB_M_PRESET_N"], "open: MSS_0:FIC_2_APB_M_PRESET_N"),
    "two drivers": (("nets", "lock"), ["CCC_0:LOCK", "FABOSC_0:RCOSC_25_50MHZ_O2F"], "2 drivers of CCC_0:LOCK"),
    "input unused": (("instance", "CORERESETP_0", "unused"), ["FAB_RESET_N"], "an input is marked as unused: CORERESETP_0:FAB_RESET_N"),
    "widths": (("nets", "interrupts"), ["CCC_0:LOCK", "MSS_0:MSS_INT_F2M"], "different widths: CCC_0:LOCK MSS_0:MSS_INT_F2M"),
    "bus of three": (("nets", "bus_slave"), ["CoreAPB3_0:APBmslave0", "fabric_board_0:APB", "MSS_0:FIC_0_APB_MASTER"],
                     "a bus joins exactly two interfaces"),
    "confirmed by now": (("unconfirmed", "MSS CM3 MPU_USED"), "why", "not used or confirmed: MSS CM3 MPU_USED"),
}


@pytest.mark.parametrize("path, value, said", GENERATOR.values(), ids=GENERATOR)
def test_a_fault_in_the_generators_data_is_found(tmp_path, path, value, said):
    system = copy.deepcopy(SYSTEM)
    inner = system
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    board = boards.load("creative")
    findings = found(tmp_path, written(board, system), board)
    assert any(said in line for line in findings), findings


# in what is written: file, pattern, replacement, what is found
OUTPUT = {
    "pin twice": ("io.pdc", "pin_low_0 -pinname M7", "pin_low_0 -pinname N7", "pin N7 (ARD_IO2) has 2 uses"),
    "pin missing": ("io.pdc", "set_io pin_low_0 .*", "", "pin_low_0 has 0 pins"),
    "pin of no net": ("io.pdc", "-pinname M7", "-pinname A1", "pin A1 is not in the board's file"),
    "port of no top": ("io.pdc", "set_io pin_low_0", "set_io pin_low_9", "set_io of pin_low_9, which the top does not have"),
    "direction": ("io.pdc", "(set_io pin_a_0 .*)INPUT", r"\1OUTPUT", "pin_a_0 is OUTPUT in io.pdc only"),
    "attribute": ("io.pdc", "-OUT_DRIVE 12", "-OUT_DRIVE 13", "no public script has: set_io -OUT_DRIVE 13"),
    "clock unconstrained": ("timing.sdc", "create_generated_clock .*", "", "no clock is made at CCC_0/CCC_INST/GL0"),
    "oscillator unconstrained": ("timing.sdc", "create_clock -name {FABOSC.*", "", "no clock is made at FABOSC_0/"),
    "clock too slow": ("timing.sdc", "-multiply_by 4", "-multiply_by 2", "the clock at CCC_0/CCC_INST/GL0 has 50 MHz"),
    "unseen cell": ("timing.sdc", "get_pins { CCC_0/CCC_INST/GL0 }", "get_pins { CCC_0/GL0 }", "timing.sdc names CCC_0/GL0, which nobody"),
    "converter's data a false path": ("timing.sdc", "set_input_delay -max .*pin_sdata_0.*", "", "pin_sdata_0 needs an input delay"),
    "clocks of a bit": ("timing.sdc", "set_multicycle_path .*pin_temp.*", "", "pin_temp_sdata_0 needs the clocks"),
    "SCLK whenever": ("timing.sdc", "set_output_delay -min .*pin_sclk.*", "", "pin_sclk_0 needs an output delay"),
    "stop whenever": ("timing.sdc", "set_max_delay.*", "", "pin_sto_a_n_0 needs a largest delay to the gates"),
    "port without a constraint": ("timing.sdc", "pin_hall_1", "", "timing.sdc says nothing of pin_hall_1"),
    "eNVM address": ("mss.tcl", "-base_address 0 ", "-base_address 4096 ", "the image would stand at 0x1000 of the eNVM"),
    "eNVM too small": ("mss.tcl", r"-number_of_words \d+", "-number_of_words 1024", "the client has 1024 bytes, the image"),
    "eNVM over the settings": ("mss.tcl", r"-number_of_words \d+", "-number_of_words 253952", "in the drive's settings from 0x3c000"),
    "command": ("design.tcl", "save_smartdesign", "keep_smartdesign", "no public script has: unknown command keep_smartdesign"),
    "option": ("project.tcl", "-die_voltage", "-voltage", "no public script has: new_project -voltage 1.2"),
    "not saved": ("mss.tcl", "mss_save_instance_config .*{INTR}", "", "INTR is configured or saved, not both"),
    "not downloaded": ("project.tcl", "download_core .*CoreAPB3.*", "", "CoreAPB3:4.2.100 is used, but not downloaded"),
    "mark lost": ("mss.tcl", "# unconfirmed: MSS INTR .*", "", "no public script has: MSS INTR F2H_INTERRUPT_USED"),
    "no timing report": ("build.tcl", "run_tool -name {VERIFYTIMING}", "", "the flow is SYNTHESIZE PLACEROUTE GENERATE"),
    "source not imported": ("design.tcl", "import_files -hdl_source .*/gate.v", "", "hdl/gate.v is imported or there, not both"),
    "open in the wrapper": ("hdl/fabric_board.v", r"\.pin_b\(pin_b_0\)", ".pin_b()", "fabric's pin_b[0] leads nowhere"),
    "no bus": ("design.tcl", '"PSELx:psel"', '"PSELx:sel"', "the bus interface names sel"),
    "error in the Tcl": ("mss.tcl", r"close \$file", "close file", "project.tcl: can not find channel"),
    "port of the RTL": ("hdl/fabric_board.v", r"\.pin_hall\(", ".pin_halls(", "yosys does not read the RTL"),
}


@pytest.mark.parametrize("name, old, new, said", OUTPUT.values(), ids=OUTPUT)
def test_a_fault_in_what_is_written_is_found(tmp_path, name, old, new, said):
    board = boards.load("creative")
    files = written(board)
    files[name], changes = re.subn(old, new, files[name])
    assert changes, "the fault changes nothing"
    findings = found(tmp_path, files, board)
    assert any(said in line for line in findings), findings


def test_a_board_that_samples_nothing_cannot_turn_a_gate_on(tmp_path):
    board = boards.load("sk1")
    files = written(board)
    files["hdl/fabric_board.v"] = files["hdl/fabric_board.v"].replace(".pin_sto_b_n(1'b0)", ".pin_sto_b_n(1'b1)")
    assert found(tmp_path, files, board) == ["a board that samples nothing must hold both STO inputs at 0"]


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


def test_the_page_lists_what_is_not_confirmed(tmp_path):
    page = (check.demands.ROOT / "docs/libero.md").read_text(encoding="utf-8")
    for name in ("creative", "sk1"):
        found(tmp_path / name, written(boards.load(name)), boards.load(name))
        marked, to_check = check.public.marks(tmp_path / name)
        assert [fact for fact in marked if fact not in page] == []
        assert marked and to_check
