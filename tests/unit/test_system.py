# SPDX-License-Identifier: MIT
"""The device's side of the program: boot, what ends a life and what the next one knows of it, clocks, guard, watchdog, idle.

The processor's registers are memory at their own addresses.
"""
import ctypes
import itertools
import os

import pytest

from rigs.device import FABRIC, KEY, SYSREG

PLL_LOST, FABRIC_PLL_LOST, ECC_ERROR, TICK, ADC_IRQ, SCOPE, PUT_BACK = 23, 32, 29, 14, 34, 9, 8


# ---- the device ------------------------------------------------------------------------------------------------------

def test_a_guarded_device_lacks_nothing(device, system):
    assert device.fault() == "STACK_GUARD"
    assert system.device_guard_stack() and device.fault() == "NONE"
    base = ctypes.addressof(ctypes.c_uint32.in_dll(system._library, "link_stack_guard_start")) & 0xFFFFFFFF
    assert (device.mpu.RNR, device.mpu.RBAR, device.mpu.CTRL) == (7, base, 5)
    assert device.mpu.RASR == 1 << 28 | 7 << 1 | 1, "256 bytes, no access, nothing to execute"


@pytest.mark.parametrize("block, register, value, found", [
    ("sysreg", "MSSDDR_PLL_STATUS", 0, "CLOCK"), ("sysreg", "MSSDDR_PLL_STATUS", 1, "CLOCK"),
    ("sysreg", "MSSDDR_PLL_STATUS", 2, "CLOCK"), ("sysreg", "MSSDDR_FACC1_CR", 1 << 12, "CLOCK"),
    ("sysreg", "MSSDDR_FACC1_CR", 1 << 26, "CLOCK"), ("sysreg", "MSSDDR_FACC1_CR", 1 << 2, "CLOCK"),
    ("sysreg", "MSSDDR_FACC1_CR", 1 << 5, "CLOCK"), ("sysreg", "MSSDDR_FACC1_CR", 1 << 13, "CLOCK"),
    ("sysreg", "MSSDDR_FACC1_CR", 1 << 9, "CLOCK"), ("sysreg", "MSSDDR_FACC1_CR", 3 << 9, "CLOCK"),
    ("sysreg", "MSSDDR_FACC1_CR", 4 << 2 | 4 << 5 | 4 << 9 | 4 << 13, "NONE"),
    ("mpu", "CTRL", 4, "STACK_GUARD"), ("mpu", "RBAR", 0x100, "STACK_GUARD"), ("mpu", "RASR", 0, "STACK_GUARD"),
    ("watchdog", "WDOGENABLE", 0, "WATCHDOG_OFF"), ("watchdog", "WDOGCONTROL", 4, "WATCHDOG_OFF"),
    ("watchdog", "WDOGCONTROL", 3, "NONE"), ("watchdog", "WDOGLOAD", 0x4C4B7F, "NONE")])
def test_what_a_device_may_lack(device, system, block, register, value, found):
    system.device_guard_stack()
    setattr(getattr(device, block), register, value)
    assert device.fault() == found


def test_the_watchdog_s_time_is_the_design_s(device, system):
    assert system.device_watchdog_ms() == 32212
    device.watchdog.WDOGLOAD = 0x4C4B7F
    assert system.device_watchdog_ms() == 100
    for register, value in (("WDOGENABLE", 0), ("WDOGCONTROL", 4)):
        device.watchdog.WDOGENABLE, device.watchdog.WDOGCONTROL = 1, 0
        setattr(device.watchdog, register, value)
        assert system.device_watchdog_ms() == 0


def test_the_gravest_comes_first(device):
    device.watchdog.WDOGENABLE = 0
    assert device.fault() == "STACK_GUARD"
    device.sysreg.MSSDDR_PLL_STATUS = 1
    assert device.fault() == "CLOCK"


def test_without_a_protection_unit_there_is_no_guard(device, system):
    device.mpu.TYPE = 0
    assert not system.device_guard_stack() and device.mpu.CTRL == 0 and device.fault() == "STACK_GUARD"


