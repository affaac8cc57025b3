# SPDX-License-Identifier: MIT
"""The registers of the MSS timers and of the encoder's counter behind each call, whatever was in them before."""
import contextlib
import ctypes

import pytest

from rigs.device import Device

TIMER1, TIMER2, RESET = 14, 15, 1 << 6


@pytest.fixture
def device(system, memory):
    """Both timers run already, interrupts are pending, the block is in reset."""
    device = Device(system)
    device.sysreg.SOFT_RESET_CR = 0xFFFFFFFF
    for n in (1, 2):
        for name, value in (("LOADVAL", 77), ("CTRL", 5), ("RIS", 0)):
            setattr(device.timer, f"TIM{n}_{name}", value)
    return device


def test_timer_1_starts_anew(device, system):
    assert system.mss_timer1_start_periodic(1234)
    assert device.sysreg.SOFT_RESET_CR == 0xFFFFFFFF & ~RESET
    assert (device.timer.TIM1_LOADVAL, device.timer.TIM1_CTRL, device.timer.TIM1_RIS) == (1234, 5, 1)
    assert device.nvic.ICPR[0] == 1 << TIMER1, "what was pending is not of this period"
    assert (device.timer.TIM2_LOADVAL, device.timer.TIM2_CTRL, device.timer.TIM2_RIS) == (77, 5, 0)


def test_timer_1_of_no_period_is_refused_and_stops(device, system):
    assert not system.mss_timer1_start_periodic(0)
    assert (device.timer.TIM1_LOADVAL, device.timer.TIM1_CTRL, device.timer.TIM1_RIS) == (77, 0, 1)
    assert device.nvic.ICPR[0] == 1 << TIMER1


def test_timer_1_stops_and_leaves_nothing_pending(device, system):
    system.mss_timer1_stop()
    assert (device.timer.TIM1_CTRL, device.timer.TIM1_RIS, device.nvic.ICPR[0]) == (0, 1, 1 << TIMER1)
    assert device.sysreg.SOFT_RESET_CR == 0xFFFFFFFF and device.timer.TIM2_CTRL == 5


def test_timer_2_once(device, system):
    system.mss_timer2_start_once(4321)
    assert (device.timer.TIM2_LOADVAL, device.timer.TIM2_CTRL, device.timer.TIM2_RIS) == (4321, 7, 1)
    assert device.nvic.ICPR[0] == 1 << TIMER2 and device.timer.TIM1_CTRL == 5


def test_timer_2_as_a_time_base(device, system):
    system.mss_timer2_start_free_running()
    assert (device.timer.TIM2_LOADVAL, device.timer.TIM2_CTRL) == (2**32 - 1, 1)
    assert device.sysreg.SOFT_RESET_CR == 0xFFFFFFFF & ~RESET and device.timer.TIM1_CTRL == 5


@pytest.mark.parametrize("counts, reverse, control", ((3, False, 0), (65537, False, 0), (4, False, 1), (65536, True, 3),
                                                      (4000, False, 1)))
def test_an_encoder_of_4_to_65536_counts_is_taken(system, counts, reverse, control):
    """One of others leaves the counter off. What the fabric has seen before is forgotten."""
    encoder = system.encoder_regs(CONTROL=1, STATUS=0xFF, COUNTS=77)
    assert system.encoder_init(encoder, counts, reverse) == bool(control) and encoder.CONTROL == control
    assert (encoder.COUNTS, encoder.STATUS) == ((counts, 0xF8) if control else (77, 0xFF))


@contextlib.contextmanager
def beside(system, happens):
    """What a block of the hardware does meanwhile: called at each basic block with its number."""
    passed = [0]

    @ctypes.CFUNCTYPE(None)
    def at_a_block():
        passed[0] += 1
        happens(passed[0])
        armed()

    def armed():
        ctypes.c_void_p.in_dll(system._library, "host_interrupt").value = ctypes.cast(at_a_block, ctypes.c_void_p).value
    system.host_interrupt_at.value = 0
    armed()
    yield passed
    ctypes.c_void_p.in_dll(system._library, "host_interrupt").value = None


# ---- CAN: registers are a structure of the test's ----

BUSY, LOST, OFF, ACKNOWLEDGED = 1, 1 << 10, 1 << 9, 1
SENDS_8 = 8 << 16 | 1 << 23 | 1 << 3 | 1 << 2 | 1  # bytes, both write-protect bits, interrupt, request


