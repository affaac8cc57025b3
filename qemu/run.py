#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Entry point of the launcher: qemu/run.py run|console|scope|debug|models|list [options]."""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from launcher.cli import main  # noqa: E402  (the path must be set first)

if __name__ == "__main__":
    sys.exit(main())
