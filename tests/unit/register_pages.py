# SPDX-License-Identifier: MIT
"""Memory of this process at the addresses of the processor's registers, for tests of system.so."""
import ctypes

GPIO_OUT_BITS = 0x42261100  # a word for each pin, in the alias of single bits
PAGES = (0x40004000, 0x40005000, 0x40013000, 0x40038000, GPIO_OUT_BITS & ~4095, 0xE0001000, 0xE000E000, 0x50000000)
SIZE = 4096
NO_ACCESS, READ_WRITE = 0, 3
PRIVATE_FIXED_ANONYMOUS = 0x100022  # MAP_FIXED_NOREPLACE: what stands there already stays


def keep_free():
    """Takes the pages, closed to all; protect() fails later if one was taken before."""
    libc = ctypes.CDLL(None)
    libc.mmap.restype = ctypes.c_void_p
    libc.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t] + [ctypes.c_int] * 3 + [ctypes.c_long]
    for page in PAGES:
        if libc.mmap(page, SIZE, NO_ACCESS, PRIVATE_FIXED_ANONYMOUS, -1, 0) == page:
            kept.add(page)


def protect(access):
    """Opens the pages, or closes them again."""
    libc = ctypes.CDLL(None)
    libc.mprotect.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int]
    for page in PAGES:
        assert page in kept and libc.mprotect(page, SIZE, access) == 0, f"{page:#x} is taken"


kept = set()
