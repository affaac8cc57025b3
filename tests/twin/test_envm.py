# SPDX-License-Identifier: MIT
"""The eNVM's controller against UG0331 as docs/settings.md has it: commands, busy time, refusals, wear, what a cut leaves."""
import ctypes

import numpy as np
import pytest

from twin.bench import address, c

MS = 10**9
PAGE, BYTES = 100, 128
DATA, STATUS, LOCK, CMD, CLRHINT, ACCESS = 0x80, 0x120, 0x140, 0x148, 0x158, 0x1FC
PROGRAM, VERIFY, UNLOCK = (code << 24 | PAGE * BYTES for code in (0x08, 0x10, 0x13))
READY, DENIED, BUSY = 1, 1 << 18, 1 << 19
told = []
CHANGED = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint32)(lambda _, __, page: told.append(page))


class Envm:
    def __init__(self, seed=1, **params):
        self.e = c.envm()
        c.envm_init(self.e, c.envm_params(**{"program_s": 8e-3, "verify_s": 1e-3, "endurance": 3, **params}), seed)
        self.e.changed, self.e.wait_states = address(CHANGED), True
        told.clear()

    def write(self, register, value, at_ps=0):
        return c.envm_write(self.e, register, value, at_ps)

    def read(self, register, at_ps=0):
        return c.envm_read(self.e, register, at_ps)

    def fill(self, word):
        for at in range(DATA, 0x100, 4):
            self.write(at, word + at)

    def page(self, word=None):
        there = np.frombuffer(self.e.array, np.uint8)[PAGE * BYTES:(PAGE + 1) * BYTES]
        return there if word is None else np.array_equal(there.view(np.uint32), word + DATA + 4 * np.arange(32))

    def busy(self):
        return c.envm_is_busy(self.e)


@pytest.fixture
def e():
    envm = Envm()
    envm.write(ACCESS, 1)
    return envm


def test_commands(e):
    e.fill(0x1000)
    e.write(CMD, PROGRAM)
    assert e.busy() and e.read(STATUS, 1) == READY, "one look may be deceived"
    assert e.read(STATUS, 8 * MS - 1) == 0 and told == []
    e.write(CMD, VERIFY, 4 * MS)
    assert e.read(STATUS, 8 * MS) == READY | BUSY and e.page(0x1000) and told == [PAGE] and not e.busy(), "the first went on"
    e.write(CLRHINT, 2, 9 * MS)
    e.write(CMD, VERIFY, 9 * MS)
    assert e.read(STATUS, 9 * MS) == READY | BUSY, "no command is taken after that"
    e.write(CLRHINT, 4, 9 * MS)
    e.write(CMD, VERIFY, 9 * MS)
    assert e.read(STATUS, 10 * MS) == READY, "until it is cleared: verified"
    e.e.array[PAGE * BYTES + 5] ^= 1
    e.write(CMD, VERIFY, 11 * MS)
    assert e.read(STATUS, 12 * MS) == READY | 1 << 1, "another content is noticed"


@pytest.mark.parametrize("register, value", [(CMD, 0x08 << 24 | (PAGE + 1) * BYTES), (DATA, 7), (ACCESS, 0), (CLRHINT, 4)])
def test_what_has_ended_when_something_is_written_has_ended_as_it_was(e, register, value):
    """Nobody has looked in between."""
    e.fill(0x1000)
    e.write(CMD, PROGRAM)
    e.write(register, value, 9 * MS)
    assert told == [PAGE] and e.page(0x1000) and e.e.writes[PAGE + 1] == (register == CMD) and not e.e.status & BUSY


@pytest.mark.parametrize("command", [0x08 << 24 | (2048 - 16) * BYTES, PROGRAM + 4])
def test_a_reserved_page_and_not_a_page_s_beginning(e, command):
    assert e.read(ACCESS) == 5
    e.write(CMD, command)
    assert e.read(STATUS) == READY | DENIED
    e.write(CMD, PROGRAM)
    assert e.read(STATUS) == READY | DENIED and not e.busy(), "no command is taken, and the denial stays"
    e.write(CLRHINT, 2)
    assert e.read(STATUS) == READY
    e.write(CMD, 0x08 << 24 | (2048 - 17) * BYTES)
    assert e.busy(), "the page below those reserved"


def test_registers_below_the_data_are_no_data(e):
    e.fill(0x1000)
    for at in (0x40, 0x7C, 0x100):
        e.write(at, 77)
        assert e.read(at) == 77 and e.read(at ^ 4) == 0
    e.write(CMD, PROGRAM)
    c.envm_settle(e.e, 8 * MS)
    assert e.page(0x1000)