class Node:
    def __init__(self, system, device, rate=500, recovers=False):
        self.c, self.regs, self.can, self.device = system, system.can_regs(), system.can(), device
        ctypes.memset(ctypes.addressof(self.regs), 0xA5, ctypes.sizeof(self.regs))  # its RAM holds anything
        self.set(RX_BUF_STATUS=0, TX_BUF_STATUS=0, ERROR_STATUS=0)
        self.opened = system.can_open(self.can, self.regs, rate, recovers)

    def set(self, **values):
        for name, value in values.items():
            setattr(self.regs, name, value)

    def send(self, id_, *data):
        return self.c.can_send(self.can, self.c.can_frame(id=id_, count=len(data), data=(ctypes.c_uint8 * 8)(*data)))

    def leaves(self):
        """What is under way has left; the id that is asked for next, None if none is."""
        self.regs.TX[0].CTRL = 0
        self.set(TX_BUF_STATUS=0)
        self.c.can_irq_handler(self.can)
        if self.regs.TX[0].CTRL == 0:
            return None
        self.set(TX_BUF_STATUS=BUSY)
        return self.regs.TX[0].ID >> 21

    def hear(self, mailbox, id_, *data, count=None, remote=False):
        """A frame that a mailbox holds until the driver has acknowledged it."""
        box = self.regs.RX[mailbox]
        box.ID, box.CTRL = id_ << 21, (len(data) if count is None else count) << 16 | remote << 21
        box.DATA_HIGH, box.DATA_LOW = (int.from_bytes(bytes([*data, *[0] * 8][at:at + 4]), "little") for at in (0, 4))

    def served(self):
        """The interrupt, while the controller takes back what is acknowledged."""
        def acknowledged(_):
            for n, box in enumerate(self.regs.RX[:8]):
                if box.CTRL == ACKNOWLEDGED:
                    box.CTRL = 0
                    self.regs.RX_BUF_STATUS &= ~(1 << n)
        with beside(self.c, acknowledged):
            self.c.can_irq_handler(self.can)
        assert self.regs.RX_BUF_STATUS == 0

    def take(self):
        frame = self.c.can_frame()
        return (frame.id, *frame.data[:frame.count]) if self.c.can_take(self.can, frame) else None


@pytest.fixture
def node(device, system):
    return Node(system, device)


@pytest.mark.parametrize("rate", (20, 50, 125, 250, 500, 800, 1000))
@pytest.mark.parametrize("recovers", (False, True))
def test_can_rates_are_had_of_100_mhz(system, device, rate, recovers):
    device.sysreg.SOFT_RESET_CR = 1 << 13
    node = Node(system, device, rate, recovers)
    config = node.regs.CONFIG
    before, behind, jump = (config >> 8 & 15) + 1, (config >> 5 & 7) + 1, (config >> 2 & 3) + 1
    assert node.opened and system.can_rate_is_known(rate) and device.sysreg.SOFT_RESET_CR == 0
    assert 100_000 == rate * ((config >> 16) + 1) * (1 + before + behind)
    assert (1 + before) / (1 + before + behind) == (0.68 if rate == 800 else 0.85), "what docs/can.md says"
    assert jump == min(behind, 4) and config >> 4 & 1 == recovers and config >> 12 & 3 == 3 and config & 3 == 0


@pytest.mark.parametrize("rate", (0, 10, 100, 999, 1001))
def test_a_can_rate_that_cannot_be_had_changes_nothing(system, device, rate):
    device.sysreg.SOFT_RESET_CR = 1 << 13
    node = Node(system, device, rate)
    assert not node.opened and not system.can_rate_is_known(rate) and device.sysreg.SOFT_RESET_CR == 1 << 13
    assert node.regs.CONFIG == 0xA5A5A5A5 and not node.can.regs


def test_a_can_controller_opens_with_every_word_written(node):
    assert (node.regs.COMMAND, node.regs.INT_STATUS) == (1, 2**32 - 1)
    assert node.regs.INT_ENABLE == 1 | 1 << 9 | 1 << 10 | 1 << 11 | 1 << 12
    for n, box in enumerate(node.regs.RX):
        linked = (1 << 3 | 1 << 5 | (1 << 6 if n < 7 else 0)) if n < 8 else 1
        assert box.CTRL == 1 << 7 | 1 << 23 | linked and box.AMR == (~4 & 0xFFFFFFFF if n < 8 else 0)
        assert (box.ID, box.DATA_HIGH, box.DATA_LOW, box.ACR, box.AMR_DATA, box.ACR_DATA) == (0, 0, 0, 0, 2**32 - 1, 0)
    for box in node.regs.TX:
        assert (box.CTRL, box.ID, box.DATA_HIGH, box.DATA_LOW) == (1 << 3 | 1 << 23, 0, 0, 0)


