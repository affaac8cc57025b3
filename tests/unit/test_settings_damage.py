# SPDX-License-Identifier: MIT
"""Settings after bit rot, power cuts and a controller that fails: the old set or the new one, whole."""
import ctypes

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigs.settings import NEW, OLD, PAGE, SLOT_BYTES, Drive, number, parse, record, slot


@pytest.fixture
def drive(c):
    return Drive(c)


# ---- damage ----------------------------------------------------------------------------------------------------------

def test_each_bit_that_flips_is_noticed(drive):
    drive.set(**OLD)
    assert drive.save() == "NONE"
    raw = drive.raw(0)
    used = PAGE + drive.c.slots_check(drive.slots).records_bytes[0]
    look = drive.c.slots_check
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


def test_a_power_cut_loses_nothing_of_a_larger_image(c):
    """Behind every 13th write of a save: what this image does not know is still there, whichever slot then counts."""
    drive = Drive(c)
    foreign = {(1, f"newer_{n}"): number(n) for n in range(20)}
    drive.put(0, slot([record(kind, name, value) for (kind, name), value in foreign.items()], 8))
    assert drive.restart() == "NONE" and drive.save() == "NONE"
    stored, writes, newest = bytes(drive.bench.envm), drive.bench.writes, set()
    for cut_at in [*range(1, writes, 13), *range(writes - 12, writes)]:
        ctypes.memmove(ctypes.addressof(drive.bench.envm), stored, len(stored))
        drive.power_on()
        assert drive.load() == "NONE" and drive.save(cut_at, 0.5) == "CUT" and drive.restart() == "NONE"
        save, found = parse(bytes(drive.raw(drive.kept.view.newest)))
        assert found.items() >= foreign.items() and drive.kept.unknown == len(foreign), cut_at
        newest.add(save)
    assert newest == {9, 10}


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
    assert drive.bench.programs == drive.bench.envm.programmed == 1 + drive.c.slots_check(drive.slots).records_bytes[0] // PAGE
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


@pytest.mark.parametrize("bit", (18, 19))
def test_an_error_that_the_controller_keeps_is_cleared(bit, drive):
    """Somebody else's denied access, or command while busy: without that it would take no command until the next reset."""
    drive.bench.envm.status |= 1 << bit
    drive.set(**NEW)
    assert drive.save() == "NONE" and drive.restart() == "NONE"


def test_the_array_is_asked_and_not_what_was_sent(drive, c):
    """Where the core does not see what the controller has written, nothing is stored."""
    elsewhere, slots, report = (ctypes.c_uint8 * (2 * SLOT_BYTES))(), c.host_slots(), c.saved()
    drive.save()
    slots.memory = ctypes.cast(elsewhere, type(slots.memory))
    assert drive.name(c.drive_save(drive.axis, slots, report).error) == "ENVM_VERIFY"


def test_without_wait_states_nothing_would_be_right(drive):
    """The model punishes it: what the driver sets in ENVM_CR is needed."""
    drive.bench.envm.wait_states = False
    assert drive.save() == "NONE", "the driver sets it"


@pytest.mark.parametrize("watchdog_ms, gives_up_ms", ((30, 20), (100, 66), (190, 66), (32212, 66), (None, None)))
def test_a_page_that_takes_for_ever(c, watchdog_ms, gives_up_ms):
    """It gives up before the watchdog does, and before it has kept the interrupts waiting for long; without a watchdog that
    counts, after a number of looks."""
    drive = Drive(c, program_s=0.5 if watchdog_ms else 1000.0)
    if watchdog_ms:
        drive.bench.watchdog_ticks = watchdog_ms * 50000
    drive.bench.watchdog_stands = watchdog_ms is None
    assert drive.save() == "ENVM_TIMED_OUT"
    took_ms = (drive.bench.now - drive.bench.served) / 1e9
    assert watchdog_ms is None or gives_up_ms <= took_ms < gives_up_ms + 30
    assert drive.c.host_primask.value == 0 and drive.restart() == "NOTHING_STORED"


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
