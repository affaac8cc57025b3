# SPDX-License-Identifier: MIT
"""A table of samples as a file: CSV, MDF 4.1 (asammdf and most tools of measurement open it), MCAP (PlotJuggler, Foxglove).

A table is columns against time in seconds, all float64: {name: (unit, values)}; `texts` are words for whole numbers,
{name: {number: word}}, as of enumerations. Small on purpose: one group of channels, sorted, not compressed.
"""
import json
import struct
import time

import numpy as np

ID = struct.Struct("<8s8s8s4xH30x2H")
HEAD = struct.Struct("<4s4x2Q")      # of a block: its name, length, number of links
FLOAT, TEXT_OF_NUMBER = 4, 7
FIXED, MASTER, IS_TIME = 0, 2, 1     # kinds of channel; a master's quantity
CREATOR = ("<FHcomment><TX>a recording</TX><tool_id>mssfoc</tool_id><tool_vendor>mssfoc</tool_vendor>"
           "<tool_version>0.1</tool_version></FHcomment>")


class _Mdf:
    """Blocks, each behind those that it links to; what links forward is written last."""

    def __init__(self):
        self.data = bytearray(64)  # of the ID, and the header, whose place is prescribed, below
        self.header = self.reserve(6, 32)

    def reserve(self, links, size):
        at = len(self.data)
        self.data += bytes(HEAD.size + 8 * links + size)
        return at

    def block(self, name, links=(), payload=b"", at=None):
        """Its address."""
        if at is None:
            self.data += bytes(-len(self.data) % 8)
            at = self.reserve(len(links), len(payload))
        block = HEAD.pack(name, HEAD.size + 8 * len(links) + len(payload), len(links))
        block += struct.pack(f"<{len(links)}Q", *links) + payload
        self.data[at:at + len(block)] = block
        return at

    def text(self, words, name=b"##TX"):
        data = words.encode() + b"\0"
        return self.block(name, payload=data + bytes(-len(data) % 8)) if words else 0

    def conversion(self, words):
        """Of numbers to words; of others, none."""
        if not words:
            return 0
        links = [self.text(word) for word in words.values()] + [0]
        payload = struct.pack("<2B3H2d", TEXT_OF_NUMBER, 0, 0, len(links), len(words), 0, 0)
        return self.block(b"##CC", [0, 0, 0, 0, *links], payload + struct.pack(f"<{len(words)}d", *words))

    def channel(self, name, unit, words, column, following):
        kind, sync = (FIXED, 0) if column else (MASTER, IS_TIME)
        payload = struct.pack("<4B4IBxH6d", kind, sync, FLOAT, 0, 8 * column, 64, 0, 0, 0, 0, *[0.0] * 6)
        return self.block(b"##CN", [following, 0, self.text(name), 0, self.conversion(words), 0, self.text(unit), 0], payload)


def mdf4(t_s, columns, texts=None, begun_ns=None):
    """The bytes of a file."""
    file, texts = _Mdf(), texts or {}
    every = [("time", "s", t_s), *((name, unit, values) for name, (unit, values) in columns.items())]
    following = 0
    for at, (name, unit, _) in reversed(list(enumerate(every))):
        following = file.channel(name, unit, texts.get(name), at, following)
    table = np.column_stack([np.asarray(values, dtype="<f8") for *_, values in every])
    group = file.block(b"##CG", [0, following, 0, 0, 0, 0],
                       struct.pack("<2Q2H4x2I", 0, len(table), 0, 0, 8 * len(every), 0))
    data = file.block(b"##DT", payload=table.tobytes())
    groups = file.block(b"##DG", [0, group, data, 0], struct.pack("<B7x", 0))
    begun_ns = time.time_ns() if begun_ns is None else begun_ns
    moment = struct.pack("<Q2h", begun_ns, 0, 0)
    history = file.block(b"##FH", [0, file.text(CREATOR, b"##MD")], moment + bytes(4))
    file.block(b"##HD", [groups, history, 0, 0, 0, 0], moment + struct.pack("<4B2d", 0, 0, 0, 0, 0.0, 0.0), at=file.header)
    file.data[:64] = ID.pack(b"MDF     ", b"4.10    ", b"mssfoc  ", 410, 0, 0)
    return bytes(file.data)


MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, DATA_END = 1, 2, 3, 4, 5, 15


def _words(text):
    data = text.encode()
    return struct.pack("<I", len(data)) + data


def _words_of_map(key, value):
    entry = _words(key) + _words(value)
    return struct.pack("<I", len(entry)) + entry


def _record(kind, data):
    return struct.pack("<BQ", kind, len(data)) + data


def mcap(t_s, columns, texts=None, begun_ns=None):
    """The bytes of a file: one topic, a message in JSON for each sample; numbers with words have those beside them."""
    texts, begun_ns = texts or {}, time.time_ns() if begun_ns is None else begun_ns
    fields = {name: {"type": "number", **({"description": unit} if unit else {})} for name, (unit, _) in columns.items()}
    fields |= {f"{name}_text": {"type": "string"} for name in texts if name in columns}
    schema = json.dumps({"type": "object", "properties": fields})
    units = json.dumps({name: unit for name, (unit, _) in columns.items()})
    out = [MAGIC, _record(HEADER, _words("") + _words("mssfoc")),
           _record(SCHEMA, struct.pack("<H", 1) + _words("mssfoc.Sample") + _words("jsonschema") + _words(schema)),
           _record(CHANNEL, struct.pack("<2H", 1, 1) + _words("drive") + _words("json")
                   + _words_of_map("units", units))]
    zero = min(t_s, default=0)  # samples before a trigger have times below 0
    for at, t in enumerate(t_s):
        row = {name: float(values[at]) for name, (_, values) in columns.items()}
        row |= {f"{name}_text": texts[name].get(round(row[name]), "") for name in texts if name in row}
        ns = begun_ns + round((t - zero) * 1e9)
        out.append(_record(MESSAGE, struct.pack("<HI2Q", 1, at, ns, ns) + json.dumps(row, allow_nan=False).encode()))
    out += [_record(DATA_END, bytes(4)), _record(FOOTER, bytes(20)), MAGIC]
    return b"".join(out)


def csv(t_s, columns, *_):
    heading = ["time_s", *(f"{name} [{unit}]" if unit else name for name, (unit, _) in columns.items())]
    rows = zip(t_s, *(values for _, values in columns.values()), strict=True)
    return "".join(",".join(row) + "\n" for row in [heading, *(map(repr, map(float, row)) for row in rows)]).encode()


KINDS = {".csv": csv, ".mf4": mdf4, ".mcap": mcap}
