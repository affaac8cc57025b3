# SPDX-License-Identifier: MIT
"""`make eds`: the drive's electronic data sheet (CiA 306) from the firmware's tables.

usage: eds.py FILE [AXES]
"""
import re
import sys
from pathlib import Path

from rows import faults, objects, param_rows, texts

ROOT = Path(__file__).resolve().parents[2]

TYPES = {"I8": 2, "I16": 3, "I32": 4, "U8": 5, "U16": 6, "U32": 7, "STRING": 9, "DOMAIN": 15}
LEAST = {"I8": -128, "I16": -32768, "I32": -2 ** 31}
VAR, ARRAY, RECORD = 7, 8, 9
PARAMS, REACTIONS, OWN = 0x3000, 0x2400, 0x2000
AXIS, TYPE = 0x800, 0x67FF  # a second axis is so much further; what each of several is stands there
EACH, DUMMIES = 4, range(1, 8)
RATES = {10: 0, 20: 1, 50: 1, 125: 1, 250: 1, 500: 1, 800: 1, 1000: 1}

# Clients look objects up by these names (CiA 402-2, 301).
NAMES = {0x1000: "Device type", 0x1001: "Error register", 0x1003: "Pre-defined error field", 0x1010: "Store parameters",
         0x1011: "Restore default parameters", 0x1016: "Consumer heartbeat time", 0x1018: "Identity object",
         0x1200: "SDO server parameter", 0x603F: "Error code", 0x6040: "Controlword", 0x6041: "Statusword",
         0x6060: "Modes of operation", 0x6061: "Modes of operation display", 0x6064: "Position actual value",
         0x606B: "Velocity demand value", 0x606C: "Velocity actual value", 0x6071: "Target torque",
         0x6075: "Motor rated current", 0x6077: "Torque actual value", 0x6079: "DC link circuit voltage",
         0x607A: "Target position", 0x607D: "Software position limit", 0x6099: "Homing speeds",
         0x60C2: "Interpolation time period", 0x6080: "Max motor speed", 0x6098: "Homing method",
         0x60F4: "Following error actual value", 0x60FF: "Target velocity", 0x6502: "Supported drive modes"}
SUBS = {(0x1018, 1): "Vendor-ID", (0x1018, 2): "Product code", (0x1018, 3): "Revision number", (0x1018, 4): "Serial number",
        (0x1010, 1): "Save all parameters", (0x1011, 1): "Restore all default parameters"}
INITIAL = {0x1000: 0x00020192, 0x6060: 3, 0x6098: 34}
SEVERAL = 0xFFFF0192  # object 0x1000 of several axes
STORE = 0xC0  # registers from here on are no process data
BUS = re.compile(r'X\((0x\w+), (\d), (\w+), +(\w+), +"([^"]*)", ([^,]+), ([^)]+)\)')
STRING = re.compile(r'X\((0x\w+), "([^"]*)", ("[^"]*"|\w+)\)')
PDO = re.compile(r"X\((rpdo|tpdo), (\d), (0x\w+), (\d), (\d+), (\d+), (\d), (0x\w+|0), (0x\w+|0)\)")


def text_of(name):
    return (ROOT / name).read_text(encoding="utf-8")


def entry(name, kind, access, initial=None, mapped=False, low=None, high=None):
    found = {"ParameterName": name, "ObjectType": f"0x{VAR:X}", "DataType": f"0x{TYPES[kind]:04X}", "AccessType": access}
    found |= {} if initial is None else {"DefaultValue": initial}
    found["PDOMapping"] = int(mapped)
    found |= {} if low is None else {"LowLimit": low, "HighLimit": high}
    return found


def pdo_rows(text):
    """The communication and mapping objects of each PDO, with what they have at first."""
    initial = {}
    for pdo, number, identifier, bits, kind, every_ms, count, *mapped in PDO.findall(text):
        key = pdo, int(number)
        initial[key] = {"id": f"$NODEID+0x{int(identifier, 16) + (int(bits) << 30):X}", "type": kind, "event_ms": every_ms,
                        "count": count,
                        **{f"map[{n}]": value for n, value in enumerate(mapped)}}
    for index, sub, kind, access, name, first, where in BUS.findall(text):
        for number in range(EACH):
            named = re.match(r"([rt]pdo)\[0\]\.(.*)", where)
            group = "rpdo" if int(index, 16) & 0x800 == 0 else "tpdo"
            value = initial[group, number].get(named[2], first) if named else first
            value = f"0x{int(value, 16):08X}" if named and named[2].startswith("map") else value
            yield int(index, 16) + number, int(sub), entry(name, kind, access.lower(), value)


def bus_objects():
    """{(index, subindex): entry} of what CiA 301 has."""
    text = text_of("firmware/operate/canopen_objects.h")
    common, pdos = text.split("#define CANOPEN_RPDO", 1)
    found = {(int(index, 16), int(sub)): entry(name, kind, access.lower(), initial, int(index, 16) == 0x1001)
             for index, sub, kind, access, name, initial, _ in BUS.findall(common)}
    found |= {(index, sub): row for index, sub, row in pdo_rows(pdos)}
    version = re.search(r'CONFIG_VERSION "(.*)"', text_of("firmware/settings/config.h")).group(1)
    for index, name, value in STRING.findall(text):
        text = version if value == "CONFIG_VERSION" else value.strip('"')
        found[int(index, 16), 0] = entry(name, "DOMAIN", "ro") if value == "NULL" else entry(name, "STRING", "const", text)
    return found


