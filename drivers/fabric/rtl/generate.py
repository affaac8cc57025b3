# SPDX-License-Identifier: MIT
"""Makes everything that repeats drivers/fabric/registers.toml. `make registers` writes the files into build/fabric/.

generate.py contract3.h        prints offsets, masks and resets for C
generate.py mssfoc_regs.vh     the same for the RTL's decode
generate.py mssfoc.svd         CMSIS-SVD, for debuggers
generate.py plant_regs.vh      the RTL's decode of the plant's registers, of drivers/fabric/rtl/plant/registers.toml
generate.py                    renews the tables of docs/fabric.md, between their markers
generate.py --check            says whether those are stale, and exits 1 if they are
"""
import re
import sys
import tomllib
from pathlib import Path
from xml.sax.saxutils import escape

ROOT = Path(__file__).resolve().parents[3]
SOURCE = "drivers/fabric/registers.toml"
PLANT = "drivers/fabric/rtl/plant/registers.toml"
PAGE = "docs/fabric.md"
ACCESS = {"RO": "read-only", "RW": "read-write", "RW1C": "read-write", "WO": "write-only"}
WRITTEN = ("RW", "WO")
NAME = re.compile(r"[A-Z][A-Z0-9_]*\Z")


class Wrong(Exception):
    """The description contradicts itself."""


def bits_of(field):
    """(high, low) of "7:4" or "3"."""
    high, _, low = field["bits"].partition(":")
    return int(high), int(low or high)


def mask_of(fields):
    mask = 0
    for field in fields:
        high, low = bits_of(field)
        mask |= (1 << (high + 1)) - (1 << low)
    return mask


def fields_with(register, *accesses):
    return [field for field in register["field"] if field["access"] in accesses]


def checked(spec):
    """The description with each field's access filled in; raises Wrong."""
    slots = set()
    for block in spec["block"]:
        if block["slot"] in slots:
            raise Wrong(f"block {block['name']}: slot {block['slot']} is taken")
        slots.add(block["slot"])
        offsets, names = set(), set()
        for register in block["register"]:
            where = f"{block['name']}.{register['name']}"
            if register["offset"] in offsets or register["name"] in names:
                raise Wrong(f"{where}: offset or name is taken")
            if register["offset"] % 4 or not 0 <= register["offset"] < spec["slot_bytes"]:
                raise Wrong(f"{where}: offset {register['offset']:#x} is not a word of its slot")
            offsets.add(register["offset"])
            names.add(register["name"])
            check_fields(where, register)
    macros = re.findall(r"^`define (\w+)", verilog_header(spec), re.M)
    twice = {name for name in macros if macros.count(name) > 1}
    if twice:
        raise Wrong(f"two things would be called {', '.join(sorted(twice))}")
    return spec


def check_fields(where, register):
    taken = 0
    for field in register["field"]:
        high, low = bits_of(field)
        field.setdefault("access", register["access"])
        if not NAME.match(field["name"]) or field["access"] not in ACCESS or not 31 >= high >= low >= 0:
            raise Wrong(f"{where}.{field['name']}: name, access or bits are not allowed")
        if taken & mask_of([field]):
            raise Wrong(f"{where}.{field['name']}: its bits are taken")
        taken |= mask_of([field])
    if register["reset"] & ~taken:
        raise Wrong(f"{where}: reset {register['reset']:#x} sets bits that no field has")


def aligned(rows):
    """#define lines, their values below each other."""
    width = max(len(name) for name, _ in rows)
    return "".join(f"#define {name:<{width}} {value}\n" for name, value in rows)


def c_header(spec):
    out = ["/* SPDX-License-Identifier: MIT */\n",
           f"/* Generated from {SOURCE} by drivers/fabric/rtl/generate.py: change it there.\n",
           " *\n",
           " * FABRIC3_<block>_<register> is an offset in the axis' window, ..._RESET its value after a reset, and\n",
           " * ..._<field>_MASK and _SHIFT are a field's bits.\n",
           " */\n#ifndef DRIVERS_FABRIC_CONTRACT3_H\n#define DRIVERS_FABRIC_CONTRACT3_H\n\n"]
    out.append(aligned([("FABRIC3_BASE", f"0x{spec['base']:08X}u"), ("FABRIC3_AXIS_BYTES", f"0x{spec['axis_bytes']:X}u")]))
    for block in spec["block"]:
        out.append(f"\n/* {block['name']}: {block['about']} */\n")
        rows = []
        for register in block["register"]:
            name = f"FABRIC3_{block['name']}_{register['name']}"
            rows.append((name, f"0x{block['slot'] * spec['slot_bytes'] + register['offset']:03X}u"))
            rows.append((f"{name}_RESET", f"0x{register['reset']:X}u"))
            for field in register["field"]:
                rows.append((f"{name}_{field['name']}_MASK", f"0x{mask_of([field]):08X}u"))
                rows.append((f"{name}_{field['name']}_SHIFT", f"{bits_of(field)[1]}u"))
        out.append(aligned(rows))
    out.append("\n#endif\n")
    return "".join(out)


