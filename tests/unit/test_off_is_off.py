# SPDX-License-Identifier: MIT
"""After `off`, a quick stop, `clear` or a control word without all enable bits, nothing energises the bridge until the next
`on`: two events in a row, at every step of an automatic restart."""
import pytest

from rigs.controller import ENABLE, NO_VOLTAGE, QUICK_STOP, RESET, SHUTDOWN, SWITCH_ON, Controller
from rigs.drive import LOOPS_PER_MS
from rigs.modbus_line import write_one
from rigs.restarting import DELAY_MS, ENOUGH_V, LONG_MS, TOO_LOW, Restarting, is_on

COMMANDS = {"off": "drive_switch_off", "quick stop": "drive_quick_stop", "clear": "drive_clear_fault"}
WORDS = {"no voltage": NO_VOLTAGE, "quick stop": QUICK_STOP, "shutdown": SHUTDOWN, "switch on": SWITCH_ON, "reset": RESET}


@pytest.fixture
def tripped(c):
    w = Restarting(c)
    w.trip()
    return w


def test_without_a_command_it_restarts(tripped):
    """What the tests below forbid does happen otherwise."""
    tripped.supply(ENOUGH_V, LONG_MS)
    assert tripped.energised


# milliseconds after the trip: it waits, is about to be cleared, is cleared, builds its tables, has been asked for, starts
@pytest.mark.parametrize("at_ms", [0, 1, 50, *range(98, 112), 150, 400])
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_ends_the_restart_wherever_it_is(c, tripped, command, at_ms):
    tripped.supply(ENOUGH_V, at_ms)
    outcome = getattr(c, COMMANDS[command])(tripped.axis)
    if command == "clear" and outcome.error != c.ERROR_NONE:
        return  # the restart has cleared it already: nothing was left to clear, and nothing was asked for
    tripped.step(2)
    tripped.energised = False
    tripped.thread(LONG_MS)
    assert not tripped.energised and tripped.fabric.gate.CONTROL == 0, tripped.state
    if tripped.state == "FAULT":
        c.drive_clear_fault(tripped.axis)
    tripped.step()
    assert c.switch_on_at_once(tripped.axis).error == c.ERROR_NONE, "a new wish is obeyed"
    assert tripped.thread(3) == "SWITCHED_ON"


def test_off_gives_no_spent_restart_back(c, tripped):
    tripped.supply(ENOUGH_V, DELAY_MS + 20)
    assert tripped.axis.retry.count == 1
    c.drive_switch_off(tripped.axis)
    assert tripped.axis.retry.count == 1
    tripped.step(2)
    assert c.switch_on_at_once(tripped.axis).error == c.ERROR_NONE
    tripped.thread(3)
    tripped.trip()
    tripped.supply(ENOUGH_V, LONG_MS)
    assert not tripped.energised


@pytest.mark.parametrize("begin", ("drive_identify", "drive_learn_hall"))
def test_what_measures_is_not_tried_again(c, begin):
    w = Restarting(c)
    c.drive_switch_off(w.axis)
    w.step(2)
    w.axis.params.angle_source = 2 if begin == "drive_learn_hall" else 0
    assert getattr(c, begin)(w.axis).error == c.ERROR_NONE
    w.step(2)
    w.trip()
    w.supply(ENOUGH_V, LONG_MS)
    assert not w.energised


def test_a_refused_on_is_no_wish(c):
    """It is answered with its reason; a fault later on, while off, must not end in operation."""
    w = Restarting(c)
    c.drive_switch_off(w.axis)
    w.step(2)
    assert c.drive_switch_on(w.axis).error == c.ERROR_NONE
    w.axis.loop.vbus_q15 = TOO_LOW
    while c.drive_prepare(w.axis):
        pass
    assert w.axis.switching.outcome.error == c.ERROR_BUS_LOW
    w.trip()
    w.supply(ENOUGH_V, LONG_MS)
    assert not w.energised


@pytest.mark.parametrize("most_rpm, energised", ((1000, False), (2999, False), (3000, True)))
@pytest.mark.parametrize("when_ms", (10, DELAY_MS + 1))
def test_a_target_beyond_a_limit_lowered_meanwhile_is_not_resumed(c, most_rpm, energised, when_ms):
    """Without an encoder the drive resumes its speed. What to do now is the operator's to say: it stays off."""
    w = Restarting(c, angle_source=1, speed_max_rpm=4000)
    w.axis.speed.target_rpm_q16 = -3000 << 16
    w.trip()
    w.supply(TOO_LOW, when_ms + 2)  # by then cleared, if it is late, and `on` refused for the voltage
    w.axis.params.speed_max_rpm = most_rpm
    w.supply(ENOUGH_V, LONG_MS)
    assert w.energised == energised


# ---- by control word ----

class Commanded(Controller):
    """Enabled by its master, then tripped; the axis lives."""

    def __init__(self, c):
        super().__init__(c)
        self.fabric.adc.VBUS, self.energised = ENOUGH_V, False
        self.axis.params.retry_count, self.axis.params.retry_delay_ms = 1, DELAY_MS
        self.enabled()
        assert self.axis.retry.wanted
        c.fault_raise(self.axis, c.FAULT_UNDERVOLTAGE)
        self.live(3)

    def live(self, ms):
        for _ in range(ms):
            self.c.drive_retry(self.axis)
            for _ in range(40):
                self.c.drive_prepare(self.axis)
            self.fabric.adc.SEQUENCE += LOOPS_PER_MS
            self.fabric.gate.STATUS = self.fabric.gate.CONTROL & 1
            self.c.drive_step(self.axis)
            self.c.cia402_poll(self.drive.cia402, self.axis)
            self.energised = self.energised or is_on(self.c, self.axis)

    def write(self, word):
        assert self.ask(write_one(0, word))[0] == 6
        self.live(1)


@pytest.fixture
def commanded(c):
    return Commanded(c)


def test_a_word_that_keeps_all_enable_bits_keeps_the_restart(commanded):
    commanded.write(ENABLE)
    commanded.live(LONG_MS)
    assert commanded.energised


@pytest.mark.parametrize("at_ms", [0, 50, *range(95, 108)])
@pytest.mark.parametrize("word", WORDS)
def test_a_word_without_them_ends_the_restart(commanded, word, at_ms):
    """Enable voltage and the others are levels, in a fault, too."""
    commanded.live(at_ms)
    commanded.write(WORDS[word])
    commanded.live(3)
    commanded.energised = False
    commanded.live(LONG_MS)
    assert not commanded.energised and commanded.fabric.gate.CONTROL == 0


def test_a_fault_that_comes_and_is_cleared_while_the_bus_waits_still_ends_its_sequence(c):
    """The console is busy for some milliseconds, and a person clears the fault there: the bus begins with 'shutdown' again."""
    plc = Controller(c)
    plc.control(SHUTDOWN)
    plc.control(SWITCH_ON)
    assert plc.state == 0x23
    c.fault_raise(plc.axis, c.FAULT_STALL)
    assert c.drive_clear_fault(plc.axis).error == c.ERROR_NO_FAULT
    plc.axis.state = c.AXIS_FAULT
    c.states_take(plc.axis, c.enums["drive_event"]["DRIVE_EVENT_CLEAR"])
    assert plc.axis.faults.cause == c.FAULT_NONE and plc.state == 0x40
    plc.control(ENABLE)
    assert plc.state == 0x40
