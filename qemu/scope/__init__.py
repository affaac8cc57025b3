# SPDX-License-Identifier: MIT
"""The page that shows a drive and commands it: `make scope`. drive.py talks to the console, by what the Python client knows of
it (qemu/client), twin.py and board.py are the two things at the line's other end, web.py is the page's server."""
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "qemu/client"), str(ROOT / "firmware/tables")]  # the package mssfoc; rows
