# SPDX-License-Identifier: MIT
"""mss.tcl: the MSS block by block, and the image as a client of the eNVM."""
from . import tcl

COMPONENT = "drive_MSS"
MODEM = ("CTS", "DCD", "DSR", "DTR", "RI", "RTS")
LINES = ("CLK", "RXD", "TXD", "TXD_RXD")


def uart_params(common, uart):
    params = dict(common)
    through = {"fabric": "CONNECTION_FABRIC", "pins": "CONNECTION_IO"}[uart["through"]]
    for line in LINES + MODEM:
        params |= {f"{line}_CONNECTION": through if line in LINES else "CONNECTION_IO", f"{line}_FAB_CAPT": "false",
                   f"{line}_GPIO_CAPT": "false"}
    return params


def blocks(system, use):
    """{block: parameters} of what is on, and the blocks that are off."""
    uarts = dict(use.uarts())
    on = {name: tcl.expanded(params) for name, params in system["mss"]["block"].items()}
    for block, uart in uarts.items():
        on[block] = uart_params(system["uart"], uart)
    if "can" in use.board:
        on["CAN"] = dict(system["can"])
    off = [block for block in (*system["mss"]["off"], "MMUART_0", "MMUART_1") if block not in on]
    if any("driver" in uart for uart in uarts.values()):
        on["GPIO"] |= system["gpio"]
    return on, off


def marks(system, block, params):
    """Comments on what of this block no public script has."""
    for key, why in system["unconfirmed"].items():
        _, named, *rest = key.split(" ")
        if named == block and (not rest or rest[0] in params):
            yield f"{tcl.UNCONFIRMED}{key}: {why}"


def configured(system, block, params, enable):
    where = f"-component_name {{{COMPONENT}}} -instance_name {{{block}}}"
    yield ""
    yield tcl.step(f"MSS: {block}")
    yield from marks(system, block, params)
    if enable:
        yield f"mss_enable_instance {where}"
    yield f"mss_configure_instance {where} -params {tcl.param_list(params)}"
    yield f"mss_save_instance_config {where}"


def envm(words, image):
    """Libero wants the path of the image whole, so the file is written when the script runs."""
    client = (f"nvm_set_data_storage_client -client_name {{mssfoc}} -number_of_words {words} -word_size 8 "
              "-use_for_simulation {0} -content_type {MEMORY_FILE} -memory_file_format {INTELHEX} "
              f"-memory_file {{$here/{image}.hex}} -base_address 0 -reprogram 1 -use_as_rom 0 -lock_address 0")
    return ["", tcl.step("MSS: eNVM"),
            "# The image counts from the start of the eNVM; the settings behind it are the drive's own.",
            "set file [open $here/envm.cfg w]", f'puts $file "{client}"', "close $file",
            f"mss_configure_envm -component_name {{{COMPONENT}}} -cfg_file $here/envm.cfg"]


def script(board, system, use, words, image):
    on, off = blocks(system, use)
    optional = set(system["mss"]["on"]) | {"MMUART_0", "MMUART_1", "CAN"}
    lines = tcl.head(board, "the MSS")
    vlnv = system["core"]["MSS"][0]
    lines += ["# DDRB and SECURITY are not named here: the configurator's defaults are what all public designs have",
              tcl.step("MSS: component"),
              f"create_and_configure_core -core_vlnv {{{vlnv}}} -component_name {{{COMPONENT}}} -params {{}}"]
    for block in off:
        lines.append(f"mss_disable_instance -component_name {{{COMPONENT}}} -instance_name {{{block}}}")
    for block, params in on.items():
        lines += configured(system, block, params, block in optional)
    lines += envm(words, image) + ["", tcl.step("MSS: generate"), f"generate_component -component_name {{{COMPONENT}}}"]
    return "\n".join(lines) + "\n"
