# SPDX-License-Identifier: MIT
"""The driver at the controller's model: errors, bus-off, a cut cable, a neighbour that talks all the time, bit times."""
import re

import numpy as np
import pytest
from launcher import simulate
from launcher.load import CURRENT_LOOP, load_irqlog
from launcher.qemu import CAN_DESIGN

from rigs.steps import event

EXACT = {"plant": "ideal", "spread": 0, "aligned": True}
UPLOAD = "605#4000100000000000"  # of object 0x1000


def play(tmp_path, steps, end_s, *typed):
    lines = ("set can_node 5", *typed)
    plan = {"title": "CAN", "preamble_s": 0.05, "end_s": end_s,
            "step": [*({"t_s": 0.1 + 0.01 * n, "console": line} for n, line in enumerate(reversed(lines))), *steps]}
    result = simulate(plan, out_dir=tmp_path, **EXACT)
    log = [(int(ns) * 1e-9, what, *rest) for ns, what, *rest in map(str.split, (tmp_path / "can.txt").read_text().splitlines())]
    return result, log


def can(t_s, frame):
    return event(t_s, "can", frame)


def bits(identifier, data):
    """Of a data frame with 11 bits of identifier, by ISO 11898-1: CRC of x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1, a bit
    stuffed behind five equal ones up to the CRC's end, then delimiter, acknowledge, end and pause."""
    body = f"0{identifier:011b}000{len(data):04b}" + "".join(f"{byte:08b}" for byte in data)
    crc = 0
    for bit in body:
        crc = (crc << 1 ^ (0x4599 if (crc >> 14 & 1) != int(bit) else 0)) & 0x7FFF
    sent = ""
    for bit in body + f"{crc:015b}":
        sent += bit
        if sent[-5:] in ("00000", "11111"):
            sent += "10"[int(bit)]
    return len(sent) + 13


def told(log, *whats):
    return [line for line in log if line[1] in whats]


def test_it_tries_until_somebody_is_there(tmp_path):
    _, log = play(tmp_path, [can(0.2, "081#")], 0.3)
    assert [line[1:] for line in told(log, "unheard", "tx")][:2] == [("unheard", "705", "00"), ("tx", "705", "00")]
    assert not told(log, "off"), "alone it goes no further than error passive"



@pytest.mark.parametrize("kbit", (20, 50, 125, 250, 500, 800, 1000))
def test_a_frame_takes_its_bits(kbit, tmp_path):
    """What others send at once when the bus is free; and the answer, with at most 1.5 ms of the thread's before it."""
    _, log = play(tmp_path, [can(0.2, "081#"), can(0.25, UPLOAD)], 0.3, f"set can_kbit {kbit}")
    asked, answer = (next(line for line in log if line[1] == what and line[2] == identifier)
                     for what, identifier in (("rx", "605"), ("tx", "585")))
    assert answer[3] == "4300100092010200"
    bit_s = 1e-3 / kbit
    assert asked[0] - 0.25 == pytest.approx(bits(0x605, bytes.fromhex(UPLOAD[4:])) * bit_s, abs=1e-7)
    answered_s = bits(0x585, bytes.fromhex(answer[3])) * bit_s
    assert answered_s < answer[0] - asked[0] < answered_s + 1.5e-3


def test_a_broken_frame_comes_again_and_only_once(tmp_path):
    steps = [can(0.2, "081#"), event(0.22, "can_break", "3"), can(0.25, UPLOAD)]
    _, log = play(tmp_path, steps, 0.3)
    answers = [line[1] for line in log if line[2:3] == ("585",)]
    assert answers == ["broken"] * 3 + ["tx"] and not told(log, "off")


