# SPDX-License-Identifier: MIT
"""docs/guides/adding.md by itself: its blocks, put into a copy of the sources, build, and each addition does what it says."""
import ctypes
import os
import re
import shutil

import pytest

from guides.edits import PAGE, apply, copied, costs, edits
from guides.transcript import ROOT
from rigs.console import Operator
from rigs.drive import World
from rigs.guide_pages import shell
from rigs.identify_alone import begin, known, measuring, thought
from rigs.operating import Drive
from tools.pages import replaced
from unit.cinterface import Library

# tests that notice a place that was forgotten, or a page that is stale; they run in the copy
NOTICE = ("unit/test_params.py unit/test_modbus_page.py tools/test_states_page.py "
          "unit/test_messages.py::test_each_has_a_text_of_its_own "
          "unit/test_messages.py::test_each_refusal_and_hint_is_one_of_its_own "
          "unit/test_messages.py::test_each_fault_is_in_the_table_of_docs_faults "
          "unit/test_modbus.py::test_each_fault_has_a_code unit/test_settings.py::test_names_tell_the_records_apart_and_fit "
          "unit/test_console_line.py::test_the_page_has_every_command")


def test_the_page_says_what_each_addition_takes():
    assert replaced(PAGE, "costs", costs()) == PAGE, "tests/guides/edits.py writes it anew"


def test_each_place_is_there_once(tmp_path):
    copied(tmp_path, [edit.path for edit in edits()])
    changed = apply(tmp_path)
    assert len(changed) > 15


@pytest.mark.parametrize("text, complaint", (("one\ntwo\n", "0 times 'three'"), ("three\nthree\n", "2 times 'three'")))
def test_a_place_that_is_not_there_once_is_told(text, complaint):
    (edit,) = edits('```c\n// a.c, after "three": four\n```\n')
    with pytest.raises(AssertionError, match=complaint):
        edit.applied(text)


ABSOLUTE = 3  # angle_source


# ---- what was added, in use ------------------------------------------------------------------------------------------

def can_be_set_and_kept(c):
    operator = Operator(c)
    c.params_init(operator.axis.params)
    assert operator("get damp_rpm") == ["damp_rpm = 1000 rpm  (1...30000)"]
    assert operator("set damp_rpm 0") == ["error: damp_rpm must be 1...30000 rpm"]
    assert operator("set damp_rpm 400") == ["ok"] and operator("save")[0] == "ok" and operator("defaults") == ["ok"]
    assert operator.axis.params.damp_rpm == 1000
    operator("load")
    assert operator.axis.params.damp_rpm == 400


def mode_brakes(c):
    torques = {}
    for rpm in (-400, 0, 200, 400):
        w = Drive(c, rpm=rpm)
        assert w.command("damp", w.axis.params.i_max_ma + 1) == c.ERROR_BEYOND_I_MAX and w.mode == "SPEED"
        assert w.command("damp", 2000) == c.ERROR_NONE and w.mode == "DAMP"
        torques[rpm] = w.control()
        assert w.step() == "OPERATION_ENABLED" and w.mode == "DAMP"
    assert torques[0] == 0 and torques[400] == -torques[-400] < torques[200] < 0
    assert torques[400] == pytest.approx(-2000 / 23571 * 32768 * 0.4, abs=2)


def fault_is_raised_by_its_name(c):
    w = Drive(c, rpm=1001)
    w.axis.reactions.choice[c.FAULT_DAMPER] = c.REACTION_OFF
    c.supervision_begin(w.axis)
    for mode, reported in (("SPEED", False), ("DAMP", True)):
        w.axis.mode, w.axis.time_ms, w.axis.reports.count = w.mode_code(mode), 7, 0
        c.supervision_step(w.axis)
        causes = [report.cause for report in w.axis.reports.report[:w.axis.reports.count]]
        assert (c.FAULT_DAMPER in causes) == reported
    c.reaction_step(w.axis)
    assert w.axis.faults.cause == c.FAULT_DAMPER and list(w.axis.faults.detail) == [1001, 0]
    assert c.cia402_error_code(c.FAULT_DAMPER) == 0xFF16


def console_answers(c):
    operator = Operator(c)
    helped = operator("help")
    assert "damp A: brake what turns the shaft" in helped and len(helped) > 30
    assert [line for line in helped if line.startswith("resume: ")]
    assert operator("damp") == ["error: usage: damp A"] and operator("damp 2")[0].startswith("error: the drive is not in oper")
    operator.axis.state = c.AXIS_OPERATION_ENABLED
    operator.axis.params.i_max_ma = 10000
    assert operator("damp 2") == ["ok"] and any("mode: damp, " in line for line in operator("status"))
    assert operator("reaction damper warn")[0].startswith("error: ")
    operator.axis.state, operator.axis.faults.cause = c.AXIS_FAULT, c.FAULT_DAMPER
    assert "fault: damper" in operator.type(b"\r")
    assert operator("reaction damper warn") == ["ok"] and "damper: warn  (off, stop, warn)" in operator("reaction")
    assert operator("fault")[:3] == ["fault: damper", "found: 0 rpm", "look at: more current for damp, or a larger damp_rpm"]


