# SPDX-License-Identifier: MIT
"""The top as a net list: every port of every instance is on one net, tied, or marked as unused."""
from typing import NamedTuple

from libero import rtl

from recording import listed

SIMPLE = {"sd_instantiate_core": "-core_vlnv", "sd_instantiate_macro": "-macro_name", "sd_instantiate_component":
          "-component_name", "sd_instantiate_hdl_core": "-hdl_core_name"}


class Port(NamedTuple):
    direction: str  # "in", "out" or "bif"
    width: int


class Design(NamedTuple):
    top: dict        # name: Port
    instances: dict  # name: {port: Port}
    params: dict     # instance: {NAME: VALUE}
    mss: dict        # block: {NAME: VALUE}
    nets: list       # of lists of pins
    tied: dict       # pin: VCC or GND
    unused: list


def mss_params(calls):
    return {call.one("-instance_name"): call.params() for call in calls if call.name == "mss_configure_instance"}


def instance_params(calls):
    return {call.one("-instance_name"): call.params() for call in calls if call.name == "sd_configure_core_instance"}


def present(table, has):
    return {name: Port(direction, width) for name, (direction, width, when) in table.items() if not when or has(when)}


def mss_ports(known, blocks):
    def has(when):
        block, _, param = when.partition(" ")
        name, _, value = param.partition(":")
        return blocks.get(block, {}).get(name) == value
    return present(known["mss"]["ports"], has)


def core_ports(table, params):
    return present(table["ports"], lambda when: params.get(when.partition(":")[0]) == when.partition(":")[2])


def wrapper(folder):
    """The modules of the sources that the project imports, with fabric_board on top."""
    return rtl.run_yosys(f"read_verilog {folder}/hdl/*.v; hierarchy -check -top fabric_board; proc; check -assert")


def hdl_ports(modules, calls):
    """The wrapper's ports; those of the bus are one interface."""
    bus = {}
    for call in calls:
        if call.name == "hdl_core_add_bif":
            bus = dict(word.split(":") for word in listed(call.one("-signal_map")))
            bif = call.one("-bif_name")
    ports = modules["fabric_board"]["ports"]
    missing = set(bus.values()) - ports.keys()
    if missing:
        raise ValueError(f"the bus interface names {', '.join(sorted(missing))}, which fabric_board does not have")
    own = {name: Port({"input": "in", "output": "out"}[port["direction"]], len(port["bits"]))
           for name, port in ports.items() if name not in bus.values()}
    return own | ({bif: Port("bif", 0)} if bus else {})


def ports_of(call, calls, known, blocks, params, modules):
    name = call.one(SIMPLE[call.name])
    if call.name == "sd_instantiate_core":
        if "ports" not in known["core"].get(name, {}):
            raise ValueError(f"nobody has seen the ports of {name}")
        return core_ports(known["core"][name], params.get(call.one("-instance_name"), {}))
    if call.name == "sd_instantiate_macro":
        return present(known["macro"][name]["ports"], bool)
    if call.name == "sd_instantiate_component":
        return mss_ports(known, blocks)
    return hdl_ports(modules, calls)


def read(calls, known, modules):
    blocks, params = mss_params(calls), instance_params(calls)
    design = Design({}, {}, params, blocks, [], {}, [])
    for call in calls:
        if call.name == "sd_create_scalar_port":
            design.top[call.one("-port_name")] = Port(call.one("-port_direction").lower(), 1)
        elif call.name in SIMPLE:
            design.instances[call.one("-instance_name")] = ports_of(call, calls, known, blocks, params, modules)
        elif call.name == "sd_connect_pins":
            design.nets.append(listed(call.one("-pin_names")))
        elif call.name == "sd_connect_pins_to_constant":
            design.tied[call.one("-pin_names")] = call.one("-value")
        elif call.name == "sd_mark_pins_unused":
            design.unused.append(call.one("-pin_names"))
    return design


def port_at(design, pin):
    instance, _, port = pin.rpartition(":")
    return design.instances.get(instance, {}).get(port) if instance else design.top.get(pin)


def drives(design, pin):
    """Whether a pin gives its net a value: an instance's output, or an input of the top."""
    return port_at(design, pin).direction == ("out" if ":" in pin else "in")


def uses(design):
    """All that the script says of pins, each as often as it is said."""
    return [pin for net in design.nets for pin in net] + list(design.tied) + design.unused


def net_findings(design, net):
    ports = [port_at(design, pin) for pin in net]
    named = " ".join(net)
    interfaces = sum(port.direction == "bif" for port in ports)
    if interfaces:
        if interfaces != 2 or len(net) != 2:
            yield f"a bus joins exactly two interfaces: {named}"
        return
    drivers = sum(drives(design, pin) for pin in net)
    if drivers != 1:
        yield f"{drivers} drivers of {named}"
    if len({port.width for port in ports}) != 1:
        yield f"different widths: {named}"


def findings(design):
    said = uses(design)
    for pin in said:
        if port_at(design, pin) is None:
            yield f"there is no pin {pin}, configured as it is"
        elif said.count(pin) > 1:
            yield f"said twice: {pin}"
    there = list(design.top) + [f"{name}:{port}" for name, ports in design.instances.items() for port in ports]
    for pin in there:
        if pin not in said:
            yield f"open: {pin}"
    for net in design.nets:
        if all(port_at(design, pin) for pin in net):
            yield from net_findings(design, net)
    for pin in design.unused:
        if port_at(design, pin) and port_at(design, pin).direction == "in":
            yield f"an input is marked as unused: {pin}"


def opposite(top, name, bit):
    """The wrapper's bit that a bit of the fabric belongs to: of a bus of the same name, or the port of that pin."""
    if name in top["ports"]:
        return top["ports"][name]["bits"][bit]
    return top["ports"].get(f"{name}_{bit}", {"bits": [None]})["bits"][0]


def inside_findings(modules, board):
    """The fabric in its wrapper: each bit leads to its own pin, unless the board ties it or leaves it open."""
    top = modules["fabric_board"]
    cell = top["cells"]["axes"]
    for name, port in modules[cell["type"]]["ports"].items():
        bits = cell["connections"].get(name, [])
        for n in range(len(port["bits"])):
            bit = bits[n] if n < len(bits) else None
            said = [table[key] for table in (board["tied"], board["open"]) for key in (name, f"{name}[{n}]") if key in table]
            if not said and (bit is None or bit != opposite(top, name, n)):
                yield f"fabric's {name}[{n}] does not lead to its own pin"
            elif said and port["direction"] == "input" and bit != str(said[0]):
                yield f"fabric's {name}[{n}] is not tied to {said[0]}"
    told = int(modules[cell["type"]]["parameter_default_values"]["IN_EN"], 2)
    if told != (2 ** board["axes"] - 1 if board["legs"] == "in_en" else 0):
        yield f"the fabric is told IN_EN {told}, and the board's legs are {board['legs']}"
    if "bring_up_only" in board and {cell["connections"][name][0] for name in ("pin_sto_a_n", "pin_sto_b_n")} != {"0"}:
        yield "a board that samples nothing must hold both STO inputs at 0"
