# SPDX-License-Identifier: MIT
"""design.tcl: the top, with its instances and the nets between them."""
from . import tcl
from .board import CLOCK

TOP = "drive"
SD = f"-sd_name {{{TOP}}}"
PAD = " -port_is_pad {1}"


def ports(use):
    yield f"sd_create_scalar_port {SD} -port_name {{DEVRST_N}} -port_direction {{IN}}{PAD}"
    for pin in use.pins:
        direction = {"input": "IN", "output": "OUT"}[pin.direction]
        pad = PAD if pin.own or pin.port == CLOCK else ""
        yield f"sd_create_scalar_port {SD} -port_name {{{pin.port}}} -port_direction {{{direction}}}{pad}"


def instance(system, name, what):
    named = f"-instance_name {{{name}}}"
    yield ""
    yield tcl.step(f"design: {name}")
    if "core" in what:
        yield f"sd_instantiate_core {SD} -core_vlnv {{{system['core'][what['core']][0]}}} {named}"
        params = tcl.param_list(tcl.expanded(what["params"]))
        yield f"sd_configure_core_instance {SD} {named} -params {params} -validate_rules 0"
        yield f"sd_save_core_instance_config {SD} {named}"
    elif "component" in what:
        yield f"sd_instantiate_component {SD} -component_name {{{what['component']}}} {named}"
    elif "macro" in what:
        yield f"sd_instantiate_macro {SD} -macro_name {{{what['macro']}}} {named}"
    else:
        yield f"sd_instantiate_hdl_core {SD} -hdl_core_name {{{what['hdl']}}} {named}"
    for pin, level in what.get("tied", {}).items():
        yield f"sd_connect_pins_to_constant {SD} -pin_names {{{name}:{pin}}} -value {{{level}}}"
    for pin in what.get("unused", []):
        yield f"sd_mark_pins_unused {SD} -pin_names {{{name}:{pin}}}"


def inside(pin):
    """What leads to this pin of the top: the fabric, the CCC, or the MSS by its own name for it."""
    if pin.port.startswith("pin_"):
        return f"fabric_board_0:{pin.port}"
    if pin.port == CLOCK:
        return f"CCC_0:{CLOCK}"
    if pin.own or pin.port == "GPIO_0_M2F":
        return f"MSS_0:{pin.port}"
    return f"MSS_0:{pin.port}" + ("_M2F" if pin.direction == "output" else "_F2M")


def nets(system, use):
    """{name: pins}: the system's and the board's."""
    return system["nets"] | {pin.port: [pin.port, inside(pin)] for pin in use.pins}


def hdl_core(system, sources):
    yield tcl.step("design: sources")
    for name in sources:
        yield f"import_files -hdl_source $here/hdl/{name}"
    yield "build_design_hierarchy"
    yield "create_hdl_core -file {hdl/fabric_board.v} -module {fabric_board} -library {work} -package {}"
    yield ("hdl_core_add_bif -hdl_core_name {fabric_board} -bif_definition {APB:AMBA:AMBA2:slave} -bif_name {APB} -signal_map "
           + tcl.param_list(system["fabric"]["bus"]))
    yield "build_design_hierarchy"


def script(board, system, use, sources):
    lines = tcl.head(board, "the top") + list(hdl_core(system, sources))
    lines += ["", tcl.step("design: top"), f"create_smartdesign {SD}", "auto_promote_pad_pins -promote_all 0", *ports(use)]
    for name, what in system["instance"].items():
        lines += instance(system, name, what)
    lines += ["", tcl.step("design: nets")]
    lines += [f"sd_connect_pins {SD} -pin_names {tcl.names(pins)}" for pins in nets(system, use).values()]
    lines += ["", tcl.step("design: generate"), "auto_promote_pad_pins -promote_all 1", f"save_smartdesign {SD}",
              f"generate_component -component_name {{{TOP}}}", "build_design_hierarchy", f"set_root -module {{{TOP}::work}}",
              "build_design_hierarchy"]
    return "\n".join(lines) + "\n"
