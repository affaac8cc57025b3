# SPDX-License-Identifier: MIT
"""Settings that outlive power-off: the same C that is flashed, on the twin's model of the eNVM's controller.

What a slot holds is written down a second time here, in Python (`slot`), from docs/settings.md: the C's slots are read by it
and its slots by the C, so that an older firmware's, a newer one's and every kind of damage can be made.
"""
import ctypes
import struct
import zlib

import pytest
from hypothesis import given, settings, strategies as st

from unit.conftest import identify

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
        c.axis_init(self.axis, self.fabric)
        identify(self.fabric)
        self.axis.fabric_doubt, self.axis.state = 0, c.AXIS_SWITCH_ON_DISABLED
        c.host_bench.axis = ctypes.pointer(self.axis)

    def name(self, error):
        return next(name for name, value in self.c.enums["error"].items() if value == error)[len("ERROR_"):]

    def save(self, cut_at=0, cut_share=0.0):
        """The error's name, or "CUT"."""
        self.saved = self.c.saved()
        error = self.c.host_save(self.axis, self.saved, cut_at, cut_share)
        return "CUT" if error < 0 else self.name(error)

    def load(self):
        self.kept = self.c.kept()
        return self.name(self.c.axis_load(self.axis, self.slots, self.kept).error)

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
        view = self.c.slots_look(self.slots)
        return next(name for name, value in self.c.enums["slot_state"].items() if value == view.state[number])[5:]


@pytest.fixture
def drive(c):
    return Drive(c)


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


# ---- the parts -------------------------------------------------------------------------------------------------------

@given(st.lists(st.binary(max_size=400), max_size=4))
def test_the_crc_is_that_of_zlib(c, pieces):
    crc = 0xFFFFFFFF
    for piece in pieces:
        crc = c.crc32_add(crc, piece, len(piece))
    assert ~crc & 0xFFFFFFFF == zlib.crc32(b"".join(pieces))


def test_names_tell_the_records_apart_and_fit(c):
    found = [info.name.decode() for info in names(c)]
    assert len(set(found)) == len(found) <= 128 and max(map(len, found)) <= 31
    faults = [c.keeping_name_of_fault(cause) for cause in range(c.FAULT_COUNT)]
    for cause, name in enumerate(faults):
        leaves_choice = c.fault_class(cause).contents.allowed != 1
        assert (name is not None) == leaves_choice, cause
        if name:
            assert name.decode() == c.message_of_fault(cause).decode().replace(" ", "_") and len(name) <= 31


def test_a_full_set_leaves_a_quarter_of_the_slot(drive, c):
    learn(drive, harmonics=8)
    assert drive.save() == "NONE"
    assert parse(bytes(drive.raw(0)))[1].keys() >= {(INDEX, "index"), (COGGING, "cogging")}
    assert c.slots_look(drive.slots).records_bytes[0] + PAGE <= 0.75 * SLOT_BYTES


# ---- there and back --------------------------------------------------------------------------------------------------

def test_nothing_is_stored_at_first(drive):
    for filled in (0x00, 0xFF):
        for number in (0, 1):
            ctypes.memset(drive.raw(number), filled, SLOT_BYTES)
        assert drive.state(0) == drive.state(1) == "EMPTY"
        assert drive.restart() == "NOTHING_KEPT" and drive.kept.state == drive.c.KEPT_NONE
    before = drive.params()
    drive.c.params_init(drive.axis.params)
    assert drive.params() == before


@given(st.fixed_dictionaries({name: st.integers(*span) for name, span in FREE.items()}), st.integers(0, 2))
@settings(max_examples=30)
def test_what_is_saved_comes_back(c, values, choice):
    drive = Drive(c)
    drive.set(**values)
    cause = c.FAULT_LIMIT_CYCLE
    drive.axis.reactions.choice[cause] = choice
    wanted = drive.params(), drive.choices()
    assert drive.save() == "NONE"
    assert drive.restart() == "NONE" and drive.kept.state == c.KEPT_LOADED
    assert (drive.params(), drive.choices()) == wanted
    assert (drive.kept.unknown, drive.kept.missing) == (0, 0)


