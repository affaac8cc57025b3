# SPDX-License-Identifier: MIT
"""The table of commands in docs/console.md, from the firmware's own `help`. Run it to write the page anew."""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "console.md"
TABLE = re.compile(r"(?<=<!-- commands -->\n).*?(?=<!-- end -->)", re.DOTALL)


def page(help_lines):
    rows = "".join(f"| `{name.replace('|', chr(92) + '|')}` | {what} |\n" for name, what in
                   (line.split(": ", 1) for line in help_lines))
    return TABLE.sub(lambda _: f"| command | what it does |\n|---|---|\n{rows}", PAGE.read_text())


def main():
    sys.path.insert(0, str(ROOT / "tests"))
    from unit.cinterface import Library
    from rigs.firmware import built
    from rigs.console import Operator
    PAGE.write_text(page(Operator(Library(built("firmware.so")))("help")))


if __name__ == "__main__":
    main()
