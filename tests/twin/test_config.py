# SPDX-License-Identifier: MIT
"""The twin's configuration: what each line sets, and that each that is wrong ends the run with one line that says so."""
import os
from functools import reduce

import pytest

from twin.bench import INVERTER, MOTOR, SENSORS, c

KEYS = [f"{table}.{key} {value}" for table, values in (("motor", MOTOR), ("inverter", INVERTER), ("sensor", SENSORS))
        for key, value in values.items()]
PROBE = "probe a 0x20000004 s16 0.5"


def written(tmp_path, lines, keys=(*KEYS,)):
    """The path of a file with these lines behind the keys of each axis."""
    path = tmp_path / "twin.cfg"
    path.write_text("\n".join([*keys, *(["axis 2", *keys, "axis 1"] if "axis 2" in lines else []), lines]))
    return bytes(path)


def of(config, path):
    """A member by its path: "axis[0].probes[0].bytes"."""
    return reduce(lambda value, step: value[int(step)] if step.isdigit() else getattr(value, step),
                  path.replace("[", ".").replace("]", "").split("."), config)


@pytest.mark.parametrize("lines, expected", [
    ("", {"axes": 1, "seed": 0, "end_s": 0, "watchdog_load": 0x1800000, "chip.part": "CHIP_M2S010",
          "chip.wiring": "WIRED_AS_ADVISED", "time_by_cycles": False, "count_instructions": False, "main_loop_wakes": False}),
    *((f"{word} a path of words", {f"{word}_path": b"a path of words"})
      for word in ("progress", "live", "irqlog", "envm", "bus_log", "can_log", "fabric")),
    ("# fabric no\n\n \t\nconsole c\r\nbus \t b", {
        "console_id": b"c", "bus_id": b"b", "fabric_path": None, "axis[0].csv_path": None}),
    ("trace t\naxis 2\ntrace u\ncsv v", {"axes": 2, "axis[0].trace_path": b"t", "axis[1].trace_path": b"u",
                                         "axis[1].csv_path": b"v", "axis[0].csv_path": None}),
    ("axis 2\naxis 1\ntrace t", {"axes": 2, "axis[0].trace_path": b"t", "axis[1].trace_path": None}),
    ("axis 2\nmotor.pole_pairs 7\ncycles.ppb 2", {"axis[1].plant.motor.pole_pairs": 7, "cycles.ppb": 2, "cycles.esram": 1}),
    ("dwt instructions", {"count_instructions": True}), ("time cycles", {"time_by_cycles": True}), ("dwt cycles", {}),
    ("time instructions", {"time_by_cycles": False}), ("wfi main_loop", {"main_loop_wakes": True}), ("wfi core", {}),
    ("can c bus", {"can_id": b"c", "can_slcan": False}), ("can c slcan", {"can_id": b"c", "can_slcan": True}),
    ("seed 9007199254740992", {"seed": 2**53}), ("seed 0", {}), ("end 1e6", {"end_s": 1e6}), ("end 1e-9", {"end_s": 1e-9}),
    ("watchdog 0x3FFFFFF", {"watchdog_load": 0x3FFFFFF}), ("watchdog 0", {"watchdog_load": 0}),
    ("chip m2s010", {"chip.part": "CHIP_M2S010"}), ("chip m2s025", {"chip.part": "CHIP_M2S025"}),
    *((f"fabric_wired {word}", {"chip.wiring": f"WIRED_{word.upper()}"})
      for word in ("core_reset_p", "m2f", "held", "no_clock")),
    ("irqpath 50 p q", {"irqpath_exception": 50, "irqpath_path": b"p q"}),
    ("design 0x48 0xFFFFFFFF\ndesign 8 2 3", {
        "design_count": 2, "design[0].offset": 0x48, "design[0].word": 2**32 - 1, "design[0].fixed": 0, "design[1].fixed": 3}),
    ("dump 0x20000000 0x100000 p\ndump 4294967295 \t 0  q r ", {
        "dump_count": 2, "dumps[0].address": 0x20000000, "dumps[0].bytes": 1 << 20, "dumps[0].path": b"p",
        "dumps[1].address": 2**32 - 1, "dumps[1].bytes": 0, "dumps[1].path": b"q r "}),
    *((f"probe p 16 {sign}{8 * size} -2", {
        "axis[0].probes[0].name": b"p", "axis[0].probes[0].address": 16, "axis[0].probes[0].bytes": size,
        "axis[0].probes[0].is_signed": sign == "s", "axis[0].probes[0].scale": -2}) for sign in "su" for size in (1, 2, 4)),
    ("event 2 end\naxis 2\nevent 1 lock 1\nevent 2 lock 0\nevent 0 lock 0", {
        "event_count": 4, "events[0].t_s": 0, "events[1].t_s": 1, "events[1].axis": 1, "events[2].t_s": 2,
        "events[2].kind": "EVENT_END", "events[2].axis": 0, "events[3].kind": "EVENT_LOCK"}),
    ("console c\nevent 1000000 console speed  5", {"events[0].text": b"speed  5", "events[0].t_s": 1e6}),
    (f"{PROBE}\nprobe b 0 u8 1\nafter b=1,-2,3,4 0.5 end", {
        "late_count": 1, "late[0].probe": 1, "late[0].count": 4, "late[0].values[1]": -2, "late[0].values[3]": 4,
        "late[0].event.t_s": 0.5, "late[0].event.kind": "EVENT_END"})])
