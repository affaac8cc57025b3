# SPDX-License-Identifier: MIT
"""The EMF must be where the Hall switches say: else the frame turns by itself, which no edge shows."""
import pytest

from rigs.hall_motor import HallMotor

LEAST_MS, MOST_MS = 60, 110  # its own time, and that of the filter before it


class Elsewhere(HallMotor):
    """Of the EMF, only a share shows along the frame."""
    share = 1.0

    def see(self):
        super().see()
        rad_s = 2 * 3.14159265 * self.hz
        self.axis.loop.v_q_q15 -= self.volt((1 - self.share) * rad_s * self.p.flux_uwb * 1e-6)


@pytest.fixture
def motor(c):
    return lambda *args, **params: Elsewhere(c, *args, **params)


def ends_after(m, share, most_ms=400):
    m.share = share
    begun_ms = m.axis.time_ms
    m.until_carried(most_ms)
    return m.axis.failover.pending or m.axis.faults.cause, m.axis.time_ms - begun_ms


@pytest.mark.parametrize("rpm", (3000, -3000, 1500))
@pytest.mark.parametrize("share", (0.3, 0.0, -1.0))
def test_an_emf_that_does_not_turn_with_the_frame_is_found(motor, rpm, share):
    m = motor(rpm)
    cause, after_ms = ends_after(m, share)
    assert cause == m.c.FAULT_HALL_SEQUENCE and LEAST_MS <= after_ms <= MOST_MS


@pytest.mark.parametrize("rpm", (3000, -3000))
@pytest.mark.parametrize("share", (0.6, 1.0, 1.4))
def test_a_flux_that_was_told_wrong_is_none(motor, rpm, share):
    assert ends_after(motor(rpm), share)[0] == 0


def test_where_the_resistance_may_hide_it_nothing_is_said(motor):
    assert ends_after(motor(1500, i_a=14.5), 0.0)[0] == 0


def test_what_passes_is_forgotten(motor):
    m = motor(3000)
    for _ in range(6):
        assert ends_after(m, 0.0, 45)[0] == 0
        assert ends_after(m, 1.0, 150)[0] == 0
