# SPDX-License-Identifier: MIT
"""Lines at the console of a drive that is in operation half of the time: one that is no command leaves the axis as it was;
`set` that is right changes its parameter and no other, and only while off; whatever comes is answered."""
import collections
import ctypes
import random
import re

from rigs.console_lines import PARAMS, command_of, some_line, table
from rigs.scoped import Scoped

LINES, LINE_MAX = 20_000, 80
MAY_CHANGE_MANY = ("load", "defaults", "identify")


def set_by(line):
    """{parameter: value} that such a line sets."""
    found = re.fullmatch(r" *set +(\w+) +([-+]?\d{1,14}) *", line)
    low, high, _ = PARAMS.get(found[1], (1, 0, 0)) if found else (1, 0, 0)
    return {found[1]: int(found[2])} if found and low <= int(found[2]) <= high else {}


def test_nothing_but_a_right_line_does_anything(c):
    operator, draw, seen = Scoped(c), random.Random(2463534242), collections.Counter()
    axis, rows = operator.axis, table(c)
    c.params_init(axis.params)
    fresh, initial = bytes(axis), {name: getattr(axis.params, name) for name in PARAMS}
    for n in range(LINES):
        ctypes.memmove(ctypes.addressof(axis), fresh, len(fresh))
        off, (kind, line) = draw.randrange(2), some_line(draw, rows)
        axis.state = c.AXIS_SWITCH_ON_DISABLED if off else c.AXIS_OPERATION_ENABLED
        before = bytes(axis)
        assert operator.type(line + b"\r").endswith("> "), line
        params = {name: getattr(axis.params, name) for name in PARAMS}
        assert all(low <= params[name] <= high for name, (low, high, _) in PARAMS.items()), line
        plain = all(32 <= byte < 127 for byte in line)
        command = command_of(line, rows) if plain and len(line) <= LINE_MAX else None
        seen.update([kind, "command" if command else "none"])
        if command is None and (plain or len(line) > LINE_MAX):
            axis.command_ms = 0  # somebody speaks, whatever he says
            assert bytes(axis) == before, line
        elif command and command not in MAY_CHANGE_MANY:
            wanted = set_by(line.decode()) if off else {}
            assert params == {**initial, **wanted}, line
            seen["set"] += bool(wanted)
    assert min(seen[kind] for kind in ("noise", "keys", "right", "mutated")) > LINES / 10
    assert seen["set"] > LINES / 20 and seen["command"] > LINES / 3
