# SPDX-License-Identifier: MIT
"""What the scope says at the console, to the letter: signals, settings, what a capture does, a record."""
import ctypes

import pytest

from rigs.scoped import SLOTS

CHOSEN = "signals: i_d,i_q,i_q_ref,vbus,speed,speed_ref,v_q,angle"  # at first
SCALES = {"i_a": "A 23571/32768", "vbus": "V 57528/32768", "count": "counts 1000/1", "v_q": "%_of_bus 100000/40000",
          "angle": "deg 45000/536870912", "turning": "Hz 312500/67108864", "speed": "rpm 1000/16", "target": "rpm 1000/65536",
          "winding": "degC 1000/16", "gate": "none 1000/1"}


@pytest.fixture(autouse=True)
def initial(scoped):
    scoped.c.params_init(scoped.axis.params)


def test_scope_text_lists_every_signal(c, scoped):
    table = (c.signal_info * ctypes.c_size_t.in_dll(c._library, "signal_count").value).in_dll(c._library, "signal_table")
    lines = scoped("scope list")
    assert [line.split(" ")[0] for line in lines] == [info.name.decode() for info in table] and len(lines) >= 24
    for line, info in zip(lines, table):
        name, text = info.name.decode(), c.signal_text(info.name).decode()
        assert line.endswith(f": {text}")
        if name in SCALES:
            assert line == f"{name} {SCALES[name]}: {text}"


def test_scope_text_of_the_settings(scoped):
    rest = ["capture: off, dropped: 0, late: 0", "kept from the last fault: 0 samples, one a millisecond"]
    assert scoped("scope") == [f"{CHOSEN}, every: 1 samples of the current loop",
                               "trigger: never, before: 256 of 512 samples"] + rest
    scoped("scope signals i_q,speed"), scoped("scope every 7"), scoped("scope before 30")
    for when in ("above", "below", "rises", "falls"):
        assert scoped(f"scope trigger speed {when} -12.5") == ["ok"]
        assert scoped("scope") == ["signals: i_q,speed, every: 7 samples of the current loop",
                                   f"trigger: speed {when} -12.500 rpm, before: 30 of 2048 samples"] + rest
    assert scoped("scope trigger never") == ["ok"]
    assert scoped("scope")[1] == "trigger: never, before: 30 of 2048 samples"


@pytest.mark.parametrize("cause", ("by command", "by the signal", "by a fault"))
def test_scope_text_of_a_capture(c, scoped, cause):
    def state():
        return scoped("scope")[2]
    scoped.choose("speed", "time")
    scoped("scope before 0"), scoped("scope trigger speed above 10"), scoped("scope arm")
    scoped.scope.dropped, scoped.scope.late = 3, 4
    assert state() == "capture: waits for its trigger, dropped: 3, late: 4"
    if cause == "by command":
        scoped("scope fire")
    elif cause == "by a fault":
        scoped.axis.faults.cause = c.FAULT_STALL
    else:
        scoped.axis.speed.speed_rpm_q4 = 160
    scoped.tick()
    scoped.type(b"")
    assert state() == f"capture: triggered {cause}, dropped: 3, late: 4"
    scoped.tick(2048)
    assert state() == f"capture: done {cause}, dropped: 3, late: 4"
    scoped("scope off")
    assert state() == f"capture: done {cause}, dropped: 3, late: 4", "it is kept"


def test_scope_text_of_a_record(c, scoped):
    """Its heading, its signals, their scales, and each sample."""
    scoped.choose("sequence", "speed")
    scoped.axis.loop.loops_per_slow, scoped.axis.speed.speed_rpm_q4 = 40, -7
    scoped("scope before 5"), scoped("scope every 3"), scoped("scope arm")
    scoped.tick(30)
    scoped("scope fire")
    scoped.tick(3 * 2048)
    scoped.scope.dropped, scoped.scope.late = 1, 2
    scoped.c.host_watchdog_served.value = 0
    lines = scoped("scope read")
    assert lines[:3] == ["samples: 2048, trigger: 5, every: 3, a millisecond has: 40, dropped: 1, late: 2", "sequence speed",
                         "1000/1 1000/16"]
    assert lines[3:-1] == [f"{16 + 3 * n} -7" for n in range(2048)] and lines[-1] == "end: 2048"
    assert scoped.c.host_watchdog_served.value >= 2048, "it takes long, and the thread lives"


def test_scope_text_of_what_a_fault_left(c, scoped):
    """One a millisecond, none missing, however the captures were set."""
    scoped.choose("time")
    scoped("scope every 3")
    for _ in range(SLOTS):
        c.scope_step(scoped.scope)
    scoped.axis.faults.cause, scoped.scope.dropped, scoped.scope.late = c.FAULT_STALL, 1, 2
    c.scope_step(scoped.scope)
    scoped.type(b"")
    lines = scoped("scope fault")
    assert lines[:3] == ["samples: 64, trigger: 63, every: 1, a millisecond has: 1, dropped: 0, late: 0", "time", "1000/1"]
    assert len(lines) == 3 + 64 + 1 and scoped("scope")[3] == "kept from the last fault: 64 samples, one a millisecond"
