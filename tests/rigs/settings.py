# SPDX-License-Identifier: MIT
"""What a slot of the eNVM holds, written down a second time from docs/settings.md, and a drive with its eNVM.

The C's slots are read by this and its slots by the C, so that an older firmware's, a newer one's and every kind of damage can
be made.
"""
import ctypes
import struct
import zlib

from rigs.drive import at_rest

PAGE, SLOT_BYTES = 128, 4096
PARAMETER, REACTION, INDEX, COGGING = 1, 2, 3, 4
MARK = int.from_bytes(b"MFS1", "little")


# ---- a slot, as docs/settings.md has it ------------------------------------------------------------------------------

def record(kind, name, value):
    return struct.pack("<BBH", kind, len(name), len(value)) + name.encode() + value


def number(value):
    return struct.pack("<i", value)


def slot(records, save):
    """The bytes of a whole one."""
    body = b"".join(records)
    body += bytes(-len(body) % PAGE)
    head = struct.pack("<III", MARK, save, len(body)) + bytes(PAGE - 16)
    return struct.pack("<I", zlib.crc32(body + head)) + head + body


def parse(raw):
    """(number of the save, {(kind, name): value}) of a slot, or None if its CRC is wrong."""
    crc, mark, save, size = struct.unpack_from("<IIII", raw)
    if mark != MARK or size > SLOT_BYTES - PAGE or crc != zlib.crc32(raw[PAGE:PAGE + size] + raw[4:PAGE]):
        return None
    found, at, end = {}, PAGE, PAGE + size
    while at + 4 <= end and raw[at]:
        kind, name, value = struct.unpack_from("<BBH", raw, at)
        at += 4
        found[kind, raw[at:at + name].decode()] = bytes(raw[at + name:at + name + value])
        at += name + value
    return save, found


# ---- a drive and its eNVM --------------------------------------------------------------------------------------------

class Drive:
    """An axis that is off; power_on() makes a new one of what is stored."""

    def __init__(self, c, program_s=8e-3, seed=1):
        self.c = c
        self.power_on()
        c.host_envm_new(self.axis, program_s, seed)
        self.bench, self.slots = c.host_bench, c.host_slots()

    def power_on(self):
        c = self.c
        self.fabric, self.axis = c.fabric(), c.axis()
        at_rest(c, self.axis, self.fabric)
        c.host_bench.axis = ctypes.pointer(self.axis)

    def name(self, error):
        return self.c.name("error", error)

    def save(self, cut_at=0, cut_share=0.0):
        """The error's name, or "CUT"."""
        self.saved = self.c.saved()
        error = self.c.host_save(self.axis, self.saved, cut_at, cut_share)
        return "CUT" if error < 0 else self.name(error)

    def load(self):
        self.kept = self.c.nvm_report()
        return self.name(self.c.drive_load(self.axis, self.slots, self.kept).error)

    def restart(self):
        """What a power-on finds: the error's name."""
        self.power_on()
        return self.load()

    def set(self, **values):
        for name, value in values.items():
            info = self.c.param_find(name.encode())
            assert info.contents.min <= value <= info.contents.max
            self.c.param_set(self.axis.params, info, value)

    def params(self):
        return bytes(self.axis.params)

    def choices(self):
        return list(self.axis.reactions.choice)

    def raw(self, number):
        start = ctypes.addressof(self.bench.envm.array) + 0x3C000 + number * SLOT_BYTES
        return (ctypes.c_uint8 * SLOT_BYTES).from_address(start)

    def put(self, number, content):
        raw = self.raw(number)
        ctypes.memset(raw, 0, SLOT_BYTES)
        ctypes.memmove(raw, content, len(content))

    def state(self, number):
        return self.c.name("slot_state", self.c.slots_check(self.slots).state[number])


def text(characters):
    return bytes(characters).split(b"\0")[0]


def names(c):
    """The rows of the table: what there is."""
    table = ctypes.cast(ctypes.addressof(ctypes.c_char.in_dll(c._library, "param_table")), ctypes.POINTER(c.param_info))
    count = ctypes.c_size_t.in_dll(c._library, "param_count").value
    return [table[n] for n in range(count)]


# values that go together with any others: what the motor and the loops do does not hang on them
FREE = {"ramp_rpm_s": (1, 1000000), "home_turns": (1, 10000), "learn_rpm": (1, 100), "retry_count": (0, 100),
        "command_timeout_ms": (0, 60000), "stop_max_ms": (100, 3600000), "home_rpm": (-30000, 30000)}
OLD = {"ramp_rpm_s": 1111, "home_rpm": -222, "stop_max_ms": 33333, "retry_count": 4}
NEW = {"ramp_rpm_s": 999999, "home_rpm": 8765, "stop_max_ms": 123456, "learn_rpm": 66}


COUNTS, SEEN = 4000, 1


def learn(drive, harmonics=2, index=1234):
    """An offset and a map, as alignment and `learn cogging` leave them; the index has passed at that count."""
    axis, motion = drive.axis, drive.axis.motion
    drive.fabric.encoder.STATUS, drive.fabric.encoder.INDEX = SEEN, index
    axis.start.aligned = axis.start.index_known = True
    axis.start.index_offset_q32 = 0x89ABCDEF
    motion.cogging.count = harmonics
    for n in range(harmonics):
        motion.cogging.harmonics[n].order = (1, 4, 8, 24, 2, 12, 48, 16)[n]
        harmonic = motion.cogging.harmonics[n]
        harmonic.cos_q23, harmonic.sin_q23 = 3_000_000 - 400_000 * n, -1_000_000 + 77_777 * n


def torque(drive, count):
    """The map's, at a count of the encoder."""
    estimate = drive.axis.speed.estimate
    estimate.count, estimate.backwards, estimate.beyond_q15, estimate.speed_rpm_q15 = count, 0, 0, 0
    return drive.c.cogging_torque_q15(drive.axis.motion.cogging, estimate, drive.axis.tuning)
