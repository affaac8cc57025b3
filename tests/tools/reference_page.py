# SPDX-License-Identifier: MIT
"""docs/reference.md: every parameter, fault and refusal, with number, meaning and remedy, from the firmware's sources.

usage: reference_page.py        writes the tables
"""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "qemu"), str(ROOT / "tests" / "tools")]

from pages import replace_block  # noqa: E402
from param_rows import param_rows, remarks, texts  # noqa: E402
from scope.words import GROUP_OF, GROUPS, OTHERS  # noqa: E402

PAGE = ROOT / "docs" / "reference.md"
STRING = r'"((?:[^"\\]|\\.)*)"'
NUMBERED = re.compile(r"^    (?:ERROR|FAULT)_(\w+) = (\d+),(?: +/\* (.*?) \*/)?$", re.M)


def source(path):
    return (ROOT / "firmware" / path).read_text(encoding="utf-8")


def joined(text):
    """What a compiler makes of adjacent strings."""
    return re.sub(r'"\s*"', "", text)


def numbers(path):
    """{name: (number, remark)} of an enum."""
    return {name: (int(number), remark) for name, number, remark in NUMBERED.findall(source(path))}


def block(name):
    """The body of a table in messages.c."""
    return joined(re.search(rf"{name}\[\w+\] = \{{(.*?)^\}};", source("operate/messages.c"), re.M | re.S)[1])


def refusal_texts():
    return dict(re.findall(rf"\[ERROR_(\w+)\] =\s*(?:OF\(\s*\w+,\s*)?{STRING}", block("error_texts")))


def fault_texts():
    """{name: [name for people, hint, detail or ""]}"""
    rows = re.findall(rf"\[FAULT_(\w+)\] =\s*\{{\s*{STRING},\s*{STRING}(?:,\s*{STRING})?\s*\}}", block("fault_texts"))
    return {name: words for name, *words in rows}


def codes():
    return dict(re.findall(r"\[FAULT_(\w+)\] = (0x\w+),", source("operate/cia402_codes.c")))


def units():
    """[(end of a name, unit)], in the order in which they are tried."""
    table = re.search(r"param_units\[\] = \{(.*?)^\};", source("operate/commands_settings.c"), re.M | re.S)[1]
    return re.findall(rf"\{{{STRING}, {STRING}\}}", table)


def unit_of(name):
    return next((unit for end, unit in units() if name.endswith(end) and name != end), "")


def cell(text):
    return text.replace("|", "\\|")


def filled(text):
    return cell(text.replace("@", "N").replace("#", "M").replace("$", "a feature"))


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
    said, code = fault_texts(), codes()
    lines = ["| number | `fault` says | code | what it is | look at | found |", "|---|---|---|---|---|---|"]
    for name, (number, remark) in numbers("fault/fault.h").items():
        if number:
            title, hint, detail = said[name]
            lines.append(f"| {number} | {title} | {code[name]} | {cell(remark)} | {filled(hint)} | {filled(detail)} |")
    return "\n".join(lines) + "\n"


def refusal_table():
    said = refusal_texts()
    lines = ["| number | `error:` | what helps |", "|---|---|---|"]
    for name, (number, remark) in numbers("settings/error.h").items():
        if number:
            lines.append(f"| {number} | {filled(said[name])} | {cell(remark)} |")
    return "\n".join(lines) + "\n"


TABLES = {"parameters": parameter_table, "faults": fault_table, "refusals": refusal_table}


def main():
    for name, table in TABLES.items():
        replace_block(PAGE, name, table())


if __name__ == "__main__":
    main()
