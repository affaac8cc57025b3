# SPDX-License-Identifier: MIT
"""Layer setting, by CiA 305: how a node gets its number and its rate, what is refused, and that it reaches nothing else."""
import ctypes
import struct

import pytest

from rigs.axes_at_rest import SLOTS_BYTES
from rigs.can_node import HEARTBEAT, NODE, RESET_COMMUNICATION, RESET_NODE, START, Node

COMMAND, ANSWER, NONE = 0x7E5, 0x7E4, 255
WAITING, CONFIGURATION = 0, 1
NODE_ID, BIT_TIMING, ACTIVATE, STORE, ASK_NODE = 0x11, 0x13, 0x15, 0x17, 0x5E
RATES = {0: 1000, 1: 800, 2: 500, 3: 250, 4: 125, 6: 50, 7: 20}
PRODUCT, VERSION = 0x6D666F63, 0x00000100
IDENTITY = (0, PRODUCT, VERSION, 0)
ON = 56  # number of the refusal "save while on"


class Setter(Node):
    """A master of layer setting beside the node."""

    def lss(self, command, *parts, pack="<BI"):
        """The answer's bytes behind the command, or None."""
        data = struct.pack(pack, command, *parts) if parts else bytes([command])
        sent = self.say((COMMAND, data.ljust(8, b"\0")))
        answers = [data for identifier, data in sent if identifier == ANSWER]
        assert len(answers) <= 1 and all(len(answer) == 8 for answer in answers), sent
        return answers[0] if answers else None

    def to(self, state):
        assert self.lss(4, state) is None

    def configure(self, command, *values):
        """(error, number of the drive's own reason)"""
        answer = self.lss(command, *values, pack="<B" + "B" * len(values))
        assert answer[0] == command and not any(answer[3:])
        return answer[1], answer[2]

    def scan(self, number, bit, part=0, following=0):
        answer = self.lss(0x51, number, bit, part, following, pack="<BIBBB")
        assert answer in (None, b"\x4f" + bytes(7))
        return answer is not None

    def asked_for_its_number(self):
        answer = self.lss(ASK_NODE)
        assert answer[0] == ASK_NODE and not any(answer[2:])
        return answer[1]

    def answers_as(self, number):
        sent = self.say((0x600 + number, struct.pack("<BHBI", 0x40, 0x1000, 0, 0)))
        return [identifier for identifier, _ in sent] == [0x580 + number]


@pytest.fixture
def node(c):
    made = Setter(c)
    assert made.sent() == [(HEARTBEAT, b"\0")]
    return made


@pytest.fixture
def new(c):
    """One without a number."""
    return Setter(c, node=NONE)


# ---- without a number ----

@pytest.mark.parametrize("number", (128, 254, 255))
def test_without_a_number_it_is_silent(c, number):
    node = Setter(c, node=number, heartbeat_ms=5)
    assert c.host_can_opened.value == 1 and node.sent() == [] and node.canopen.heartbeat_ms == 5
    everybody = [(0, bytes([START, 0])), (0, bytes([RESET_NODE, number])), (0x80, b""), (0x600 + number & 0x7FF, bytes(8))]
    assert node.say(*everybody) == [] and node.canopen.state == 0
    node.axis.faults.count, node.axis.faults.cause = 1, c.FAULT_OVERVOLTAGE
    assert node.wait(250) == []
    node.to(CONFIGURATION)
    assert node.asked_for_its_number() == NONE


def test_it_boots_with_its_number_when_that_is_complete(new):
    new.to(CONFIGURATION)
    assert new.configure(NODE_ID, 9) == (0, 0)
    assert new.asked_for_its_number() == NONE and not new.answers_as(9) and new.wait(5) == []
    assert new.say((COMMAND, bytes([4, WAITING]).ljust(8, b"\0"))) == [(0x709, b"\0")]
    assert new.answers_as(9) and new.canopen.state == 127
    new.nmt(START, 9)
    assert new.canopen.state == 5 and new.axis.params.can_node == NONE


