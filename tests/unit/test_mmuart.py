# SPDX-License-Identifier: MIT
"""The UART's interrupt on registers that stand still, so that a call receives sixteen times: characters that are damaged, lost
or too many, and who asks whom to wait. The line itself: tests/target/test_mmuart.c."""
import ctypes

import pytest

from rigs.device import Device

DR, PE, FE, BI, THRE = (1 << n for n in (0, 2, 3, 4, 5))  # of LSR
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
