# SPDX-License-Identifier: MIT
"""The tables of docs/libero.md from a board's file: its wires, and what to buy.

    wiring_page.py          writes the page
"""
import os
import sys
from pathlib import Path

import pages

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "drivers/fabric"))

from libero import board as boards  # noqa: E402  (the path must be set first)
from libero import project, rtl, wires  # noqa: E402

PAGE = ROOT / "docs/libero.md"
BUILD = (ROOT / os.environ.get("BUILD", "build")).resolve()
BOARD = "creative"  # the one that a motor can be wired to


def use_of(name):
    board = boards.load(name)
    return boards.Use(board, rtl.read(board["axes"], BUILD / "fabric"))


def page(text):
    use, signals = use_of(BOARD), project.toml("signals.toml")
    return pages.replaced(pages.replaced(text, "wires", wires.table(use, signals)), "to buy", wires.shopping(use, signals))


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text()))
