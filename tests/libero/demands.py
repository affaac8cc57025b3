# SPDX-License-Identifier: MIT
"""What firmware and RTL ask of the device: docs/fabric.md, drivers/board.h and linker/m2s010.ld."""
import re
from pathlib import Path

from libero import project as generator

ROOT = Path(__file__).resolve().parents[2]
WATCHDOG_MIN = 0x1800000   # the user guide, 19.3.1
USED = ("FIC32_0", "GPIO", "WATCHDOG")
READS = {"SYNTHESIZE": {"timing.sdc"}, "VERIFYTIMING": {"timing.sdc"}, "PLACEROUTE": {"timing.sdc", "io.pdc"}}
ORDER = ["SYNTHESIZE", "PLACEROUTE", "VERIFYTIMING", "GENERATEPROGRAMMINGDATA", "GENERATEPROGRAMMINGFILE"]

# block, parameter, value, and what fails without it
MSS = (
    ("CCC", "REFCLK_SRC", "CLK_BASE", "the MSS is not clocked by the fabric's PLL"),
    ("CCC", "FAB_PLL_LOCK_IS_USED", "1", "the firmware sees no lock of the fabric's PLL: fault `clock`"),
    ("CCC", "FAB_PLL_LOCK_LOST_EN", "true", "no interrupt when the fabric's PLL loses its lock"),
    ("CCC", "MPLL_LOCK_LOST_EN", "true", "no interrupt when the MSS' PLL loses its lock"),
    ("CM3", "MPU_USED", "true", "fault `stack guard`"),
    ("INTR", "F2H_INTERRUPT_USED", "true", "no interrupt of the fabric: no current loop"),
    ("RESET", "FPGA_RESET_N_USED", "true", "the fabric knows no end of the power-on reset"),
    ("RESET", "USER_MSS_RESET_N_USED", "true", "CoreResetP cannot hold the MSS"),
    ("FIC32_0", "INTERFACE_TYPE", "INTERFACE_APB", "the fabric speaks APB3"),
    ("FIC32_0", "INTERFACE_MASTER", "true", "the MSS does not reach the fabric"),
    ("FIC32_0", "USE_FAB_REGION_1", "true", "0x5000_0000 does not lead to the fabric"),
    ("EDAC", "EDAC_ENABLE_ESRAM0_EDAC_EN", "true", "errors in the eSRAM go unseen"),
    ("EDAC", "EDAC_ENABLE_ESRAM1_EDAC_EN", "true", "errors in the eSRAM go unseen"),
    ("SWITCH", "CORTEXM3_REMAP", "ENVM", "the M3 does not boot from the eNVM"),
    ("WATCHDOG", "WDOG_MODE", "MODE_RESET", "the watchdog only interrupts: `on` is refused"),
    ("WATCHDOG", "WDOG_MVRP", "0xFFFFFFFF", "an early refresh resets"),
)
# pins that must share a net, and why
TOGETHER = (
    (("CCC_0:LOCK", "MSS_0:MCCC_CLK_BASE_PLL_LOCK", "fabric_board_0:pin_clock_ok"), "the PLL's lock"),
    (("CCC_0:GL0", "MSS_0:MCCC_CLK_BASE", "fabric_board_0:clk", "CORERESETP_0:CLK_BASE"), "one clock for MSS, bus and fabric"),
    (("CORERESETP_0:MSS_HPMS_READY", "fabric_board_0:rst_n"), "a reset that does not hang on FPGA_SOFTRESET alone"),
    (("CORERESETP_0:RESET_N_M2F", "MSS_0:MSS_RESET_N_M2F"), "the end of the power-on reset"),
    (("CORERESETP_0:FIC_2_APB_M_PRESET_N", "MSS_0:FIC_2_APB_M_PRESET_N"), "warm resets reach the fabric"),
    (("fabric_board_0:irq", "MSS_0:MSS_INT_F2M"), "the interrupt of the current loop"),
)


def defined(name):
    """A constant of drivers/board.h."""
    return int(re.search(rf"#define {name}\s+(\w+?)u\b", (ROOT / "drivers/board.h").read_text(encoding="utf-8"))[1], 0)


def settings_start():
    """Where the image must end, from the start of the eNVM."""
    script = (ROOT / "linker/m2s010.ld").read_text(encoding="utf-8")
    starts = {room: int(start, 0) for room, start in re.findall(r"^\s*(\w+) .*ORIGIN = (\w+)", script, re.M)}
    return starts["settings"] - starts["envm_load"]


def of_mss(design):
    for block, name, value, without in MSS:
        if design.mss.get(block, {}).get(name) != value:
            yield f"MSS {block} {name} is not {value}: {without}"
    load = design.mss.get("WATCHDOG", {}).get("WDOG_LOAD", "0")
    if int(load, 0) < WATCHDOG_MIN:
        yield f"MSS WATCHDOG WDOG_LOAD {load} is below {WATCHDOG_MIN:#x}, the least that the user guide allows"


