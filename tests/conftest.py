# SPDX-License-Identifier: MIT
"""Where everything is: tests run from the repository's root, products are in $BUILD, the launcher is a package in qemu/."""
import ctypes
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "qemu"))
os.chdir(ROOT)
os.environ.setdefault("BUILD", "build")

# Where tests/unit/test_system.py puts the registers: kept free from the start, for a heap that grows may reach them.
REGISTER_PAGES = (0x40004000, 0x40005000, 0x40038000, 0xE0001000, 0xE000E000, 0x50000000)
NO_ACCESS, PRIVATE_FIXED_ANONYMOUS = 0, 0x100022  # MAP_FIXED_NOREPLACE


def keep_free(pages):
    libc = ctypes.CDLL(None)
    libc.mmap.restype, libc.mmap.argtypes = ctypes.c_void_p, [ctypes.c_void_p, ctypes.c_size_t] + [ctypes.c_int] * 3 + [
        ctypes.c_long]
    for page in pages:
        libc.mmap(page, 4096, NO_ACCESS, PRIVATE_FIXED_ANONYMOUS, -1, 0)


keep_free(REGISTER_PAGES)
