# SPDX-License-Identifier: MIT
"""The registers of the MSS timers and of the encoder's counter behind each call, whatever was in them before."""
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