@pytest.mark.parametrize("recovers", (0, 1))
def test_bus_off_ends_by_itself_only_if_it_shall(recovers, tmp_path):
    """By hand it comes back when a parameter is set."""
    steps = [can(0.2, "081#"), event(0.22, "can_break", "32"), can(0.25, UPLOAD)]
    steps += [] if recovers else [{"t_s": 0.3, "console": "set can_recover 1"}, can(0.35, UPLOAD)]
    _, log = play(tmp_path, steps, 0.4, f"set can_recover {recovers}")
    answers = [line[1] for line in log if line[2:3] == ("585",)]
    off_s = told(log, "off")[0][0]
    broken = answers.count("broken")
    assert answers[:broken] == ["broken"] * broken and broken >= 16  # alone at first, it has 128 errors already, of 256
    if recovers:
        assert told(log, "on")[0][0] - off_s == pytest.approx(128 * 11 * 2e-6, rel=0.01) and answers[broken:] == ["tx"]
        assert any(line[1:3] == ("tx", "085") and line[3].startswith("4081") for line in log), "EMCY 8140"
    else:
        assert answers[broken:] == ["tx"] and [line[0] > 0.35 for line in log if line[1:3] == ("tx", "585")] == [True]


def test_a_burst_comes_in_order_and_none_is_lost(tmp_path):
    """24 writes back to back at 1 Mbit/s, each 0x6060 or 0x6098: answered in the order in which they were asked."""
    asked = [f"605#{'2f' if n % 3 else '40'}{'6060' if n % 2 else '9860'}00{3 if n % 2 else 0x22:02x}000000" for n in range(24)]
    _, log = play(tmp_path, [can(0.2, "081#"), *(can(0.25, frame) for frame in asked)], 0.3, "set can_kbit 1000")
    answers = [line[3] for line in log if line[1:3] == ("tx", "585")]
    assert [(answer[:2] == "60", answer[2:6]) for answer in answers] == [
        (frame[4:6] == "2f", frame[6:10]) for frame in asked]


MASTER = [can(0.2, "081#"), *(can(0.25 + 0.01 * n, f"605#2b406000{word:02x}000000") for n, word in enumerate((6, 7, 15))),
          can(0.24, "605#23ff6000e8030000")]


def operating(more, end_s):
    start = [can(0.21, "000#0105"), *MASTER]
    return start + more, end_s


def test_a_cut_cable_is_a_lost_master_and_a_controlled_stop(tmp_path):
    beats = [can(0.22, "605#2316100164007f00"), *(can(0.23 + 0.05 * n, "77f#05") for n in range(24))]
    steps, end_s = operating([*beats, event(1.2, "can_cut", "1")], 2.0)
    result, log = play(tmp_path, steps, end_s)
    trace = result.trace
    before = trace["speed_rad_s"][trace["t_s"] < 1.2][-1] * 60 / 6.2832
    assert before == pytest.approx(1000, rel=0.02)
    assert "fault: master lost" in result.console or re.search(r"master lost", result.console)
    assert abs(trace["speed_rad_s"][-1]) * 60 / 6.2832 < 30 and not told(log, "off")


@pytest.mark.parametrize("frame", ("001#", "7ff#ffffffffffffffff"))
def test_a_babbling_neighbour_changes_nothing(frame, tmp_path):
    """The bus is full for a quarter of a second while the motor turns: it turns on, and answers what is meant for it."""
    babble = [can(0.8 + 0.0002 * n, frame) for n in range(1200)]
    steps, end_s = operating([*babble, can(0.9, UPLOAD)], 1.2)
    result, log = play(tmp_path, steps, end_s)
    trace = result.trace
    steady = trace["speed_rad_s"][trace["t_s"] > 0.75] * 60 / 6.2832
    assert not trace["fault"].any() and steady.min() > 980 and steady.max() < 1020
    assert [line for line in log if line[1:3] == ("tx", "585") and line[0] > 0.9]


def test_the_design_leaves_the_controller_out_of_reset():
    assert int(CAN_DESIGN["design 0x48"], 16) >> 13 & 1 == 0


CYCLE_COUNTS = 20                # 300 rpm of 4000 counts a turn
CSP_S, CSP_SECONDS = 1.2, 4.5  # when the set-points begin; in that time the two clocks meet once


