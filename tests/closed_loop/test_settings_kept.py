# SPDX-License-Identifier: MIT
"""Settings over power-off, with the whole image: saved, a cut in the midst of it, loaded by themselves, and with them what was
learned of the encoder.

Every write of a save is cut in tests/unit/test_settings_damage.py. Here are samples of them, and what only the whole drive can
show.
"""
import re
from pathlib import Path

import numpy as np
import pytest
from launcher import LauncherError, simulate
from launcher.probes import code_of

from rigs.settings import PARAMETER, number, parse, record, slot

PAGE = 128
# writes to the controller's registers for a page, and which of them begin its commands
WRITES, PROGRAM, VERIFY = 38, 36, 37


def play(tmp_path, envm, steps, end_s, plant="ideal", design=(), **more):
    """Nothing is typed but `steps`: (seconds, line) or (seconds, event, arguments...)."""
    plan = [{"t_s": t_s, "console": what} if not arguments and " " in f"{what} " and what not in EVENTS
            else {"t_s": t_s, "event": what, "args": list(arguments)} for t_s, what, *arguments in steps]
    return simulate({"key": "kept", "title": "kept", "end_s": end_s, "step": plan, "expect_refusal": ".*", **dict(design)},
                    out_dir=tmp_path, plant=plant, spread=0, envm=envm, **more)


EVENTS = ("power_cut", "watchdog_reset", "end")


def typed(lines, begin_s, every_s=0.02):
    return [(begin_s + every_s * n, line) for n, line in enumerate(lines)]


def lives(result):
    """What was said in each life of the program."""
    return result.console.split("'help' lists the commands")[1:]


def log(result):
    return (result.out_dir / "qemu.log").read_text()


