# SPDX-License-Identifier: MIT
"""The current loop's interrupt between any two basic blocks of the slow loop, and the slow loop between those of the thread."""
import contextlib
import ctypes

import pytest

from rigs.carrying import Carrying
from rigs.drive import World
from rigs.identify_alone import begin
from rigs.searching import Searching
from rigs.starting import switched_on

NEAR = 200  # blocks before and behind the one that enables the gates


@contextlib.contextmanager
def watching(c, *exclusive):
    """The two words that must not be set together, as addresses."""
    words = (ctypes.c_void_p * 2).in_dll(c._library, "host_exclusive")
    words[:] = exclusive
    c.host_both_set.value = c.host_first_set_at.value = c.host_blocks.value = 0
    try:
        yield
    finally:
        words[:] = (None, None)


def interrupted(c, run, handler, at):
    """Runs it with the handler at that block; returns whether it came."""
    came = []
    hook = ctypes.CFUNCTYPE(None)(lambda: came.append(handler()))
    slot = ctypes.c_void_p.in_dll(c._library, "host_interrupt")
    c.host_interrupt_at.value, c.host_blocks.value = at, 0
    slot.value = ctypes.cast(hook, ctypes.c_void_p).value
    try:
        run()
    finally:
        slot.value = None
    return bool(came)


# ---- a latched fault and live gates exclude each other ----

def switching_on(c):
    w = World(c)
    return w, lambda: c.current_loop_on(w.axis.loop, w.fabric, w.axis.tuning)


def catching_with_hall(c):
    w = switched_on(c)
    w.fabric.gate.CONTROL, w.axis.loop.status_max = 0, 2**32 - 1
    return w, lambda: c.start_hall(w.axis)


def catching_by_emf(c):
    w = Searching(c)
    return w, lambda: c.flying_resume(w.axis, 0x12345678, 3_000_000)


def short_pulse(c):
    w = Searching(c)
    return w, lambda: c.emf_pulse(w.axis.loop, w.fabric, 100)


def long_pulse(c):
    w = Searching(c)
    return w, lambda: c.emf_pulse_period(w.axis.loop, w.fabric, 1)


PLACES = (switching_on, catching_with_hall, catching_by_emf, short_pulse, long_pulse)


@pytest.mark.parametrize("place", PLACES, ids=lambda place: place.__name__)
def test_a_fault_that_interrupts_the_enabling_of_the_gates_leaves_them_off(c, place):
    w, run = place(c)
    before, registers = bytes(w.axis), bytes(w.fabric)
    control = ctypes.addressof(w.fabric.gate) + type(w.fabric.gate).CONTROL.offset
    cause = ctypes.addressof(w.axis.faults) + type(w.axis.faults).cause.offset

    def again():
        ctypes.memmove(ctypes.addressof(w.axis), before, len(before))
        ctypes.memmove(ctypes.addressof(w.fabric), registers, len(registers))
    with watching(c, control, cause):
        run()
        enabled_at = c.host_first_set_at.value
    assert enabled_at > 0, "it does enable them"
    for at in range(max(enabled_at - NEAR, 1), enabled_at + NEAR):
        again()
        with watching(c, control, cause):
            came = interrupted(c, run, lambda: c.fault_raise(w.axis, c.FAULT_UNDERVOLTAGE), at)
            assert c.host_both_set.value == 0, f"both at block {at}"
        assert not came or (w.axis.faults.cause == c.FAULT_UNDERVOLTAGE and w.fabric.gate.CONTROL == 0), f"block {at}"


def test_a_fault_latched_before_is_respected_until_it_is_cleared(c):
    """Played in sequence: no pulse and no live gate, whoever asks."""
    for place in PLACES:
        w, run = place(c)
        c.fault_raise(w.axis, c.FAULT_STALL)
        run()
        assert w.fabric.gate.CONTROL == 0, place.__name__
        c.fault_clear(w.axis)
        run()
        assert w.fabric.gate.CONTROL == 1 or "pulse" in place.__name__


def test_a_fault_that_comes_while_another_is_cleared_stays_and_locks_out(c):
    w = World(c)
    for at in range(1, 40):
        c.fault_raise(w.axis, c.FAULT_UNDERVOLTAGE)
        came = interrupted(c, lambda: c.fault_clear(w.axis), lambda: c.fault_raise(w.axis, c.FAULT_ECC), at)
        assert bool(w.axis.faults.cause) == bool(w.axis.loop.locked_out), f"block {at}"
        if not came:
            break
    assert at >= 3 and not came