def test_a_fault_from_before_is_told_behind_the_boot_up(new):
    new.axis.faults.count, new.axis.faults.cause = 1, new.c.FAULT_OVERVOLTAGE
    new.wait(3)
    new.to(CONFIGURATION)
    new.configure(NODE_ID, 9)
    sent = new.say((COMMAND, bytes([4, WAITING]).ljust(8, b"\0")))
    assert [identifier for identifier, _ in sent] == [0x709, 0x89]


def test_left_without_a_number_it_stays_silent(new):
    new.to(CONFIGURATION)
    assert new.configure(NODE_ID, NONE) == (0, 0)
    new.to(WAITING)
    assert new.wait(5) == [] and new.canopen.state == 0


# ---- which of them ----

def test_all_are_switched_at_once_without_an_answer(node):
    assert node.lss(ASK_NODE) is None
    node.to(CONFIGURATION)
    assert node.asked_for_its_number() == NODE
    node.to(2)
    assert node.asked_for_its_number() == NODE, "2 is no state"
    node.to(WAITING)
    assert node.lss(ASK_NODE) is None


RIGHT = list(enumerate(IDENTITY))


def named(node, parts):
    """Whether it answered to each."""
    answers = [node.lss(0x40 + part, value) for part, value in parts]
    assert set(answers) <= {None, b"\x44" + bytes(7)}
    return [answer is not None for answer in answers]


@pytest.mark.parametrize("parts", [
    RIGHT, *([(part, value + (part == wrong)) for part, value in RIGHT] for wrong in range(4)),
    *([RIGHT[part] for part in order] for order in ((0, 2, 1, 3), (1, 2, 3), (0, 1, 3), (0, 1, 1, 2, 3), (3,)))])
def test_one_is_switched_by_all_of_its_identity_in_its_order(node, parts):
    switches = parts == RIGHT
    assert named(node, parts) == [False] * (len(parts) - 1) + [switches]
    assert (node.lss(ASK_NODE) is not None) == switches
    assert named(node, RIGHT)[3] != switches, "another time; switched already it does not answer that again"


@pytest.mark.parametrize("between", (
    lambda node: (node.to(CONFIGURATION), node.to(WAITING)), lambda node: node.nmt(RESET_COMMUNICATION),
    lambda node: node.nmt(RESET_NODE)), ids=("switched", "reset of communication", "reset"))
def test_what_was_named_before_is_forgotten(node, between):
    assert not any(named(node, RIGHT[:3]))
    between(node)
    assert not any(named(node, RIGHT[3:])) and node.lss(ASK_NODE) is None


def test_its_identity_is_that_of_the_dictionary(node):
    node.to(CONFIGURATION)
    for part, value in enumerate(IDENTITY):
        assert node.lss(0x5A + part) == struct.pack("<BI", 0x5A + part, value).ljust(8, b"\0")
        assert node.value(0x1018, part + 1) == value


@pytest.mark.parametrize("command", (NODE_ID, BIT_TIMING, ACTIVATE, STORE, *range(0x5A, 0x5F)))
def test_only_in_configuration(node, command):
    before = node.everything(), bytes(node.canopen.lss)
    assert node.lss(command, 9) is None and (node.everything(), bytes(node.canopen.lss)) == before
    assert not node.c.slots_check(node.slots).any


@pytest.mark.parametrize("length", range(8))
def test_a_frame_of_another_length_is_none(node, length):
    node.say((COMMAND, bytes([4, CONFIGURATION]).ljust(8, b"\0")[:length]))
    assert node.lss(ASK_NODE) is None


def test_what_is_no_command_has_no_answer(node):
    known = {NODE_ID, BIT_TIMING, STORE, *range(0x5A, 0x5F)}
    node.to(CONFIGURATION)
    for command in range(256):
        if command not in (4, ACTIVATE):
            assert (node.lss(command) is not None) == (command in known), hex(command)
            node.to(CONFIGURATION)