def of_clocks(design):
    ccc, out = design.mss.get("CCC", {}), design.params.get("CCC_0", {})
    m3 = defined("BOARD_M3_HZ")
    for name, told in (("MSS CCC FCLK_FREQ", ccc.get("FCLK_FREQ")), ("CCC_0 GL0_OUT_0_FREQ", out.get("GL0_OUT_0_FREQ")),
                       ("MSS FIC32_0 FAB_CLK_FREQUENCY", design.mss.get("FIC32_0", {}).get("FAB_CLK_FREQUENCY"))):
        if float(told or 0) * 1e6 != m3:
            yield f"{name} is {told}: drivers/board.h has {m3 // 1_000_000} MHz"
    for name, rate in (("FCLK_PCLK0_DIVISOR", "BOARD_APB0_HZ"), ("FCLK_PCLK1_DIVISOR", "BOARD_APB1_HZ"),
                       ("FIC32_0_DIVISOR", "BOARD_FIC0_HZ")):
        if int(ccc.get(name, 0)) * defined(rate) != m3:
            yield f"MSS CCC {name} is {ccc.get(name)}: {rate} of drivers/board.h needs {m3 // defined(rate)}"


def of_nets(design):
    for pins, what in TOGETHER:
        if not any(set(pins) <= set(net) for net in design.nets):
            yield f"not on one net: {' '.join(pins)} ({what})"


def of_envm(calls, folder):
    clients = [call for call in calls["envm.cfg"] if call.name == "nvm_set_data_storage_client"]
    if len(clients) != 1:
        yield f"{len(clients)} clients of the eNVM instead of one"
        return
    client = clients[0]
    image = Path(client.one("-memory_file"))
    if not image.is_absolute() or not image.is_file():
        yield f"there is no image {image}"
        return
    first, end = generator.image_extent(image)
    start, words = int(client.one("-base_address") or -1, 0), int(client.one("-number_of_words") or 0)
    if start + first != 0:
        yield f"the image would stand at {start + first:#x} of the eNVM; the M3 boots from 0"
    if words < end:
        yield f"the client has {words} bytes, the image {end}"
    if start + words > settings_start():
        yield f"the client ends at {start + words:#x}, in the drive's settings from {settings_start():#x}"


def of_saved(calls):
    """What is configured is saved, what is used is downloaded first."""
    for configure, save in (("mss_configure_instance", "mss_save_instance_config"),
                            ("sd_configure_core_instance", "sd_save_core_instance_config")):
        done, saved = ([call.one("-instance_name") for call in calls if call.name == name] for name in (configure, save))
        for name in set(done) ^ set(saved):
            yield f"{name} is configured or saved, not both"
    there = {call.one("-vlnv") for call in calls if call.name == "download_core"}
    for vlnv in {call.one("-core_vlnv") for call in calls} - there - {""}:
        yield f"{vlnv} is used, but not downloaded"


def of_blocks(calls, known, board):
    """Each block that can be on or off is told so once; what the firmware uses is on."""
    told = {}
    for call in calls:
        if call.name in ("mss_enable_instance", "mss_disable_instance"):
            told.setdefault(call.one("-instance_name"), []).append(call.name == "mss_enable_instance")
    keys = {"MMUART_0": "console", "MMUART_1": "modbus", "CAN": "can"}
    used = USED + tuple(block for block, key in keys.items() if key in board)
    for block, table in known["mss"]["block"].items():
        if {"on", "off"} & set(table["seen"]) and told.get(block) != [block in used]:
            yield f"MSS {block} is told {told.get(block)} instead of {'on' if block in used else 'off'} once"


def of_components(calls):
    """What is instantiated was made before, and generated; the top is the root."""
    made = {call.one("-hdl_core_name") for call in calls if call.name == "hdl_core_add_bif"}
    made &= {call.one("-module") for call in calls if call.name == "create_hdl_core"}
    generated = [call.one("-component_name") for call in calls if call.name == "generate_component"]
    for call in calls:
        if call.name == "sd_instantiate_hdl_core" and call.one("-hdl_core_name") not in made:
            yield f"no create_hdl_core or bus of {call.one('-hdl_core_name')}"
        if call.name == "sd_instantiate_component" and call.one("-component_name") not in generated:
            yield f"{call.one('-component_name')} is not generated"
        if call.name == "create_smartdesign" and call.one("-sd_name") not in generated:
            yield f"{call.one('-sd_name')} is not generated"
    top = [call.one("-sd_name") + "::work" for call in calls if call.name == "create_smartdesign"]
    if [call.one("-module") for call in calls if call.name == "set_root"] != top:
        yield f"the root is not {' '.join(top)}"


def of_constraints(calls):
    """Both files are in the project, and each tool gets those that it reads."""
    linked = {Path(path).name for call in calls if call.name == "create_links"
              for option in ("-io_pdc", "-sdc") for path in call.options.get(option, [])}
    tools = {call.one("-tool"): {Path(path).name for path in call.options["-file"]} for call in calls
             if call.name == "organize_tool_files"}
    if linked != {"io.pdc", "timing.sdc"}:
        yield f"the project has the constraints {sorted(linked)}"
    if tools != READS:
        yield f"the tools read {tools}, not {READS}"


def of_flow(calls):
    names = [call.one("-name") if call.name == "run_tool" else call.name for call in calls["project.tcl"]]
    there = [name for name in names if name in ORDER or name == "export_prog_job"]
    if there != ORDER + ["export_prog_job"]:
        yield f"the flow is {' '.join(there)}, not {' '.join(ORDER)} export_prog_job"


def findings(calls, design, folder, known, board):
    yield from of_mss(design)
    yield from of_clocks(design)
    yield from of_nets(design)
    yield from of_envm(calls, folder)
    for rule in (of_saved, of_components, of_constraints):
        yield from rule(calls["project.tcl"])
    yield from of_blocks(calls["project.tcl"], known, board)
    yield from of_flow(calls)
