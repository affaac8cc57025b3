# SPDX-License-Identifier: MIT
"""Who commands the drive, by the plant's truth: lost masters, parked ones, a second one, at exact times on the image."""
import struct

import numpy as np
import pytest
from launcher import simulate

from rigs.modbus_line import write_one
from rigs.steps import event, typed

NODE, ON_S = 5, 0.3
HEARTBEAT = 0x701


def can(t_s, identifier, data=b""):
    return event(t_s, "can", f"{identifier:03x}#{bytes(data).hex()}")


def sdo(t_s, index, sub, value, size):
    head = struct.pack("<BHB", 0x23 | (4 - size) << 2, index, sub)
    return can(t_s, 0x600 + NODE, head + (value & 256 ** size - 1).to_bytes(4, "little"))


def read(t_s, index):
    return can(t_s, 0x600 + NODE, struct.pack("<BHBI", 0x40, index, 0, 0))


def nmt(t_s, command, node=NODE):
    return can(t_s, 0, bytes([command, node]))


def plc(t_s, word):
    return event(t_s, "bus", write_one(0, word).hex())


def enabled(t_s=ON_S):
    return [sdo(t_s + 0.004 * n, 0x6040, 0, word, 2) for n, word in enumerate((6, 7, 15))]


def beats(until_s, limit_ms=200):
    return [sdo(ON_S - 0.05, 0x1016, 1, 1 << 16 | limit_ms, 4),
            *(can(ON_S - 0.03 + 0.05 * n, HEARTBEAT, b"\5") for n in range(int((until_s - ON_S + 0.03) / 0.05)))]


class Run:
    def __init__(self, folder, steps, end_s, *lines, aligned=True):
        lines = ("set can_node 5", *lines)
        typed_first = [{"t_s": 0.1 + 0.01 * n, "console": line} for n, line in enumerate(reversed(lines))]
        plan = {"title": "owner", "preamble_s": 0.05, "end_s": end_s, "expect_refusal": ".*",
                "step": sorted([*typed_first, *steps], key=lambda step: step["t_s"])}
        self.result = simulate(plan, out_dir=folder, plant="ideal", spread=0, aligned=aligned)
        self.trace, self.console = self.result.trace, self.result.console
        self.frames = [(int(ns) * 1e-9, *rest) for ns, *rest in map(str.split, (folder / "can.txt").read_text().splitlines())]

    def rpm(self, t_s):
        return float(self.trace["speed_rad_s"][np.searchsorted(self.trace["t_s"], t_s)]) * 30 / np.pi

    def lives(self, from_s, to_s):
        """Seconds of live gates."""
        t = self.trace["t_s"]
        inside = (t >= from_s) & (t < to_s)
        return float(np.mean(self.trace["gate_live"][inside] > 0)) * (to_s - from_s)

    def sent(self, identifier, from_s=0.0):
        return [line[3] for line in self.frames if line[1] == "tx" and line[2] == identifier and line[0] >= from_s]


@pytest.mark.parametrize("command, off_by_s", ((129, 0.01), (130, 0.5), (2, 0.5)))
def test_a_reset_or_a_stop_ends_what_was_enabled_by_sdo_alone(command, off_by_s, tmp_path):
    run = Run(tmp_path, [sdo(0.28, 0x60FF, 0, 1000, 4), *beats(0.8), *enabled(), nmt(0.8, command)], 1.5)
    assert run.rpm(0.79) == pytest.approx(1000, abs=20)
    assert run.lives(0.8 + off_by_s, 1.5) == 0
    assert command == 129 or abs(run.rpm(0.8 + off_by_s)) < 40, "a loss is a controlled stop"


def test_a_line_that_was_cut_tells_what_is_so_and_nothing_old(tmp_path):
    steps = [*beats(0.8, 1000), sdo(0.28, 0x1800, 5, 0, 2), sdo(0.285, 0x1801, 5, 0, 2), sdo(0.29, 0x60FF, 0, 1000, 4),
             *enabled(), nmt(0.6, 1), event(0.85, "can_cut", 1), event(2.9, "can_cut", 0)]
    run = Run(tmp_path, steps, 3.4, "set can_heartbeat_ms 20")
    back = [line for line in run.frames if line[1] == "tx" and line[0] > 2.9]
    assert any(line[2] == "085" and line[3][:4] == "3081" for line in back), "EMCY"
    assert int(run.sent("185", 2.9)[-1][:2], 16) & 0x4F == 0x08, "the status word"
    assert sum(line[0] < 2.92 and line[2] == "705" for line in back) <= 3, "heartbeats are of now"


