# SPDX-License-Identifier: MIT
"""The half-duplex line: when its driver is on, what it hears meanwhile, and what it makes of silence."""
import ctypes

import pytest

from rigs.device import Device
from unit.register_pages import GPIO_OUT_BITS

PIN, BAUD = 5, 19200
TICKS = 11 * (100_000_000 // BAUD + 1)  # of a character
EMPTY, FREE, RECEIVED = 1 << 6, 1 << 5, 1 << 0  # LSR: all has left, room in the FIFO, a character is there
LOSS, SILENCE = 1 << 8, 1 << 9


class Line:
    """The driver of a line, and the UART's registers in memory; whoever owns the other end is the test."""

    def __init__(self, system):
        self.c, self.device = system, Device(system)
        self.device.sysreg.SOFT_RESET_CR = 0xFFFFFFFF
        self.regs, self.line = system.mmuart_regs(), system.rs485()
        self.drives = ctypes.c_uint32.from_address(GPIO_OUT_BITS + 4 * PIN)
        self.drives.value = 1
        self.opened = self.open(BAUD)

    def open(self, baud, how=0):
        return self.c.rs485_open(self.line, self.regs, PIN, baud, how)

    def send(self, text):
        self.c.rs485_send(self.line, (ctypes.c_uint8 * len(text))(*text), len(text))

    def timer(self):
        """Ticks that it was started for since the last look; None: it was not."""
        regs = self.device.timer
        ticks = regs.TIM2_LOADVAL if regs.TIM2_CTRL == 7 else None
        regs.TIM2_CTRL = regs.TIM2_LOADVAL = 0
        return ticks

    def expire(self):
        self.timer()
        self.c.rs485_timer_handler(self.line)

    def hear(self, character):
        """A character comes: the interrupt finds it each time that it looks, up to its FIFO's depth."""
        self.timer()
        self.regs.LSR, self.regs.THR = RECEIVED, character
        self.c.rs485_uart_handler(self.line)
        self.regs.LSR = 0

    def taken(self):
        """The first that has been received, with its marks; the others are the same again, and bear none."""
        received, every = ctypes.c_uint32(), []
        while self.c.mmuart_take(self.line.uart, received):
            every.append(received.value)
        assert all(one == every[0] & 0xFF for one in every[1:])
        return every[0] if every else None

    def state(self):
        line = self.line
        return bool(self.drives.value), line.driving, line.whole, line.settling, line.uart.rx_muted

    def empty(self):
        """All characters are in the transmitter, or have left it."""
        self.line.uart.tx_tail = self.line.uart.tx_head


@pytest.fixture
def line(system, memory):
    return Line(system)


LISTENING = (False, False, False, False, False)


def test_rs485_opens_with_the_line_released(line):
    assert line.opened and line.state() == LISTENING
    gpio = ctypes.c_uint32.from_address(0x40013000 + 4 * PIN)
    assert gpio.value == 7 and line.line.character_ticks == TICKS and line.line.pin == PIN
    assert line.device.sysreg.SOFT_RESET_CR == 0xFFFFFFFF & ~(1 << 7 | 1 << 20 | 15 << 21), "UART 0, GPIO, its outputs"
    line.send(b"ab")
    assert line.open(9600) and line.state() == LISTENING and line.line.character_ticks == 11 * (100_000_000 // 9600 + 1)


@pytest.mark.parametrize("how, lcr", enumerate((0x03, 0x07, 0x0B, 0x1B)))
def test_rs485_opens_in_each_format(line, how, lcr):
    assert line.open(BAUD, how) and line.regs.LCR == lcr
    assert not line.open(90, how) and not line.open(4_000_000, how)


@pytest.mark.parametrize("text", (b"ab", b"0123456789" * 20))
def test_rs485_drives_and_is_deaf_while_it_sends(line, text):
    line.send(text)
    assert line.state() == (True, True, True, False, True)
    assert bytes(line.line.uart.tx_data[:len(text)]) == text and line.line.uart.tx_head == len(text)
    assert line.timer() == (len(text) - 1) * TICKS, "when the last is on its way"
    line.hear(0x55)
    assert line.taken() is None and line.timer() is None, "an echo, and no silence is measured behind it"


def test_rs485_releases_the_line_when_the_last_stop_bit_has_left(line):
    line.send(b"ab")
    for lsr in (0, FREE):
        line.regs.LSR = lsr
        line.expire()
        assert line.timer() == TICKS // 4 and line.state()[:2] == (True, True)
    line.empty()
    line.regs.LSR = FREE
    line.expire()
    assert line.timer() == TICKS // 4 and line.state()[:2] == (True, True), "the last one is still on its way"
    line.regs.LSR = FREE | EMPTY
    line.expire()
    assert line.timer() == 2 * TICKS and line.state() == (False, False, True, True, False)
    assert line.device.timer.TIM2_RIS == 1


def test_rs485_waits_with_the_release_for_what_the_thread_still_adds(line):
    line.send(b"ab")
    line.empty()
    line.line.whole, line.regs.LSR = False, EMPTY
    line.expire()
    assert line.timer() == TICKS // 4 and line.line.driving


def released(line):
    line.send(b"ab")
    line.empty()
    line.regs.LSR = EMPTY
    line.expire()
    line.regs.LSR = 0
    return line


def test_rs485_marks_what_comes_right_behind_its_own_as_the_rest_of_something(line):
    released(line).hear(0x41)
    assert line.taken() == 0x41 | LOSS and not line.line.settling
    assert line.timer() == TICKS * 7 // 2
    line.expire()
    line.hear(0x42)
    assert line.taken() == 0x42 | SILENCE, "3.5 characters' time later it is a beginning"


def test_rs485_takes_what_comes_after_two_characters_time_for_a_beginning(line):
    released(line).expire()
    assert not line.line.settling and line.line.uart.rx_suspects == 0 and not line.line.uart.rx_silence
    line.hear(0x43)
    assert line.taken() == 0x43 and line.timer() == TICKS * 7 // 2


def test_rs485_forgets_what_it_was_about_when_it_is_opened_again(line):
    released(line)
    assert line.open(BAUD) and line.state() == LISTENING
    line.hear(0x44)
    assert line.taken() == 0x44
