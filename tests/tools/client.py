# SPDX-License-Identifier: MIT
"""`make client`: the Python client (qemu/client) with the list of this firmware's registers and objects, for pip.

usage: client.py FOLDER        writes the package there; registers.csv in it is for PLCs, too
"""
import csv
import io
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/tools"), str(ROOT / "firmware/tables"), str(ROOT / "linker/bounds")]

from rows import PARAMS, REACTIONS, faults, objects, param_rows, reactions, refusals, texts  # noqa: E402
from eds import AXIS  # noqa: E402
from reference_page import unit_of  # noqa: E402

CLIENT = ROOT / "qemu" / "client"
LIST = "mssfoc/registers.csv"
OWN_OBJECTS, OWN_PARAMS, OWN_REACTIONS = 0x2000, 0x3000, 0x2400  # firmware/operate/canopen_objects.h
COLUMNS = ("kind", "number", "register", "count", "index", "subindex", "name", "type", "access", "unit", "least", "most",
           "initial", "what")


def rows():
    """Everything with a name or a number, as COLUMNS has it; what a kind does not have is empty."""
    for at, place, kind, access, name, unit, what in objects(ROOT):
        index, sub = (place >> 8, place & 0xFF) if place else (OWN_OBJECTS + at, 0)
        yield "object", "", at, 2 if "32" in kind else 1, f"0x{index:04X}", sub, name, kind, access, unit, "", "", "", what
    meant = texts(ROOT)
    for number, (name, (least, most, initial)) in enumerate(param_rows(ROOT).items()):
        yield ("parameter", number, PARAMS + 2 * number, 2, f"0x{OWN_PARAMS + number:04X}", 0, name, "I32", "RW", unit_of(name),
               least, most, initial, meant[name])
    for number, name, choices, initial in reactions(ROOT):
        yield ("reaction", number, REACTIONS + number, 1, f"0x{OWN_REACTIONS + number:04X}", 0, name, "U16", "RW", "", "", "",
               initial, ", ".join(choices))
    yield ("axis", 2, "", "", f"0x{AXIS:04X}", *[""] * 8,
           "of a drive with two axes: objects from 0x2000 on stand so much further; the same registers under the next address")
    for row in faults(ROOT).values():
        yield "fault", row.number, *[""] * 4, row.text, *[""] * 6, row.what
    for row in refusals(ROOT).values():
        yield "refusal", row.number, *[""] * 4, row.text, *[""] * 6, row.helps


def register_list():
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([COLUMNS, *rows()])
    return out.getvalue()


def package():
    """{name: bytes} of all that pip needs."""
    paths = [CLIENT / "pyproject.toml", CLIENT / "README.md", *(CLIENT / "mssfoc").glob("*.py")]
    files = {str(path.relative_to(CLIENT)): path.read_bytes() for path in paths}
    return {**files, LIST: register_list().encode()}


def write(folder):
    if folder.exists() and not (folder / LIST).exists():
        sys.exit(f"mssfoc: {folder} is there, and is no package of the client")
    shutil.rmtree(folder, ignore_errors=True)
    for name, data in package().items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)


if __name__ == "__main__":
    write(Path(sys.argv[1]))
    print(f"written: {sys.argv[1]}; pip install {sys.argv[1]}")