def test_a_reset_that_holds_nothing_is_not_written(device, system):
    """A process of its own, for which the registers can only be read."""
    device.sysreg.SOFT_RESET_CR = 1 << 16
    child = os.fork()
    if child == 0:
        ctypes.CDLL(None).mprotect(ctypes.c_void_p(SYSREG), ctypes.c_size_t(4096), 1)
        system.sysreg_release_reset(1 << 6 | 1 << 20)
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
    system.sysreg_release_reset(1 << 6 | 1 << 16)
    assert device.sysreg.SOFT_RESET_CR == 0


# ---- boot ------------------------------------------------------------------------------------------------------------

def test_the_core_is_set_up(device, system):
    device.sysreg.SOFT_RESET_CR = 0xFFFFFFFF
    device.dwt.CYCCNT = 77
    system.boot_core()
    assert device.sysreg.CC_CR == 5 and device.sysreg.CC_REGION_CR == 1 and device.sysreg.FLUSH_CR == 1
    assert device.scb.CCR == 1 << 4 and device.scb.SHCSR == 7 << 16
    assert device.fault() == "NONE", "the guard stands"
    assert device.dwt.CTRL == 1 and device.dwt.CYCCNT == 0 and ctypes.c_uint32.from_address(0xE000EDFC).value == 1 << 24
    assert device.sysreg.SOFT_RESET_CR == 0xFFFFFFFF & ~(1 << 6 | 1 << 7 | 1 << 8 | 1 << 16 | 1 << 18 | 31 << 20)
    assert device.watchdog.WDOGREFRESH == KEY


@pytest.mark.parametrize("found, left", ((0, 1), (1, 1), (2, 2), (3, 3)))
def test_a_watchdog_that_a_probe_has_switched_off_is_switched_on(device, system, found, left):
    """And refreshed behind that; what a design has chosen stays. At boot, and later by the slow loop, which refreshes nothing
    else."""
    device.sysreg.WDOG_CR = found
    system.boot_core()
    assert device.sysreg.WDOG_CR == left and device.watchdog.WDOGREFRESH == KEY
    device.sysreg.WDOG_CR, device.watchdog.WDOGREFRESH, system.axes[0].fabric_untrusted = found, 0, 0xD0B7FABC
    system.handlers_start_scope()
    for system.axes[0].time_ms in range(8):
        system.Timer1_IRQHandler()
    assert device.sysreg.WDOG_CR == left and device.watchdog.WDOGREFRESH == (KEY if found == 0 else 0)


@pytest.mark.parametrize("word", (0, 1, 7, 2047))
def test_a_cache_that_holds_other_words_is_off(device, system, word):
    code, array = (ctypes.c_uint32 * 2048)(*range(2048)), (ctypes.c_uint32 * 2048)(*range(2048))
    device.sysreg.MASTER_WEIGHT0_CR = 0x2108421
    assert system.cache_lock(code, array) and device.sysreg.CC_CR == 5
    assert device.sysreg.MASTER_WEIGHT0_CR == 0x2108420, "32 of the cache's accesses in a row"
    array[word] ^= 1 << 31
    assert not system.cache_lock(code, array) and device.sysreg.CC_CR == 0 and device.sysreg.CC_REGION_CR == 1


def test_a_first_life(device, system):
    system.boot_core()
    found, last = device.boot()
    assert found == "NONE" and not last.valid and not last.probe_failed


@pytest.mark.parametrize("cause, exception, found", [
    (1 << 5, None, "WATCHDOG"), (1 << 4, None, "LOCKUP"), (1 << 4 | 1 << 5, 3, "LOCKUP"), (1 << 3, None, "NONE"),
    (1 << 0, None, "NONE"), (0xFF, None, "NONE"),
    (1 << 3, 3, "EXCEPTION"), (1 << 5, 3, "EXCEPTION"), (1 << 3, 16 + ECC_ERROR, "ECC"),
    (1 << 3, 16 + PLL_LOST, "PLL"), (1 << 3, 16 + FABRIC_PLL_LOST, "PLL"), (1 << 3, 16 + 31, "EXCEPTION")])