# ---- fastscan ----

def scanned(node):
    """A master that finds out the identity bit by bit."""
    found = [0] * 4
    for part in range(4):
        for bit in range(31, -1, -1):
            if not node.scan(found[part], bit, part, part):
                found[part] |= 1 << bit
        assert node.scan(found[part], 0, part, (part + 1) % 4)
    return tuple(found)


def test_it_is_found_bit_by_bit_and_switched(new):
    assert new.scan(0, 128)
    assert scanned(new) == IDENTITY and new.asked_for_its_number() == NONE
    assert not new.scan(0, 128), "in configuration it is found already"


def test_a_scan_begins_anew_whenever_a_master_wants(new):
    assert new.scan(0, 128) and not new.scan(PRODUCT, 0, 1, 2), "another part than the one it is at"
    assert new.scan(0, 0, 0, 1) and new.scan(PRODUCT, 0, 1, 2)
    assert not new.scan(0, 0, 0, 1), "it is two parts further"
    assert new.scan(0, 128) and scanned(new) == IDENTITY


@pytest.mark.parametrize("bit, part, following", [
    (32, 0, 0), (127, 0, 0), (129, 0, 0), (255, 0, 0), (0, 4, 0), (0, 0, 4), (0, 1, 1)])
def test_what_no_master_asks_is_not_answered(new, bit, part, following):
    assert new.scan(0, 128) and not new.scan(0, bit, part, following) and new.lss(ASK_NODE) is None
    assert scanned(new) == IDENTITY


def test_who_has_a_number_or_shall_lose_it_is_not_looked_for(node, new):
    assert not node.scan(0, 128)
    for each, number in ((new, 9), (node, NONE)):
        each.to(CONFIGURATION)
        each.configure(NODE_ID, number)
        assert not each.scan(0, 128)
        each.to(WAITING)
        assert not each.scan(0, 128)


# ---- the number ----

@pytest.mark.parametrize("number, error", [(1, 0), (127, 0), (NONE, 0), (0, 1), (128, 1), (254, 1)])
def test_numbers(node, number, error):
    node.to(CONFIGURATION)
    assert node.configure(NODE_ID, number) == (error, 0)
    node.nmt(RESET_COMMUNICATION)
    assert node.canopen.node == (NODE if error else number)


@pytest.mark.parametrize("command", (RESET_COMMUNICATION, RESET_NODE))
def test_who_has_a_number_takes_the_other_by_a_reset(node, command):
    node.to(CONFIGURATION)
    node.configure(NODE_ID, 9)
    assert node.asked_for_its_number() == NODE
    assert node.say((COMMAND, bytes([4, WAITING]).ljust(8, b"\0"))) == [] and node.answers_as(NODE) and not node.answers_as(9)
    node.to(CONFIGURATION)
    assert node.nmt(command) == [(0x709, b"\0")] and node.answers_as(9) and not node.answers_as(NODE)
    assert node.lss(ASK_NODE) is None, "waiting, as after power-on"
    assert node.axis.params.can_node == NODE


def test_without_a_number_again_by_a_reset(c):
    node = Setter(c, heartbeat_ms=5)
    assert len(node.sent()) == 1 and len(node.wait(50)) == 10
    node.to(CONFIGURATION)
    node.configure(NODE_ID, NONE)
    assert node.nmt(RESET_COMMUNICATION) == [] and node.wait(150) == [] and not node.answers_as(NODE)
    assert node.scan(0, 128)


def test_the_initial_parameters_leave_it_where_it_is_and_a_parameter_that_is_set_takes_its_place(node):
    node.to(CONFIGURATION)
    node.configure(NODE_ID, 9)
    node.nmt(RESET_COMMUNICATION)
    assert node.wait(3) == [] and node.answers_as(9)
    ask = struct.pack("<BHBI", 0x23, 0x1011, 1, 0x64616F6C)
    assert [identifier for identifier, _ in node.say((0x609, ask))] == [0x589]
    assert node.wait(3) == [] and node.answers_as(9) and node.axis.params.can_node == NODE
    node.axis.params.can_node = 17
    assert node.wait(1) == [(1, 0x711, b"\0")] and node.answers_as(17)


