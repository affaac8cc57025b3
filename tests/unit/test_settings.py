# SPDX-License-Identifier: MIT
"""Settings that outlive power-off: the same C that is flashed, on the twin's model of the eNVM's controller."""
import ctypes
import struct
import zlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigs.settings import (COGGING, FREE, INDEX, OLD, PAGE, PARAMETER, REACTION, SLOT_BYTES, Drive, learn, names, number,
                           parse, record, slot, text)


@pytest.fixture
def drive(c):
    return Drive(c)


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
    faults = [c.nvm_name_of_fault(cause) for cause in range(c.FAULT_COUNT)]
    for cause, name in enumerate(faults):
        leaves_choice = c.fault_class(cause).contents.allowed != 1
        assert (name is not None) == leaves_choice, cause
        if name:
            assert name.decode() == c.message_of_fault(cause).decode().replace(" ", "_").lower() and len(name) <= 31


def test_a_full_set_leaves_a_quarter_of_the_slot(drive, c):
    learn(drive, harmonics=8)
    assert drive.save() == "NONE"
    assert parse(bytes(drive.raw(0)))[1].keys() >= {(INDEX, "index"), (COGGING, "cogging")}
    assert c.slots_check(drive.slots).records_bytes[0] + PAGE <= 0.75 * SLOT_BYTES


# ---- there and back --------------------------------------------------------------------------------------------------

def test_nothing_is_stored_at_first(drive):
    for filled in (0x00, 0xFF):
        for number in (0, 1):
            ctypes.memset(drive.raw(number), filled, SLOT_BYTES)
        assert drive.state(0) == drive.state(1) == "EMPTY"
        assert drive.restart() == "NOTHING_STORED" and drive.kept.state == drive.c.NVM_NOTHING
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
    assert drive.restart() == "NONE" and drive.kept.state == c.NVM_LOADED
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


FOREIGN = [(PARAMETER, "newer_row_ma", number(-5)), (REACTION, "a_later_fault", b"\x01"), (99, "later_kind", b"abc"),
           (PARAMETER, "another", number(7) * 3)]


@pytest.mark.parametrize("saves", (1, 2, 5))
def test_what_a_larger_image_has_stored_outlives_saves_of_a_smaller_one(drive, saves):
    drive.put(1, slot([record(PARAMETER, "ramp_rpm_s", number(777)), *(record(*one) for one in FOREIGN)], 41))
    for n in range(saves):
        assert drive.restart() == "NONE" and drive.kept.unknown == len(FOREIGN)
        drive.set(stop_max_ms=200 + n)
        assert drive.save() == "NONE"
    save, stored = parse(bytes(drive.raw(drive.saved.slot)))
    assert save == 41 + saves and stored.items() >= {(kind, name): value for kind, name, value in FOREIGN}.items()
    assert stored[PARAMETER, "ramp_rpm_s"] == number(777) and stored[PARAMETER, "stop_max_ms"] == number(199 + saves)


def test_defaults_and_save_make_a_clean_store(drive):
    drive.put(0, slot([record(*one) for one in FOREIGN], 41))
    assert drive.restart() == "NONE"
    assert drive.c.drive_defaults(drive.axis).error == 0
    drive.set(ramp_rpm_s=5)
    assert drive.save() == "NONE" and drive.restart() == "NONE"
    assert (drive.kept.unknown, drive.axis.params.ramp_rpm_s) == (0, 5)
    drive.put(0, slot([record(*one) for one in FOREIGN], 99))
    assert drive.c.drive_defaults(drive.axis).error == 0 and drive.load() == "NONE", "`load` takes `defaults` back"
    assert drive.save() == "NONE" and drive.restart() == "NONE" and drive.kept.unknown == len(FOREIGN)


def test_what_does_not_fit_beside_is_not_dropped_in_silence(drive):
    much = [(PARAMETER, f"newer_row_{n:020}", number(n)) for n in range(100)]
    drive.put(1, slot([record(*one) for one in much], 41))
    assert drive.restart() == "NONE" and drive.save() == "SAVE_FULL"
    assert drive.restart() == "NONE" and drive.kept.unknown == len(much), "the set before is still there"
    assert drive.c.drive_defaults(drive.axis).error == 0 and drive.save() == "NONE"


