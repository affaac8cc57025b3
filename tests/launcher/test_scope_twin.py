# SPDX-License-Identifier: MIT
"""Whether QEMU is at work, by what the system says of its threads: a busy machine must not pass for a silent drive."""
import asyncio
import signal
from types import SimpleNamespace

import pytest

from scope import twin

PID = 7


@pytest.fixture
def system(tmp_path, monkeypatch):
    """(says(state, ticks) of QEMU's second thread, passes(seconds)); the first sleeps."""
    now_s = [100.0]
    monkeypatch.setattr(twin, "PROC", tmp_path)
    monkeypatch.setattr(twin, "time", SimpleNamespace(monotonic=lambda: now_s[0]))

    def says(thread, state, ticks):
        folder = tmp_path / str(PID) / "task" / str(thread)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "stat").write_text(f"{thread} (qemu) one) {state} {'0 ' * 10}{ticks} 0 0\n", encoding="ascii")

    def passes(seconds):
        now_s[0] += seconds

    says(PID, "S", 3)
    return lambda state, ticks: says(PID + 1, state, ticks), passes


@pytest.fixture
def qemu():
    found = twin.Twin("teknic_m2310p", 1)
    found._process = SimpleNamespace(pid=PID)
    return found


@pytest.mark.parametrize("state, later, at_work", (
    ("S", 0, False), ("T", 0, False), ("S", 1, True), ("R", 0, True), ("D", 0, True)))
def test_it_is_at_work_while_it_used_the_processor_or_waits_for_it_or_for_a_disk(qemu, system, state, later, at_work):
    says, passes = system
    says("S", 40)
    assert qemu.at_work(), "the first look"
    passes(twin.STILL_S + 0.1)
    says(state, 40 + later)
    assert qemu.at_work() == at_work


def test_what_was_at_work_is_not_forgotten_at_once_and_one_that_has_ended_is_not(qemu, system):
    says, passes = system
    says("R", 40)
    assert qemu.at_work()
    says("S", 40)
    passes(twin.STILL_S - 0.1)
    assert qemu.at_work()
    qemu._process.pid = 8
    passes(0.2)
    assert not qemu.at_work()


def test_one_that_is_held_here_is_at_work_however_late_this_program_lets_go(qemu, system):
    says, passes = system
    sent = []
    qemu._process.send_signal = sent.append

    async def scene():
        says("R", 40)
        held = asyncio.ensure_future(qemu._hold(0))
        await asyncio.sleep(0)
        says("T", 40), qemu.at_work()
        passes(10 * twin.STILL_S)
        assert qemu.at_work() and sent == [signal.SIGSTOP]
        await held
        says("S", 40)
        assert qemu.at_work() and sent == [signal.SIGSTOP, signal.SIGCONT]
        passes(twin.STILL_S + 0.1)
        assert not qemu.at_work(), "but not for ever"

    asyncio.run(scene())