# ---- the rate ----

@pytest.mark.parametrize("row", (*range(11), 127, 255))
def test_rates(node, row):
    node.to(CONFIGURATION)
    assert node.configure(BIT_TIMING, 0, row) == (0 if row in RATES else 1, 0)
    assert node.configure(BIT_TIMING, 1, 2) == (1, 0), "another table"
    node.lss(ACTIVATE, 0, pack="<BH")
    node.wait(3)
    assert node.c.host_can_kbit.value == RATES.get(row, 500)


def test_the_other_rate_is_between_two_silences(node):
    c = node.c
    node.write(0x1017, 0, 5, 2)
    node.to(CONFIGURATION)
    assert node.configure(BIT_TIMING, 0, 3) == (0, 0)
    opened = c.host_can_opened.value
    assert node.wait(10) and node.lss(ACTIVATE, 50, pack="<BH") is None
    assert node.wait(50) == [] and c.host_can_opened.value == opened
    assert node.wait(1) == [] and c.host_can_opened.value == opened + 1 and c.host_can_kbit.value == 250
    assert node.say((0, bytes([START, NODE])), (COMMAND, bytes([ASK_NODE]).ljust(8, b"\0"))) == []
    assert node.wait(50) == [] and node.canopen.state == 127
    assert {identifier for _, identifier, data in node.wait(11)} == {HEARTBEAT}, "no boot-up, it has not been reset"
    assert node.asked_for_its_number() == NODE and c.host_can_opened.value == opened + 1
    assert node.axis.params.can_kbit == 500


def test_what_changes_meanwhile_is_told_behind_it(node):
    node.nmt(START)
    node.wait(5)
    node.to(CONFIGURATION)
    node.lss(ACTIVATE, 20, pack="<BH")
    node.axis.state = node.c.AXIS_SWITCHED_ON
    sent = node.wait(50)
    assert [identifier for _, identifier, _ in sent][:1] == [0x180 + NODE] and 42 <= sent[0][0] <= 44


def test_that_it_is_back_from_bus_off_is_told_behind_it(node):
    bus = node.c.host_can_state
    node.to(CONFIGURATION)
    bus.value = 2
    node.wait(2)
    node.lss(ACTIVATE, 20, pack="<BH")
    node.wait(5)
    bus.value = 0
    assert [(identifier, data[:2]) for _, identifier, data in node.wait(60)] == [
        (0x80 + NODE, b"\x40\x81"), (0x80 + NODE, b"\0\0")]
    assert node.value(0x1003) == 1


def enabled_by_sdo(node):
    """In pre-operational, which NMT then need not leave."""
    for word in (6, 7, 15):
        node.write(0x6040, 0, word, 2)
    node.axis.request, node.axis.state = 0, node.c.AXIS_OPERATION_ENABLED
    node.poll()
    node.sent()


def test_a_master_that_makes_the_bus_leave_is_lost(node):
    """To a drive that this bus has enabled, as if the controller were bus-off; to another it is not."""
    node.to(CONFIGURATION)
    node.lss(ACTIVATE, 20, pack="<BH")
    node.wait(1)
    assert node.axis.master_lost == 0
    node.wait(60)
    node.enabled()
    node.to(CONFIGURATION)
    node.lss(ACTIVATE, 20, pack="<BH")
    node.wait(1)
    assert node.axis.master_lost == node.c.CANOPEN_LOST_BUS


def test_one_whose_number_is_taken_has_lost_its_master(node):
    """Nobody on the bus could stop it any more, and what watched the master's heartbeat is reset."""
    node.write(0x1016, 1, 0x7F << 16 | 30, 4)
    node.say((0x77F, b"\5"))
    enabled_by_sdo(node)
    node.to(CONFIGURATION)
    node.configure(NODE_ID, NONE)
    assert node.axis.master_lost == 0
    node.nmt(RESET_COMMUNICATION)
    assert node.canopen.node == NONE and node.axis.master_lost == node.c.CANOPEN_LOST_NMT
    node.wait(50)
    assert node.axis.master_lost == node.c.CANOPEN_LOST_NMT