REFUSED = {
    "below its range": ([record(PARAMETER, "learn_rpm", number(0))], "STORED_RANGE", b"learn_rpm"),
    "above its range": ([record(PARAMETER, "learn_rpm", number(101))], "STORED_RANGE", b"learn_rpm"),
    "too short": ([record(PARAMETER, "learn_rpm", b"\1\0")], "STORED_FORMAT", b"learn_rpm"),
    "reaction too long": ([record(REACTION, "limit_cycle", b"\1\0")], "STORED_FORMAT", b"limit_cycle"),
    "reaction not allowed": ([record(REACTION, "over-speed", b"\2")], "REACTION_NOT_ALLOWED", b"over-speed"),
    "no reaction": ([record(REACTION, "over-speed", b"\3")], "REACTION_NOT_ALLOWED", b"over-speed"),
    "index of another length": ([record(INDEX, "index", b"\1")], "STORED_FORMAT", b"index"),
    "part of a harmonic": ([record(COGGING, "cogging", bytes(13))], "STORED_FORMAT", b"cogging"),
    "too many harmonics": ([record(COGGING, "cogging", bytes(12 * 9))], "STORED_FORMAT", b"cogging"),
    "a length beyond the end": ([struct.pack("<BBH", PARAMETER, 9, 60000) + b"learn_rpm"], "STORED_FORMAT", b""),
    "a name beyond the longest": ([record(PARAMETER, "n" * 32, number(1))], "STORED_FORMAT", b""),
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
    assert drive.kept.state == c.NVM_REFUSED and text(drive.kept.about) == about
    assert (drive.params(), drive.choices()) == before


def test_what_does_not_hold_together_is_not_saved(drive):
    drive.set(i_max_ma=14999)
    assert drive.save() == "I_MAX_BEYOND_TRIP"
    assert drive.bench.writes == 0 and drive.state(0) == drive.state(1) == "EMPTY"


@pytest.mark.parametrize("beyond, whole", ((0, True), (1, True), (-1, False)))
def test_a_record_that_ends_where_the_page_does_is_whole(c, beyond, whole):
    """One byte less, and it is another format's."""
    written = record(PARAMETER, "ramp_rpm_s", number(777))
    page = (ctypes.c_uint8 * (len(written) + 1)).from_buffer_copy(written + b"\0")
    reader, found, start = c.record_reader(), c.record(), ctypes.addressof(page)
    byte = ctypes.POINTER(ctypes.c_uint8)
    reader.at = ctypes.cast(start, byte)
    reader.end = ctypes.cast(start + len(written) + beyond, byte)
    assert c.record_next(reader, found) == whole and reader.broken != whole
    if whole:
        assert c.record_word(found, 0) == 777 and not c.record_next(reader, found) and not reader.broken


def test_a_record_of_more_than_255_bytes_is_passed_over_as_a_whole(c):
    """Of a later version: what is behind it counts."""
    written = b"".join((record(99, "table", bytes(range(200)) * 3), record(PARAMETER, "ramp_rpm_s", number(-777))))
    page = (ctypes.c_uint8 * len(written)).from_buffer_copy(written)
    start, byte = ctypes.addressof(page), ctypes.POINTER(ctypes.c_uint8)
    reader, found = c.record_reader(at=ctypes.cast(start, byte), end=ctypes.cast(start + len(written), byte)), c.record()
    assert c.record_next(reader, found) and (found.kind, found.value_bytes, found.value[599]) == (99, 600, 199)
    assert c.record_next(reader, found) and (found.kind, bytes(found.name).rstrip(b"\0")) == (PARAMETER, b"ramp_rpm_s")
    assert c.record_word(found, 0) == -777 and not c.record_next(reader, found) and not reader.broken


def test_conversions_missed_while_a_page_is_written_are_excused_on_both_axes(drive, c):
    """The other axis' slow loop waits, too, and would take them for a current loop that has stopped."""
    beside = c.axis()
    beside.time_ms, beside.state = 777, c.AXIS_SWITCH_ON_DISABLED
    drive.axis.other_axis = ctypes.pointer(beside)
    assert drive.save() == "NONE"
    assert beside.rate_chosen_ms == 777 and drive.axis.rate_chosen_ms == drive.axis.time_ms
