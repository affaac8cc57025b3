# SPDX-License-Identifier: MIT
"""What the scope says at the console, to the letter: signals, settings, what a capture does, a record."""
import ctypes

import pytest

from rigs.scoped import SLOTS

CHOSEN = "signals: i_d,i_q,i_q_ref,vbus,speed,speed_ref,v_q,angle"  # at first
SCALES = {"i_a": "A 23571/32768", "vbus": "V 57528/32768", "count": "counts 1000/1", "v_q": "%_of_bus 100000/40000",
          "angle": "deg 45000/536870912", "turning": "Hz 312500/67108864", "speed": "rpm 1000/16", "target": "rpm 1000/65536",
          "winding": "degC 1000/16", "gate": "none 1000/1"}


@pytest.fixture(autouse=True)
def initial(scoped):
    scoped.c.params_init(scoped.axis.params)


def test_scope_text_lists_every_signal(c, scoped):
    table = (c.signal_info * ctypes.c_size_t.in_dll(c._library, "signal_count").value).in_dll(c._library, "signal_table")
    lines = scoped("scope list")
    assert [line.split(" ")[0] for line in lines] == [info.name.decode() for info in table] and len(lines) >= 24
    for line, info in zip(lines, table):
        name, text = info.name.decode(), c.signal_text(info.name).decode()
        assert line.endswith(f": {text}")
        if name in SCALES:
            assert line == f"{name} {SCALES[name]}: {text}"


def test_scope_text_of_the_settings(scoped):
    rest = ["capture: off, dropped: 0, late: 0", "kept from the last fault: 0 samples, one a millisecond"]
    assert scoped("scope") == [f"{CHOSEN}, every: 1 samples of the current loop",
                               "trigger: never, before: 256 of 512 samples"] + rest
    scoped("scope signals i_q,speed"), scoped("scope every 7"), scoped("scope before 30")
    for when in ("above", "below", "rises", "falls"):
        assert scoped(f"scope trigger speed {when} -12.5") == ["ok"]
        assert scoped("scope") == ["signals: i_q,speed, every: 7 samples of the current loop",
                                   f"trigger: speed {when} -12.500 rpm, before: 30 of 2048 samples"] + rest
    assert scoped("scope trigger never") == ["ok"]
    assert scoped("scope")[1] == "trigger: never, before: 30 of 2048 samples"


@pytest.mark.parametrize("cause", ("by command", "by the signal", "by a fault"))
def test_scope_text_of_a_capture(c, scoped, cause):
    def state():
        return scoped("scope")[2]
    scoped.choose("speed", "time")
    scoped("scope before 0"), scoped("scope trigger speed above 10"), scoped("scope arm")
    scoped.scope.dropped, scoped.scope.late = 3, 4
    assert state() == "capture: waits for its trigger, dropped: 3, late: 4"
    if cause == "by command":
        scoped("scope fire")
    elif cause == "by a fault":
        scoped.axis.faults.cause = c.FAULT_STALL
    else:
        scoped.axis.speed.speed_rpm_q4 = 160
    scoped.tick()
    scoped.type(b"")
    assert state() == f"capture: triggered {cause}, dropped: 3, late: 4"
    scoped.tick(2048)
    assert state() == f"capture: done {cause}, dropped: 3, late: 4"
    scoped("scope off")
    assert state() == f"capture: done {cause}, dropped: 3, late: 4", "it is kept"


def test_scope_text_of_a_record(c, scoped):
    """Its heading, its signals, their scales, and each sample."""
    scoped.choose("sequence", "speed")
    scoped.axis.loop.loops_per_slow, scoped.axis.speed.speed_rpm_q4 = 40, -7
    scoped("scope before 5"), scoped("scope every 3"), scoped("scope arm")
    scoped.tick(30)
    scoped("scope fire")
    scoped.tick(3 * 2048)
    scoped.scope.dropped, scoped.scope.late = 1, 2
    scoped.c.host_watchdog_served.value = 0
    lines = scoped("scope read")
    assert lines[:3] == ["samples: 2048, trigger: 5, every: 3, a millisecond has: 40, dropped: 1, late: 2", "sequence speed",
                         "1000/1 1000/16"]
    assert lines[3:-1] == [f"{16 + 3 * n} -7" for n in range(2048)] and lines[-1] == "end: 2048"
    assert scoped.c.host_watchdog_served.value >= 2048, "it takes long, and the thread lives"


