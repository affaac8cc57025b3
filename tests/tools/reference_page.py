# SPDX-License-Identifier: MIT
"""docs/reference.md: every parameter, fault and refusal, with number, meaning and remedy, from the firmware's sources.

usage: reference_page.py        writes the tables
"""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "qemu"), str(ROOT / "tests/tools"), str(ROOT / "firmware/tables"), str(ROOT / "linker/bounds")]

from rows import STRING, faults, param_rows, refusals, remarks, texts  # noqa: E402
from pages import replace_block  # noqa: E402
from scope.words import GROUP_OF, GROUPS, OTHERS  # noqa: E402

PAGE = ROOT / "docs" / "reference.md"


def source(path):
    return (ROOT / "firmware" / path).read_text(encoding="utf-8")


def units():
    """[(end of a name, unit)], in the order in which they are tried."""
    table = re.search(r"param_units\[\] = \{(.*?)^\};", source("operate/commands_settings.c"), re.M | re.S)[1]
    return re.findall(rf"\{{{STRING}, {STRING}\}}", table)


def unit_of(name):
    return next((unit for end, unit in units() if name.endswith(end) and name != end), "")


def cell(text):
    return text.replace("|", "\\|")


def filled(text):
    return cell(text.replace("@", "N").replace("#", "M").replace("$", "a feature").replace("&", "a line"))


def parameter_table():
    rows, what, remark = param_rows(), texts(), remarks()
    lines = []
    for group in [*GROUPS, OTHERS]:
        names = [name for name in rows if GROUP_OF.get(name, OTHERS) == group]
        if names:
            lines += [f"#### {group}", "", "| parameter | what it is | range | initially | what it affects | explained in |",
                      "|---|---|---|---|---|---|"]
        for name in names:
            (least, most, initial), (page, affects), unit = rows[name], remark[name], unit_of(name)
            title = page.rpartition("/")[2].removesuffix(".md").replace("-", " ")
            span = f"{least}...{most}{unit and ' ' + unit}"
            lines.append(f"| `{name}` | {cell(what[name])} | {span} | {initial} | {cell(affects)} | [{title}]({page}) |")
        lines += [""] if names else []
    return "\n".join(lines)


def fault_table():
    lines = ["| number | `fault` says | code | what it is | look at | found |", "|---|---|---|---|---|---|"]
    for row in faults().values():
        cells = (row.number, row.text, row.code, cell(row.what), filled(row.hint), filled(row.details))
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines) + "\n"


def refusal_table():
    lines = ["| number | `error:` | what helps |", "|---|---|---|"]
    for row in refusals().values():
        lines.append(f"| {row.number} | {filled(row.text)} | {cell(row.helps)} |")
    return "\n".join(lines) + "\n"


TABLES = {"parameters": parameter_table, "faults": fault_table, "refusals": refusal_table}


def main():
    for name, table in TABLES.items():
        replace_block(PAGE, name, table())


if __name__ == "__main__":
    main()