def verilog_header(spec):
    """Macros rather than parameters: a module that does not use one of them need not be told so."""
    source = spec.get("source", SOURCE)
    guard = "PLANT_REGS_VH" if source == PLANT else "MSSFOC_REGS_VH"
    out = ["// SPDX-License-Identifier: MIT\n",
           f"// Generated from {source} by drivers/fabric/rtl/generate.py: change it there.\n",
           "//   <block>_<register>         word address in its slot\n",
           "//   ..._RESET                  value after a reset, as wide as the register's highest bit asks\n",
           "//   ..._WRITABLE, ..._READABLE bits that keep what is written; bits that are not always 0\n",
           "//   ..._<field>                its bits, for a part-select; ..._<field>_LSB the lowest\n",
           f"`ifndef {guard}\n`define {guard}\n"]
    if source == SOURCE:
        out.append(f"\n`define CONTRACT_SLOTS {len(spec['block'])}\n")
    for block in spec["block"]:
        out.append(f"\n// {block['name']}: {block['about']}\n`define {block['name']}_SLOT 2'd{block['slot']}\n")
        for register in block["register"]:
            name = f"{block['name']}_{register['name']}"
            out.append(f"`define {name} 6'h{register['offset'] // 4:02X}\n")
            width = max(bits_of(field)[0] for field in register["field"]) + 1
            out.append(f"`define {name}_RESET {width}'h{register['reset']:X}\n")
            out.append(f"`define {name}_WRITABLE 32'h{mask_of(fields_with(register, *WRITTEN)):08X}\n")
            out.append(f"`define {name}_READABLE 32'h{mask_of(fields_with(register, 'RO', 'RW', 'RW1C')):08X}\n")
            for field in register["field"]:
                high, low = bits_of(field)
                out.append(f"`define {name}_{field['name']} {f'{high}:{low}' if high > low else high}\n")
                out.append(f"`define {name}_{field['name']}_LSB {low}\n")
        out.append("// by word address, for proofs\n")
        out.append(by_address(block, "WRITABLE_AT", lambda register: mask_of(fields_with(register, *WRITTEN))))
        out.append(by_address(block, "READABLE_AT", lambda register: mask_of(fields_with(register, "RO", "RW", "RW1C"))))
        out.append(by_address(block, "RESET_AT", lambda register: register["reset"]))
        out.append(by_address(block, "LOCKED_AT", lambda register: 1 if register.get("locked") else 0))
    out.append("\n`endif\n")
    return "".join(out)


def by_address(block, name, value):
    """A macro that picks one word of each register by its address, and 0 where there is none."""
    picks = [f"(a) == 6'h{register['offset'] // 4:02X} ? 32'h{value(register):X} : \\\n    "
             for register in block["register"] if value(register)]
    return f"`define {block['name']}_{name}(a) ({''.join(picks)}32'h0)\n"


def svd_field(field):
    high, low = bits_of(field)
    clears = "<modifiedWriteValues>oneToClear</modifiedWriteValues>" if field["access"] == "RW1C" else ""
    return (f"            <field><name>{field['name']}</name><description>{escape(field['about'])}</description>"
            f"<bitRange>[{high}:{low}]</bitRange><access>{ACCESS[field['access']]}</access>{clears}</field>\n")


def svd_register(register):
    return (f"        <register>\n          <name>{register['name']}</name>\n"
            f"          <description>{escape(register['about'])}</description>\n"
            f"          <addressOffset>0x{register['offset']:02X}</addressOffset>\n"
            f"          <access>{ACCESS[register['access']]}</access>\n"
            f"          <resetValue>0x{register['reset']:08X}</resetValue>\n          <fields>\n"
            + "".join(map(svd_field, register["field"])) + "          </fields>\n        </register>\n")