def test_locks(e):
    e.write(LOCK, 1)
    e.write(CMD, PROGRAM)
    c.envm_settle(e.e, 8 * MS)
    assert e.e.locked[PAGE]
    e.write(CMD, PROGRAM, 9 * MS)
    assert e.read(STATUS, 9 * MS) == READY | 1 << 4
    e.write(CMD, UNLOCK, 9 * MS)
    e.write(CMD, PROGRAM, 9 * MS)
    assert e.busy()


def test_without_access_and_without_wait_states():
    e = Envm()
    e.fill(7)
    e.write(CMD, PROGRAM)
    assert not e.busy() and e.read(DATA) == 0 and e.read(STATUS) == 0
    e.e.held = True
    e.write(ACCESS, 1)
    assert e.read(ACCESS) != 5, "while somebody else has it"
    e = Envm()
    e.write(ACCESS, 1)
    e.e.wait_states = False
    e.fill(9)
    e.write(CMD, PROGRAM)
    assert e.read(STATUS, 9 * MS) == READY | 1 << 3 and not e.page(9)


def test_wear(e):
    for n in range(1, 5):
        e.write(CMD, PROGRAM, n * 10 * MS)
        assert e.read(STATUS, n * 10 * MS + 9 * MS) == (READY if n <= 3 else READY | 1 << 5)
    assert e.e.writes[PAGE] == 4 and e.e.writes[PAGE + 1] == 0


@pytest.mark.parametrize("share, old, erased, new", [
    (0, (256, 256), (0, 0), (0, 0)), (0.25, (91, 165), (90, 166), (0, 0)), (0.5, (0, 0), (256, 256), (0, 0)),
    (0.75, (0, 0), (90, 166), (90, 166))])
def test_what_a_cut_leaves(share, old, erased, new):
    """Bits of which old, erased and new value differ."""
    def left():
        e = Envm()
        e.write(ACCESS, 1)
        e.page()[:] = 0x0F
        for at in range(DATA, 0x100, 4):
            e.write(at, 0x33333333)
        e.write(CMD, PROGRAM)
        c.envm_power_cut(e.e, int(share * 8 * MS))
        assert not e.busy() and not e.e.granted and e.e.status == READY, "the controller starts anew"
        return e.page().copy()
    bytes_ = left()
    counts = [int(np.unpackbits(part).sum()) for part in (~bytes_ & 0x30, bytes_ & 0xC0, ~bytes_ & 0x0C)]
    assert all(low <= count <= high for count, (low, high) in zip(counts, (old, erased, new))), counts
    assert np.array_equal(left(), bytes_), "the same seed leaves the same"


def test_a_cut_at_the_end_and_behind_a_write(e):
    e.fill(1)
    e.write(CMD, PROGRAM)
    c.envm_power_cut(e.e, 8 * MS)
    assert e.page(1)
    e = Envm(cut_write=3)
    assert [e.write(at, 1) for at in (ACCESS, DATA, DATA + 4)] == [False, False, True] and not e.e.granted
    e = Envm(cut_write=2, cut_share=0.5)
    e.write(ACCESS, 1, 5 * MS)
    e.page()[:] = 0x0F
    assert e.write(CMD, PROGRAM, 5 * MS) and (e.page() == 0xFF).all(), "half of the command it gave"


def test_files(e, tmp_path):
    path = tmp_path / "envm"
    e.fill(0x7000)
    e.write(CMD, PROGRAM)
    c.envm_settle(e.e, 8 * MS)
    e.e.locked[PAGE] = True
    assert c.envm_store(e.e, bytes(path))
    e = Envm()
    assert c.envm_recall(e.e, bytes(path)) and e.page(0x7000) and e.e.writes[PAGE] == 1 and e.e.locked[PAGE]
    assert e.e.writes[PAGE - 1] == 0 and e.e.array[PAGE * BYTES - 1] == 0 and not e.e.locked[PAGE + 1]
    whole = path.read_bytes()
    assert len(whole) < 2 * (BYTES + 16), "that page alone"
    for other in (b"mssenvm0 and more", b"x" + whole[1:], whole[:8] + b"\xFF" * 4 + whole[12:]):
        path.write_bytes(other)
        assert not c.envm_recall(Envm().e, bytes(path)), other[:20]
    path.unlink()
    assert c.envm_recall(Envm().e, bytes(path)), "a device that is new"
