# SPDX-License-Identifier: MIT
"""A reader of MDF 4.1, by its specification alone."""
import struct

import numpy as np


class Mdf:
    """Follows the links of a file, as ASAM MDF 4.1 has them."""

    def __init__(self, data):
        self.data = data
        assert data[:8] == b"MDF     " and struct.unpack_from("<H", data, 28) == (410,)
        links, start = self.block(64, b"##HD")
        self.begun_ns = struct.unpack_from("<Q", data, start)[0]
        assert self.block(links[1], b"##FH")
        links, _ = self.block(links[0], b"##DG")
        self.block(links[1], b"##CG"), self.block(links[2], b"##DT")
        self.group, self.samples = links[1:3]

    def block(self, at, name):
        """Its links, and where its data begins."""
        found, length, count = struct.unpack_from("<4s4x2Q", self.data, at)
        assert found == name and at % 8 == 0 and at + length <= len(self.data), (found, name, at)
        return struct.unpack_from(f"<{count}Q", self.data, at + 24), at + 24 + 8 * count

    def text(self, at):
        return self.data[self.block(at, b"##TX")[1]:].split(b"\0")[0].decode() if at else ""

    def words(self, at):
        links, start = self.block(at, b"##CC")
        kind, _, _, texts, values = struct.unpack_from("<2B3H", self.data, start)
        assert kind == 7 and texts == values + 1
        keys = struct.unpack_from(f"<{values}d", self.data, start + 24)
        return {int(key): self.text(link) for key, link in zip(keys, links[4:])}

    def channels(self):
        """{name: (unit, values, words)}"""
        links, start = self.block(self.group, b"##CG")
        count, size = struct.unpack_from("<Q", self.data, start + 8)[0], struct.unpack_from("<I", self.data, start + 24)[0]
        at, found = links[1], {}
        table = self.block(self.samples, b"##DT")[1]
        while at:
            links, start = self.block(at, b"##CN")
            kind, sync, number, _, offset, bits = struct.unpack_from("<4B2I", self.data, start)
            assert (number, bits) == (4, 64) and (kind, sync) == ((0, 0) if found else (2, 1)), "time is the master"
            values = np.ndarray(count, "<f8", self.data, table + offset, size)
            found[self.text(links[2])] = self.text(links[6]), values, self.words(links[4]) if links[4] else {}
            at = links[0]
        return found
