# SPDX-License-Identifier: MIT
"""Where 32 bits end: positions of a shaft that has turned for hours, speeds that reverse in a cycle, times after days."""
import ctypes
import subprocess

import pytest

from rigs.firmware import HERE, ROOT
from rigs.motor_numbers import compute, shipped
from rigs.operating import Drive

BORDERS = (0, 2**31, -2**31, 2**32, 3 * 2**31, -5 * 2**31, 10**12)


def shown(counts):
    """As a host sees it, and sends it."""
    return ctypes.c_int32(counts).value


def at(c, counts, mode="SPEED"):
    w = Drive(c, mode, rpm=0)
    w.axis.motion.turns.counts = counts
    return w


def target(w):
    return w.axis.motion.profile.target >> w.axis.tuning.profile.shift


@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.parametrize("off, way", [(-50, 100), (50, -100), (-1, 1), (0, -1), (0, 2**31 - 1), (0, 1 - 2**31)])
def test_a_target_is_the_nearest_with_these_bits(c, border, off, way):
    w = at(c, border + off)
    assert c.drive_status(w.axis).position == shown(border + off)
    assert w.command("position", shown(border + off + way), False) == c.ERROR_NONE
    assert target(w) == border + off + way
    assert c.drive_status(w.axis).target == shown(border + off + way)
    w.step()
    assert w.command("position", shown(border + off), False) == c.ERROR_NONE and target(w) == border + off


@pytest.mark.parametrize("border", BORDERS)
def test_relative_ones_count_on(c, border):
    w = at(c, border - 10)
    c.drive_command_position(w.axis, shown(border - 5), False)
    c.drive_command_position(w.axis, 2**31 - 1, True)
    c.drive_command_position(w.axis, 2**31 - 1, True)
    w.step()
    assert target(w) == border - 5 + 2 * (2**31 - 1)


def test_a_target_never_turns_round(c):
    """A master that adds for ever while the shaft cannot follow."""
    w = at(c, 0)
    w.axis.tuning.profile.shift = 24
    targets = []
    for _ in range(300):
        assert w.command("position", 2**31 - 1, True) == c.ERROR_NONE
        targets.append(target(w))
    assert targets == sorted(targets) and targets[-1] == targets[-2] > 2**35


@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.parametrize("way", (40, -40))
def test_cyclic_positions_cross_it(c, border, way):
    w = at(c, border - 2 * way)
    here = border - 2 * way
    for _ in range(4):
        here += way
        assert w.command("cyclic_position", shown(here)) == c.ERROR_NONE
        assert w.axis.motion.cyclic.target >> w.axis.tuning.profile.shift == here
    assert c.drive_command_cyclic_position(w.axis, shown(here + way)).error == c.ERROR_NONE
    assert c.drive_command_cyclic_position(w.axis, shown(here + 2 * way)).error == c.ERROR_NONE
    assert c.drive_command_cyclic_position(w.axis, shown(here + 2**30)).error == c.ERROR_BEYOND_CYCLE
    c.set_point_take(w.axis)
    assert w.axis.motion.cyclic.target >> w.axis.tuning.profile.shift == here + 2 * way


@pytest.mark.parametrize("sign", (1, -1))
def test_a_reversal_within_a_cycle_is_fed_forward_its_own_way(c, sign):
    """From 30 000 to -30 000 rpm are more than 32 bits of rpm Q16."""
    w = Drive(c, rpm=0)
    c.modes_enter(w.axis, w.mode_code("CYCLIC_SPEED"))
    cyclic = w.axis.motion.cyclic
    cyclic.stepped = sign * 30000 << 16
    cyclic.now = cyclic.target = -cyclic.stepped
    w.turn(-sign * 30000)  # so that nothing but the feed-forward asks for torque
    w.axis.speed.integral_q29 = 0
    assert w.control() * sign < 0


@pytest.mark.parametrize("sign", (1, -1))
def test_and_of_a_position(c, sign):
    _, _, tuning = compute(c, {**shipped(), "pole_pairs": 1, "speed_max_rpm": 30000, "overspeed_rpm": 32000})
    speed, turns, position = c.speed_loop(), c.turns(), c.position_loop()
    c.speed_loop_init(speed)
    c.speed_loop_tune(speed, tuning)
    speed.estimate.interval_clocks = 1000
    speed.estimate.speed_rpm_q15 = speed.estimate.travel_q15 = sign * 30000 << 15
    c.position_begin(position, 0, sign * 8000000)
    assert c.position_step(position, -sign * 8000000, speed, turns, tuning, c.interval(low=-20000, high=20000)) * sign < 0


@pytest.mark.parametrize("days", (1, 4.97102697, 10, 40, 49.8, 400))
def test_what_was_long_ago_stays_long_ago(c, days):
    """An inhibit time of 6.5 s, in 100 us, is over after 6.5 s and for ever."""
    axis, node, then = c.axis(), c.canopen(), ctypes.c_uint32(0)
    node.drives[0].axis = ctypes.pointer(axis)
    for part in range(1, 101):
        axis.time_ms = int(days * 864e5 * part / 100) % 2**32
        since = c.canopen_elapsed_ms(node, ctypes.byref(then))
        assert 65535 < since * 10 < 2**32 and since >= 65535


PROGRAM = """
#include "drivers/mss/sysreg.h"
static struct sysreg_regs sysreg;
#undef SYSREG
#define SYSREG (&sysreg)
#include "drivers/mss/can.c"
#include <stdio.h>
uint32_t host_primask;
void sysreg_release_reset(uint32_t mask) { (void)mask; }
int main(void)
{
    static struct can c;
    static struct can_regs regs;
    static const uint32_t rates[] = {20, 50, 125, 250, 500, 800, 1000};
    for (int n = 0; n < 7; n++) {
        c.regs = NULL;
        can_open(&c, &regs, rates[n], false);
        printf("%u\\n", (unsigned)regs.CONFIG);
    }
}
"""


def test_each_can_rate_follows_the_largest_clock_error(tmp_path):
    """SJW, b3:2 of CONFIG: at most 4 quanta and no more than there are behind the sample, b7:5 (ISO 11898-1)."""
    (tmp_path / "rates.c").write_text(PROGRAM)
    subprocess.run(["cc", "-w", "-std=gnu11", f"-I{HERE / 'host'}", f"-I{ROOT}", str(tmp_path / "rates.c"), "-o",
                    str(tmp_path / "rates")], check=True)
    configs = [int(line) for line in subprocess.run([tmp_path / "rates"], capture_output=True, text=True).stdout.split()]
    assert len(configs) == 7
    for config in configs:
        jump, behind = (config >> 2 & 3) + 1, (config >> 5 & 7) + 1
        assert jump == min(behind, 4)


@pytest.mark.parametrize("said_ms", (0, 1000, 2**31 - 100, 2**31 + 100, 2**32 - 200, 2**32 - 1))
def test_silence_is_counted_across_the_clocks_wrap(c, said_ms):
    axis = c.axis()
    axis.params.command_timeout_ms = 300
    axis.command_ms = said_ms
    for after_ms, silent in ((0, False), (1, False), (250, False), (300, False), (301, True), (5000, True)):
        axis.time_ms = (said_ms + after_ms) % 2**32
        assert c.supervision_is_silent(axis) == silent, after_ms
