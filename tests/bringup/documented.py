# SPDX-License-Identifier: MIT
"""Writes the values after resets that docs/silicon.md has as a header for the bring-up image: documented.py PATH"""
import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from silicon import facts  # noqa: E402  (the path must be set first)


def macros():
    """{DOCUMENTED_POWER_ON_SYSREG_SOFT_RESET_CR: value, ...}"""
    return {"DOCUMENTED_" + re.sub(r"\W", "_", name).upper(): facts.number(fact.value)
            for fact in facts.facts() for name in fact.code if ":" in name}


def main():
    lines = [f"#define {name} 0x{value:X}u" for name, value in macros().items()]
    Path(sys.argv[1]).write_text("\n".join(["/* Values after resets, from docs/silicon.md by tests/bringup/documented.py. */",
                                            *lines, ""]))


if __name__ == "__main__":
    main()
