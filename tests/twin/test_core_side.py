# SPDX-License-Identifier: MIT
"""Of the core's side what needs no core: the watchdog, the system registers and the cache (docs/silicon.md); lines of events,
and parameters of the power stage that do not go together."""
import ctypes
import os

import pytest

from twin.bench import INVERTER, NEVER, c

MS = 10**9
LOAD, TICK_PS = 0x1800000 << 6 | 0x3F, 20_000
VALUE, REFRESH, ENABLE, CONTROL, STATUS, KEY = 0x00, 0x0C, 0x10, 0x14, 0x18, 0xAC15DE42
CC_CR, SOFT_RESET_CR, WDOG_CR, WDOGLOAD, FLUSH_CR = 0x18, 0x48, 0x6C, 0x16C, 0x1A8
EDAC_IRQ_ENABLE, CAUSES, EDAC_COUNT, EDAC_SR = 0x78, 0xB0, 0xF0, 0x190


def write_register(offset, value):
    for word in c.sysreg_words:
        if word.offset == offset:
            c.sysreg_write(ctypes.byref(word), offset, value & 0xFFFFFFFF)


# ---- the watchdog ----

class Dog:
    def __init__(self, design):
        c.sysreg_design(WDOGLOAD, 0x1800000)
        c.sysreg_design(WDOG_CR, design)
        c.sysreg_reset(c.RESET_POWER_ON)
        self.w = c.watchdog(control=3)
        c.watchdog_init(self.w, ctypes.CFUNCTYPE(None)())

    def control(self, value, now=0):
        write_register(WDOG_CR, value)
        c.watchdog_switched(self.w, now)

    def read(self, offset, now):
        return c.watchdog_read(self.w, offset, now)


@pytest.mark.parametrize("written", range(4))
def test_who_changes_wdog_cr(written):
    Dog(1).control(written | 0xFFFFFFF0)
    assert c.sysreg_value(WDOG_CR) == written
    for cause in (c.RESET_SOFT, c.RESET_LOCKUP, c.RESET_WATCHDOG, c.RESET_USER):
        c.sysreg_reset(cause)
        assert c.sysreg_value(WDOG_CR) == written, "it outlives a reset"
    c.sysreg_design(WDOG_CR, 0)
    c.sysreg_reset(c.RESET_WATCHDOG)
    assert c.sysreg_value(WDOG_CR) == written, "another design is in effect from power-on on"
    c.sysreg_reset(c.RESET_POWER_ON)
    assert c.sysreg_value(WDOG_CR) == 0


def test_traffic_puts_back_what_power_on_left():
    Dog(0).control(1)
    c.sysreg_reset(c.RESET_SOFT)
    c.sysreg_put_back()
    assert c.sysreg_value(WDOG_CR) == 0


def test_the_watchdog_counts():
    dog = Dog(1)
    assert (dog.read(ENABLE, 0), dog.read(CONTROL, 0), dog.read(STATUS, 0)) == (1, 0, 1) and dog.w.expires_at == LOAD * TICK_PS
    dog.control(0, 7 * MS)
    assert dog.read(ENABLE, 7 * MS) == 0 and dog.w.expires_at == NEVER
    assert dog.read(VALUE, 99 * MS) == LOAD - 7 * MS // TICK_PS, "off it stands where it was"
    dog.control(1, 100 * MS)
    assert dog.w.expires_at == LOAD * TICK_PS + 93 * MS
    c.watchdog_write(dog.w, REFRESH, KEY, 101 * MS)
    assert dog.w.expires_at == LOAD * TICK_PS + 101 * MS and dog.read(VALUE, 102 * MS) == LOAD - MS // TICK_PS
    c.watchdog_write(dog.w, REFRESH, KEY ^ 1, 102 * MS)
    assert dog.w.expires_at == LOAD * TICK_PS + 101 * MS, "by its key alone"
    c.watchdog_write(dog.w, CONTROL, 0xFFFFFFFF, 102 * MS)
    assert dog.read(CONTROL, 102 * MS) == dog.w.control == 3, "what firmware may set of it"
    c.watchdog_write(dog.w, CONTROL, 0, 102 * MS)
    dog.control(3, 102 * MS)
    assert dog.read(CONTROL, 102 * MS) == 4 and dog.w.expires_at == NEVER, "it interrupts"
    c.watchdog_reload(dog.w, 103 * MS)
    assert dog.read(VALUE, 103 * MS) == LOAD


def test_openocd_and_a_design_s_lock():
    Dog(1)
    c.sysreg_reset(c.RESET_SOFT)
    c.sysreg_leave_as_openocd()
    assert c.sysreg_value(WDOG_CR) | c.sysreg_value(CC_CR) == 0
    c.sysreg_reset(c.RESET_SOFT)
    assert c.sysreg_value(WDOG_CR) == 0, "another reset does not help"
    dog = Dog(0)
    c.sysreg_fix(WDOG_CR, 3)
    dog.control(1)
    assert c.sysreg_value(WDOG_CR) == 0
    c.sysreg_fix(WDOG_CR, 0)


