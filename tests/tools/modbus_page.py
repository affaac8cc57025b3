# SPDX-License-Identifier: MIT
"""The generated parts of docs/modbus.md: tables of registers from the firmware's sources, and the session with mbpoll.

usage: modbus_page.py [--session]      writes the tables; with --session plays the session on a running drive as well
"""
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / folder) for folder in ("qemu", "tests", "tests/tools", "firmware/tables", "linker/bounds")]

from rows import PARAMS, REACTIONS, objects, param_rows, reactions, texts  # noqa: E402
from pages import replace_block  # noqa: E402

PAGE = ROOT / "docs" / "modbus.md"


def registers(at, count):
    return f"{at}" if count == 1 else f"{at}...{at + count - 1}"


def object_table(source=ROOT):
    lines = ["| register | name | object | type | access | unit | what |", "|---|---|---|---|---|---|---|"]
    for at, index, kind, access, name, unit, what in objects(source):
        shown = f"0x{index >> 8:04X}" + (f":{index & 0xFF}" if index & 0xFF else "") if index else ""
        lines.append(f"| {registers(at, 2 if '32' in kind else 1)} | {name} | {shown} | {kind} | {access} | {unit} | {what} |")
    return "\n".join(lines) + "\n"


def parameter_table(source=ROOT):
    what = texts(source)
    lines = ["| register | parameter | least | most | initial | what |", "|---|---|---|---|---|---|"]
    for number, (name, (least, most, initial)) in enumerate(param_rows(source).items()):
        lines.append(f"| {registers(PARAMS + 2 * number, 2)} | `{name}` | {least} | {most} | {initial} | {what[name]} |")
    return "\n".join(lines) + "\n"


def reaction_table(source=ROOT):
    lines = ["| register | fault | choices | initial |", "|---|---|---|---|"]
    lines += [f"| {REACTIONS + number} | {name} | {', '.join(choices)} | {initial} |"
              for number, name, choices, initial in reactions(source)]
    return "\n".join(lines) + "\n"


TABLES = {"objects": object_table, "parameters": parameter_table, "reactions": reaction_table}


def session():
    from closed_loop.live import live
    from closed_loop.modbus_transcript import transcript
    with tempfile.TemporaryDirectory() as folder, live(Path(folder)) as (port, progress):
        return transcript(port, progress)


def main():
    for name, table in TABLES.items():
        replace_block(PAGE, name, table())
    if "--session" in sys.argv[1:]:
        replace_block(PAGE, "session", f"```text\n{session()}```\n")


if __name__ == "__main__":
    main()