def test_scope_text_of_what_a_fault_left(c, scoped):
    """One a millisecond, none missing, however the captures were set."""
    scoped.choose("time")
    scoped("scope every 3")
    for _ in range(SLOTS):
        c.scope_step(scoped.scope)
    scoped.axis.faults.cause, scoped.scope.dropped, scoped.scope.late = c.FAULT_STALL, 1, 2
    c.scope_step(scoped.scope)
    scoped.type(b"")
    lines = scoped("scope fault")
    assert lines[:3] == ["samples: 64, trigger: 63, every: 1, a millisecond has: 1, dropped: 0, late: 0", "time", "1000/1"]
    assert len(lines) == 3 + 64 + 1 and scoped("scope")[3] == "kept from the last fault: 64 samples, one a millisecond"


PLACES = range(0x30000000, 0x40000000, 0x1000000)  # where this machine may have some, with the bit of the device's
READ_WRITE, PRIVATE, BYTES = 3, 0x22, 4096


@pytest.fixture
def ram(scoped):
    """(its address, its words); what may be read begins one word later."""
    libc = ctypes.CDLL(None)
    libc.mmap.restype = ctypes.c_size_t
    libc.mmap.argtypes = [ctypes.c_size_t, ctypes.c_size_t, *[ctypes.c_int] * 3, ctypes.c_long]
    at = next(place for place in PLACES if libc.mmap(place, BYTES, READ_WRITE, PRIVATE, -1, 0) == place)
    scoped.scope.ram, scoped.scope.ram_end = at + 4, at + BYTES
    yield at, (ctypes.c_int32 * (BYTES // 4)).from_address(at)
    libc.munmap(ctypes.c_size_t(at), ctypes.c_size_t(BYTES))


def test_scope_text_of_words_of_ram(scoped, ram):
    """By their addresses, whatever stands before and behind; of what may not be read, no byte."""
    at, words = ram
    words[4], words[5], scoped.axis.speed.speed_rpm_q4 = 0x12345678, -2, 16
    assert scoped(f"scope values @{at + 16:x},speed,@{at + 18:x},@{at + 20 - 0x20000000:08x}") == [
        f"@{at + 16:x} speed @{at + 18:x} @{at + 20:x}", "1/1 1000/16 1/1 1/1", "305419896 16 -126412 -2"]
    for wrong in (*(f"@{at + far:x}" for far in (0, 3, BYTES - 3, BYTES)), "@0", "@2fffffff", "@ffffffff"):
        refusal = [f"error: {wrong}: not in the RAM that may be read"]
        for line in (f"scope values speed,{wrong}", f"scope signals {wrong}", f"scope trigger {wrong} above 1"):
            assert scoped(line) == refusal, line
    for wrong in ("@", "@3000001G", "@030000010", "@-4"):
        assert scoped(f"scope values {wrong}")[0].startswith("error: "), wrong
    last = f"@{at + BYTES - 4:x}"
    for line in (f"scope values @{at + 4:x},{last}", f"scope signals speed,{last}"):
        assert not scoped(line)[0].startswith("error"), line
    assert scoped("scope")[0].startswith(f"signals: speed,{last},")


def test_scope_text_of_a_trigger_by_a_word_of_ram(scoped, ram):
    at, words = ram
    word = f"@{at + 32:x}"
    scoped.choose(word, "sequence")
    assert scoped(f"scope trigger {word} rises 2147483.647") == ["ok"]
    assert scoped("scope")[1] == f"trigger: {word} rises 2147483.647 none, before: 256 of 2048 samples"
    scoped("scope before 1"), scoped("scope arm")
    for value in (-1 << 31, 1000, (1 << 31) - 2, (1 << 31) - 1):
        words[8] = value
        scoped.tick()
    scoped.tick(2048)
    lines = scoped("scope read")
    assert lines[1:5] == [f"{word} sequence", "1/1 1000/1", "2147483646 3", "2147483647 4"], "all bits of a word"
