# SPDX-License-Identifier: MIT
"""What the fuzzers begin with, from the project's own tables: each command as 'help' has it, functions and registers of Modbus,
objects of CANopen, stored records. The programs beside say what an input's bytes are."""
import re
import struct
from pathlib import Path

from rigs.settings import MARK, PAGE, number, record, slot
from rows import PARAMS as PARAMS_AT, REACTIONS, objects, param_rows

ROOT = Path(__file__).resolve().parents[2]
PARAMS = param_rows()
HARMONICS, HEAD = 8, PAGE + 64  # of a cogging map; what of a slot is kept
OFF, ON = b"\0", b"\1"
TOGETHER, CHECK_SUM, PATIENCE = 0, 16, 8
KEYS = b"\x1b[A\x1b[D\x1b[3~\t\x15\x17\x0b\x01\x05\x02\x06\x08\x7f\x10\x0e\x0c\x03\x1b[1~\x1b[4~\xc3\r"
NMT, SYNC, PDO, SDO, LSS, ANY, TIME, ANEW = range(8)
EXAMPLES = {"PARAM": "pole_pairs", "TOPIC": "speed", "FAULT": "stall", "SIGNAL": "i_q"}


def _words(arguments, nth):
    """An example of each; of words that exclude each other the nth."""
    for word in arguments.split():
        choices = word.split("|")
        yield EXAMPLES.get(word) or (choices[nth % len(choices)] if word[0].islower() else "100")


def console():
    rows = [row for path in sorted((ROOT / "firmware/operate").glob("commands*.c"))
            for row in re.findall(r'^ +\{"(\w+)", "([^"]*)",', path.read_text(), re.MULTILINE)]
    lines = [f"set {name} {value}" for name, bounds in PARAMS.items() for value in bounds[:2]]
    lines += [" ".join([name, *_words(arguments, nth)]) for name, arguments in rows for nth in range(arguments.count("|") + 1)]
    text = [line.encode() + b"\r" for line in lines]
    return [state + b"".join(text[n:n + 3]) for n in range(0, len(text), 3) for state in (OFF, ON)] + [
        OFF + b"get all\r" + KEYS, ON + b"get " + b"x" * 90 + b"\r\nspeed 1.5\r"]


def modbus():
    at = [row[0] for row in objects()] + [REACTIONS, REACTIONS + 8, PARAMS_AT, PARAMS_AT + 2]
    pdus = [struct.pack(">BHH", function, where, 2) for where in at for function in (3, 4, 6)]
    pdus += [struct.pack(">BHHBI", 16, where, 2, 4, 1) for where in at] + [struct.pack(">BHHH", 22, at[0], 0xF0, 7)]
    pdus += [struct.pack(">BHHHHBI", 23, where, 2, where, 2, 4, 1) for where in at[::4]]
    pdus += [bytes([0x2B, 14, what, 0]) for what in range(1, 5)] + [bytes([code, 0, 0]) for code in (1, 7, 17, 20, 24, 65)]
    pdus += [struct.pack(">BHH", 3, PARAMS_AT, count) for count in (0, 124, 125, 126, 200)]
    pdus += [struct.pack(">BHHHHBI", 23, PARAMS_AT, count, 0, 2, 4, 1) for count in (124, 126, 200)]
    noise = [bytes([0, 255]) + bytes([unit]) * 255 for unit in (1, 7)] + [bytes([0, 200, 7, 0x2B]) + bytes([26]) * 198]
    inside = bytes([PATIENCE | CHECK_SUM, 22, 9, 3, 18]) + pdus[0] + b"\0\0" + pdus[1]  # of another slave
    parts = [bytes([before | CHECK_SUM, 1 + len(pdu), unit]) + pdu for unit in (1, 0, 7) for pdu in pdus
             for before in ((PATIENCE, TOGETHER) if unit == 1 else (TOGETHER,))]
    return [state + b"".join(parts[n:n + 4]) for n in range(0, len(parts), 4) for state in (OFF, ON)] + [
        ON + inside, *(ON + one + one for one in noise)]


def _can(kind, data, more=0):
    return bytes([kind | len(data) << 3 | more]) + data


