# SPDX-License-Identifier: MIT
"""The four functions that the compiler may call by itself, under other names: sizes, offsets and overlaps, against Python."""
import ctypes
import os
import random
import subprocess

import pytest

from rigs.firmware import ROOT

NAMES = ("memcpy", "memmove", "memset", "memcmp")
SIZE = 48


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    target = tmp_path_factory.mktemp("memory") / "memory.so"
    subprocess.run([os.environ.get("HOSTCC") or "cc", "-std=c11", "-O1", "-shared", "-fPIC", "-fno-builtin",
                    "-fno-tree-loop-distribute-patterns", "-fsanitize=undefined", "-fno-sanitize-recover=all",
                    *(f"-D{name}=own_{name}" for name in NAMES), str(ROOT / "startup/memory.c"), "-o",
                    str(target)], check=True)
    library = ctypes.CDLL(str(target))
    for name in NAMES:
        function = getattr(library, "own_" + name)
        function.restype = ctypes.c_int if name == "memcmp" else ctypes.c_void_p
    return library


def made(draw):
    return ctypes.create_string_buffer(bytes(draw.randrange(256) for _ in range(SIZE)), SIZE)


def at(buffer, offset):
    return ctypes.c_void_p(ctypes.addressof(buffer) + offset)


def test_copies_and_moves(own):
    draw = random.Random(1)
    for _ in range(1500):
        size = draw.randrange(20)
        to, start = draw.randrange(SIZE - size), draw.randrange(SIZE - size)
        buffer, other = made(draw), made(draw)
        expected = bytearray(buffer.raw)
        expected[to:to + size] = buffer.raw[start:start + size]
        assert own.own_memmove(at(buffer, to), at(buffer, start), ctypes.c_size_t(size)) == at(buffer, to).value
        assert buffer.raw == bytes(expected)
        expected[to:to + size] = other.raw[start:start + size]
        assert own.own_memcpy(at(buffer, to), at(other, start), ctypes.c_size_t(size)) == at(buffer, to).value
        assert buffer.raw == bytes(expected)


def test_fills(own):
    draw = random.Random(2)
    for _ in range(300):
        size = draw.randrange(20)
        to, value, buffer = draw.randrange(SIZE - size), draw.randrange(-256, 512), made(draw)
        expected = bytearray(buffer.raw)
        expected[to:to + size] = bytes([value & 0xFF]) * size
        assert own.own_memset(at(buffer, to), value, ctypes.c_size_t(size)) == at(buffer, to).value
        assert buffer.raw == bytes(expected)


def test_compares(own):
    draw = random.Random(3)
    for _ in range(1500):
        one, other = made(draw), ctypes.create_string_buffer(SIZE)
        other.raw = one.raw
        if draw.random() < 0.8:
            other[draw.randrange(SIZE)] = draw.randrange(256)
        size = draw.randrange(SIZE + 1)
        got, a, b = own.own_memcmp(one, other, ctypes.c_size_t(size)), one.raw[:size], other.raw[:size]
        assert (got > 0) - (got < 0) == (a > b) - (a < b)