def test_how_the_last_life_ended(device, system, cause, exception, found):
    system.boot_core()
    device.sysreg.RESET_SOURCE_CR = cause
    if exception:
        system.host_exception.value = exception
        system.postmortem_keep(None, 0xFFFFFFF9)
    this, last = device.boot()
    assert this == found and last.reset_causes == cause
    assert device.sysreg.RESET_SOURCE_CR == 0 and device.boot()[0] == "NONE", "the next life does not hear of it again"


def test_what_is_so_now_is_graver_than_what_was(device, system):
    system.boot_core()
    for lacks, found in (({"WDOGENABLE": 0}, "WATCHDOG_OFF"), ({}, "WATCHDOG")):
        device.watchdog.WDOGENABLE = 1
        for name, value in lacks.items():
            setattr(device.watchdog, name, value)
        device.sysreg.RESET_SOURCE_CR = 1 << 5
        assert device.boot()[0] == found


def test_another_fabric(device, system):
    system.boot_core()
    device.fabric.gate.ID = 0x464F4321
    device.sysreg.RESET_SOURCE_CR = 1 << 5
    assert device.boot()[0] == "FABRIC"
    device.sysreg.MSSDDR_PLL_STATUS = 0
    assert device.boot()[0] == "CLOCK", "then nothing of the fabric is read"


def test_a_fabric_that_ended_the_last_life_is_left_alone(device, system):
    """The mark stands while the identity is read, and not after it."""
    system.boot_core()
    system.postmortem_probe(True)
    assert device.boot()[0] == "FABRIC"
    assert device.boot()[0] == "NONE", "it is forgotten"
    system.postmortem_probe(True)
    system.postmortem_probe(False)
    assert not system.postmortem_collect().probe_failed
    device.boot()
    assert not system.postmortem_collect().probe_failed, "the fabric answered"


# ---- what is left after a fault --------------------------------------------------------------------------------------

NAMES = ("r0", "r1", "r2", "r3", "r12", "lr", "pc", "xpsr")


def keep(device, frame=True):
    device.scb.CFSR, device.scb.HFSR, device.scb.MMFAR, device.scb.BFAR = 0xA1, 0xB2, 0xC3, 0xD4
    device.sysreg.EDAC_SR, device.c.host_exception.value = 0x15, 5
    taken = device.c.fault_frame()
    for number, name in enumerate(NAMES):
        setattr(taken, name, 0x01010101 * (number + 1))
    device.c.postmortem_keep(taken if frame else None, 0xFFFFFFF1)


def test_the_record_has_everything(device, system):
    keep(device)
    last = system.postmortem_collect()
    assert last.valid and last.frame_valid and not last.probe_failed
    assert (last.exception, last.exc_return) == (5, 0xFFFFFFF1)
    assert (last.cfsr, last.hfsr, last.mmfar, last.bfar, last.edac) == (0xA1, 0xB2, 0xC3, 0xD4, 0x15)
    assert [getattr(last.frame, name) for name in NAMES] == [0x01010101 * (n + 1) for n in range(8)]
    assert not system.postmortem_collect().valid, "once"


def test_a_record_without_a_frame(device, system):
    keep(device)
    keep(device, frame=False)
    last = system.postmortem_collect()
    assert last.valid and not last.frame_valid and not any(getattr(last.frame, name) for name in NAMES)


def test_a_record_that_has_suffered_is_none(device, system):
    """Whichever word has changed: the mark, each of the record, the sum."""
    words = ctypes.sizeof(system.postmortem) // 4
    kept = system.address_of_static("kept", "host_exception") + 4  # behind the probe's mark: mark, record, sum
    for word in range(words + 2):
        keep(device)
        at = ctypes.c_uint32.from_address(kept + 4 * word)
        at.value ^= 0x100
        assert not system.postmortem_collect().valid, word
        at.value ^= 0x100


# ---- idle, measurement, interrupts -----------------------------------------------------------------------------------

def awake(system, clock):
    """(idle, where each axis finds when the thread last made progress)."""
    idle, progress = system.structs["idle"](), [ctypes.c_uint32(0) for _ in range(2)]
    idle.time_ms = ctypes.pointer(clock)
    for n, ms in enumerate(progress):
        idle.progress_ms[n] = ctypes.pointer(ms)
    return idle, progress