def drive_objects():
    found = {}
    for at, place, kind, access, name, unit, _ in objects(ROOT):
        index, sub = (place >> 8, place & 0xFF) if place else (OWN + at, 0)
        shown = SUBS.get((index, sub)) or NAMES.get(index) or (f"{name} / {unit}" if unit else name)
        mapped = at < STORE
        how = {"RO": "ro", "RW": "rww" if at <= 7 else "rw"}[access]
        found[index, sub] = entry(shown, kind, how, INITIAL.get(index), mapped)
    return found


def own_objects():
    """Parameters, and what a fault leads to."""
    found, what = {}, texts(ROOT)
    for number, (name, (least, most, initial)) in enumerate(param_rows(ROOT).items()):
        assert what[name]
        found[PARAMS + number, 0] = entry(name, "I32", "rw", initial, low=least, high=most)
    for name, row in faults(ROOT).items():
        found[REACTIONS + row.number, 0] = entry(f"reaction to {name.lower()}", "U16", "rw")
    for index, sub, kind, access, name, first, _ in BUS.findall(text_of("firmware/operate/objects.h")):
        found[int(index, 16), int(sub)] = entry(name, kind, access.lower(), first)
    return found


def of_every_axis(found, axes):
    """The first axis' objects, and each further one's; not what CiA 301 has, which is the device's."""
    for axis in range(1, axes):
        found |= {(index + axis * AXIS, sub): {**row, "ParameterName": f"{row['ParameterName']}, axis {axis + 1}"}
                  for (index, sub), row in list(found.items()) if OWN <= index and not index & AXIS}
    return found


def axis_objects(axes):
    found = {**drive_objects(), **own_objects()}
    if axes > 1:
        found[TYPE, 0] = found[0x1000, 0]
        found[0x1000, 0] = {**found[0x1000, 0], "DefaultValue": SEVERAL}
    return of_every_axis(found, axes)


def section(name, items):
    return [f"[{name}]", *(f"{key}={value}" for key, value in items.items()), ""]


def listed(name, indices):
    return section(name, {"SupportedObjects": len(indices), **{n: f"0x{i:04X}" for n, i in enumerate(indices, 1)}})


def object_sections(index, subs):
    """An object alone, or a record with its members."""
    if set(subs) == {0}:
        return section(f"{index:04X}", subs[0])
    kind = ARRAY if index in (0x1003, 0x1010, 0x1011, 0x1016, 0x607D, 0x6099, 0x687D, 0x6899) else RECORD
    own = NAMES.get(index - AXIS)
    name = NAMES.get(index) or (own and f"{own}, axis 2") or {
        0x1400: "RPDO communication parameter", 0x1600: "RPDO mapping parameter", 0x1800: "TPDO communication parameter",
        0x1A00: "TPDO mapping parameter"}[index & ~3]
    lines = section(f"{index:04X}", {"ParameterName": name, "ObjectType": f"0x{kind:X}", "SubNumber": len(subs)})
    for sub in sorted(subs):
        lines += section(f"{index:04X}sub{sub:X}", subs[sub])
    return lines


def heads(version):
    lines = section("FileInfo", {
        "FileName": "mssfoc.eds", "FileVersion": 1, "FileRevision": 0, "EDSVersion": "4.0", "Description": "mssfoc drive",
        "CreationTime": "12:00AM", "CreationDate": "01-01-2026", "CreatedBy": "mssfoc", "ModificationTime": "12:00AM",
        "ModificationDate": "01-01-2026", "ModifiedBy": "mssfoc"})
    lines += section("DeviceInfo", {
        "VendorName": "mssfoc", "VendorNumber": "0x0", "ProductName": f"mssfoc {version}", "ProductNumber": "0x6D666F63",
        "RevisionNumber": "0x0", "OrderCode": "mssfoc", **{f"BaudRate_{rate}": on for rate, on in RATES.items()},
        "SimpleBootUpMaster": 0, "SimpleBootUpSlave": 1, "Granularity": 8, "DynamicChannelsSupported": 0, "GroupMessaging": 0,
        "NrOfRXPDO": EACH, "NrOfTXPDO": EACH, "LSS_Supported": 1})
    lines += section("DummyUsage", {f"Dummy{n:04X}": 0 for n in DUMMIES})
    return lines + section("Comments", {"Lines": 1, "Line1": "written by firmware/tables/eds.py from the firmware's tables"})


def eds(axes=1):
    everything = {**bus_objects(), **axis_objects(axes)}
    tree = {}
    for (index, sub), found in everything.items():
        tree.setdefault(index, {})[sub] = found
    mandatory = [0x1000, 0x1001, 0x1018]
    own = sorted(index for index in tree if 0x2000 <= index < 0x6000)
    optional = sorted(index for index in tree if index not in mandatory and index not in own)
    lines = heads(re.search(r'CONFIG_VERSION "(.*)"', text_of("firmware/settings/config.h")).group(1))
    for name, indices in (("MandatoryObjects", mandatory), ("OptionalObjects", optional), ("ManufacturerObjects", own)):
        lines += listed(name, indices)
        for index in indices:
            lines += object_sections(index, tree[index])
    return "\n".join(lines)


if __name__ == "__main__":
    Path(sys.argv[1]).parent.mkdir(parents=True, exist_ok=True)
    Path(sys.argv[1]).write_text(eds(*map(int, sys.argv[2:])), encoding="utf-8")
