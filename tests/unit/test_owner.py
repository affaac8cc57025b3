# SPDX-License-Identifier: MIT
"""One line commands an axis, is watched in every state of power, and nothing starts without it: owner x loss x state, and who
else may do what."""
import itertools
import struct

import pytest

from rigs.can_node import NODE, PRE_OPERATIONAL, RESET_COMMUNICATION, RESET_NODE, START, STOP
from rigs.commanding import MASTER, NAMES, NUMBERS, OWNERS, STOPPED, Commanding, refused_by_name
from rigs.modbus_line import write
from rigs.restarting import DELAY_MS

STATES = ("start", "operation", "quick stop", "retry", "restart")
LONG_MS, SILENCE_MS = 2000, 300
# {loss: (how it comes, the fault's detail, ms until it is noticed)}; the master's heartbeat is due each 100 ms
LOSSES = {
    "heartbeat": (lambda w: setattr(w, "live", False), 1, 110),
    "stop": (lambda w: w.nmt(STOP), 2, 8),
    "reset communication": (lambda w: w.nmt(RESET_COMMUNICATION), 2, 8),
    "bus-off": (lambda w: setattr(w.c.host_can_state, "value", w.c.CAN_OFF), 3, 8),
}
ONLY_OPERATIONAL = {"pre-operational": (lambda w: w.nmt(PRE_OPERATIONAL), 2, 8)}


@pytest.fixture
def machine(c):
    yield lambda **params: Commanding(c, **params)
    c.host_can_state.value = c.host_can_cut.value = 0


def gates_shut(w):
    return w.fabric.gate.CONTROL == 0 and w.state in ("FAULT", "SWITCH_ON_DISABLED")


def nothing_comes_of_it(w, within_ms, name, detail=None):
    """Off within the time, or a controlled stop that ends; named; and nothing starts again, whoever speaks next."""
    named = w.axis.faults.cause or w.state in ("QUICK_STOP", "SWITCH_ON_DISABLED")  # a stop may end before anything is lost
    w.step(within_ms)
    assert gates_shut(w) or w.state == "QUICK_STOP", w.state
    w.step(300)
    assert gates_shut(w) and w.owner == "NONE", (w.state, w.owner)
    if not named:
        assert w.fault == name and (detail is None or w.axis.faults.detail[0] == detail)
    w.energised, w.live = False, True
    w.c.host_can_state.value = 0
    w.step(LONG_MS)
    assert not w.energised, "nothing starts without its owner"
    assert w.state != "FAULT" or w.clear("CONSOLE")
    assert w.step(3) == "SWITCH_ON_DISABLED"
    assert w.line("on") and w.step(3) == "SWITCHED_ON" and w.owner == "CONSOLE", "another one may begin"


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("operational", (True, False), ids=("operational", "by SDO alone"))
@pytest.mark.parametrize("loss", LOSSES)
def test_a_lost_master_is_lost_in_every_state(machine, loss, state, operational):
    lose, detail, within_ms = LOSSES[loss]
    w = machine().started("CAN", operational).into(state)
    lose(w)
    nothing_comes_of_it(w, within_ms + 1, "MASTER_LOST", detail)


@pytest.mark.parametrize("phase", range(4))
@pytest.mark.parametrize("state", ("start", "operation", "restart"))
def test_a_bus_that_was_off_for_a_millisecond_was_off(machine, state, phase):
    """Less than the slow loop takes from look to look; unless it is only warned of, and then it is over."""
    for warns in (False, True):
        w = machine(can_recover=1).started("CAN").into(state)
        w.axis.reactions.choice[w.c.FAULT_MASTER_LOST] = w.c.REACTION_WARN if warns else w.c.REACTION_STOP
        w.step(phase)
        w.c.host_can_state.value = w.c.CAN_OFF
        w.step()
        w.c.host_can_state.value = w.c.CAN_ACTIVE
        if warns:
            w.step(8)
            assert w.axis.master_lost == 0 and w.fault == "NONE" and w.owner == "CAN"
        else:
            nothing_comes_of_it(w, 8, "MASTER_LOST", 3)