def test_what_a_line_sets(tmp_path, lines, expected):
    config = c.config()
    c.config_load(config, written(tmp_path, lines), False)
    for path, value in expected.items():
        assert of(config, path) == (getattr(c, value) if isinstance(value, str) else value), path
    assert config.axis[0].plant.motor.pole_pairs == 4 and config.axis[0].plant.seed == config.seed
    assert config.axis[0].plant.seed != config.axis[1].plant.seed


def said(path, motor_only=False):
    """(status, its lines on stderr) of a process that loads it."""
    there, here = os.pipe()
    config, load = c.config(), c.config_load  # found before the fork: an error in the child would go on with the tests
    child = os.fork()
    if child == 0:
        os.dup2(here, 2)
        load(config, path, motor_only)
        os._exit(0)
    os.close(here)
    with os.fdopen(there) as stream:
        text = stream.read()
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), text.splitlines()


REFUSED = [
    *((word, f"'{word}' needs a value") for word in ("trace", "axis", "seed", "motor.flux_wb")),
    ("seed \t", "'seed' needs a value"), ("engine 1", "unknown item 'engine'"),
    ("motor.flux 1", "unknown key 'motor.flux'"), ("motor.flux_wb 1 2", "motor.flux_wb takes one value"),
    *((f"sensor.adc_bits {word}", f"adc_bits: '{word}' is not a number") for word in ("x", "12x", "nan", "inf", "1e999")),
    *((f"cycles.ppb {word}", f"cycles.ppb: {word} is outside 0...100") for word in ("-0.001", "100.001")),
    *((f"seed {word}", f"seed: '{word}' is not a whole number from 0") for word in ("-1", "0.5", "9007199254740994")),
    *((f"end {word}", f"end: {word} is outside 0...1e6 s") for word in ("0", "-1", "1000000.1")),
    ("watchdog 0x4000000", "watchdog: 0x4000000 is outside 0...0x3ffffff"),
    *((f"watchdog {word}", f"watchdog: '{word}' is not a number of 32 bits") for word in ("-1", "4294967296", "1k")),
    ("axis 3", "axis: '3' is neither 1 nor 2"), ("dwt no", "dwt: 'no' is neither cycles nor instructions"),
    ("time no", "time: 'no' is neither instructions nor cycles"), ("wfi no", "wfi: 'no' is neither core nor main_loop"),
    ("can c no", "can: 'no' is neither bus nor slcan"), ("can c", "can: '' is neither"),
    ("chip m", "is neither m2s010 nor m2s025"),
    ("fabric_wired no", "fabric_wired: 'no' is none of core_reset_p, m2f, held, no_clock"),
    ("irqpath 50", "expected: irqpath EXCEPTION PATH"), ("irqpath x p", "irqpath: 'x' is not a number of 32 bits"),
    ("design 1", "expected: design OFFSET WORD"), ("design 1 2 3 4", "expected: design"),
    ("design 1 2 x", "design: 'x' is not a number"),
    ("dump 0 4", "expected: dump ADDRESS BYTES PATH"), ("dump 0 1048577 p", "dump: at most 1048576 bytes"),
    ("dump 4294967296 4 p", "dump: '4294967296' is not a number of 32 bits"),
    *((f"probe {words}", "expected: probe NAME ADDRESS TYPE SCALE")
      for words in ("a 0 u8", "a 0 u8 1 2", "a,b 0 u8 1", '"a 0 u8 1')),
    ("probe a 0x100000000 u8 1", "probe a: '0x100000000' is not an address"), ("probe a 4x u8 1", "'4x' is not an address"),
    ("probe a 0 u64 1", "probe a: unknown type 'u64'"), ("probe a 0 u8 x", "a: 'x' is not a number"),
    *((f"event {t_s} end", "the time of an event is 0...1e6 s") for t_s in ("-0.001", "1000000.1")),
    ("event x end", "time of the event: 'x' is not a number"), ("event 1 dance", "dance"),
    ("event 1 lock", "expected: lock 0|1"), (f"{PROBE}\nafter b=1 0 end", "after: there is no probe 'b' yet"),
    (f"{PROBE}\naxis 2\nafter a=1 0 end", "no probe 'a' yet"), (f"{PROBE}\nafter a 0 end", "expected: after PROBE=VALUE"),
    (f"{PROBE}\nafter a=1,2,3,4,5 0 end", "after: at most 4 values"),
    (f"{PROBE}\nafter a=1 -1 end", "the time of an event is"), (f"{PROBE}\nafter a=1 0 lock", "expected: lock 0|1")]
