# SPDX-License-Identifier: MIT
"""Writes the table of AES's round as assembler source: for each S-box value s (FIPS 197) the bytes s, 3s, 2s, s."""


def times(a, b):
    """Product in GF(2^8)."""
    product = 0
    while b:
        product ^= a if b & 1 else 0
        a = a << 1 ^ (0x11B if a & 0x80 else 0)
        b >>= 1
    return product


def substitute(value):
    inverse = next((n for n in range(256) if times(value, n) == 1), 0)
    result = 0x63
    for turn in range(5):
        result ^= inverse << turn | inverse >> (8 - turn)
    return result & 0xFF


for number in range(256):
    s = substitute(number)
    print(f"    .word 0x{s:02x}{times(s, 2):02x}{times(s, 3):02x}{s:02x}")
