# SPDX-License-Identifier: MIT
"""io.pdc against the board's file and the top; timing.sdc against the clocks and the pins."""
from recording import listed

OSCILLATOR_MHZ = 50
WITH_CLOCK = ("pin_sclk", "pin_cs_n", "pin_temp_sclk", "pin_temp_cs_n", "pin_high", "pin_low", "pin_chopper")
STOPS = ("pin_overcurrent", "pin_driver_fault")


def set_io(calls):
    return [(call.words[0], call.one("-pinname"), call.one("-DIRECTION")) for call in calls["io.pdc"] if call.name == "set_io"]


def lines(board):
    """(port of the top, net, whether it is one of the MSS' own pins)."""
    for block, key in (("MMUART_0", "console"), ("MMUART_1", "modbus")):
        uart = board.get(key, {})
        for line in ("txd", "rxd"):
            if line in uart:
                yield f"{block}_{line.upper()}", uart[line], uart["through"] == "pins"
        if "driver" in uart:
            yield "GPIO_0_M2F", uart["driver"], False
    for port, key in (("CAN_TX", "tx"), ("CAN_RX", "rx"), ("CAN_TX_EN_N", "enable")):
        if "can" in board:
            yield port, board["can"][key], False
    if "clock" in board:
        yield "CLK0_PAD", board["clock"]["net"], False


def of_places(calls, board):
    """Each port is on the pin that the board's file says."""
    told = {key.replace("[", "_").rstrip("]"): net for key, net in board["wired"].items()}
    told |= {port: net for port, net, own in lines(board) if not own}
    for name, package, _ in set_io(calls):
        if name in told and board["nets"][told[name]] != package:
            yield f"{name} is on {package}, and {told[name]} is {board['nets'][told[name]]}"


def of_banks(calls, board):
    told = {call.words[0]: call.one("-vcci") for call in calls["io.pdc"] if call.name == "set_iobank"}
    if told != board.get("bank_volts", {}):
        yield f"banks have {told}, the board's file {board.get('bank_volts', {})}"


def of_pins(calls, design, board):
    """Every net of the board's file has one use, every port of the top one pin, both the same direction."""
    placed = set_io(calls)
    own = [board["nets"][net] for _, net, own in lines(board) if own]
    used = [package for _, package, _ in placed] + own + [board["nets"][net] for net in board["unused"]["nets"]]
    for net, package in board["nets"].items():
        if used.count(package) != 1:
            yield f"pin {package} ({net}) has {used.count(package)} uses instead of one"
    for package in set(used) - set(board["nets"].values()):
        yield f"pin {package} is not in the board's file"
    names = [name for name, _, _ in placed]
    for name in set(names) - design.top.keys():
        yield f"set_io of {name}, which the top does not have"
    for name in inside(design, board):
        if names.count(name) != 1:
            yield f"{name} has {names.count(name)} pins instead of one"
    for name, _, direction in placed:
        if name in design.top and design.top[name].direction != {"INPUT": "in", "OUTPUT": "out"}.get(direction):
            yield f"{name} is {direction} in io.pdc only"


def inside(design, board):
    """Ports of the top that the fabric or the fabric's side of the MSS drives or reads; Libero places the others."""
    own = {port for port, _, own in lines(board) if own}
    return [name for name in design.top if name != "DEVRST_N" and name not in own]


def objects(text, kind):
    return [word.removeprefix(kind + ":") for word in listed(text) if word.startswith(kind + ":")]


def of_clocks(calls, design, board):
    made = {pin: call for call in calls["timing.sdc"] if call.name in ("create_clock", "create_generated_clock")
            for kind in ("pins", "ports") for pin in objects(" ".join(call.words), kind)}
    needed = {"FABOSC_0/I_RCOSC_25_50MHZ/CLKOUT": OSCILLATOR_MHZ, "CCC_0/CCC_INST/GL0": 100}
    if "clock" in board:
        needed["CLK0_PAD"] = board["clock"]["mhz"]
    if "FIC_2_APB_M_PCLK" in design.instances.get("MSS_0", {}):
        needed["MSS_0/MSS_ADLIB_INST/CLK_CONFIG_APB"] = 25
    for pin, mhz in needed.items():
        if pin not in made:
            yield f"no clock is made at {pin}"
        elif frequency(made[pin]) != mhz:
            yield f"the clock at {pin} has {frequency(made[pin]):g} MHz, not {mhz}"


def frequency(call):
    if call.name == "create_clock":
        return 1000 / float(call.one("-period"))
    return OSCILLATOR_MHZ * int(call.one("-multiply_by")) / int(call.one("-divide_by"))


def constrained(calls):
    """{port: [(command, option)]} of what timing.sdc says of ports."""
    said = {}
    for call in calls["timing.sdc"]:
        options = [(option, value) for option, values in call.options.items() for value in values]
        for option, text in options + [("", word) for word in call.words]:
            for port in objects(text, "ports"):
                said.setdefault(port, []).append((call.name, option or next(iter(call.options))))
    return said


def of_ports(calls, design, board):
    said = constrained(calls)
    for port in said.keys() - design.top.keys():
        yield f"timing.sdc names {port}, which the top does not have"
    for port in inside(design, board):
        if port not in said:
            yield f"timing.sdc says nothing of {port}"
    for port in design.top:
        commands = [name for name, _ in said.get(port, [])]
        if "sdata" in port and commands.count("set_input_delay") != 2:
            yield f"{port} needs an input delay, latest and earliest: it answers our own clock"
        if "sdata" in port and "set_multicycle_path" not in commands:
            yield f"{port} needs the clocks after which it is taken"
        if port.startswith(WITH_CLOCK) and commands.count("set_output_delay") != 2:
            yield f"{port} needs an output delay, latest and earliest"
        if port.startswith(STOPS) and "set_max_delay" not in commands:
            yield f"{port} needs a largest delay to the gates"


def of_cells(calls, known, board):
    """Names inside the design: those that Libero is known to make, all of which need a constraint."""
    there = {f"{instance}/{cell}" for instance, cells in known["cells"].items() for cell in cells}
    there.add("CCC_0/CCC_INST/" + ("CLK0_PAD" if "clock" in board else "RCOSC_25_50MHZ"))
    named = set()
    for call in calls["timing.sdc"]:
        for text in [*call.words, *(value for values in call.options.values() for value in values)]:
            for kind in ("pins", "cells", "nets"):
                named.update(objects(text, kind))
    for name in named - there:
        yield f"timing.sdc names {name}, which nobody has seen"
    for name in there - named:
        yield f"timing.sdc says nothing of {name}"


def findings(calls, design, board, known):
    yield from of_places(calls, board)
    yield from of_banks(calls, board)
    yield from of_pins(calls, design, board)
    yield from of_clocks(calls, design, board)
    yield from of_ports(calls, design, board)
    yield from of_cells(calls, known, board)