def quick_stop_is_resumed(c):
    w = Drive(c, rpm=600)
    assert c.drive_resume(w.axis).error == c.ERROR_NOT_OPERATING
    w.axis.speed.ref_rpm_q16 = 600 << 16
    assert c.drive_quick_stop(w.axis).error == c.ERROR_NONE and w.step() == "QUICK_STOP"
    w.turn(600)
    assert c.drive_resume(w.axis).error == c.ERROR_NONE and w.step() == "OPERATION_ENABLED"
    assert w.mode == "SPEED" and w.fabric.gate.CONTROL == 1


def identify_knows_the_supply(c):
    d = begin(c)
    io = measuring(c, d, "SUPPLY")
    c.speed_loop_init(io.speed)
    c.speed_loop_tune(io.speed, d.tuning)
    io.loop.contents.vbus_q15 = 13670
    assert [c.identify_measure(d, io) for _ in range(64)] == [False] * 63 + [True]
    thought(c, d, "SUPPLY")
    millivolt = round(13670 / 32768 * d.params.v_range_mv)
    assert known(c, d, "SUPPLY") == (millivolt, round(millivolt / 100)) and d.step == c.IDENTIFY_STEP_INDUCTANCE
    assert ctypes.string_at(c.identify_step_name(c.IDENTIFY_STEP_SUPPLY)) == b"supply"


def absolute_encoder_starts_without_alignment(c):
    w = World(c)
    w.axis.params.angle_source, w.axis.params.zero_cdeg = ABSOLUTE, 9000
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
    assert w.step() == "SWITCHED_ON"
    w.axis.start.phase = c.START_FOLLOW  # its zeros are known, its wiring is right
    assert w.step() == "OPERATION_ENABLED" and w.axis.loop.source == c.LOOP_ENCODER
    assert w.axis.loop.angle_offset_q32 == 1 << 30 and w.axis.start.aligned


def absolute_encoder_is_an_encoder_to_all_others(c):
    """What an encoder may and must: position, a weakened field, a count fine enough, no turning start, identify."""
    def found(source):
        drive = Drive(c, angle_source=source, overmodulation=50, low_side_shunts=0)
        coarse = World(c, angle_source=source, encoder_counts=64, pole_pairs=5)
        turning, known = World(c, angle_source=source), World(c, angle_source=source)
        turning.axis.speed.speed_rpm_q4 = 1600
        return (drive.axis.tuning.weakens, drive.request("position"), c.switch_on_at_once(coarse.axis).error,
                c.switch_on_at_once(turning.axis).error, c.drive_identify(known.axis).error)
    encoder = found(0)
    assert encoder == (True, c.ERROR_NONE, c.ERROR_ENCODER_COARSE, c.ERROR_TURNING, c.ERROR_NONE)
    assert found(ABSOLUTE) == encoder != found(1)


def test_what_the_page_adds_builds_and_works(tmp_path):
    """With the objects of this build, as far as what was added leaves them fresh."""
    folder = tmp_path / "copy"
    shutil.copytree(ROOT, folder, ignore=lambda at, names: [
        name for name in names if name in (".git", "__pycache__") or (at == str(ROOT) and name.startswith("build"))])
    if os.environ["BUILD"] == "build":  # or dependencies would name other files
        for name in ("host", "arm", "fabric", "choices"):
            (shutil.copy2 if name == "choices" else shutil.copytree)(ROOT / "build" / name, folder / "build" / name)

    def run(line):
        result = shell(f"export BUILD=build; {line}", folder)
        assert result.returncode == 0, line + "\n" + result.stdout + result.stderr
    apply(folder)
    run("make -s build/tests/unit/firmware.so build/mssfoc.elf")
    for command in re.findall(r"`(/usr/bin/python3 \S+)`", PAGE):
        run(command)
    run("/usr/bin/python3 tests/tools/arrows.py build/arm/firmware")
    run("/usr/bin/python3 -m pytest -q -p no:cacheprovider " + " ".join(f"tests/{name}" for name in NOTICE.split()))
    c = Library(folder / "build/tests/unit/firmware.so")
    for works in (can_be_set_and_kept, mode_brakes, fault_is_raised_by_its_name, console_answers, quick_stop_is_resumed,
                  identify_knows_the_supply, absolute_encoder_starts_without_alignment,
                  absolute_encoder_is_an_encoder_to_all_others):
        works(c)
