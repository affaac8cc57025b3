# SPDX-License-Identifier: MIT
"""Settings in a file: lines as the console takes them, `set NAME VALUE`; what follows a # is a remark."""
import os
import re
from pathlib import Path

from .errors import Refused

# what a line to the drive depends on, and two drives at one bus must not have alike: no setting of the machine
OF_THE_LINE = ("can_node", "can_kbit", "modbus_address", "modbus_baud", "modbus_parity")
LINE = re.compile(r"set (\w+) (-?\d+)")


def read_settings(path):
    """{name: value}"""
    values = {}
    for number, line in enumerate(Path(path).read_text(encoding="utf-8").splitlines(), 1):
        text = line.split("#", 1)[0].strip()
        found = LINE.fullmatch(text)
        if text and not found:
            raise Refused(f"{path}, line {number}: '{text}' is not of the form 'set NAME VALUE'")
        if found and found[1] in values:
            raise Refused(f"{path}, line {number}: {found[1]} is set twice")
        if found:
            values[found[1]] = int(found[2])
    if not values:
        raise Refused(f"{path} sets nothing")
    return values


def written_settings(path, parameters):
    """The file is the old one or the new one, never half of it."""
    lines = [f"set {one.name} {one.value}" + (f"  # {one.unit}" if one.unit else "") for one in parameters.values()]
    new = Path(f"{path}.new")
    new.write_text("\n".join([*lines, ""]), encoding="utf-8")
    os.replace(new, path)