def test_the_watchdog_is_served_and_each_axis_told_while_the_slow_loop_lives(device, system):
    clock = ctypes.c_uint32(5)
    idle, progress = awake(system, clock)
    for now, served in ((5, True), (5, False), (6, True), (6, False), (2, True)):
        device.watchdog.WDOGREFRESH, clock.value = 0, now
        progress[0].value = progress[1].value = 0
        system.idle_serve_watchdog(idle)
        assert (device.watchdog.WDOGREFRESH == KEY) == served
        assert [ms.value for ms in progress] == [now * served] * 2


def resting(system):
    """(idle, its clock, what its lines have heard), let go at 1 ms."""
    clock, heard = ctypes.c_uint32(1), [ctypes.c_uint32(n) for n in (0, 7, 9)]
    idle, _ = awake(system, clock)
    for n, count in enumerate(heard):
        idle.received[n] = ctypes.pointer(count)
    system._library.idle(ctypes.byref(idle))
    system.host_sleeps.value = 0
    return idle, clock, heard


@pytest.fixture
def sleeping(system):
    """Sets what comes with each interrupt that the processor sleeps for."""
    hook, kept = ctypes.c_void_p.in_dll(system._library, "host_on_sleep"), []

    def with_each(wake):
        kept.append(ctypes.CFUNCTYPE(None)(wake))
        hook.value = ctypes.cast(kept[-1], ctypes.c_void_p).value
    yield with_each
    hook.value = None


@pytest.mark.parametrize("moves", ("clock", 0, 1, 2))
def test_idle_sleeps_until_there_is_something_new(system, device, sleeping, moves):
    """Interrupts that bring nothing, the current loop's, let the thread sleep on."""
    idle, clock, heard = resting(system)

    def wake():
        if system.host_sleeps.value == 20:
            (clock if moves == "clock" else heard[moves]).value += 1
    sleeping(wake)
    system._library.idle(ctypes.byref(idle))
    assert system.host_sleeps.value == 20


def test_idle_does_not_sleep_where_something_came_before(system, device):
    idle, clock, heard = resting(system)
    for moved in (clock, *heard):
        moved.value += 1
        system._library.idle(ctypes.byref(idle))
    assert system.host_sleeps.value == 0


def test_idle_serves_the_watchdog_before_it_sleeps(system, device, sleeping):
    idle, clock, _ = resting(system)

    def wake():
        clock.value += 1
    sleeping(wake)
    for _ in range(3):
        device.watchdog.WDOGREFRESH = 0
        system._library.idle(ctypes.byref(idle))
        assert (device.watchdog.WDOGREFRESH == KEY) == (clock.value > 2), "as soon as the clock has moved"


@pytest.mark.parametrize("slow_at, asked", ((None, 1), (700, 2)))
def test_cycles_of_the_current_loop(device, system, slow_at, asked):
    """The longest gap less the shortest; once more where the slow loop has come in between."""
    clock, now, reads = ctypes.c_uint32(0), [0], itertools.count()

    def cycles():
        read = next(reads)
        now[0] += 7 + (210 if read % 400 == 300 else 0) + (900 if read == slow_at else 0)
        clock.value += read == slow_at
        return now[0] % 2**32

    hook = ctypes.CFUNCTYPE(ctypes.c_uint32)(cycles)
    slot = ctypes.c_void_p.in_dll(system._library, "host_on_cycles")
    slot.value = ctypes.cast(hook, ctypes.c_void_p).value
    assert system.measure_current_loop_cycles(ctypes.byref(clock)) == 210
    assert asked * 10000 <= now[0] < asked * 10000 + 2000