def svd(spec):
    out = ['<?xml version="1.0" encoding="utf-8"?>\n<!-- SPDX-License-Identifier: MIT -->\n',
           f"<!-- Generated from {SOURCE} by drivers/fabric/rtl/generate.py: change it there. -->\n",
           '<device schemaVersion="1.3" xmlns:xs="http://www.w3.org/2001/XMLSchema-instance" '
           'xs:noNamespaceSchemaLocation="CMSIS-SVD.xsd">\n'
           f"  <name>mssfoc</name>\n  <version>{spec['contract']}</version>\n"
           "  <description>mssfoc's fabric on SmartFusion2, first axis</description>\n"
           "  <addressUnitBits>8</addressUnitBits>\n  <width>32</width>\n  <size>32</size>\n  <peripherals>\n"]
    for block in spec["block"]:
        base = spec["base"] + block["slot"] * spec["slot_bytes"]
        out.append(f"    <peripheral>\n      <name>{block['name']}</name>\n"
                   f"      <description>{escape(block['about'])}</description>\n"
                   f"      <baseAddress>0x{base:08X}</baseAddress>\n"
                   f"      <addressBlock><offset>0</offset><size>0x{spec['slot_bytes']:X}</size><usage>registers</usage>"
                   "</addressBlock>\n      <registers>\n")
        out.extend(map(svd_register, block["register"]))
        out.append("      </registers>\n    </peripheral>\n")
    out.append("  </peripherals>\n</device>\n")
    return "".join(out)


def table(block):
    """The block's registers as a table of the page, fields in the last column."""
    rows = ["| offset | name | access | reset | what |\n|---|---|---|---|---|\n"]
    for register in block["register"]:
        fields = [field_text(register, field) for field in register["field"]]
        locked = " Only while the PWM is off." if register.get("locked") else ""
        reset = f"{register['reset']:#x}" if register["reset"] > 65535 else register["reset"]
        reset = "its own" if register.get("volatile") else reset
        rows.append(f"| 0x{register['offset']:02X} | {register['name']} | {register['access']} | {reset} | "
                    f"{register['about']}{locked} {'; '.join(fields)} |\n")
    return "".join(rows)


def field_text(register, field):
    access = f" ({field['access']})" if field["access"] != register["access"] else ""
    return f"b{field['bits']} {field['name']}{access}: {field['about']}"


def page(spec, text):
    """The page with the tables between its markers renewed."""
    for block in spec["block"]:
        begin, end = f"<!-- registers {block['name']} -->\n", f"<!-- end {block['name']} -->\n"
        if text.count(begin) != 1 or text.count(end) != 1:
            raise Wrong(f"{PAGE}: the markers of {block['name']} are not there once each")
        head, rest = text.split(begin)
        text = head + begin + table(block) + end + rest.split(end)[1]
    return text


PRODUCTS = {"contract3.h": c_header, "mssfoc_regs.vh": verilog_header, "mssfoc.svd": svd, "plant_regs.vh": verilog_header}


def source_of(product):
    return PLANT if product == "plant_regs.vh" else SOURCE


def described(root=ROOT, source=SOURCE):
    with open(root / source, "rb") as stream:
        return checked(tomllib.load(stream) | {"source": source})


def renewed_page(root=ROOT):
    """(its text, its text with fresh tables)."""
    text = (root / PAGE).read_text(encoding="utf-8")
    return text, page(described(root, PLANT), page(described(root), text))


def main(arguments):
    try:
        if arguments == ["--check"]:
            old, new = renewed_page()
            if old != new:
                print(f"{PAGE} is stale: run drivers/fabric/rtl/generate.py", file=sys.stderr)
                return 1
        elif not arguments:
            (ROOT / PAGE).write_text(renewed_page()[1], encoding="utf-8")
        elif len(arguments) == 1 and arguments[0] in PRODUCTS:
            sys.stdout.write(PRODUCTS[arguments[0]](described(source=source_of(arguments[0]))))
        else:
            print(__doc__, file=sys.stderr)
            return 1
    except (Wrong, KeyError, tomllib.TOMLDecodeError) as error:
        print(f"{SOURCE}: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