@pytest.mark.parametrize("phase", range(4))
@pytest.mark.parametrize("how", ("a heartbeat comes a millisecond late", "the master boots", "another rate"))
def test_a_master_that_was_away_for_a_millisecond_was_away(machine, how, phase):
    """The same of the others; a boot-up message is no heartbeat (CiA 301), and rates change within 2 ms."""
    for warns in (False, True):
        w = machine().started("CAN").into("operation")
        w.axis.reactions.choice[w.c.FAULT_MASTER_LOST] = w.c.REACTION_WARN if warns else w.c.REACTION_STOP
        w.live = False
        w.step(phase + 1)
        w.frames((0x700 + MASTER, b"\5"))
        if how == "the master boots":
            w.frames((0x700 + MASTER, b"\0"))
        elif how == "another rate":
            for said in ((0x04, 1), (0x13, 0, 3), (0x15, 0, 0)):
                w.frames((0x7E5, bytes(said).ljust(8, b"\0")))
        else:
            w.step(102)
        w.step(how != "a heartbeat comes a millisecond late")
        w.live = True
        w.frames((0x700 + MASTER, b"\5"))
        if warns:
            w.step(8)
            assert w.axis.master_lost == 0 and w.fault == "NONE" and w.owner == "CAN"
        else:
            nothing_comes_of_it(w, 8, "MASTER_LOST", 3 if how == "another rate" else 1)


