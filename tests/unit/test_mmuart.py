# SPDX-License-Identifier: MIT
"""The UART's interrupt on registers that stand still, so that a call receives sixteen times: characters that are damaged, lost
or too many, and who asks whom to wait. The rates."""
import ctypes

import pytest

from rigs.device import Device

DR, OE, PE, FE, BI, THRE, TEMT = (1 << n for n in range(7))  # of LSR
RECEIVES, SENDS, ERRORS = 1, 2, 4                         # of IER
FIFO, ROOM, HIGH, LOW, XON, XOFF = 16, 512, 128, 32, 0x11, 0x13


class Uart:
    def __init__(self, system, flow_control):
        Device(system)
        self.c, self.regs, self.u = system, system.mmuart_regs(), system.mmuart()
        assert system.mmuart_init(self.u, self.regs, 115200)
        if flow_control:
            system.mmuart_use_flow_control(self.u)

    def interrupt(self, lsr, character=ord("x")):
        """What is in the transmitter's register afterwards, which is the receiver's as well."""
        self.regs.IER, self.regs.LSR, self.regs.THR = 0, lsr, character
        self.c.mmuart_irq_handler(self.u)
        return self.regs.THR

    def taken(self, most=10**6):
        """Of each character whether it says that others are missing near it."""
        marks, character = [], ctypes.c_char()
        while len(marks) < most:
            loss = ctypes.c_bool(False)
            if not self.c.mmuart_get(self.u, ctypes.byref(character), ctypes.byref(loss)):
                break
            marks.append(loss.value)
        return marks


@pytest.fixture
def uart(system, memory):
    return lambda flow_control=False: Uart(system, flow_control)


@pytest.mark.parametrize("error", (FE, PE, BI), ids=("framing", "parity", "break"))
def test_a_damaged_character_is_none_is_counted_and_the_next_one_says_so(uart, error):
    u = uart()
    u.interrupt(DR | error)
    assert u.taken() == [] and u.u.counters.rx_errors == FIFO
    u.interrupt(DR)
    assert u.taken() == [True] + [False] * (FIFO - 1)


def test_muted_it_receives_nothing(uart):
    u = uart()
    u.u.rx_muted = True
    u.interrupt(DR)
    assert u.taken() == []


def test_what_comes_behind_a_drop_is_marked_and_what_came_before_is_not(uart):
    u = uart()
    for _ in range(ROOM // FIFO + 1):
        u.interrupt(DR)
    assert u.taken() == [False] * ROOM and u.u.counters.rx_dropped == FIFO
    u.interrupt(DR)
    assert u.taken() == [True] + [False] * (FIFO - 1)


def test_the_other_side_is_asked_to_wait_and_to_go_on(uart):
    u = uart(flow_control=True)
    for _ in range(HIGH // FIFO):
        u.interrupt(DR)
    assert u.interrupt(THRE) == ord("x"), "up to the mark nobody is asked"
    u.interrupt(DR)
    assert u.regs.IER == RECEIVES | ERRORS | SENDS
    assert [u.interrupt(THRE) for _ in range(2)] == [XOFF, ord("x")], "once"
    for _ in range(2 * ROOM // FIFO):
        u.interrupt(DR)
    assert u.regs.IER == ERRORS, "with the buffer full the rest stays outside"
    u.interrupt(DR | PE)
    assert u.u.counters.rx_dropped == 0
    assert len(u.taken(ROOM - LOW - 1)) == ROOM - LOW - 1 and u.interrupt(THRE, 0) == 0, "not yet"
    assert len(u.taken(1)) == 1 and u.interrupt(THRE) == XON
    u.interrupt(DR)
    assert u.u.counters.rx_errors == 1, "what was wrong with the one outside is still known"


def test_asked_to_wait_it_sends_nothing_until_it_may(uart):
    u = uart(flow_control=True)
    u.interrupt(DR, XOFF)
    u.c.mmuart_put(u.u, ord("a"))
    assert u.interrupt(THRE) == ord("x") and u.regs.IER == RECEIVES | ERRORS
    assert u.interrupt(DR | THRE, XON) == ord("a") and u.taken() == [], "the reader sees neither"
    plain = uart()
    plain.interrupt(DR, XOFF)
    assert len(plain.taken()) == FIFO, "without flow control they are characters"


WHAT_IT_LEAVES_OUT = ("IEM", "MM1", "MM2", "GFR", "TTG", "RTO", "MCR")  # LIN, IrDA, filters, guards, time-outs, a modem


@pytest.mark.parametrize("baud, divisor_64ths", (
    (0, None), (3_125_001, None), (3_125_000, 2 << 6), (95, None), (96, 65104 << 6 | 11), (115200, 54 << 6 | 16),
    (9600, 651 << 6 | 3), (56000, 111 << 6 | 39)))
def test_rates_between_pclk_over_2_20_and_over_32(system, memory, baud, divisor_64ths):
    """To the nearest 64th of the divisor; its upper half stands where IER does."""
    Device(system)
    u, regs = system.mmuart(), system.mmuart_regs()
    for name in WHAT_IT_LEAVES_OUT:
        setattr(regs, name, 0x5A)
    assert system.mmuart_init(u, regs, baud) == (divisor_64ths is not None)
    assert all(getattr(regs, name) == (0x5A if divisor_64ths is None else 0) for name in WHAT_IT_LEAVES_OUT)
    assert divisor_64ths is None or (regs.DLR, regs.DFR, regs.LCR, regs.MM0) == (
        divisor_64ths >> 6 & 255, divisor_64ths & 63, 3, 1 << 7)


def test_what_is_put_leaves_in_order_and_what_finds_no_room_is_counted(uart):
    u = uart()
    text = [(37 * n + 11) % 256 for n in range(1024)]
    assert u.c.mmuart_free_space(u.u) == len(text) and all(u.c.mmuart_put(u.u, one) for one in text)
    assert not any(u.c.mmuart_put(u.u, 1) for _ in range(3)) and u.c.mmuart_free_space(u.u) == 0
    assert [u.interrupt(THRE) for _ in range(len(text) // FIFO)] == text[FIFO - 1::FIFO], "the last that each has written"
    assert u.regs.IER == RECEIVES | ERRORS and u.c.mmuart_counters(u.u).tx_dropped == 3
    for lsr in (THRE, THRE | TEMT):
        u.regs.LSR = lsr
        assert u.c.mmuart_is_idle(u.u) == bool(lsr & TEMT)


def test_behind_an_overrun_all_that_the_fifo_held_and_one_more_are_marked(uart):
    u = uart()
    for lsr, marked in ((DR, False), (DR | OE, True), (DR, True), (DR, False)):
        u.interrupt(lsr)
        assert u.taken() == [marked] * FIFO
    assert u.c.mmuart_counters(u.u).rx_overruns == FIFO


def test_an_emergency_needs_no_interrupt_and_gives_up_on_a_dead_line(uart):
    u = uart()
    for lsr, sent in ((THRE, ord("p")), (0, ord("x"))):
        u.regs.LSR, u.regs.THR, u.regs.IER = lsr, ord("x"), 7
        assert u.c.mmuart_emergency_write(u.regs, b"help") == bool(lsr) and (u.regs.THR, u.regs.IER) == (sent, 0)