@pytest.mark.parametrize("extra", ((), (nmt(2.4, 129, 0), nmt(2.5, 128, 0))), ids=("dead", "reset"))
def test_nothing_restarts_for_a_master_that_is_gone(extra, tmp_path):
    """An under-voltage; while the retry waits, the last heartbeat of the master has come, or it has reset the node."""
    steps = [*beats(2.0), nmt(0.26, 1), *enabled(), sdo(1.0, 0x60FF, 0, 1500, 4), event(2.0, "supply_v", 8),
             event(2.08, "supply_v", 24), *extra]
    run = Run(tmp_path, steps, 4.2, "set retry_count 3", "set retry_delay_ms 1000", "set angle_source 1", aligned=False)
    assert run.rpm(1.95) > 1000
    assert run.lives(2.1, 4.2) == 0


def test_a_restarted_drive_obeys_its_master_and_notices_its_death(tmp_path):
    steps = [*beats(4.0), nmt(0.26, 1), *enabled(), sdo(0.8, 0x60FF, 0, 300, 4), event(1.3, "supply_v", 8),
             event(1.5, "supply_v", 24), sdo(3.0, 0x60FF, 0, 500, 4)]
    run = Run(tmp_path, steps, 4.8, "set retry_count 1", "set retry_delay_ms 200")
    assert run.lives(1.35, 1.5) == 0 and run.lives(2.9, 3.0) == pytest.approx(0.1, abs=1e-3)
    assert abs(run.rpm(2.95)) < 30 and run.rpm(3.9) == pytest.approx(500, abs=20)
    assert run.lives(4.6, 4.8) == 0 and "fault: master lost" in run.console


def test_a_parked_plc_does_not_take_the_motor_of_another_master(tmp_path):
    steps = [plc(0.22, 6), plc(0.24, 7), *beats(1.9), nmt(0.26, 1), *enabled(), sdo(0.9, 0x60FF, 0, 1000, 4), plc(1.4, 15),
             read(1.8, 0x60FF)]
    run = Run(tmp_path, steps, 2.9)
    for t_s in (1.35, 1.6, 1.9):
        assert run.rpm(t_s) == pytest.approx(1000, abs=20)
    assert run.lives(2.6, 2.9) == 0, "and it is that master's death which counts"


@pytest.mark.parametrize("extra", ((), (nmt(ON_S + 0.1, 2),), (event(ON_S + 0.1, "can_break", 1),)),
                         ids=("heartbeat", "stop", "off"))
def test_a_master_that_is_lost_during_the_start_ends_it(extra, tmp_path):
    steps = [*beats(0.47, 100), nmt(0.26, 1), *enabled(), *extra]
    run = Run(tmp_path, steps, 2.0, aligned=False)
    assert run.lives(0.65, 2.0) == 0 and "fault: master lost" in run.console


def test_the_next_master_that_only_enables_meets_no_old_target(tmp_path):
    steps = [nmt(0.25, 1), *enabled(), sdo(0.8, 0x60FF, 0, 1000, 4), sdo(1.3, 0x6040, 0, 2, 2), sdo(1.6, 0x6040, 0, 6, 2),
             nmt(1.8, 129), nmt(1.9, 1), read(1.95, 0x60FF), *enabled(2.0)]
    run = Run(tmp_path, steps, 2.9)
    assert run.rpm(1.25) == pytest.approx(1000, abs=20)
    assert run.lives(2.6, 2.9) > 0.29 and abs(run.rpm(2.85)) < 30
    assert "43ff600000000000" in run.sent("585", 1.9)


def test_a_master_that_repeats_its_idle_word_ends_nothing(tmp_path):
    steps = [nmt(0.25, 1), *(can(0.3 + 0.01 * n, 0x205, b"\6\0") for n in range(170)), typed(0.6, "on"),
             typed(1.2, "speed 300"), typed(1.9, "status")]
    run = Run(tmp_path, steps, 2.0)
    assert run.rpm(1.85) == pytest.approx(300, abs=20) and "commanded by: the console" in run.console