INCOMPLETE = [
    ("event 1 console on", "a console event needs 'console CHARDEV_ID'"),
    (f"{PROBE}\nafter a=1 0 keys 0d", "a console event needs"),
    ("cycles.ppb 0.5", "cycles.ppb is a whole number"), ("sensor.adc_bits 11.5", "sensor.adc_bits is a whole number"),
    ("axis 2\nsensor.shunt 0.5", "axis 2: sensor.shunt is 0 or 1"), ("axis 2\nsupply", "'supply' needs a value"),
    ("inverter.supply_sinks 0.5", "inverter: supply_sinks"),
    ("axis 2\nmotor.pole_pairs 1.5", "axis 2: motor.pole_pairs is a whole"),
    ("sensor.modulators 1\nsensor.shunt 0", "sensor.modulators need 'fabric PATH'"),
    ("axis 2\nfabric f", "axis 2 has C models only"), ("motor.sat_a_d0 5", "motor.sat_")]


@pytest.mark.parametrize("lines, complaint", REFUSED)
def test_a_line_that_is_wrong(tmp_path, lines, complaint):
    path = written(tmp_path, lines)
    number = len(open(path, encoding="utf-8").read().split("\n"))
    status, (line,) = said(path)
    assert status == 1 and line.startswith(f"mssfoc twin: {path.decode()}:{number}: ") and complaint in line


@pytest.mark.parametrize("lines, complaint", INCOMPLETE)
def test_lines_that_do_not_go_together(tmp_path, lines, complaint):
    status, (line,) = said(written(tmp_path, lines))
    assert status == 1 and complaint in line


def test_what_is_missing(tmp_path):
    for key in ("motor.flux_wb", "inverter.vbus_v", "sensor.i_range_a"):
        for lines, of_axis in (("", ""), ("axis 2", "axis 2: ")):
            path = written(tmp_path, lines)
            text = open(path, encoding="utf-8").read()
            head, _, tail = text.rpartition(f"{key} ")
            (tmp_path / "twin.cfg").write_text(f"{head}#{tail}")
            for motor_only in (False, True):
                needed = not motor_only or key.startswith("motor.")
                status, lines_said = said(path, motor_only)
                assert (status, lines_said) == ((1, [f"mssfoc twin: {path.decode()}: {of_axis}missing key '{key}'"]) if needed
                                                else (0, []))
    (status, (line,)) = said(bytes(tmp_path / "none"))
    assert status == 1 and line.endswith("none: cannot read: No such file or directory")