@pytest.mark.parametrize("number", (0, 1))
def test_the_current_loops_interrupt(device, two_axes, number):
    axis, irq = two_axes.axes[number], ADC_IRQ + number
    axis.loop.handlers = None
    two_axes.handlers_start_current_loop(number)
    assert device.nvic.ISER[irq // 32] == 1 << irq % 32 and device.nvic.IPR[irq] == 0
    assert device.nvic.ICPR[irq // 32] == 1 << irq % 32
    table = axis.loop.handlers.contents
    place = ctypes.cast(table.vector, ctypes.c_void_p).value
    vectors = ctypes.addressof(ctypes.c_void_p.in_dll(two_axes._library, "startup_vectors"))
    assert place == vectors + (16 + irq) * ctypes.sizeof(ctypes.c_void_p)
    names = (f"FabricIrq{number}_IRQHandler",
             *(f"handlers_{source}_ab{'_1' * number}" for source in ("forced", "observer", "injection", "hall")))
    for source, name in enumerate(names):
        expected = ctypes.cast(getattr(two_axes._library, name), ctypes.c_void_p).value
        assert ctypes.cast(table.handler[source], ctypes.c_void_p).value == expected, name


def test_the_slow_loops_interrupt(device, system):
    device.nvic.IPR[TICK] = 0xFF
    system.handlers_start_slow_loop()
    assert device.nvic.ISER[0] == 1 << TICK and device.nvic.IPR[TICK] == 4 << 4
    assert (device.timer.TIM1_LOADVAL, device.timer.TIM1_CTRL) == (100000, 5)


def test_the_sampler_is_below_the_current_loop_and_above_the_slow_loop(device, system):
    system.handlers_start_scope()
    assert device.nvic.ISER[0] == 1 << SCOPE and device.nvic.IPR[SCOPE] == 2 << 4
    entry = system.scope.entry
    ctypes.cast(entry.pend, ctypes.POINTER(ctypes.c_uint32))[0] = entry.pend_bit
    assert device.nvic.ISPR[0] == 1 << SCOPE
    assert system.scope.enter == ctypes.cast(system._library.scoped_tick, ctypes.c_void_p).value
    memory = ctypes.addressof(system.link_data_start) & 0xFFFFFFFF
    assert (system.scope.ram, system.scope.ram_end) == (memory, memory + 256)


def test_the_device_is_watched(device, system):
    """Each interrupt's bit is the last that was written."""
    for held, last in ((1 << 8, ECC_ERROR), (0, PUT_BACK)):
        device.sysreg.SOFT_RESET_CR = held
        system.handlers_watch_device()
        assert device.sysreg.EDAC_IRQ_ENABLE == 0x0A and device.sysreg.EDAC_SR == 0x0F
        assert device.nvic.ISER[0] == 1 << last and device.nvic.ISER[1] == 1 << FABRIC_PLL_LOST - 32


@pytest.mark.parametrize("pll, edac, pended", ((3, 0, 0), (1, 0, 1 << PLL_LOST), (2, 0, 1 << PLL_LOST), (3, 0x15, 0),
                                               (3, 2, 1 << ECC_ERROR), (3, 8, 1 << ECC_ERROR), (3, 0x30, 0)))
def test_the_device_is_looked_at_within_eight_milliseconds(device, system, pll, edac, pended):
    device.sysreg.MSSDDR_PLL_STATUS, device.sysreg.EDAC_SR = pll, edac
    axis = system.axes[0]
    axis.fabric_untrusted = 0xD0B7FABC
    system.handlers_start_scope()
    seen = 0
    for ms in range(1, 9):
        axis.time_ms, device.timer.TIM1_RIS, device.nvic.ISPR[0] = ms, 0, 0
        system.Timer1_IRQHandler()
        seen |= device.nvic.ISPR[0]
        assert axis.time_ms == ms + 1 and device.timer.TIM1_RIS == 1
    assert seen == pended


@pytest.mark.parametrize("held, identity, doubted, lost", [
    (0, True, False, False), (1 << 16, True, False, False), (1 << 16, False, False, True), (1 << 16, False, True, False),
    *((1 << bit, True, False, True) for bit in (6, 7, 8, 18, 20, 21, 24)), (1 << 16 | 1 << 8, True, False, True),
    (0x07FFFFFF & ~(7 << 6 | 1 << 16 | 1 << 18 | 31 << 20), True, False, False)])
def test_a_block_in_reset_again_ends_the_program(device, system, held, identity, doubted, lost):
    """The fabric only where it has lost its identity. Where it is so from the start, the interrupt stays disabled: no reset
    would mend it."""
    system.drive_init(system.axes[0], device.fabric)
    system.handlers_start_scope()
    if not doubted:
        system.axes[0].fabric_untrusted = 0
    device.fabric.gate.ID = 0x464F4332 if identity else 0
    device.sysreg.SOFT_RESET_CR = held
    system.handlers_watch_device()
    assert device.nvic.ISER[0] == 1 << (ECC_ERROR if lost else PUT_BACK)
    device.nvic.ISPR[0] = device.sysreg.EDAC_IRQ_ENABLE = device.sysreg.EDAC_SR = 0
    system.Timer1_IRQHandler()
    assert device.sysreg.EDAC_IRQ_ENABLE == 0x0A and device.nvic.ISPR[0] == (1 << PUT_BACK if lost else 0)


@pytest.mark.parametrize("doubted", (None, 0, 1))
def test_a_processor_fault_opens_every_bridge(device, two_axes, doubted):
    """But no fabric is touched that start-up does not trust."""
    second = two_axes.fabric.from_address(FABRIC + 0x400)
    for n, fabric in enumerate((device.fabric, second)):
        fabric.gate.CONTROL = 1
        two_axes.axes[n].fabric_untrusted = 0xD0B7FABC if n == doubted else 0
    two_axes.handlers_bridges_off()
    assert [device.fabric.gate.CONTROL, second.gate.CONTROL] == [int(n == doubted) for n in range(2)]


def test_a_sample_with_a_fault_is_the_axis(device, system):
    axis = system.axes[0]
    axis.fabric_untrusted, axis.fabric, axis.faults.cause = 0, ctypes.pointer(device.fabric), system.FAULT_NONE
    device.fabric.gate.STATUS, device.fabric.gate.CONTROL = 4, 1
    system.current_loop_fault(axis)
    assert axis.faults.cause == system.FAULT_GATE_DRIVER and device.fabric.gate.CONTROL == 0


def test_each_current_loop_of_two_is_its_axis_s(device, two_axes):
    """Its loop, its fabric, its fault; and the slow loop steps both."""
    fabrics = [two_axes.fabric.from_address(FABRIC + 0x400 * number) for number in range(2)]
    for axis, fabric in zip(two_axes.axes, fabrics):
        two_axes.drive_init(axis, fabric)
        axis.fabric_untrusted = 0
        two_axes.current_loop_field(axis.loop, 1000, 77)
    for number in (1, 0):
        other = bytes(two_axes.axes[1 - number]), bytes(fabrics[1 - number])
        getattr(two_axes, "handlers_forced_ab" + "_1" * number)()
        assert two_axes.axes[number].loop.field_angle_q32 == 1077 and fabrics[number].pwm.COMPARE_C != 0
        two_axes.axes[number].loop.status_max, fabrics[number].gate.STATUS = 1, 2
        getattr(two_axes, "handlers_forced_ab" + "_1" * number)()
        assert two_axes.axes[number].faults.cause == two_axes.FAULT_OVERCURRENT_HARDWARE
        assert (bytes(two_axes.axes[1 - number]), bytes(fabrics[1 - number])) == other
    two_axes.handlers_start_scope()
    before = [axis.time_ms for axis in two_axes.axes]
    for _ in range(6):
        two_axes.Timer1_IRQHandler()
    assert [axis.time_ms - ms for axis, ms in zip(two_axes.axes, before)] == [3, 3], "in turn"


@pytest.mark.parametrize("handler, frame", (("encoder_ab", "pll"), ("forced_ab", "field")))
def test_each_handler_in_c_runs_its_loop(device, system, handler, frame):
    """The field of the forced ones goes on by its speed; the status is looked at by all."""
    axis = system.axes[0]
    system.drive_init(axis, device.fabric)
    axis.fabric_untrusted = 0
    system.current_loop_field(axis.loop, 1000, 77)
    getattr(system, "handlers_" + handler)()
    assert (axis.loop.field_angle_q32 == 1077) == (frame == "field")
    assert axis.faults.cause == system.FAULT_NONE and device.fabric.pwm.COMPARE_C != 0
    axis.loop.status_max, device.fabric.gate.STATUS = 1, 2
    getattr(system, "handlers_" + handler)()
    assert axis.faults.cause == system.FAULT_OVERCURRENT_HARDWARE
