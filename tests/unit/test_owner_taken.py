# SPDX-License-Identifier: MIT
"""Who takes over commands, in whatever the drive does; and nobody commands by another way while somebody else does."""
import ctypes
import itertools
import struct

import pytest

from rigs.can_node import SDO_IN
from rigs.commanding import NUMBERS, OWNERS, Commanding, refused_by_name
from rigs.modbus_line import write
from rigs.restarting import DELAY_MS, ENOUGH_V

TWO = list(itertools.permutations(OWNERS, 2))
LONG_MS = 2000


@pytest.fixture
def machine(c):
    return lambda **params: Commanding(c, **params)


@pytest.mark.parametrize("what", ("on", "zero", "identify", "forget", "speed 100"))
@pytest.mark.parametrize("bus_v", (ENOUGH_V, 1000), ids=("fault", "cleared, and waits for its supply"))
def test_while_a_retry_waits_nobody_else_commands(machine, bus_v, what):
    """Nothing takes it away by the way: `zero` would, and move the place that its owner's targets count from."""
    w = machine().started("CAN").into("retry")
    w.fabric.adc.VBUS = w.axis.loop.vbus_q15 = bus_v
    w.step(5 if bus_v == ENOUGH_V else DELAY_MS + 20)
    assert w.line(what) == (what == "forget") and (what == "forget" or refused_by_name(w, "CONSOLE", "CAN"))
    w.fabric.adc.VBUS = w.axis.loop.vbus_q15 = ENOUGH_V
    w.step(DELAY_MS + 20)
    assert (w.state, w.owner) == ("SWITCHED_ON", "CAN")


@pytest.mark.parametrize("stop", ("off", "quick_stop"))
@pytest.mark.parametrize("owner, other", [pair for pair in TWO if pair[1] != "CONSOLE"])
def test_a_word_that_was_refused_is_not_obeyed_when_the_drive_is_off(machine, owner, other, stop):
    """A master that had been ready repeats its 0x0F, and an old target waits there: off is off for it, too."""
    w = machine()
    assert w.speed(other, 900) and w.word(other, 6) and w.word(other, 7)
    w.started(owner).operate()
    assert not w.word(other, 0x0F) and getattr(w, stop)(owner)
    w.energised = False
    for _ in range(300):
        w.step()
        w.word(other, 0x0F)
    assert w.state == "SWITCH_ON_DISABLED" and not w.fabric.gate.CONTROL
    assert w.enable(other), "but the whole sequence is"


@pytest.mark.parametrize("owner, other", TWO)
def test_who_takes_over_commands_and_the_former_owner_does_not(machine, owner, other):
    w = machine().started(owner).operate()
    assert w.speed(owner, 500)
    w.step()
    assert w.take_over(other)
    w.step()
    assert (w.state, w.owner, w.axis.speed.target_rpm_q16) == ("OPERATION_ENABLED", other, 500 << 16)
    assert not w.speed(owner, 100) and refused_by_name(w, owner, other)
    assert w.speed(other, 300)
    w.step()
    assert w.axis.speed.target_rpm_q16 == 300 << 16
    w.tripped().step(LONG_MS)
    assert not w.energised, "no restart was asked for by who commands now"


@pytest.mark.parametrize("owner, other", [pair for pair in TWO if pair[0] != "CONSOLE"])
def test_a_start_that_is_prepared_may_be_taken_over(machine, owner, other):
    """Between the word and its first current: the drive goes on, and starts again for nobody."""
    w = machine()
    assert w.enable(owner) and w.axis.switching.under_way and w.take_over(other)
    w.step(3)
    assert (w.state, w.owner) == ("SWITCHED_ON", other)
    w.operate().tripped().step(LONG_MS)
    assert not w.energised


def test_what_the_console_prepares_may_be_taken_over(machine):
    """Who takes over while `on` computes keeps what he has taken."""
    w = machine()
    w.console.session.out.can = ctypes.pointer(w.canopen)  # served meanwhile
    place = w.c.host_can_said[0]
    place.id, place.count, place.data[:8] = SDO_IN, 8, [0x2B, 0x09, 0x20, 0, NUMBERS["CAN"], 0, 0, 0]
    w.c.host_can_saids.value, w.c.host_can_taken.value = 1, 0
    w.c.commands_execute(w.console.session, ctypes.create_string_buffer(b"on"))
    assert w.owner == "CAN" and w.step(3) == "SWITCHED_ON"
    w.operate().tripped().step(LONG_MS)
    assert not w.energised


def test_a_refused_take_over_changes_nothing(machine):
    w = machine().started("CONSOLE").operate()
    assert not w.ask(write(8, struct.pack(">HH", 1, 2))), "a source that it has already, or cannot have"
    assert w.owner == "CONSOLE"


@pytest.mark.parametrize("who", ("MODBUS", "CAN"))
@pytest.mark.parametrize("line, mode", (("torque 0.1", 4), ("csv 100", 9), ("pp 100", 1)))
def test_who_takes_over_has_the_mode_in_effect(machine, who, line, mode):
    """And not the one that it last had itself, whose old target another target would start."""
    w = machine()
    assert w.speed(who, 900)
    w.started("CONSOLE").operate()
    assert w.line(line) and w.step() and w.take_over(who)
    before = w.axis.mode
    w.step()
    shown = [w.read(index) if who == "CAN" else w.registers(at)[0] for at, index in ((1, 0x6060), (17, 0x6061))]
    assert shown == [mode, mode] and w.write(who, 6, 0x6071, 20, 2)
    w.step()
    assert w.axis.mode == before and w.axis.speed.target_rpm_q16 != 900 << 16


@pytest.mark.parametrize("direction", (0, 1))
@pytest.mark.parametrize("who", ("MODBUS", "CAN"))
def test_who_takes_over_has_the_speed_in_effect_the_right_way_round(machine, who, direction):
    w = machine(direction=direction)
    w.started("CONSOLE").operate()
    assert w.line("speed 700") and w.step() and w.take_over(who)
    drive = w.canopen.drives[0] if who == "CAN" else w.modbus.drives[0]
    assert drive.cia402.setpoints.target_rpm == 700
    assert w.axis.speed.target_rpm_q16 == (-700 if direction else 700) << 16