def test_can_frames_leave_one_after_the_other_in_their_order(node, device):
    assert node.send(0x123, *range(1, 9)) and node.send(0x7FF) and node.send(1, 9)
    assert device.nvic.ISPR[0] == 1 << 16 and node.c.can_pending(node.can) == 3
    assert node.leaves() == 0x123 and node.regs.TX[0].CTRL == SENDS_8
    assert (node.regs.TX[0].DATA_HIGH, node.regs.TX[0].DATA_LOW) == (0x04030201, 0x08070605)
    node.regs.TX[0].CTRL = 77
    node.c.can_irq_handler(node.can)
    assert node.regs.TX[0].CTRL == 77 and node.c.can_pending(node.can) == 3, "nothing changes under way"
    assert node.leaves() == 0x7FF and node.regs.TX[0].CTRL >> 16 & 15 == 0 and node.c.can_pending(node.can) == 2
    node.c.can_forget(node.can)
    assert node.c.can_pending(node.can) == 1 and node.leaves() is None and node.c.can_pending(node.can) == 0


def test_a_can_queue_that_is_full_takes_no_more(node):
    assert [node.send(n) for n in range(33)] == [True] * 32 + [False] and node.can.tx_dropped == 1
    assert [node.leaves() for _ in range(33)] == [*range(32), None] and node.send(5) and node.leaves() == 5
    node.c.can_close(node.can)
    assert not node.send(1) and node.can.tx_dropped == 2 and node.c.can_pending(node.can) == 0


def test_can_frames_are_taken_from_the_lowest_mailbox_on(node):
    node.hear(1, 0x222, 1, 2, 3, 4, 5)
    node.hear(6, 0x333, remote=True)
    node.hear(0, 0x111, *range(8), count=15)
    node.set(RX_BUF_STATUS=1 << 0 | 1 << 1 | 1 << 6)
    node.can.rx_head = node.can.rx_tail = 2**32 - 2  # they run free
    node.set(INT_STATUS=0)
    node.served()
    assert [node.take() for _ in range(4)] == [(0x111, *range(8)), (0x222, 1, 2, 3, 4, 5), (0x8333,), None]
    assert node.can.rx_head == 1 and node.can.rx_lost == node.can.offs == 0


def test_can_frames_beyond_the_queue_are_lost_and_counted(node):
    for n in range(40):
        node.hear(n % 8, n)
        node.set(RX_BUF_STATUS=1 << n % 8, INT_STATUS=0)
        node.served()
    assert [node.take() for _ in range(33)] == [*((n,) for n in range(32)), None] and node.can.rx_lost == 8
    for status, lost, offs in ((LOST, 9, 0), (OFF, 9, 1), (LOST | OFF | 1 << 12, 10, 2)):
        node.set(INT_STATUS=status)
        node.c.can_irq_handler(node.can)
        assert (node.can.rx_lost, node.can.offs, node.regs.INT_STATUS) == (lost, offs, status)


def test_can_states_and_what_is_closed(node, device):
    for state, expected in enumerate((node.c.CAN_ACTIVE, node.c.CAN_PASSIVE, node.c.CAN_OFF, node.c.CAN_OFF)):
        node.set(ERROR_STATUS=state << 16 | 0xFFFCFFFF)
        assert node.c.can_state(node.can) == expected
    device.sysreg.SOFT_RESET_CR = 0
    node.hear(0, 5)
    node.set(RX_BUF_STATUS=1)
    node.c.can_close(node.can)
    assert (node.regs.COMMAND, node.regs.INT_ENABLE) == (0, 0) and device.sysreg.SOFT_RESET_CR == 1 << 13
    node.c.can_irq_handler(node.can)
    assert node.c.can_state(node.can) == 0 and node.take() is None
    node.set(COMMAND=7)
    node.c.can_close(node.can)
    assert node.regs.COMMAND == 7, "once"
    assert node.c.can_open(node.can, node.regs, 500, False) and node.c.can_pending(node.can) == 0


# ---- the fabric's converters ----

@pytest.mark.parametrize("at, polls, found", ((20, 1000, 8), (20, 3, 7), (None, 50, 7)))
def test_the_next_conversion_is_waited_for_so_long_and_no_longer(system, at, polls, found):
    adc = system.adc_regs(SEQUENCE=7, IA=7)

    def converts(blocks):
        if blocks % 20 == 0 and at:
            adc.SEQUENCE += 1
            adc.IA += 1
    with beside(system, converts) as passed:
        assert system.adc_read_next(adc, polls).ia_q15 == found
    assert adc.SEQUENCE <= 8 and passed[0] < 150