def test_the_layout_is_that_of_the_document(drive, c):
    drive.set(**OLD)
    assert drive.save() == "NONE"
    raw = bytes(drive.raw(0))
    save, found = parse(raw)
    assert save == 1
    for info in names(c):
        value = found[PARAMETER, info.name.decode()]
        assert struct.unpack("<i", value)[0] == OLD.get(info.name.decode(), info.initial)
    assert found[REACTION, "voltage_limit"] == bytes([c.REACTION_WARN])
    size = struct.unpack_from("<I", raw, 12)[0]
    assert raw[PAGE + size:] == bytes(SLOT_BYTES - PAGE - size), "pages that are not needed are not worn"


def test_slots_are_written_in_turn_and_the_later_counts(drive):
    for save in range(1, 6):
        drive.set(ramp_rpm_s=1000 * save)
        assert drive.save() == "NONE"
        assert (drive.saved.slot, drive.saved.number) == ((save - 1) % 2, save)
        assert drive.restart() == "NONE" and drive.axis.params.ramp_rpm_s == 1000 * save
        assert drive.kept.view.newest == (save - 1) % 2


@pytest.mark.parametrize("first, second, newest", ((1, 2, 1), (2, 1, 0), (2**32 - 1, 0, 1), (0, 2**32 - 1, 0),
                                                   (2**31 - 1, 2**31, 1), (2**31, 2**31 - 1, 0)))
def test_numbers_go_on_over_their_end(drive, first, second, newest):
    for number, save in enumerate((first, second)):
        drive.put(number, slot([record(PARAMETER, "learn_rpm", struct.pack("<i", 10 + number))], save))
    assert drive.load() == "NONE" and drive.kept.view.newest == newest and drive.axis.params.learn_rpm == 10 + newest
    assert drive.save() == "NONE"
    assert drive.saved.slot == 1 - newest and drive.saved.number == ((first, second)[newest] + 1) % 2**32


# ---- what another firmware has written -------------------------------------------------------------------------------

def test_an_older_set_with_other_names(drive, c):
    records = [record(PARAMETER, "ramp_rpm_s", number(777)), record(PARAMETER, "old_name_ma", number(5)),
               record(REACTION, "an_old_fault", b"\x01"), record(99, "later_kind", b"abc"),
               record(REACTION, "limit_cycle", bytes([c.REACTION_WARN])), record(PARAMETER, "learn_rpm", number(7))]
    drive.put(0, slot(records, 41))
    drive.axis.params.pole_pairs = 9
    assert drive.load() == "NONE"
    assert drive.axis.params.ramp_rpm_s == 777 and drive.axis.params.learn_rpm == 7, "behind what was passed over, too"
    assert drive.axis.reactions.choice[c.FAULT_LIMIT_CYCLE] == c.REACTION_WARN
    assert drive.axis.params.pole_pairs == 4, "not stored: initial, whatever it was"
    assert (drive.kept.unknown, text(drive.kept.first_unknown)) == (3, b"old_name_ma")
    assert drive.kept.missing == len(names(c)) - 2