def store(path, offset, content):
    """A file as the twin keeps it (qemu/twin/envm_file.c), with a slot's bytes from that offset on."""
    pages = b"".join(np.array([(offset + at) // PAGE, 1, 0], "<u4").tobytes() + content[at:at + PAGE].ljust(PAGE, b"\0")
                     for at in range(0, len(content), PAGE))
    path.write_bytes(b"mssenvm1" + pages)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """What a device keeps that has been saved once."""
    folder = tmp_path_factory.mktemp("saved")
    play(folder, folder / "envm", typed(["set ramp_rpm_s 1111", "save"], 0.02), 0.2)
    return (folder / "envm").read_bytes()


def test_a_save_outlives_a_reset_a_cut_and_the_end_of_the_run(tmp_path):
    envm = tmp_path / "envm"
    result = play(tmp_path, envm, [
        *typed(["set ramp_rpm_s 1234", "reaction limit_cycle warn", "save"], 0.02), (0.3, "watchdog_reset"),
        *typed(["get --changed", "clear", "set ramp_rpm_s 4321", "save"], 0.32), (0.64, "power_cut"),
        *typed(["get --changed", "reaction"], 0.66)], 0.8)
    first, second, third = lives(result)
    assert "settings: none stored, initial values" in first and "slot A, save 1;" in first
    assert "settings: slot A, save 1, loaded" in second and "set ramp_rpm_s 1234" in second
    assert "settings: slot B, save 2, loaded" in third and "set ramp_rpm_s 4321" in third
    assert "limit cycle: warn" in third
    assert "has waited" not in log(result), "the core must not need the eNVM while a page is programmed"
    again = play(tmp_path / "again", envm, typed(["get --changed", "version"], 0.02), 0.1)
    assert "settings: slot B, save 2, loaded" in again.console and "set ramp_rpm_s 4321" in again.console
    assert again.trace["t_s"][0] < 1.6e-3, "the PWM does not wait for the settings"
    assert play(tmp_path / "other", "", typed(["version"], 0.02), 0.06).console.count("none stored") == 1


def test_the_slow_loop_and_the_watchdog_bear_a_save(tmp_path):
    """No fault, no reset, and the PWM's interrupt takes up again; with pages that take as long as may be."""
    result = play(tmp_path, "", [*typed(["save"], 0.02), (1.0, "status"), (1.05, "fault")], 1.2, envm_model={"program_s": 0.04})
    assert len(lives(result)) == 1 and "save 1;" in result.console and "fault: none" in result.console
    assert re.search(r"up: 0\.\d+ s", result.console), "its clock stands while a page is programmed"
    late = play(tmp_path / "late", "", [*typed(["save", "fault"], 0.02, 0.2)], 0.4, envm_model={"program_s": 0.08})
    assert "error: eNVM: programming a page did not end in time" in late.console
    assert len(lives(late)) == 1 and "fault: none" in late.console


def test_a_page_that_does_not_end_is_ended_by_the_watchdog(tmp_path, saved):
    """What would tell of it waits for the eNVM, too. The next life has what was stored before. With a watchdog that is faster
    than the page; with one of 32.2 s the drive would only say that the page did not end in time."""
    (tmp_path / "envm").write_bytes(saved)
    result = play(tmp_path, tmp_path / "envm", [*typed(["set ramp_rpm_s 2222", "save"], 0.02), (0.2, "get ramp_rpm_s")], 0.3,
                  envm_model={"program_s": 0.5}, design={"watchdog_s": 0.1})
    found = lives(result)
    assert len(found) == 2 and "fault: watchdog reset" in found[1] and "ramp_rpm_s = 1111" in found[1]
    assert "slot A, save 1, loaded" in found[1]


@pytest.mark.parametrize("page, write, share, whole", [
    (2, PROGRAM, 0.3, 1), (0, VERIFY, 0.9, 2), (2, 20, 0.5, 1), (2, PROGRAM, 0.8, 1), (0, PROGRAM, 0.6, 1)])
def test_a_power_cut_in_the_midst_of_a_save(page, write, share, whole, tmp_path, saved):
    """In a page's words; in the first half and in the second of programming one; in the head; and behind it."""
    envm = tmp_path / "envm"
    envm.write_bytes(saved)
    pages = (len(saved) - 8) // (12 + PAGE)
    write += ((page or pages) - 1) * WRITES  # the head comes last
    result = play(tmp_path, envm, [*typed(["set ramp_rpm_s 2222", "set learn_rpm 22", "save"], 0.02),
                                   *typed(["get ramp_rpm_s", "get learn_rpm", "version"], 0.3)], 0.4,
                  envm_model={"cut_write": write, "cut_share": share})
    found = lives(result)
    assert len(found) == 2, "the power has failed"
    values = re.search(r"ramp_rpm_s = (\d+) .*learn_rpm = (\d+) ", found[1], re.S).groups()
    assert values == (("1111", "10"), ("2222", "22"))[whole - 1]
    slot_said = "ABx"[whole - 1]
    assert f"settings: slot {slot_said}, save {whole}, loaded" in found[1]
    assert ("warning: slot B is damaged" in found[1]) == (whole == 1)


def test_an_older_image_s_settings(tmp_path):
    """Other names, fewer of them; and a set that does not hold together."""
    envm = tmp_path / "envm"
    store(envm, 0x3C000, slot([record(PARAMETER, "ramp_rpm_s", number(2500)), record(PARAMETER, "dead_name", number(1))], 9))
    result = play(tmp_path, envm, typed(["get --changed", "version"], 0.02), 0.1)
    assert "settings: slot A, save 9, loaded" in result.console and "the first is dead_name" in result.console
    assert "set ramp_rpm_s 2500" in result.console
    store(envm, 0x3D000, slot([record(PARAMETER, name, number(value)) for name, value in (("ramp_rpm_s", 2500),
                                                                                          ("i_max_ma", 14999))], 9))
    refused = play(tmp_path, envm, typed(["get --changed", "version"], 0.02), 0.1).console
    assert "error: settings refused, nothing has changed: i_max_ma must be at most 85 %" in refused
    assert "ramp_rpm_s =" not in refused


OLDER = Path(__file__).parent / "older"  # its README says how the files were made
CHANGED = re.compile(r"^set (\w+) (-?\d+)$", re.M)
NEW = {"modbus_address": 1, "modbus_baud": 19200, "modbus_parity": 2, "can_node": 0, "can_kbit": 500,
       "can_recover": 0, "can_heartbeat_ms": 0, "friction_unm": 0, "hall_states": 513264,
       **{f"hall_edge_{n + 1}_cdeg": 6000 * n for n in range(6)},
       "injection_silent": 0, "direction": 0}  # to both images: initial values


def start_on(older, tmp_path):
    """Today's image on what an older one has stored: what it says at the start, what differs from the initial values, and what
    the older one's slot holds of parameters."""
    envm = tmp_path / "envm"
    envm.write_bytes((OLDER / older).read_bytes())
    said = play(tmp_path, envm, typed(["get --changed", "reaction", *(f"get {name}" for name in NEW)], 0.02), 0.4).console
    assert envm.read_bytes() == (OLDER / older).read_bytes(), "reading leaves it as it was"
    save, records = parse(slot_of(envm))
    assert save == 1
    stored = {name: int.from_bytes(value, "little", signed=True)
              for (kind, name), value in records.items() if kind == PARAMETER}
    return said, {name: int(value) for name, value in CHANGED.findall(said)}, stored


def slot_of(path):
    """The pages of a file of the twin's, in their order: here those of one slot."""
    raw = path.read_bytes()[8:]
    pages = sorted((int.from_bytes(raw[at:at + 4], "little"), raw[at + 12:at + 12 + PAGE])
                   for at in range(0, len(raw), 12 + PAGE))
    return b"".join(content for _, content in pages)


def test_what_the_first_image_that_could_save_has_stored(tmp_path):
    """Each parameter that it knew is taken, and those that have come since have their initial values; it says how many."""
    said, changed, stored = start_on("first.envm", tmp_path)
    assert "settings: slot A, save 1, loaded" in said and "passed over" not in said
    assert not set(NEW) & set(stored) and f"{len(NEW)} parameters are not stored and have their initial values" in said
    assert {name: stored[name] for name in changed} == changed and not set(NEW) & set(changed)
    assert changed == {"ramp_rpm_s": 1357, "speed_bw_hz": 41, "encoder_counts": 4096}
    assert {name: int(re.search(rf"{name} = (\d+) ", said)[1]) for name in NEW} == NEW
    assert "limit cycle: warn" in said


def test_what_an_image_with_other_names_has_stored(tmp_path):
    """What nobody knows any more is passed over, and said; what has a new name has its initial value."""
    said, changed, stored = start_on("renamed.envm", tmp_path)
    assert stored["teach_rpm"] == 33 and stored["home_push_pct"] == 44
    assert "settings: slot A, save 1, loaded" in said
    assert "2 stored records are unknown to this firmware and were passed over, the first is home_push_pct" in said
    assert f"{len(NEW) + 2} parameters are not stored and have their initial values" in said
    assert changed == {"ramp_rpm_s": 2468}, "neither learn_rpm nor home_pct"
    assert "over-speed: stop" in said


def test_nothing_is_programmed_while_the_bridge_is_on(tmp_path):
    envm = tmp_path / "envm"
    result = play(tmp_path, envm, [(0.02, "on"), *typed(["save", "load", "defaults"], 0.1)], 0.2)
    assert result.console.count("error: settings are saved only while the drive is off") == 1
    assert result.console.count("error: parameters can change only while the drive is off") == 2
    assert envm.read_bytes() == b"mssenvm1"


def test_the_index_is_back_and_the_drive_need_not_align(tmp_path):
    """Found by alignment, saved; after power-off the shaft is turned by hand past the index, and `on` knows the angle."""
    envm, rad_s = tmp_path / "envm", 40.0
    first = play(tmp_path, envm, [(0.02, "on"), (1.9, "speed 300"), (2.3, "speed 0"), (2.45, "off"), (2.7, "save")], 3.0,
                 plant="full", seed=3)
    assert "save 1;" in first.console, first.console
    second = play(tmp_path / "second", envm, [
        (0.03, "spin_rad_s", rad_s), (0.25, "spin_rad_s", 0.0), (0.27, "spin", "off"), (0.3, "on"), (0.7, "speed 300"),
        (0.9, "status")], 1.0,
        plant="full", seed=4)
    assert "settings: slot A, save 1, loaded" in second.console and "state: operation enabled" in second.console
    state, t_s = second.trace["state"], second.trace["t_s"]
    on = t_s[np.flatnonzero(state == code_of(second.enums["state"], "SWITCHED_ON"))[0]]
    running = t_s[np.flatnonzero(state == code_of(second.enums["state"], "OPERATION_ENABLED"))[0]]
    assert running - on < 0.45, "zeros 0.13 s, a look at the rotor as long, the pace 0.032; an alignment takes a second"
    rows = t_s > 0.8
    pole_pairs = second.drive.motor["electrical"]["pole_pairs"]
    off = np.angle(np.exp(1j * (second.trace["angle_fw_rad"][rows] - pole_pairs * second.trace["theta_mech_rad"][rows])))
    assert np.degrees(np.abs(off)).max() < 5


def test_the_file_is_looked_at(tmp_path):
    (tmp_path / "envm").write_bytes(b"something else")
    with pytest.raises(LauncherError, match="Invalid argument"):
        play(tmp_path, tmp_path / "envm", typed(["version"], 0.02), 0.1)
    with pytest.raises(LauncherError, match="there is no folder"):
        play(tmp_path, tmp_path / "no" / "envm", typed(["version"], 0.02), 0.1)