def test_causes_that_zeros_clear_and_those_that_ones_do():
    c.sysreg_reset(c.RESET_POWER_ON)
    write_register(CAUSES, 0x21)
    assert c.sysreg_value(CAUSES) == 0x21, "plain bits"
    c.sysreg_fix(CAUSES, 0xFF)
    write_register(CAUSES, 0)
    assert c.sysreg_value(CAUSES) == 0x21
    write_register(CAUSES, 0x20)
    assert c.sysreg_value(CAUSES) == 0x01
    c.sysreg_words[0].writable = 0xFFFFFFFF


def test_the_fabric_s_reset_and_the_blocks_held():
    c.sysreg_design(SOFT_RESET_CR, 1 << 16 | c.sysreg_value(SOFT_RESET_CR))
    c.sysreg_reset(c.RESET_POWER_ON)
    assert not c.sysreg_holds_fabric(), "power-on does not keep it low"
    c.sysreg_reset(c.RESET_SOFT)
    assert c.sysreg_holds_fabric()
    write_register(SOFT_RESET_CR, 1 << 13)
    assert not c.sysreg_holds_fabric() and c.sysreg_holds(1 << 13) and not c.sysreg_holds(1 << 8)
    c.sysreg_design(SOFT_RESET_CR, 0)
    c.sysreg_reset(c.RESET_POWER_ON)


@pytest.mark.parametrize("fatal, flag, other, counted", [(False, 1, 2, 1), (True, 2, 1, 1 << 16)])
def test_wrong_bits_of_memory(fatal, flag, other, counted):
    c.sysreg_reset(c.RESET_POWER_ON)
    before = c.sysreg_value(EDAC_COUNT)
    assert not c.sysreg_memory_error(fatal) and c.sysreg_value(EDAC_SR) & flag
    for enabled, interrupts in ((other, False), (flag, True)):
        write_register(EDAC_IRQ_ENABLE, enabled)
        assert c.sysreg_memory_error(fatal) == interrupts
    assert c.sysreg_value(EDAC_COUNT) - before == 3 * counted


# ---- the cache ----

ENABLED, LOCKED, LINE, WAY, CACHE, MISS, WAIT = 1, 4, 32, 2048, 8192, 35, 8


def cache(control):
    c.sysreg_reset(c.RESET_POWER_ON)
    c.cycles_cache_init(c.cycles_params(envm_wait=WAIT, cache=c.CYCLES_CACHE_DEVICE, cache_miss=MISS))
    c.cycles_cache_reset()
    write_register(CC_CR, control)


def fill_and_lock(missing=0):
    """As drivers/mss/cache.c does it, but for so many of the last lines."""
    cache(ENABLED)
    for at in range(0, CACHE - missing * LINE, LINE):
        c.cycles_cache_waits(at)
    write_register(CC_CR, ENABLED | LOCKED)


def waits(*addresses):
    return [c.cycles_cache_waits(at) for at in addresses]


def test_the_cache_off():
    cache(0)
    assert waits(0x100, 0x104, 0x108, 0x204, 0x204) == [WAIT, 0, WAIT, WAIT, WAIT], "the second of a pair does not wait"


def test_its_ways():
    cache(ENABLED)
    assert waits(0, LINE - 4, WAY, 2 * WAY, 3 * WAY, 0) == [MISS, 0, MISS, MISS, MISS, 0], "four ways hold four"
    assert waits(4 * WAY, 0, WAY) == [MISS, 0, MISS], "a fifth pushes out the one used longest ago"
    assert waits(5 * WAY + LINE, 0) == [MISS, 0], "another set is not concerned"
    flushes = c.sysreg_cache_flushes()
    write_register(FLUSH_CR, 1)
    assert waits(0) == [MISS] and c.sysreg_cache_flushes() == flushes + 1
    c.cycles_cache_evict()
    assert waits(0) == [MISS], "so does other code"


def test_its_lock():
    fill_and_lock()
    assert not any(waits(*range(0, CACHE, 4)))
    assert waits(CACHE, CACHE) == [WAIT, WAIT]
    c.cycles_cache_evict()
    assert waits(CACHE - 4) == [0], "other code leaves all there"


def test_a_lock_without_a_line_ends_the_run():
    child = os.fork()
    if child == 0:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        fill_and_lock(1)
        waits(CACHE - 2 * LINE, CACHE - LINE)
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 1


# ---- events ----

