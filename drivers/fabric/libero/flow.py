# SPDX-License-Identifier: MIT
"""project.tcl, which runs the others, constraints.tcl, and build.tcl: synthesis to programming job."""
from . import tcl
from .design import TOP

REPOSITORIES = "www.microchip-ip.com/repositories"
PART = (("-adv_options", "PLL_SUPPLY:PLL_SUPPLY_33"), ("-adv_options", "SYSTEM_CONTROLLER_SUSPEND_MODE:0"),
        ("-adv_options", "IO_DEFT_STD:LVCMOS 3.3V"), ("-adv_options", "DSW_VCCA_VOLTAGE_RAMP_RATE:100_MS"))
PLACEROUTE = ("TDPR:true", "EFFORT_LEVEL:true", "REPAIR_MIN_DELAY:true")
STATES = """# to check: the state of the gate pins during programming
# It should be 0. Libero keeps that in a file whose format is not public: set it once in
# "Configure I/O States During JTAG Programming", save it as gates.ios beside this script, and make the project anew.
if {[file exists $here/gates.ios]} {
    configure_tool -name {IO_PROGRAMMING_STATE} -params "ios_file:$here/gates.ios"
} else {
    puts "mssfoc: no gates.ios: while programming, the gate pins float, and only the board's pull-downs hold the bridge off"
}"""


def project(board, system):
    where = ["-name {drive}", "-location $here/libero", "-family {SmartFusion2}", f"-die {{{board['die']}}}",
             f"-package {{{board['package']}}}", f"-speed {{{board['speed']}}}", "-die_voltage {1.2}", "-part_range {COM}",
             "-hdl {VERILOG}"] + [f"{option} {{{value}}}" for option, value in PART]
    lines = tcl.head(board, "the whole project: `libero SCRIPT:project.tcl`, in this folder")
    if "bring_up_only" in board:
        lines.append(f"puts {{mssfoc: for the bring-up alone: {board['bring_up_only']}}}")
    lines += [tcl.TO_CHECK + what for what in board.get("to_check", [])]
    lines += ["set here [pwd]",
              'if {![file exists $here/project.tcl]} {error "mssfoc: start Libero in the folder of project.tcl"}',
              'if {[file exists $here/libero]} {error "mssfoc: $here/libero is there already; delete it, or open it there"}',
              'proc step {what} {puts "mssfoc: $what"}', "", tcl.step("project"), "new_project " + " \\\n    ".join(where), ""]
    lines.append(f"{tcl.TO_CHECK}whether Microchip still offers these versions: all are from projects of 2017 to 2024")
    lines += [f"download_core -vlnv {{{vlnv}}} -location {{{REPOSITORIES}/{part}}}" for vlnv, part in system["core"].values()]
    lines += [f"source $here/{name}.tcl" for name in ("mss", "design", "constraints")]
    lines += ["save_project", "source $here/build.tcl", "save_project"]
    return "\n".join(lines) + "\n"


def constraints(board):
    module = f"-module {{{TOP}::work}} -input_type {{constraint}}"
    lines = tcl.head(board, "which tool reads which constraints") + [tcl.step("constraints")]
    lines += [f"create_links -convert_EDN_to_HDL 0 {what}" for what in ("-io_pdc $here/io.pdc", "-sdc $here/timing.sdc")]
    for tool in ("SYNTHESIZE", "VERIFYTIMING"):
        lines.append(f"organize_tool_files -tool {{{tool}}} -file $here/timing.sdc {module}")
    lines.append(f"organize_tool_files -tool {{PLACEROUTE}} -file $here/timing.sdc -file $here/io.pdc {module}")
    return "\n".join(lines) + "\n"


def build(board):
    options = " ".join(f"-params {{{option}}}" for option in PLACEROUTE)
    export = f"$here/libero/designer/{TOP}/export"
    lines = tcl.head(board, "synthesis to programming job")
    lines += [tcl.step("build: SYNTHESIZE"), "run_tool -name {SYNTHESIZE}", f"configure_tool -name {{PLACEROUTE}} {options}"]
    for tool in ("PLACEROUTE", "VERIFYTIMING", "GENERATEPROGRAMMINGDATA"):
        lines += [tcl.step(f"build: {tool}"), f"run_tool -name {{{tool}}}"]
    lines += STATES.splitlines() + [tcl.step("build: GENERATEPROGRAMMINGFILE"), "run_tool -name {GENERATEPROGRAMMINGFILE}"]
    lines += [f"export_prog_job -job_file_name {{{TOP}}} -export_dir {export} -bitstream_file_type {{TRUSTED_FACILITY}} "
              "-bitstream_file_components {FABRIC ENVM} -include_plaintext_passkey 0",
              f'puts "mssfoc: {export}/{TOP}.job is for FlashPro Express. Read the timing report before you program."']
    return "\n".join(lines) + "\n"
