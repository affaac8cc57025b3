# SPDX-License-Identifier: MIT
"""What a motor or its inverter is read from, as text: of a lot, the file that would give the same."""
from .data import files_of
from .lot import is_lot, lot_files

_TEXTS = ("name", "summary", "inverter")


def text_of(name, inverter=False):
    """The file of a motor, or of its inverter. A lot's motor names the lot as its inverter, which any motor file may."""
    if is_lot(name):
        return toml(lot_files(name)[1 if inverter else 0], f"{name}, drawn by lot: docs/lots.md")
    return files_of(name)[-1 if inverter else 0].read_text()


def toml(tables, title):
    """As TOML: only what data files have."""
    lines = ["# SPDX-License-Identifier: MIT", f"# {title}", ""]
    lines += [f"{key} = {_value(tables[key])}" for key in _TEXTS if key in tables]
    for table, entries in tables.items():
        if table in _TEXTS or not entries:
            continue
        lines += ["", f"[{table}]"]
        for key, entry in entries.items():
            inline = _value(entry) if isinstance(entry, str) else ", ".join(f"{k} = {_value(v)}" for k, v in entry.items())
            lines.append(f"{key} = {inline if isinstance(entry, str) else '{ ' + inline + ' }'}")
    return "\n".join(lines) + "\n"


def _value(value):
    """Texts here have neither quotes nor backslashes."""
    return f'"{value}"' if isinstance(value, str) else repr(value)
