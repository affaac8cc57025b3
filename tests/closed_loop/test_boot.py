# SPDX-License-Identifier: MIT
"""What start-up finds: each with a name, the bridge off, `on` refused; and what the fabric is not touched for.

The board is changed while the drive runs, and a reset brings the change into effect, as a power-on would.
"""
import re
import sys

import pytest

from launcher import LauncherError, simulate
from launcher.qemu import chip_items

RESET_S = 0.1
AFTER_S = RESET_S + 0.05
FACC1, WDOG_CR, WDOG_CR_AT = "0x98", "0x6C", "0x4003806C"
GATE_ID = "0x308"  # in the fabric
CHIPS = ("m2s010", "m2s025")
SOFT_RESET_CR, FABRIC_BIT = 0x40038048, 1 << 16
EVERY_COMMAND = ["status", "on", "speed 100", "torque 1", "quickstop", "off", "set ramp_rpm_s 1000", "fault", "clear", "on",
                 "off"]


def boot(tmp_path, changes=(), lines=("fault", "on", "clear", "on", "status"), reset="watchdog_reset", more=(), chip="",
         wired="", dumps=None, **design):
    """The console after the reset, and the result. `changes` are events just before it; `more` at their own times."""
    steps = [{"t_s": RESET_S - 0.001, "event": kind, "args": args} for kind, *args in changes]
    steps += [{"t_s": RESET_S, "event": reset, "args": []}] if reset else []
    steps += more
    steps += [{"t_s": AFTER_S + 0.1 * n, "console": line} for n, line in enumerate(lines)]
    end_s = AFTER_S + 0.1 * (len(lines) + 1)
    steps += [{"t_s": end_s - 1e-3, "event": "end", "args": []}]  # the trace has no rows while the PWM does not run
    result = simulate({"key": "boot", "end_s": end_s, "preamble_s": 0.002,
                       "step": sorted(steps, key=lambda step: step["t_s"]), "expect_refusal": ".*", **design},
                      out_dir=tmp_path, plant="ideal", spread=0, chip=chip, wired=wired, dumps=dumps)
    return result.console.split("'help' lists the commands")[-1], result


# What the device lacks stays a fault until it is mended and the device reset; `clear` says so.
LASTING = {
    "clock, another ratio": ([("flash_bits", FACC1, "0x4")], "clock", "the fabric is not touched"),
    "clock, from standby": ([("flash_bits", FACC1, "0x1000")], "clock", "the fabric is not touched"),
    "clock, PLL not locked": ([("pll_lost", "1")], "clock", "the fabric is not touched"),
    "clock, fabric's PLL not locked": ([("fabric_pll_lost", "1")], "clock", "the fabric is not touched"),
    "another design": ([("fabric_other", "1")], "fabric", "the fabric is not touched"),
    "watchdog only interrupts": ([("flash_bits", WDOG_CR, "3")], "watchdog off", "the cause is still there: the watchdog"),
    # the function that sets the guard returns at once
    "no stack guard": ([("poke_rom", "&device_guard_stack", "0x4770")], "stack guard", "the cause is still there: the stack"),
}


@pytest.mark.parametrize("case", LASTING)
def test_what_the_device_lacks_keeps_the_drive_off(case, tmp_path):
    changes, name, refusal = LASTING[case]
    said, result = boot(tmp_path, changes, reset="power_cut")
    assert f"fault: {name}\n" in said, said
    assert said.count("error: a fault is latched") == 2, said
    assert refusal in said and "state: fault" in said
    assert ("watchdog: off\n" in said) == case.startswith("watchdog")
    assert not result.trace["gates"].any()


LOCKED_OFF = {"design 0x6C": "0x0 0x3"}  # WDOG_CR 0, and no program can write it


def test_a_watchdog_that_nobody_may_switch_on_keeps_the_drive_off_and_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules["launcher.simulate"], "chip_items", lambda *chip: {**chip_items(*chip), **LOCKED_OFF})
    said, result = boot(tmp_path, reset=None, lines=("fault", "clear", "on", "status"))
    assert "fault: watchdog off\nlook at: start-up could not switch it on" in said and "watchdog: off\n" in said
    assert "the cause is still there: the watchdog" in said and not result.trace["gates"].any()


# what the design or a probe has left -> the reset behind it
LEFT_OFF = {"by the design": ([("flash_bits", WDOG_CR, "0")], "power_cut"), "by OpenOCD": ([], "openocd"),
            "by OpenOCD, and reset": ([("poke", WDOG_CR_AT, "0")], "soft_reset"),
            "by a program that ended": ([("poke", WDOG_CR_AT, "0")], "lockup_reset")}


