# SPDX-License-Identifier: MIT
"""fabric_board.v: the fabric with this board's pins, one port a pin; what is tied or open is so in here."""


def range_of(width):
    return f"[{width - 1}:0] " if width > 1 else ""


def outside(fabric, system):
    """(name, direction, width) of the wrapper's ports that lead to the MSS."""
    widths = system["fabric"]["ports"]
    return [(port.name, port.direction, widths[port.name]) for port in fabric.ports if port.name in widths]


def bus_value(port, width):
    """What the fabric's port gets or gives, where the other side is wider."""
    if port.width == width:
        return port.name
    return f"{port.name}[{port.width - 1}:0]"


def pin_value(port, use):
    bits = []
    for bit in reversed(range(port.width)):
        if (port.name, bit) in use.tied:
            bits.append(f"1'b{use.tied[port.name, bit]}")
        else:
            bits.append(f"{'open_' if (port.name, bit) in use.open else ''}{port.name}_{bit}")
    if all(bit.startswith("open_") for bit in bits):
        return ""
    return bits[0] if len(bits) == 1 else "{" + ", ".join(bits) + "}"


def spare_wires(fabric, use):
    """For bits that are open beside others that are not."""
    for port in fabric.ports:
        open_bits = [bit for bit in range(port.width) if (port.name, bit) in use.open]
        if 0 < len(open_bits) < port.width:
            yield f"    wire {', '.join(f'open_{port.name}_{bit}' for bit in open_bits)};"


def in_en(board):
    """Of all axes, if the board's drivers have an input and an enable for each leg."""
    return f", .IN_EN({2 ** board['axes'] - 1})" if board["legs"] == "in_en" else ""


def idle(fabric, system):
    widths = system["fabric"]["ports"]
    for port in fabric.ports:
        width = widths.get(port.name, port.width)
        if width > port.width and port.direction == "output":
            yield f"    assign {port.name}[{width - 1}:{port.width}] = {width - port.width}'d0;"


def verilog(board, system, fabric, use):
    ports = [f"    {direction:6} wire {range_of(width)}{name}" for name, direction, width in outside(fabric, system)]
    ports += [f"    {pin.direction:6} wire {pin.port}" for pin in use.pins if pin.port.startswith("pin_")]
    inner = []
    for port in fabric.ports:
        width = system["fabric"]["ports"].get(port.name)
        value = bus_value(port, width) if width else pin_value(port, use)
        inner.append(f"        .{port.name}({value})")
    lines = ["// SPDX-License-Identifier: MIT",
             f"// The fabric on {board['title']}; written by `make libero BOARD={board['name']}`.",
             "`default_nettype none", "module fabric_board (", ",\n".join(ports), ");", *spare_wires(fabric, use),
             f"    fabric #(.AXES({board['axes']}){in_en(board)}) axes (", ",\n".join(inner) + ");", *idle(fabric, system),
             "endmodule", "`default_nettype wire"]
    return "\n".join(lines) + "\n"