# ---- an over-current: gates first ----

def test_gates_are_off_before_an_overcurrent_is_analysed(c):
    """Between the reads that found it and the gates there are a few blocks, whatever caused it."""
    w = Carrying(c)
    gates = []
    w.fabric.adc.STATUS = 1 << 4
    for at in range(1, 400):
        w.fabric.gate.CONTROL = 1
        w.axis.faults.cause = 0
        if not interrupted(c, lambda: c.drive_sample_fault(w.axis), lambda: gates.append(w.fabric.gate.CONTROL), at):
            break
    assert len(gates) > 50 and sum(gates) < 40, f"live for {sum(gates)} of {len(gates)} blocks"


# ---- two contexts, one decision ----

def test_the_interrupt_takes_over_from_the_encoder_while_the_slow_loop_does(c):
    """Whoever comes first turns the frame to where the rotor is; the other finds it done."""
    w = Carrying(c)
    before = bytes(w.axis)

    def again():
        ctypes.memmove(ctypes.addressof(w.axis), before, len(before))
        w.fabric.gate.CONTROL = 1

    def slow_loop():
        w.report("ENCODER_DEAD")

    def interrupt():
        w.sample_fault(gate=1 << 5)

    def frame():
        return w.axis.loop.source, w.axis.loop.field_angle_q32, w.axis.failover.seed.angle_q32, w.axis.failover.seed.speed_q32
    alone = []
    for act in (slow_loop, interrupt):
        again()
        act()
        assert w.axis.failover.pending and w.axis.loop.source == c.LOOP_OBSERVER
        alone.append(frame())
    blocks = 0
    while True:
        again()
        blocks += 1
        if not interrupted(c, slow_loop, interrupt, blocks):
            break
        assert w.axis.faults.cause == 0 and w.axis.failover.pending and frame() in alone, f"turned twice at block {blocks}"
    assert blocks > 100


@pytest.mark.parametrize("ends", (False, True))
def test_a_sweep_leaves_references_alone_that_an_interrupt_has_turned_with_the_frame(c, ends):
    """The reference is the sweep's where it was so before, and the loop's own from the instant at which it took over."""
    w = Carrying(c)
    loop = w.axis.loop
    sweep = c.sweep(axis=ctypes.pointer(w.axis))
    assert c.sweep_begin(sweep, c.SWEEP_Q, 500).error == c.ERROR_NONE
    c.sweep_sample(sweep, 1)
    c.sweep_sample(sweep, 7)
    before = bytes(w.axis), bytes(sweep)

    def sampler():
        (c.sweep_end if ends else lambda s: c.sweep_sample(s, 5))(sweep)

    def takes_over():
        c.current_loop_coast(loop, 2**28, loop.pll.speed_q32)  # as failover_from_sample() does
        turned.append((loop.i_d_ref_q15, loop.i_q_ref_q15))
    blocks, turned = 0, []
    while True:
        for part, kept in zip((w.axis, sweep), before):
            ctypes.memmove(ctypes.addressof(part), kept, len(kept))
        w.fabric.gate.CONTROL = 1
        blocks += 1
        if not interrupted(c, sampler, takes_over, blocks):
            break
        begins_anew = not ends and (sweep.base_q15, sweep.written_q15) == (turned[-1][1], loop.i_q_ref_q15)
        assert loop.i_d_ref_q15 == turned[-1][0] and (begins_anew or loop.i_q_ref_q15 == turned[-1][1]), f"block {blocks}"
    assert blocks > 3


def test_a_stop_while_identify_thinks_stays(c):
    for at in [*range(1, 60), *range(60, 3000, 37)]:
        d = begin(c)
        d.evaluating = True
        came = interrupted(c, lambda: c.identify_evaluate(d), lambda: c.identify_stop(d, c.FAULT_STALL), at)
        if not came:
            break
        if d.running:
            continue
        assert d.fault == c.FAULT_STALL and d.step == c.IDENTIFY_STEP_PULSES == d.stopped_in, f"block {at}"
        assert all(result.state != 0 for result in d.results), f"block {at}: something is left open"