@pytest.mark.parametrize("chip", CHIPS)
@pytest.mark.parametrize("case", LEFT_OFF)
def test_a_watchdog_that_was_left_off_is_on_again_and_bites(case, chip, tmp_path):
    """Also where traffic on FIC_0 puts the design's 0 back, again and again: M2S010. Then the thread hangs."""
    changes, reset = LEFT_OFF[case]
    lines = ["clear", "status", "on", *["version"] * 22, "status"]
    hangs_s = AFTER_S + 0.1 * len(lines)
    said, result = boot(tmp_path, changes, reset=reset, chip=chip, lines=[*lines, *["version"] * 3], watchdog_s=0.1, more=[
        {"t_s": hangs_s, "event": "poke_rom", "args": ["&idle", "0xE7FE"]},
        {"t_s": hangs_s + 0.11, "event": "poke_rom", "args": ["&idle", "*idle"]}])
    before = result.console.split("'help' lists the commands")[-2]
    assert before.count("watchdog: 0.100 s\n") == 2 and "state: operation enabled" in before, result.console
    assert "last reset by: watchdog" in said


# How the last life ended is a fault that can be cleared; then the drive starts.
PAST = {"watchdog_reset": "watchdog reset", "lockup_reset": "lock-up reset"}


@pytest.mark.parametrize("reset", PAST)
def test_how_the_last_life_ended_is_said_and_can_be_cleared(reset, tmp_path):
    said, _ = boot(tmp_path, reset=reset, lines=("fault", "on", "clear", "on", *["version"] * 23, "status"))
    assert f"fault: {PAST[reset]}\n" in said and said.count("error:") == 1, said
    assert "state: operation enabled" in said


def test_causes_that_ones_clear_are_told_one_by_one(tmp_path, monkeypatch):
    """And not that of the life before: a lock-up, cleared, then the watchdog."""
    monkeypatch.setattr(sys.modules["launcher.simulate"], "chip_items",
                        lambda *chip: {**chip_items(*chip), "design 0xB0": "0x0 0xFF"})
    said, _ = boot(tmp_path, reset="lockup_reset", lines=("fault", "status", "version", "fault"),
                   more=[{"t_s": AFTER_S + 0.25, "event": "watchdog_reset", "args": []}])
    assert "fault: watchdog reset\n" in said and "last reset by: watchdog\n" in said, said


@pytest.mark.parametrize("design, time_s", (({}, "32.212"), ({"watchdog_s": 0.1}, "0.100"), ({"watchdog_s": 50}, "50.000")))
def test_the_drive_takes_the_watchdog_as_the_design_has_it(design, time_s, tmp_path):
    """By default with the shortest time that the user guide allows."""
    said, _ = boot(tmp_path, reset=None, lines=("fault", "on", "status"), **design)
    assert "fault: none\n" in said and "is latched" not in said and f"watchdog: {time_s} s\n" in said


# event: what start-up calls the cause, and the fault
SAID = {"watchdog_reset": ("watchdog", "watchdog reset"), "lockup_reset": ("lock-up", "lock-up reset"),
        "soft_reset": ("software", "none"), "user_reset": ("the design", "none"), "power_cut": (None, "none")}


@pytest.mark.parametrize("chip", CHIPS)
@pytest.mark.parametrize("reset", SAID)
def test_after_each_reset_the_drive_is_back_and_says_why(reset, chip, tmp_path):
    """Within 100 ms of the reset, which is the start, too: the PWM runs again, and who types is answered."""
    cause, fault = SAID[reset]
    said, result = boot(tmp_path, reset=reset, lines=("fault", "status"), chip=chip)
    rows_s = result.trace["t_s"][result.trace["t_s"] > RESET_S + 1e-4]
    assert rows_s[0] < RESET_S + 0.1 and not result.trace["gates"].any()
    assert re.findall("last reset by: (.*)", said.split("> fault")[0]) == ([cause] if cause else [])
    assert f"fault: {fault}\n" in said and "state: " in said


def test_a_start_up_that_releases_nothing_has_no_fabric_after_a_warm_reset(tmp_path):
    """sysreg_release_reset() returns at once. At power-on nobody would notice."""
    mutant = ("poke_rom", "&sysreg_release_reset", "0x4770")
    for reset, fault in (("watchdog_reset", "fabric"), ("power_cut", "none")):
        said, _ = boot(tmp_path / reset, [mutant], reset=reset, lines=("fault",), chip="m2s025")
        assert f"fault: {fault}\n" in said


@pytest.mark.parametrize("wired, lives", (("held", 1), ("no_clock", 2)))
def test_a_fabric_without_reset_or_clock_is_said(wired, lives, tmp_path):
    with pytest.raises(LauncherError, match="has no samples"):  # its PWM never ran
        boot(tmp_path, reset=None, lines=("fault", "on"), wired=wired)
    said = (tmp_path / "console.txt").read_text().replace("\r", "")
    assert "fault: fabric\n" in said and "error: a fault is latched" in said
    assert ("last reset by: watchdog" in said) == (lives == 2)


@pytest.mark.parametrize("chip, held", zip(CHIPS, (FABRIC_BIT, 0)))
def test_only_on_the_smaller_device_traffic_puts_the_bit_back(chip, held, tmp_path):
    """After a warm reset start-up clears it. The drive does not mind that it comes back."""
    said, _ = boot(tmp_path, lines=("clear", *["version"] * 9, "status"), chip=chip, dumps={"held": (SOFT_RESET_CR, 4)})
    word = int.from_bytes((tmp_path / "held").read_bytes(), "little")
    assert word & FABRIC_BIT == held and "state: switch on disabled" in said