def sdo(t_s, index, sub, value, size=4):
    return can(t_s, f"605#{ {1: '2f', 2: '2b', 4: '23'}[size] }{index & 0xFF:02x}{index >> 8:02x}{sub:02x}"
                    f"{value.to_bytes(4, 'little').hex()}")


def cycles(every_s, seconds):
    """SYNC, a set-point that acts with it, a control word; two TPDOs come back. Up to speed, then straight on."""
    frames, places, place = [], [], 0.0
    for n in range(int(seconds / every_s)):
        place += CYCLE_COUNTS * min(1, n * every_s / 0.3)
        places.append(round(place))
        t_s, target = CSP_S + n * every_s, round(place).to_bytes(4, "little").hex()
        frames += [can(t_s, "080#"), can(t_s + 0.00012, f"405#0f00{target}"), can(t_s + 0.0003, "205#0f00")]
    return frames, np.array(places)


@pytest.mark.parametrize("every_s", (1e-3, 1.0003e-3, 0.9997e-3))
def test_csp_by_sync_each_millisecond_loses_no_set_point(every_s, tmp_path):
    """At 1 Mbit/s, four PDOs a cycle; a master's clock may be 300 ppm off."""
    setup = [sdo(0.21, 0x6060, 0, 8, 1), sdo(0.22, 0x1402, 1, 0x80000405), sdo(0.225, 0x1402, 2, 1, 1),
             sdo(0.23, 0x1402, 1, 0x405), sdo(0.24, 0x1802, 1, 0x40000385), sdo(0.245, 0x1803, 1, 0x40000485),
             can(0.26, "000#0105"),
             *(can(0.27 + 0.01 * n, f"205#{word:02x}00") for n, word in enumerate((6, 7, 15)))]
    frames, places = cycles(every_s, CSP_SECONDS)
    result, log = play(tmp_path, [can(0.2, "081#"), *setup, *frames], CSP_S + CSP_SECONDS, "set can_kbit 1000",
                       "set cyclic_ms 1")
    trace = result.trace
    reference = np.unwrap(trace["count_fw"], period=4000) + trace["following_counts"]
    reference -= reference[np.searchsorted(trace["t_s"], CSP_S - 0.01)]
    steady = (trace["t_s"] > CSP_S + 0.5) & (trace["t_s"] < CSP_S + CSP_SECONDS - 0.01)
    cycle = np.interp(reference[steady], places, np.arange(len(places)))
    late = (trace["t_s"][steady] - CSP_S) / every_s - cycle
    print(f"set-points {late.mean() - 0.5:.2f} cycles late, +-{(np.ptp(late) - 1) / 2:.3f}; following error at most "
          f"{np.abs(trace['following_counts'][steady]).max():.0f} counts")
    assert np.ptp(late) < 1.5, "a value a millisecond is a cycle wide by itself: the rest is jitter"
    assert not trace["fault"][steady].any()
    assert np.abs(trace["following_counts"][steady]).max() < CYCLE_COUNTS, "less than one that is lost"
    irqs = load_irqlog(result.irqlog)
    loop = irqs["exception"] == CURRENT_LOOP
    busy, quiet = (loop & when for when in (irqs["t_s"] > CSP_S + 0.1, (irqs["t_s"] > 0.1) & (irqs["t_s"] < 0.2)))
    spreads = [np.ptp(irqs["start_ns"][rows]) for rows in (busy, quiet)]
    print(f"current loop: {irqs['cycles'][busy].max():.0f} cycles at most, begins {spreads[0]:.0f} ns apart; without a frame "
          f"{spreads[1]:.0f}")
    assert irqs["cycles"][busy].max() <= irqs["cycles"][quiet].max() and spreads[0] < 500
    answers = [sum(line[1:3] == ("tx", identifier) for line in log) for identifier in ("385", "485")]
    assert min(answers) >= len(places) - 2
