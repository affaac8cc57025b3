# SPDX-License-Identifier: MIT
"""SPREAD: where in its tolerance each parameter of this very plant lies.

A value with `spread = 0.1` is drawn uniformly from 0.9...1.1 of it, one with `spread_abs = 5` from 5 below to 5 above. SPREAD
scales these ranges; 0 is the nominal plant. A draw depends on SEED and on the parameter's name only, so that a further
parameter leaves the others where they were. The angle at which the rotor stands at first is drawn over the whole turn.
"""
import hashlib
import math
from dataclasses import dataclass

from .errors import LauncherError

SPREAD_MAX = 10.0
START_ANGLE = ("start", "initial_angle_rad")


@dataclass(frozen=True)
class Spread:
    """Half the width of a range, relative and absolute; `like` names the key of the table whose draw it shares."""
    relative: float = 0.0
    absolute: float = 0.0
    like: str = ""


def check_spread(value):
    """A factor 0...SPREAD_MAX from a number or text."""
    try:
        factor = float(str(value))
    except ValueError as error:
        raise LauncherError(f"SPREAD '{value}' is not a number") from error
    if not 0 <= factor <= SPREAD_MAX:
        raise LauncherError(f"SPREAD {value} is outside 0..{SPREAD_MAX:g}")
    return factor


def share(seed, name):
    """-1...1, uniform, the same for the same seed and name on every machine."""
    digest = hashlib.blake2b(f"{seed} {name}".encode(), digest_size=8).digest()
    return int.from_bytes(digest, "big") / 2**63 - 1


def drawn(device, seed, factor):
    """{table: {key: value}} of this very device: the nominal values moved within their tolerances."""
    values = {table: dict(entries) for table, entries in device.values.items()}
    if factor == 0:
        return values
    for table, entries in device.spreads.items():
        for key, spread in entries.items():
            name = f"{device.kind}.{table}.{spread.like or key}"
            nominal = device.values[table][key]
            value = nominal + factor * share(seed, name) * (spread.relative * abs(nominal) + spread.absolute)
            limits = device.tables[table][key]
            if not limits.low <= value <= limits.high:
                raise LauncherError(f"{device.where}: [{table}] {key}: SPREAD {factor:g} draws {value:.4g}, which is outside"
                                    f" {limits.low:g}..{limits.high:g}")
            values[table][key] = value
    table, key = START_ANGLE
    if key in values.get(table, {}) and (table, key) not in device.pinned:
        values[table][key] = math.pi * (share(seed, f"{device.kind}.{table}.{key}") + 1)
    return values