def _sequences():
    """Values and strings in segments; a mapping that is made anew, of up to one entry too many."""
    for count in range(1, 8):
        yield struct.pack("<BHBI", 0x21, 0x6040, 0, count), bytes([(7 - count) << 1 | 1]).ljust(8, b"\0")
    yield struct.pack("<BHBI", 0x20, 0x60FF, 0, 0), bytes(8), b"\x11".ljust(8, b"\0")
    yield struct.pack("<BHBI", 0x40, 0x1008, 0, 0), *(bytes([0x60 | n % 2 << 4]).ljust(8, b"\0") for n in range(4))
    for pdo, (index, entry) in enumerate(((0x1400, 0x60600008), (0x1800, 0x60610008))):
        off = struct.pack("<BHBI", 0x23, index, 1, 1 << 31 | 0x205 - 0x80 * pdo)
        entries = [struct.pack("<BHBI", 0x23, index + 0x200, n, entry) for n in range(1, 9)]
        for count in (1, 4, 8, 9):
            yield off, struct.pack("<BHBI", 0x2F, index + 0x200, 0, 0), *entries, struct.pack(
                "<BHBI", 0x2F, index + 0x200, 0, count), struct.pack("<BHBI", 0x23, index, 1, 0x205 - 0x80 * pdo)


def canopen():
    places = [(index >> 8 or 0x2000 + at, index & 0xFF) for at, index, *_ in objects()]
    places += [(index, sub) for index in (*range(0x1000, 0x1019), *(base + n for base in (0x1400, 0x1600, 0x1800, 0x1A00)
                                                                    for n in range(4))) for sub in range(3)]
    places += [(0x2400 + 8, 0), *((0x3000 + n, 0) for n in range(len(PARAMS)))]
    frames = [_can(SDO, struct.pack("<BHBI", command, *place, 1)) for place in places for command in (0x40, 0x23, 0x2B, 0x2F)]
    frames += [_can(NMT, bytes([command, node])) for command in (1, 2, 128, 129, 130) for node in (0, 5)]
    frames += [_can(PDO, struct.pack("<HI", word, 7)[:n]) for word in (6, 7, 15, 31, 143) for n in (1, 2, 3, 6)]
    frames += [_can(LSS, bytes([command, value, 9, 0, 0, 0, 0, 0]))
               for command in (4, 0x11, 0x13, 0x15, 0x17, 0x40, 0x51, 0x5A, 0x5E) for value in (0, 1)]
    begun = _can(NMT, b"\1\5") + _can(SYNC, b"")
    return [state + begun + b"".join(frames[n:n + 6]) + bytes([TIME | 32, ANEW]) for n in range(0, len(frames), 6)
            for state in (OFF, ON)] + [ON + _can(ANY, b"\x7f\x07\5")] + [
        OFF + b"".join(_can(SDO, data) for data in one) for one in _sequences()]


def records():
    """Of each kind, at both edges; cut off at the end of a page, too, and one that claims as much as its name is long."""
    stored = [record(1, name, number(value)) for name, bounds in PARAMS.items() for value in bounds]
    edges = [record(2, "stall", bytes([choice])) for choice in (*range(6), 64)]
    edges += [record(3, "", number(5)), record(9, "later", b"x")]
    edges += [record(4, "", number(4) * 3 * count) for count in (1, HARMONICS, HARMONICS + 1)]
    edges += [record(9, "n" * count, b"") for count in (31, 32, 33, 255)]
    whole = b"".join(stored[2::3])
    pages = [whole[:PAGE * count] for count in (1, 2, 5)] + [record(9, "", bytes(PAGE - 8 - left)) + stored[0]
                                                             for left in range(len(stored[0]) + 8)]
    alone = [*stored, *edges]
    return [b"\1" + one for one in (*alone, *pages, whole)] + [b"\0" + slot([one], 2)[:HEAD] for one in alone[::40]] + [
        b"\0" + struct.pack("<IIII", 0, MARK, 2, 0xFFFF80)]


def tuning():
    return [bytes((byte ^ n) & 255 for n in range(count)) for byte in range(0, 256, 16) for count in (8, 64, 512)]
