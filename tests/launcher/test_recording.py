# SPDX-License-Identifier: MIT
"""Captures as files of other tools: read back by those, and by what their specifications say where those cannot be had."""
import json
import os
import struct
import subprocess
import sys

import numpy as np
import pytest
from mssfoc import recording
from mssfoc.capture import Capture

from scope import words

from rows import faults
from rigs.mdf import Mdf

T_S = np.arange(300) / 20000 - 0.005
COLUMNS = {"i_q": ("A", np.sin(T_S * 3000)), "angle": ("deg", np.arange(300) * 7.5 % 360),
           "state": ("", np.repeat([1, 4, 7], 100))}
TEXTS = {"state": {1: "switch on disabled", 4: "operation enabled", 7: "fault"}}
BEGUN_NS = 1_700_000_000_000_000_000


def test_mdf_has_every_sample_unit_and_word():
    read = Mdf(recording.mdf4(T_S, COLUMNS, TEXTS, BEGUN_NS))
    found = read.channels()
    assert read.begun_ns == BEGUN_NS and list(found) == ["time", *COLUMNS]
    for name, (unit, values) in {"time": ("s", T_S), **COLUMNS}.items():
        assert found[name][0] == unit and np.array_equal(found[name][1], values) and found[name][2] == TEXTS.get(name, {})


def records(data):
    """[(kind, content)] of MCAP."""
    assert data.startswith(recording.MAGIC) and data.endswith(recording.MAGIC)
    at, found = len(recording.MAGIC), []
    while at < len(data) - len(recording.MAGIC):
        kind, length = struct.unpack_from("<BQ", data, at)
        found.append((kind, data[at + 9:at + 9 + length]))
        at += 9 + length
    assert at == len(data) - len(recording.MAGIC)
    return found


def test_mcap_has_every_sample_and_word():
    found = records(recording.mcap(T_S, COLUMNS, TEXTS, BEGUN_NS))
    assert [kind for kind, _ in found] == [1, 3, 4] + 300 * [5] + [15, 2]
    assert b'"units"' not in found[1][1] and b'"i_q": "A"' in found[2][1]
    rows = [json.loads(content[22:]) for kind, content in found if kind == recording.MESSAGE]
    times = [struct.unpack_from("<HI2Q", content)[2] for kind, content in found if kind == recording.MESSAGE]
    for name, (_, values) in COLUMNS.items():
        assert [row[name] for row in rows] == values.tolist()
    assert {row["state_text"] for row in rows} == set(TEXTS["state"].values())
    assert times[0] == BEGUN_NS and np.diff(times) == pytest.approx(50000, abs=1)


def test_the_page_knows_the_words_of_states_and_faults():
    found = words.enumerations()
    assert found["state"][1] == "switch on disabled" and found["state"][7] == "fault" and len(found["state"]) == 8
    assert found["fault"][0] == "none" and found["fault"][faults()["STO_A"].number] == faults()["STO_A"].text


def test_a_capture_is_saved_by_the_ending_of_the_name(tmp_path):
    units, values = ({name: one[at] for name, one in COLUMNS.items()} for at in (0, 1))
    capture = Capture(T_S, values, units)
    for ending, begin in ((".csv", b"time_s,i_q [A],angle [deg],state\n"), (".mf4", b"MDF "), (".mcap", recording.MAGIC)):
        path = tmp_path / f"a{ending}"
        capture.save(path, TEXTS)
        assert path.read_bytes().startswith(begin)
    read = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1)
    assert np.array_equal(read[:, 0], T_S) and np.array_equal(read[:, 1], COLUMNS["i_q"][1])
    with pytest.raises(ValueError, match=r"\.csv, \.mf4, \.mcap"):
        capture.save(tmp_path / "a.xls")


THEIRS = """
import asammdf, mcap.reader, json, sys
read = asammdf.MDF(sys.argv[1])
raw = {name: read.get(name, raw=True) for name in sys.argv[3:]}
found = {name: [one.unit, one.samples.tolist(), one.timestamps.tolist()] for name, one in raw.items()}
words = sorted({str(word, "ascii") for word in read.get("state").samples})
rows = [json.loads(message.data) for _, _, message in mcap.reader.make_reader(open(sys.argv[2], "rb")).iter_messages()]
print(json.dumps([found, words, rows]))
"""


def test_asammdf_and_mcap_read_the_same(tmp_path):
    """Where they are installed for ASAMMDF_PYTHON or this Python: neither is in the distribution."""
    python = os.environ.get("ASAMMDF_PYTHON", sys.executable)
    if subprocess.run([python, "-c", "import asammdf, mcap.reader"], capture_output=True, check=False).returncode != 0:
        pytest.skip("asammdf and mcap are not installed: set ASAMMDF_PYTHON")
    for name, of in (("a.mf4", recording.mdf4), ("a.mcap", recording.mcap)):
        (tmp_path / name).write_bytes(of(T_S, COLUMNS, TEXTS, BEGUN_NS))
    done = subprocess.run([python, "-c", THEIRS, tmp_path / "a.mf4", tmp_path / "a.mcap", *COLUMNS], capture_output=True,
                          text=True, check=True)
    found, words, rows = json.loads(done.stdout)
    assert found == {name: [unit, values.tolist(), T_S.tolist()] for name, (unit, values) in COLUMNS.items()}
    assert words == sorted(TEXTS["state"].values())
    assert all([row[name] for row in rows] == values.tolist() for name, (_, values) in COLUMNS.items())