def test_it_is_the_same_if_the_parameter_takes_it_but_not_at_rest(node, new):
    enabled_by_sdo(node)
    node.axis.params.can_node = NONE
    node.wait(1)
    assert node.axis.master_lost == node.c.CANOPEN_LOST_NMT
    new.wait(3)
    assert new.axis.master_lost == 0 and not any(new.canopen.lost)


def test_its_heartbeat_is_not_missed_meanwhile(node):
    node.write(0x1016, 1, 0x7F << 16 | 30, 4)
    node.say((0x77F, b"\5"))
    node.to(CONFIGURATION)
    node.lss(ACTIVATE, 100, pack="<BH")
    node.wait(202)
    assert not node.canopen.comm_errors and node.wait(20) == []
    assert [identifier for _, identifier, _ in node.wait(20)] == [0x80 + NODE], "from then on it is"


# ---- storing ----

def kept(node):
    """What the drive, or the first of two, finds at its next start: (number, rate)."""
    c, other = node.c, node.c.axis()
    c.drive_init(other, node.fabric)
    other.fabric_untrusted, other.state = 0, c.AXIS_SWITCH_ON_DISABLED
    assert c.drive_load(other, node.slots[0] if len(node.axes) > 1 else node.slots, c.nvm_report()).error == c.ERROR_NONE
    return other.params.can_node, other.params.can_kbit


def test_stored_they_are_there_at_the_next_start_and_not_before(node):
    node.to(CONFIGURATION)
    node.configure(NODE_ID, 9)
    node.configure(BIT_TIMING, 0, 4)
    opened = node.c.host_can_opened.value
    assert node.configure(STORE) == (0, 0)
    assert node.wait(3) == [] and node.answers_as(NODE) and node.c.host_can_opened.value == opened
    assert kept(node) == (9, 125) and (node.axis.params.can_node, node.axis.params.can_kbit) == (9, 125)


@pytest.mark.parametrize("number, kbit", ((NODE, 300), (NONE, 500)))
def test_what_has_not_been_set_is_stored_as_it_was_and_none_too(node, number, kbit):
    node.axis.params.can_kbit = kbit
    node.poll()
    node.to(CONFIGURATION)
    if number == NONE:
        node.configure(NODE_ID, NONE)
    assert node.configure(STORE) == (0, 0) and kept(node) == (number, kbit)


@pytest.mark.parametrize("on", (True, False))
def test_what_a_save_refuses_is_named_and_changes_nothing(node, on):
    if on:
        node.enabled()
    node.to(CONFIGURATION)
    node.configure(NODE_ID, 9)
    node.axis.params.i_max_ma = node.axis.params.i_max_ma if on else 14999
    before = node.everything()
    assert node.configure(STORE) == (255, ON if on else node.c.ERROR_I_MAX_BEYOND_TRIP) and node.everything() == before
    assert not node.c.slots_check(node.slots).any


@pytest.mark.parametrize("name, value", [("can_node", 17), ("can_kbit", 250), ("can_recover", 1)])
def test_a_parameter_set_in_the_same_turn_takes_effect_first(node, name, value):
    """It is not stored over, and not taken for what is in effect already."""
    node.to(CONFIGURATION)
    node.configure(NODE_ID, 9)
    opened, setting = node.c.host_can_opened.value, struct.pack("<BHBI", 0x23, node.param(name), 0, value)
    sent = node.say((0x600 + NODE, setting), (COMMAND, bytes([STORE]).ljust(8, b"\0")))
    assert dict(sent)[ANSWER][:3] == bytes([STORE, 255, node.c.ERROR_BUSY]) and not node.c.slots_check(node.slots).any
    node.wait(1)
    assert getattr(node.axis.params, name) == value and node.c.host_can_opened.value == opened + 1
    assert node.canopen.node == (value if name == "can_node" else NODE)
    assert node.c.host_can_kbit.value == (value if name == "can_kbit" else 500)
    assert node.c.host_can_recovers.value == (name == "can_recover")


