# SPDX-License-Identifier: MIT
"""python -m launcher, with PYTHONPATH=qemu."""
import sys

from .cli import main

sys.exit(main())