ACCEPTED = {
    "phase_swap AB": ("PHASE_SWAP", True, 0, 1), "phase_swap BC": ("PHASE_SWAP", True, 1, 2),
    "phase_swap CA": ("PHASE_SWAP", True, 2, 0), "phase_swap off": ("PHASE_SWAP", False),
    "hall_swap CA": ("HALL_SWAP", True, 2, 0), "hall_open B 1": ("HALL_OPEN", True, 1),
    "hall_invert C 0": ("HALL_INVERT", False, 2),
    "chopper 1": ("CHOPPER", True), "chopper 0": ("CHOPPER", False), "encoder_reverse 1": ("ENCODER_REVERSE", True),
    "temperature_c -20.5": ("TEMPERATURE", True), "temperature_c off": ("TEMPERATURE", False),
}


@pytest.mark.parametrize("line", ACCEPTED)
def test_a_line_is_understood(line):
    e, (kind, on, *phases) = c.event(phase=-1, other_phase=-1), ACCEPTED[line]
    assert c.event_parse(line.encode(), e) is None
    assert e.kind == getattr(c, f"EVENT_{kind}") and e.on == on and [e.phase, e.other_phase] == [*phases, -1, -1][:2]


def test_numbers_of_a_line():
    e = c.event()
    assert c.event_parse(b"sensor_order CAB", e) is None and e.order[:] == [2, 0, 1]
    assert c.event_parse(b"sensor_sine 1.5 320 -0.5", e) is None and e.kind == c.EVENT_SENSOR_SINE
    assert (e.number, e.second, e.third) == (1.5, 320, -0.5)
    assert c.event_parse(b"temperature_c 300", e) is None and e.number == 300


@pytest.mark.parametrize("line, member, least, most, step", [
    *((line, "number", -1e5, 1e5, 1) for line in ("load_nm {}", "sensor_gain B {}", "sensor_sine {} 1 1")),
    ("sensor_sine 1 {} 1", "second", -1e5, 1e5, 1), ("sensor_sine 1 1 {}", "third", -1e5, 1e5, 1),
    ("load_fan {}", "number", 0, 1e6, 1), ("encoder_slip {}", "number", -10**9, 10**9, 1),
    ("encoder_slip {}", "number", -3, 3, 0.5), ("sensor_stuck A {}", "number", 0, 4095, 1),
    ("short CA {}", "number", 1e-4, 100, 1e-6), ("winding_short C 1 {}", "number", 1e-4, 100, 1e-6),
    ("winding_short C {} 1", "fraction", 1e-3, 1, 1e-6), ("temperature_c {}", "number", -100, 300, 0.1),
    *((line, member, 0, 2**32 - 1, 1) for line, member in (
        ("can_break {}", "word"), ("poke {} 0", "address"), ("poke 0 {}", "word"))),
    ("poke_rom 0 {}", "word", 0, 65535, 1), ("sto {} 1", "phase", "A", "B", 1), ("phase_open {} 1", "phase", "A", "C", 1),
    ("chopper {}", "on", 0, 1, 1)])
def test_each_argument_has_its_bounds(line, member, least, most, step):
    def beside(value, by):
        return chr(ord(value) + by) if isinstance(value, str) else value + by
    for value, right in ((beside(least, -step), False), (least, True), (most, True), (beside(most, step), False)):
        e = c.event()
        wrong = c.event_parse(line.format(value).encode(), e)
        assert (wrong is None) == right and (right or b"expected: " + line.split()[0].encode() in wrong), (line, value)
        assert not right or getattr(e, member) == (ord(value) - ord("A") if isinstance(value, str) else value)


@pytest.mark.parametrize("line", [
    "sensor_order", "sensor_order AB", "sensor_order ABB", "sensor_order ABCA", "sensor_sine 1.5 320", "sensor_sine 1 2 0 0",
    "sensor_sine 1.5 x 0", "temperature_c 301", "temperature_c", "encoder_reverse off", "phase_swap", "phase_swap AC",
    "phase_swap AB BC", "chopper 2", "chopper off"])
def test_a_line_is_refused_with_its_usage(line):
    assert b"expected: " in c.event_parse(line.encode(), c.event())


@pytest.mark.parametrize("changes, key", [
    ({}, None), ({"supply_sinks": 0.5}, b"supply_sinks"), ({"supply_r2_ohm": 0.1}, b"supply_c2_f"),
    ({"supply_resistance_ohm": 0}, None), ({"supply_resistance_ohm": 0, "bus_esr_ohm": 0.1}, b"bus_esr_ohm"),
    ({"supply_resistance_ohm": 0, "bus_esr_ohm": 0.1, "supply_inductance_h": 1e-6}, None),
    ({"chopper_ohm": 5, "chopper_on_v": 30, "chopper_off_v": 20}, b"chopper_off_v"),
    ({"chopper_ohm": 5, "chopper_on_v": 30, "chopper_off_v": 31}, b"chopper_off_v"),
    ({"chopper_on_v": 30, "chopper_off_v": 20}, None), ({"vbus_v": 0, "coss_c": 1e-9}, b"coss_c")])
def test_parameters_that_do_not_go_together(changes, key):
    wrong = c.inverter_mismatch(c.inverter_params(**{**INVERTER, **changes}))
    assert wrong is None if key is None else key in wrong
