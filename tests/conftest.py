# SPDX-License-Identifier: MIT
"""Where everything is: tests run from the repository's root, products are in $BUILD, the launcher is a package in qemu/."""
import gc
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "qemu"))
os.chdir(ROOT)
os.environ.setdefault("BUILD", "build")
gc.set_threshold(100_000, 20, 100)  # of thousands of tests, all of which stay, looked through for garbage

from unit import register_pages  # noqa: E402  (the path must be set first)

register_pages.keep_free()  # before a heap that grows reaches them