def test_a_chip_that_there_is_not(tmp_path, monkeypatch):
    for chip, variable in (("m2s150", ""), ("", "m2s150")):
        monkeypatch.setenv("CHIP", variable)
        with pytest.raises(LauncherError, match="CHIP 'm2s150' is neither m2s010, .* nor m2s025"):
            boot(tmp_path, chip=chip)


def test_where_traffic_can_take_the_fabric_away_each_restart_says_so(tmp_path):
    """An M2S010 whose fabric hangs on bit 16, which docs/fabric.md advises against: after a warm reset, and not before."""
    said, result = boot(tmp_path, chip="m2s010", wired="m2f", lines=("fault",) * 10)
    before, *lives = result.console.split("'help' lists the commands")[1:]
    assert "put back" not in before and "last reset by: watchdog" in lives[0] and len(lives) > 2
    assert all("a block was put back into reset" in life for life in lives[1:])
    assert "fault: processor exception" in said


@pytest.mark.parametrize("reset", ("watchdog_reset", "power_cut"))
def test_a_reset_costs_what_power_on_costs(reset, tmp_path, monkeypatch):
    """In cycles, wherever the core was: what it had fetched ahead is gone. All that differs is what start-up keeps."""
    monkeypatch.setattr(sys.modules["launcher.simulate"], "chip_items", lambda *chip: {**chip_items(*chip), "time": "cycles"})
    _, result = boot(tmp_path, reset=reset, lines=("status",))
    first_s, behind_s = (result.trace["t_s"][result.trace["t_s"] > from_s][0] - from_s for from_s in (0, RESET_S + 1e-4))
    assert behind_s + 1e-4 == pytest.approx(first_s, abs=5e-5)


def test_power_on_is_no_fault(tmp_path):
    """It sets the bit of every cause: of a lock-up and of the watchdog, too."""
    said, _ = boot(tmp_path, reset="power_cut", lines=("fault", "on", *["version"] * 23, "status"))
    assert "fault: none\n" in said and "error:" not in said and "state: operation enabled" in said, said


@pytest.mark.parametrize("case", [case for case in LASTING if case.startswith("clock")])
def test_without_the_right_clock_no_register_of_the_fabric_is_touched(case, tmp_path):
    """Neither read nor written, whatever is typed."""
    changes, name, _ = LASTING[case]
    said, _ = boot(tmp_path, changes, lines=EVERY_COMMAND,
                   more=[{"t_s": RESET_S, "event": "fabric_sealed", "args": ["1"]}])
    assert f"fault: {name}\n" in said and "reference 0.000 rpm" in said


def test_with_another_design_the_identity_is_read_and_nothing_is_touched(tmp_path):
    """Once, however long the start takes; no other access."""
    said, _ = boot(tmp_path, [("fabric_other", "1")], lines=EVERY_COMMAND,
                   more=[{"t_s": RESET_S, "event": "fabric_sealed_behind", "args": [GATE_ID]}])
    assert "fault: fabric\n" in said and "reference 0.000 rpm" in said


@pytest.mark.parametrize("seal, behind", [("fabric_sealed", "1"), ("fabric_sealed_behind", GATE_ID)])
def test_the_seal_notices(seal, behind, tmp_path):
    with pytest.raises(LauncherError, match="sealed fabric is"):
        boot(tmp_path, more=[{"t_s": RESET_S, "event": seal, "args": [behind]}])


def test_a_fabric_that_does_not_answer_is_not_asked_twice(tmp_path):
    """The first life hangs in the first access, which the watchdog ends; the second one says so."""
    said, result = boot(tmp_path, [("fabric_hangs", "1")], lines=EVERY_COMMAND, reset=None)
    assert "fault: fabric\n" in said
    assert len(re.findall("'help' lists the commands", result.console)) == 2, "the life that hung has not come to it"
    again, _ = boot(tmp_path / "mended", [("fabric_hangs", "1")], lines=("version", "fault"), reset=None,
                    more=[{"t_s": AFTER_S + 0.01, "event": "fabric_hangs", "args": ["0"]},
                          {"t_s": AFTER_S + 0.02, "event": "watchdog_reset", "args": []}])
    assert "fault: watchdog reset\n" in again, "a reset looks again"


def test_a_processor_fault_with_a_fabric_in_doubt_leaves_it_alone(tmp_path):
    """An undefined instruction in the thread: the entry that switches off must not touch what may not answer."""
    said, result = boot(tmp_path, [("pll_lost", "1")], lines=("fault",), more=[
        {"t_s": RESET_S, "event": "fabric_sealed", "args": ["1"]},
        {"t_s": AFTER_S - 0.02, "event": "poke_rom", "args": ["&idle", "0xDE00"]},
        {"t_s": AFTER_S - 0.018, "event": "poke_rom", "args": ["&idle", "*idle"]}])
    assert "usage fault (6)" in said and "fault: clock\n" in said, result.console