@pytest.mark.parametrize("state", STATES)
def test_a_master_that_leaves_operational_is_lost_in_every_state(machine, state):
    lose, detail, within_ms = ONLY_OPERATIONAL["pre-operational"]
    w = machine().started("CAN").into(state)
    lose(w)
    w.nmt(1)  # and comes back at once: what it had enabled is over nevertheless
    nothing_comes_of_it(w, within_ms + 1, "MASTER_LOST", detail)


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("owner", OWNERS)
def test_an_owner_that_falls_silent_is_lost_in_every_state(machine, owner, state):
    """However much the others say."""
    w = machine(command_timeout_ms=SILENCE_MS).started(owner).into(state)
    w.live = False
    w.canopen.consumer = 0  # of a heartbeat that was announced
    for _ in range(SILENCE_MS // 10 + 2):
        w.step(10)
        for other in set(OWNERS) - {owner}:
            w.line("") if other == "CONSOLE" else w.registers(0) if other == "MODBUS" else w.read(0x6041)
    nothing_comes_of_it(w, 10, "COMMAND_TIMEOUT")


@pytest.mark.parametrize("owner, setting", [("MODBUS", "modbus_address 0"), ("MODBUS", "modbus_address 7"),
                                            ("MODBUS", "modbus_baud 9600"), ("MODBUS", "modbus_parity 0"),
                                            ("CAN", "can_node 0"), ("CAN", "can_node 7"), ("CAN", "can_kbit 250")])
def test_whose_line_becomes_another_is_lost(machine, owner, setting):
    """Parameters of a line change in a fault, too, while its retry waits."""
    w = machine().started(owner).into("retry")
    assert w.line(f"set {setting}")
    nothing_comes_of_it(w, 3, "UNDERVOLTAGE")


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("owner", OWNERS)
def test_reset_node_is_off_and_as_at_power_on(machine, owner, state):
    w = machine().started(owner).into(state)
    assert owner != "CAN" or (w.speed("CAN", 700) and w.sdo(0x6098, 0, 37, 1))
    w.nmt(RESET_NODE)
    w.step(2)
    assert gates_shut(w) and w.owner == ("NONE" if state != "retry" or owner else w.owner)
    assert w.fault == ("UNDERVOLTAGE" if state == "retry" else "NONE")
    w.energised = False
    w.step(LONG_MS)
    assert not w.energised
    assert [w.read(index) for index in (0x60FF, 0x6040, 0x6060, 0x6098)] == [0, 0, 3, 34]


@pytest.mark.parametrize("owner", OWNERS)
def test_with_its_owner_it_restarts_and_obeys(machine, owner):
    """What the tests above forbid does happen otherwise; a target is to be given again."""
    w = machine(command_timeout_ms=1000).started(owner).operate()
    assert w.speed(owner, 500)
    w.step()
    w.restarted()
    assert w.owner == owner and w.axis.speed.target_rpm_q16 == 0
    assert w.speed(owner, 600)
    w.step()
    assert w.axis.speed.target_rpm_q16 == 600 << 16
    assert owner == "CONSOLE" or w.halt(owner)
    w.step()
    assert owner == "CONSOLE" or w.axis.speed.target_rpm_q16 == 0


@pytest.mark.parametrize("word", (0x00, 0x02))
@pytest.mark.parametrize("owner", ("MODBUS", "CAN", "CONSOLE"))
@pytest.mark.parametrize("line", ("MODBUS", "CAN"))
def test_a_word_that_stops_does_whatever_comes_with_it(machine, line, owner, word):
    """A target beyond the limit is refused, and the block of four registers or the process data with it."""
    w = machine().started(owner).operate().turning()
    if line == "CAN":
        assert w.sdo(0x1403, 1, 0x500 + NODE, 4)
        w.nmt(START)
        w.frames((0x500 + NODE, struct.pack("<Hi", word, 99999)))
    else:
        assert not w.ask(write(0, struct.pack(">HHi", word, 3, 99999))) and w.refused == 3
    w.step(2)
    assert w.state == ("SWITCH_ON_DISABLED" if word == 0 else "QUICK_STOP")
    assert (w.read(0x60FF) if line == "CAN" else w.registers(2, 2)[1]) == 0


# ---- the others ----

TWO = list(itertools.permutations(OWNERS, 2))


@pytest.mark.parametrize("what", ("speed", "mode", "halt", "enable"))
@pytest.mark.parametrize("owner, other", TWO)
def test_others_are_refused_by_name_and_change_nothing(machine, owner, other, what):
    w = machine().started(owner).operate()
    assert w.speed(owner, 500)
    w.step()
    if what == "enable" and other != "CONSOLE":  # it has stood in "switched on" since before
        assert w.word(other, 6) and w.word(other, 7)
    said = w.speed(other, 900) if what == "speed" else getattr(w, what)(other)
    assert not said and refused_by_name(w, other, owner)
    w.step()
    assert (w.state, w.owner, w.axis.mode, w.axis.speed.target_rpm_q16) == ("OPERATION_ENABLED", owner, 0, 500 << 16)
    assert w.speed(owner, 400)
    w.step()
    assert w.axis.speed.target_rpm_q16 == 400 << 16


@pytest.mark.parametrize("state", ("start", "operation", "restart"))
@pytest.mark.parametrize("stop", ("off", "quick_stop"))
@pytest.mark.parametrize("owner, other", TWO)
def test_everybody_may_stop_twice_and_is_named(machine, owner, other, stop, state):
    w = machine().started(owner)
    for _ in range(2):
        w.into(state)
        w.heard()
        assert getattr(w, stop)(other), w.refused
        w.step(100)
        assert gates_shut(w) and w.fault == "NONE" and w.owner == "NONE"
        if owner != "CONSOLE":
            assert w.refusal(owner) == (STOPPED, NUMBERS[other])
        else:
            assert f"warning: {NAMES[other]} has stopped the drive" in w.heard()
        w.energised = False
        w.step(LONG_MS)
        assert not w.energised
        w.started(owner)


@pytest.mark.parametrize("how", ("off", "quick_stop", "clear"))
@pytest.mark.parametrize("owner, other", [pair for pair in TWO if pair[0] != "CONSOLE"])
def test_who_ends_a_retry_that_waits_for_its_supply_is_named(machine, owner, other, how):
    """The fault has been cleared: there is none any more, and yet something to end."""
    w = machine().started(owner).into("retry")
    w.fabric.adc.VBUS = w.axis.loop.vbus_q15 = 1000
    w.step(DELAY_MS + 20)
    assert w.state == "SWITCH_ON_DISABLED" and w.owner == owner
    assert getattr(w, how)(other), w.refused
    w.step(3)
    assert w.refusal(owner) == (STOPPED, NUMBERS[other]) and w.owner == "NONE"


def test_a_clear_that_is_refused_ends_a_retry_and_is_named(machine):
    w = machine().started("CAN").into("retry")
    identity, w.fabric.gate.ID = w.fabric.gate.ID, 0
    assert not w.line("clear")
    w.fabric.gate.ID = identity
    w.step(LONG_MS)
    assert w.state == "FAULT" and w.axis.owner.stopped_by == NUMBERS["CONSOLE"]


@pytest.mark.parametrize("owner, other", [pair for pair in TWO if pair[1] != "CONSOLE"])
@pytest.mark.parametrize("word", (0x06, 0x07))
def test_behind_a_quick_stop_every_bus_is_disabled(machine, owner, other, word):
    """CiA 402's transition 12, whoever commanded: the bus that did not had been ready, or says so again meanwhile."""
    w = machine()
    shown = lambda: w.read(0x6041) & 0x6F if other == "CAN" else w.registers(0x10)[0] & 0x6F  # noqa: E731
    assert w.word(other, 6) and w.word(other, word)
    w.started(owner).into("quick stop")
    assert shown() == 0x07 and w.word(other, 6) and w.word(other, word)
    while w.state == "QUICK_STOP":
        assert shown() == 0x07
        w.axis.speed.ref_rpm_q16 = 0
        w.step()
    assert gates_shut(w) and shown() & 0x4F == 0x40
    assert w.word(other, 6) and shown() == 0x21


@pytest.mark.parametrize("owner, other", [pair for pair in TWO if pair[1] != "CONSOLE"])
@pytest.mark.parametrize("word", (0x06, 0x07))
def test_a_parked_master_that_repeats_its_word_disturbs_nobody(machine, owner, other, word):
    w = machine()
    assert w.word(other, 6) and w.word(other, word)
    w.started(owner)
    for _ in range(50):
        assert w.word(other, word), w.refused
        w.step(1)
    assert w.state == "SWITCHED_ON" and w.owner == owner
    w.operate().tripped()
    for _ in range(DELAY_MS + 20):
        w.word(other, word)
        w.step()
    assert w.state == "SWITCHED_ON", "nor the restart"


@pytest.mark.parametrize("who", OWNERS)
def test_it_is_shown_everywhere(machine, who):
    w = machine()
    shown = lambda: (w.registers(9)[0], w.read(0x2009))  # noqa: E731
    assert shown() == (0, 0) and "commanded by: nobody\r\n" in w.type(b"status\r")
    w.started(who)
    assert shown() == (NUMBERS[who],) * 2 and f"commanded by: {NAMES[who]}\r\n" in w.type(b"status\r")
    remote = (w.registers(0x10)[0] >> 9 & 1, w.read(0x6041) >> 9 & 1)
    assert remote == (who == "MODBUS", who == "CAN"), "bit 9: its words are obeyed"
    w.off(who)
    w.step(3)
    assert shown() == (0, 0)


@pytest.mark.parametrize("who", ("MODBUS", "CAN"))
def test_words_within_a_millisecond_are_obeyed_or_refused_with_a_reason(machine, who):
    w = machine()
    assert w.enable(who)
    w.step(3)
    assert w.state == "SWITCHED_ON"
    w.operate()
    w.enable(who)  # off and on again, before the slow loop has taken the first
    number, _ = w.refusal(who)
    assert number == 40, "busy"
    w.step(3)
    assert w.state == "SWITCH_ON_DISABLED" and w.word(who, 0x0F)
    w.step(3)
    assert w.state == "SWITCHED_ON", "from `switched on`, where the words have led"