def test_memory_that_cannot_be_written_is_told(node):
    locked = node.c.host_bench.envm.locked
    for page in range(len(locked)):
        locked[page] = True
    node.to(CONFIGURATION)
    node.configure(NODE_ID, 9)
    before = node.everything()
    assert node.configure(STORE) == (2, 0) and node.everything() == before
    for page in range(len(locked)):
        locked[page] = False
    assert node.configure(STORE) == (0, 0) and kept(node) == (9, 500)


# ---- nothing else; whatever else comes: tests/fuzz/canopen.c ----

def test_it_is_no_sign_of_life_of_a_master(node):
    node.axis.command_ms = 0
    node.to(CONFIGURATION)
    node.asked_for_its_number()
    assert node.axis.command_ms == 0


# ---- two axes ----

def test_two_axes_are_one_node_to_it(two_buses):
    pair = Setter(two_buses, node=NONE, count=2)
    assert pair.scan(0, 128) and scanned(pair) == IDENTITY
    assert pair.configure(NODE_ID, 9) == (0, 0) and pair.configure(STORE) == (0, 0)
    assert [axis.params.can_node for axis in pair.axes] == [9, 0]
    pair.axes[1].state = two_buses.AXIS_OPERATION_ENABLED
    before = ctypes.string_at(ctypes.addressof(pair.axes), ctypes.sizeof(pair.axes))
    assert pair.configure(NODE_ID, 10) == (0, 0) and pair.configure(STORE) == (255, ON)
    assert ctypes.string_at(ctypes.addressof(pair.axes), ctypes.sizeof(pair.axes)) == before


@pytest.fixture
def pair(two_buses):
    made = Setter(two_buses, count=2)
    made.to(CONFIGURATION)
    assert made.configure(STORE) == (0, 0) and kept(made) == (NODE, 500)
    made.configure(NODE_ID, 9)
    made.configure(BIT_TIMING, 0, 4)
    return made


@pytest.mark.parametrize("before", (0, "NO_FAULT"))
def test_it_names_what_the_second_axis_refuses_and_the_first_stores_nothing(pair, before):
    """And not what was refused before."""
    pair.axes[1].params.i_max_ma = 14999
    pair.canopen.drives[0].cia402.refusal.error = pair.c.ERROR_NO_FAULT if before else 0
    assert pair.configure(STORE) == (255, pair.c.ERROR_I_MAX_BEYOND_TRIP)
    assert kept(pair) == (pair.axis.params.can_node, pair.axis.params.can_kbit) == (NODE, 500)


@pytest.mark.parametrize("turning", (0, 1))
def test_none_stores_while_a_shaft_turns(pair, turning):
    pair.axes[turning].speed.speed_rpm_q4 = 16 * 100
    answer, why = pair.configure(STORE)
    assert answer == 255 and why in (pair.c.ERROR_TURNING, pair.c.ERROR_SAVE_BESIDE_ON) and kept(pair) == (NODE, 500)


def test_memory_of_the_second_that_cannot_be_written_is_told(pair):
    """The first has stored by then; what is in effect stays, and the same again mends it."""
    locked = pair.c.host_bench.envm.locked
    first = pair.slots[1].offset_bytes // 128
    for page in range(first, first + SLOTS_BYTES // 128):
        locked[page] = True
    assert pair.configure(STORE) == (2, 0) and kept(pair) == (9, 125)
    assert (pair.axis.params.can_node, pair.axis.params.can_kbit) == (NODE, 500)
    for page in range(len(locked)):
        locked[page] = False
    assert pair.configure(STORE) == (0, 0) and kept(pair) == (9, 125)
