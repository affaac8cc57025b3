# SPDX-License-Identifier: MIT
"""io.pdc and timing.sdc: where each pin is, and when what passes through it must be there."""
from . import tcl
from .board import CLOCK as PAD
from .wrong import Wrong

OSCILLATOR_MHZ = 50
CLOCK = "CCC_0/GL0"
GATES = ("pin_high_", "pin_low_")
SWITCHES = GATES + ("pin_chopper_",)
PULLED_DOWN = SWITCHES + ("pin_sto_",)
STOPS = ("pin_overcurrent_", "pin_driver_fault_")
READERS = {"converters": ("pin_sclk_", "pin_cs_n_", "pin_sdata_"),
           "thermometer": ("pin_temp_sclk_", "pin_temp_cs_n_", "pin_temp_sdata_")}
STOP_NS = 20  # from a stop pin to the gates, by logic alone
CONFIG_APB = 4  # FIC_2's clock is the M3's, divided by this: no design needs it faster

PDC_NOTE = """# Each pin of a gate or of the chopper needs a pull-down of at most 4.7 kOhm on the board: until the device is
# programmed, it is an input with a weak pull-up. The STO inputs need one, too: 0 stops. While programming: build.tcl.
# The device's own pull-downs are weak, and there only once it is programmed: where a wire breaks, and in low-power modes.
"""
PULL = tcl.UNCONFIRMED + "set_io -RES_PULL Down: public constraints for this family have only Up"



def pdc(board, use):
    lines = tcl.head(board, "pins") + PDC_NOTE.splitlines() + [PULL, ""]
    for bank, volts in board.get("bank_volts", {}).items():
        lines.append(f"set_iobank {bank} -vcci {volts} -fixed no")
    standard = f" -iostd {board['io_standard']}" if "io_standard" in board else ""
    for pin in use.pins:
        lines.append(f"# {pin.port}: {pin.net}" + (f", {pin.package}: the MSS' own, placed by Libero" if pin.own else ""))
        if not pin.own:
            drive = " -OUT_DRIVE 12" if pin.port.startswith(SWITCHES) else ""
            pull = " -RES_PULL Down" if pin.port.startswith(PULLED_DOWN) else ""
            lines.append(f"set_io {pin.port} -pinname {pin.package} -fixed yes{standard}{drive}{pull} "
                         f"-DIRECTION {pin.direction.upper()}")
    return "\n".join(lines) + "\n"


def ports(pins):
    return f"[ get_ports {tcl.braced(pins)} ]"


def clocks(board, system):
    mhz = system["clock_mhz"]
    source = PAD if "clock" in board else "RCOSC_25_50MHZ"
    yield "# clocks, by the names that Libero derives"
    yield "create_clock -name {FABOSC_0/I_RCOSC_25_50MHZ/CLKOUT} -period 20 [ get_pins { FABOSC_0/I_RCOSC_25_50MHZ/CLKOUT } ]"
    if "clock" in board:
        yield f"create_clock -name {{{PAD}}} -period 20 {ports([PAD])}"
    yield (f"create_generated_clock -name {{{CLOCK}}} -multiply_by {2 * mhz // OSCILLATOR_MHZ} -divide_by 2 "
           f"-source [ get_pins {{ CCC_0/CCC_INST/{source} }} ] -phase 0 [ get_pins {{ CCC_0/CCC_INST/GL0 }} ]")
    yield (f"create_clock -name {{MSS_0/CLK_CONFIG_APB}} -period {1000 * CONFIG_APB // mhz} "
           "[ get_pins { MSS_0/MSS_ADLIB_INST/CLK_CONFIG_APB } ]")
    yield "# CoreResetP synchronises these itself; the device's reset comes whenever it likes"
    yield "set_false_path -ignore_errors -through [ get_pins { SYSRESET_0/POWER_ON_RESET_N } ]"
    yield ("set_false_path -ignore_errors -from [ get_cells { CORERESETP_0/MSS_HPMS_READY_int } ] "
           "-to [ get_cells { CORERESETP_0/sm0_areset_n_rcosc CORERESETP_0/sm0_areset_n_rcosc_q1 } ]")
    yield "set_false_path -ignore_errors -through [ get_nets { CORERESETP_0/ddr_settled CORERESETP_0/count_ddr_enable } ]"


def reader(name, names, period, clocks_a_bit, sampling, part):
    """SCLK and CS leave within a window; each bit answers an edge of SCLK and is taken 2 HALF clocks after it was launched."""
    sclk, cs, data = names
    leaves, wires = sampling["sclk_leaves_ns"], sampling["wires_ns"]
    latest = leaves[1] + wires[1] + part["data_ns"]
    if latest >= clocks_a_bit * period:
        raise Wrong(f"{name}: a bit is there {latest:g} ns after its clock and taken after {clocks_a_bit * period:g}; "
                    "shorten wires_ns or sclk_leaves_ns, or set a larger HALF in adc.v")
    yield f"# {part['what']}"
    if "to_check" in part:
        yield f"{tcl.TO_CHECK}{part['to_check']}"
    yield f"set_output_delay -max {period - leaves[1]:.3f} -clock {{ {CLOCK} }} {ports(sclk + cs)}"
    yield f"set_output_delay -min {-leaves[0]:.3f} -clock {{ {CLOCK} }} {ports(sclk + cs)}"
    yield f"set_input_delay -max {latest:.3f} -clock {{ {CLOCK} }} {ports(data)}"
    yield f"set_input_delay -min {leaves[0] + wires[0] + part['hold_ns']:.3f} -clock {{ {CLOCK} }} {ports(data)}"
    yield f"set_multicycle_path -setup_only {clocks_a_bit} -from {ports(data)}"


def of(pins, *prefixes):
    return [pin.port for pin in pins if pin.port.startswith(prefixes)]


def power_stage(use):
    gates, stops, outputs = of(use.pins, *GATES), of(use.pins, *STOPS), of(use.pins, *SWITCHES)
    yield "# the power stage: all edges of one clock alike; a stop passes through by logic alone"
    yield f"set_output_delay -max 0.300 -clock {{ {CLOCK} }} {ports(outputs)}"
    yield f"set_output_delay -min 0.300 -clock {{ {CLOCK} }} {ports(outputs)}"
    if stops:
        yield f"set_max_delay {STOP_NS} -from {ports(stops)} -to {ports(gates)}"


def sdc(board, system, fabric, use, parts):
    if of(use.pins, "pin_mod_"):
        raise Wrong(f"{board['name']}: modulators are wired, and this generator has no times for them; tie pin_mod_data")
    lines = tcl.head(board, "times") + list(clocks(board, system)) + list(power_stage(use))
    done = set(of(use.pins, *SWITCHES, *STOPS, PAD))
    if "sampling" in board:
        for name, prefixes in READERS.items():
            names = [of(use.pins, prefix) for prefix in prefixes]
            part = board["sampling"][name]
            if part not in parts:
                raise Wrong(f"{board['name']}: {name} = {part}; converters.toml has {', '.join(parts)}")
            lines += reader(name, names, 1000 / system["clock_mhz"], 2 * fabric.half[name], board["sampling"], parts[part])
            done.update(*names)
    lines.append("# asynchronous: two flip-flops behind each, or the MSS' own affair")
    for option, direction in (("-from", "input"), ("-to", "output")):
        rest = [pin.port for pin in use.pins if pin.port not in done and pin.direction == direction and not pin.own]
        if rest:
            lines.append(f"set_false_path {option} {ports(rest)}")
    return "\n".join(lines) + "\n"