REFUSED = {
    "below its range": ([record(PARAMETER, "learn_rpm", number(0))], "KEPT_RANGE", b"learn_rpm"),
    "above its range": ([record(PARAMETER, "learn_rpm", number(101))], "KEPT_RANGE", b"learn_rpm"),
    "too short": ([record(PARAMETER, "learn_rpm", b"\1\0")], "KEPT_FORMAT", b"learn_rpm"),
    "reaction too long": ([record(REACTION, "limit_cycle", b"\1\0")], "KEPT_FORMAT", b"limit_cycle"),
    "reaction not allowed": ([record(REACTION, "over-speed", b"\2")], "REACTION_NOT_ALLOWED", b"over-speed"),
    "no reaction": ([record(REACTION, "over-speed", b"\3")], "REACTION_NOT_ALLOWED", b"over-speed"),
    "index of another length": ([record(INDEX, "index", b"\1")], "KEPT_FORMAT", b"index"),
    "part of a harmonic": ([record(COGGING, "cogging", bytes(13))], "KEPT_FORMAT", b"cogging"),
    "too many harmonics": ([record(COGGING, "cogging", bytes(12 * 9))], "KEPT_FORMAT", b"cogging"),
    "a length beyond the end": ([struct.pack("<BBH", PARAMETER, 9, 60000) + b"learn_rpm"], "KEPT_FORMAT", b""),
    "a name beyond the longest": ([record(PARAMETER, "n" * 32, number(1))], "KEPT_FORMAT", b""),
    "does not hold together": ([record(PARAMETER, "i_max_ma", number(14999))], "I_MAX_BEYOND_TRIP", b""),
    "an overspeed beyond the bus": ([record(PARAMETER, "overspeed_rpm", number(32000))], None, b""),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_is_refused_as_a_whole(case, drive, c):
    """With the reason; nothing has changed."""
    records, problem, about = REFUSED[case]
    good = record(PARAMETER, "ramp_rpm_s", number(777))
    drive.put(1, slot([good, *records], 8))
    drive.set(home_turns=99)
    before = drive.params(), drive.choices()
    error = drive.load()
    assert error == problem or (problem is None and error != "NONE")
    assert drive.kept.state == c.KEPT_REFUSED and text(drive.kept.about) == about
    assert (drive.params(), drive.choices()) == before


def test_what_does_not_hold_together_is_not_saved(drive):
    drive.set(i_max_ma=14999)
    assert drive.save() == "I_MAX_BEYOND_TRIP"
    assert drive.bench.writes == 0 and drive.state(0) == drive.state(1) == "EMPTY"


# ---- damage ----------------------------------------------------------------------------------------------------------

def test_each_bit_that_flips_is_noticed(drive):
    drive.set(**OLD)
    assert drive.save() == "NONE"
    raw = drive.raw(0)
    used = PAGE + drive.c.slots_look(drive.slots).records_bytes[0]
    look = drive.c.slots_look
    for byte in range(used):
        for bit in range(8):
            raw[byte] ^= 1 << bit
            assert not look(drive.slots).any, (byte, bit)
            raw[byte] ^= 1 << bit
    assert look(drive.slots).any


def test_a_damaged_set_gives_way_to_the_one_before(drive):
    drive.set(**OLD)
    assert drive.save() == "NONE"
    old = drive.params()
    drive.set(**NEW)
    assert drive.save() == "NONE"
    drive.raw(1)[200] ^= 4
    assert drive.state(1) == "DAMAGED" and drive.restart() == "NONE" and drive.params() == old
    assert drive.save() == "NONE" and (drive.saved.slot, drive.saved.number) == (1, 2), "the damaged one is next"


@pytest.mark.parametrize("saves_before", (1, 2))
def test_a_power_cut_behind_every_write_of_a_save(c, saves_before):
    """The old set or the new one, whole; both orders of the slots. Within a command, at several shares of its time."""
    drive = Drive(c)
    drive.set(home_turns=1234)
    for _ in range(saves_before):
        drive.set(**OLD)
        assert drive.save() == "NONE"
    old, stored = drive.params(), bytes(drive.bench.envm)
    drive.set(**NEW)
    new = drive.params()
    assert drive.save() == "NONE"
    writes, found = drive.bench.writes, set()
    assert writes > 400
    for cut_at in range(1, writes + 1):
        for seed, share in enumerate([0.5, *(n / 48 for n in range(49))]):
            ctypes.memmove(ctypes.addressof(drive.bench.envm), stored, len(stored))
            drive.bench.envm.noise.state += cut_at * 64 + seed
            drive.power_on()
            ctypes.memmove(ctypes.addressof(drive.axis.params), new, len(new))
            assert drive.save(cut_at, share) == "CUT"
            assert drive.restart() == "NONE", (cut_at, share)
            assert drive.params() in (old, new), (cut_at, share)
            found.add(drive.params() == new)
            if cut_at % 97 == 0:  # and the drive goes on from there
                drive.set(**NEW)
                assert drive.save() == "NONE" and drive.restart() == "NONE" and drive.params() == new
            if not drive.bench.cut_in_command:
                break  # nothing is under way, whatever the share
    assert found == {False, True}


def test_the_head_is_written_last(drive):
    """Order and CRC guard against a cut each by itself, so the test above misses either alone."""
    drive.set(**OLD)
    assert drive.save() == drive.save() == "NONE"
    head = bytes(drive.raw(0))[:PAGE]
    drive.set(**NEW)
    assert drive.save() == "NONE"
    new, writes = bytes(drive.raw(0)), drive.bench.writes
    drive.set(**OLD)
    assert drive.save() == drive.save() == "NONE"
    older = bytes(drive.raw(0))[:PAGE]
    assert older != head
    drive.set(**NEW)
    assert drive.save() == "NONE"  # to the other one
    assert drive.save(cut_at=writes - 20) == "CUT", "amid the words of the last page"
    assert bytes(drive.raw(0))[PAGE:] == new[PAGE:] and bytes(drive.raw(0))[:PAGE] == older


@given(st.lists(st.one_of(
    st.tuples(st.just("save"), st.integers(1, 10**6)),
    st.tuples(st.just("cut"), st.integers(1, 10**6), st.integers(1, 500), st.floats(0, 1)),
    st.tuples(st.just("rot"), st.integers(0, SLOT_BYTES - 1), st.integers(0, 7), st.integers(0, 1)),
    st.tuples(st.just("restart"))), max_size=12), st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_whatever_happens_the_set_is_one_that_was_saved(c, deeds, seed):
    drive = Drive(c, seed=seed)
    possible, last = {drive.params()}, drive.params()
    for deed, *how in deeds:
        if deed == "restart":
            drive.restart()
            assert drive.params() in possible
            continue
        if deed == "rot":
            byte, bit, number = how
            drive.raw(number)[byte] ^= 1 << bit
            continue
        drive.set(ramp_rpm_s=how[0], stop_max_ms=100 + how[0])
        if deed == "cut":
            assert drive.save(how[1], how[2]) in ("CUT", "NONE")
        else:
            assert drive.save() == "NONE"
            last = drive.params()
            assert drive.restart() == "NONE" and drive.params() == last
        possible.add(drive.params())
        drive.restart()
        assert drive.params() in possible


# ---- the controller --------------------------------------------------------------------------------------------------

def test_the_controller_is_left_as_it_was_found(drive):
    drive.bench.envm_cr = 0x1040
    assert drive.save() == "NONE"
    assert drive.bench.envm_cr == 0x1040 and not drive.bench.envm.granted
    assert drive.bench.open == 0, "no interrupt may come while a command is under way"
    assert drive.c.host_primask.value == 0
    assert drive.bench.programs == drive.bench.envm.programmed == 1 + drive.c.slots_look(drive.slots).records_bytes[0] // PAGE
    assert drive.bench.refreshes == drive.bench.programs and drive.bench.late_ms < 15


PROBLEMS = {"held": "ENVM_NOT_GRANTED", "locked": "ENVM_LOCKED", "erase": "ENVM_ERASE", "write": "ENVM_WRITE",
            "verify": "ENVM_VERIFY", "busy": "ENVM_BUSY"}


@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.parametrize("when", (0, 5))
def test_each_way_in_which_the_controller_fails(problem, when, drive):
    """Is named, and what was stored before is still there."""
    drive.set(**OLD)
    assert drive.save() == "NONE"
    old, envm = drive.params(), drive.bench.envm
    page = (0x3C000 + SLOT_BYTES) // PAGE + (1 + when if when < 5 else 0)  # the first that is written, or the head
    drive.set(**NEW)
    if problem == "held":
        envm.held = True
    elif problem == "locked":
        envm.locked[page] = True
    elif problem == "busy":
        envm.status |= 1 << 19
        envm.until, envm.began = 2**62, drive.bench.now
        envm.status &= ~1
    else:
        envm.fails = {"erase": 4, "write": 8, "verify": 2}[problem]
    said = drive.save()
    assert said == PROBLEMS[problem] or (problem == "busy" and said in ("ENVM_BUSY", "ENVM_TIMED_OUT"))
    assert not envm.granted and drive.c.host_primask.value == 0
    envm.held, envm.until, envm.status = False, 2**63 - 1, 1
    assert drive.restart() == "NONE" and drive.params() == old


def test_the_array_is_asked_and_not_what_was_sent(drive, c):
    """Where the core does not see what the controller has written, nothing is stored."""
    elsewhere, slots, report = (ctypes.c_uint8 * (2 * SLOT_BYTES))(), c.host_slots(), c.saved()
    drive.save()
    slots.memory = ctypes.cast(elsewhere, type(slots.memory))
    assert drive.name(c.axis_save(drive.axis, slots, report).error) == "ENVM_VERIFY"


def test_without_wait_states_nothing_would_be_right(drive):
    """The model punishes it: what the driver sets in ENVM_CR is needed."""
    drive.bench.envm.wait_states = False
    assert drive.save() == "NONE", "the driver sets it"


@pytest.mark.parametrize("stands", (False, True))
def test_a_page_that_takes_for_ever(c, stands):
    """It gives up before the watchdog does; without one that counts, after a number of looks."""
    drive = Drive(c, program_s=1000.0 if stands else 0.5)
    drive.bench.watchdog_stands = stands
    began = drive.bench.now
    assert drive.save() == "ENVM_TIMED_OUT"
    assert stands or 20e9 < (drive.bench.now - began) <= 92e9
    assert drive.c.host_primask.value == 0 and drive.restart() == "NOTHING_KEPT"


def test_pages_of_the_device_are_denied(drive):
    words = (ctypes.c_uint32 * 32)()
    for offset in (0x3F800, 0x3FF80):
        assert drive.c.envm_program_page(offset, words) == drive.c.ENVM_DENIED
    assert drive.c.envm_program_page(0x3F780, words) == drive.c.ENVM_DONE
    assert drive.bench.open == 0, "the driver holds the interrupts back by itself"


def test_wear_is_said(drive):
    assert drive.save() == "NONE" and not drive.saved.worn
    drive.bench.envm.p.endurance = 1
    assert drive.save() == "NONE" and not drive.saved.worn
    assert drive.save() == "NONE" and drive.saved.worn
    assert drive.bench.envm.writes[0x3C000 // PAGE] == 2


# ---- when not --------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("state", ("NOT_READY", "READY", "SWITCHED_ON", "OPERATION_ENABLED", "QUICK_STOP", "FAULT_REACTION"))
def test_nothing_while_the_bridge_may_be_on(state, drive, c):
    drive.set(**OLD)
    assert drive.save() == "NONE"
    drive.set(**NEW)
    before = drive.params()
    drive.axis.state, drive.fabric.gate.STATUS = c.enums["axis_state"]["AXIS_" + state], 1
    drive.bench.commands = drive.bench.lit = 0
    assert drive.save() == "SAVE_WHILE_ON"
    assert drive.load() == "DRIVE_IS_ON" and drive.kept.state == c.KEPT_NONE
    assert drive.name(c.axis_defaults(drive.axis).error) == "DRIVE_IS_ON"
    assert drive.params() == before and drive.bench.commands == drive.bench.lit == 0


def test_a_drive_with_a_fault_can_be_saved(drive, c):
    drive.axis.state = c.AXIS_FAULT
    assert drive.save() == "NONE" and drive.load() == "NONE"


def test_not_while_the_shaft_turns(drive):
    drive.axis.speed.speed_rpm_q4 = -31 * 16
    assert drive.save() == "TURNING" and drive.bench.writes == 0


def test_not_at_a_wrong_clock(drive, c):
    c.host_device_fault.value = c.FAULT_CLOCK
    try:
        assert drive.save() == "ENVM_CLOCK" and drive.bench.writes == 0
    finally:
        c.host_device_fault.value = 0


def test_not_where_the_slow_loop_is_dead(drive, c):
    """Programming serves the watchdog, which then would never bite."""
    drive.set(**OLD)
    assert drive.save() == "NONE"  # and the bench's clock has an axis that goes on
    before, other, report = drive.bench.commands, c.axis(), c.saved()
    drive.bench.axis = ctypes.pointer(other)  # now it is another one
    assert drive.name(c.axis_save(drive.axis, drive.slots, report).error) == "BUSY"
    assert drive.bench.commands == before


def test_the_slow_loop_does_not_take_it_for_a_dead_current_loop(drive, c):
    """Conversions have gone unanswered: the next steps do not count them."""
    axis = drive.axis
    axis.heartbeat = drive.fabric.adc.SEQUENCE = 1000
    axis.time_ms = axis.paced_ms = 50
    axis.time_ms += 40
    assert drive.save() == "NONE"
    assert axis.time_ms - axis.paced_ms <= 2
    drive.fabric.adc.SEQUENCE = 1400
    c.axis_step(axis)
    assert axis.faults.cause == c.FAULT_NONE


def test_defaults(drive, c):
    initial = drive.params(), drive.choices()
    drive.set(**NEW)
    drive.axis.reactions.choice[c.FAULT_HOMING] = c.REACTION_OFF
    assert drive.save() == "NONE"
    assert drive.name(c.axis_defaults(drive.axis).error) == "NONE"
    assert (drive.params(), drive.choices()) == initial
    assert drive.load() == "NONE" and drive.axis.params.learn_rpm == NEW["learn_rpm"]


# ---- what was learned of the encoder ---------------------------------------------------------------------------------

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


def test_the_index_and_the_cogging_are_back_wherever_the_counter_begins(drive, c):
    learn(drive, index=1234)
    drive.axis.params.speed_bw_hz = 60
    c.cogging_set_fade(drive.axis.motion.cogging, 60)
    before = {place: torque(drive, (1234 + place) % COUNTS) for place in range(0, COUNTS, 53)}
    assert max(before.values()) > 100
    assert drive.save() == "NONE" and not drive.saved.cogging_dropped
    assert drive.restart() == "NONE"
    start = drive.axis.start
    assert start.index_known and start.index_offset_q32 == 0x89ABCDEF and not start.aligned
    c.axis_remember(drive.axis)
    assert drive.axis.motion.cogging.count == 0, "the index has not been seen yet"
    drive.fabric.encoder.STATUS, drive.fabric.encoder.INDEX = SEEN, 3210
    c.axis_remember(drive.axis)
    assert drive.axis.motion.cogging.count == 2 and not drive.axis.keeping.waits
    for place, torque_q15 in before.items():
        assert abs(torque(drive, (3210 + place) % COUNTS) - torque_q15) <= 1
    assert drive.save() == "NONE" and drive.restart() == "NONE", "and again"


def test_a_map_that_waits_for_the_index_is_stored_as_it_is(drive, c):
    learn(drive)
    assert drive.save() == "NONE" and drive.restart() == "NONE" and drive.axis.keeping.waits
    first = parse(bytes(drive.raw(0)))[1][COGGING, "cogging"]
    assert drive.save() == "NONE"
    assert parse(bytes(drive.raw(1)))[1][COGGING, "cogging"] == first


def test_without_an_index_there_is_nothing_to_count_from(drive):
    learn(drive)
    drive.axis.start.index_known, drive.fabric.encoder.STATUS = False, 0
    assert drive.save() == "NONE" and drive.saved.cogging_dropped
    assert {kind for kind, _ in parse(bytes(drive.raw(0)))[1]} == {PARAMETER, REACTION}


def test_of_another_encoder_nothing_is_kept(drive):
    """`set encoder_counts`, and no `on` since: what was learned is of the old one."""
    learn(drive)
    drive.set(encoder_counts=4096)
    assert drive.save() == "NONE"
    assert {kind for kind, _ in parse(bytes(drive.raw(0)))[1]} == {PARAMETER, REACTION}


def test_the_scale_of_the_set_comes_with_its_index(drive, c):
    """Not only with the next `on`, which would take another scale for another encoder and forget."""
    drive.put(0, slot([record(PARAMETER, "encoder_counts", number(8192)), record(INDEX, "index", struct.pack("<I", 77))], 1))
    assert drive.load() == "NONE" and drive.axis.start.index_offset_q32 == 77
    drive.axis.loop.vbus_q15 = (drive.axis.tuning.v_min_q15 + drive.axis.tuning.v_max_q15) // 2
    assert drive.name(c.switch_on_at_once(drive.axis).error) == "NONE"
    assert drive.axis.start.index_known and drive.axis.start.index_offset_q32 == 77


def test_what_was_aligned_in_this_life_is_newer_than_what_is_stored(drive):
    learn(drive)
    assert drive.save() == "NONE"
    drive.axis.start.index_offset_q32 = 5
    assert drive.load() == "NONE" and drive.axis.start.index_offset_q32 == 5


def test_in_a_fabric_in_doubt_nothing_is_touched(drive, c):
    learn(drive)
    assert drive.save() == "NONE"
    drive.power_on()
    drive.axis.fabric_doubt = 0xD0B7FABC
    before = bytes(drive.fabric)
    assert drive.load() == "NONE" and bytes(drive.fabric) == before and not drive.axis.start.index_known
