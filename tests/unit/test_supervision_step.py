# SPDX-License-Identifier: MIT
"""Which part of the supervision has its turn in which millisecond, and what is looked at in every one."""
import pytest

from rigs.motor import Motor

FOREIGN = -12345


@pytest.fixture
def motor(c):
    def running(rpm=3000, i_a=4.0):
        m = Motor(c, rpm, i_a).step(600)
        c.fault_clear_warnings(m.axis.reports)
        m.axis.command_ms = m.axis.time_ms
        assert m.fault == "NONE"
        return m
    return running


def at_turn(m, turn):
    """The next step is this one."""
    while (m.axis.time_ms + 1) % 4 != turn:
        m.step()
    return m


TURNS = {"emf": (1,), "judge": (3,), "phases": (1, 3), "references": (0, 2), "speed": (0, 2), "voltage": (3,)}


@pytest.mark.parametrize("turn", range(4))
def test_supervision_step_has_its_turns(motor, turn):
    """While nothing is strange: what each part leaves is new in its turn, and in no other."""
    m = at_turn(motor(), turn)
    watch, axis = m.axis.supervision, m.axis
    watch.encoder.emf.expected_q15 = FOREIGN
    watch.encoder.against_ms = 2  # the EMF agrees: one less
    watch.phases.missing_q15[:] = (5, 5, 5)
    watch.phases.i_d_ref_q15 = FOREIGN if turn % 2 == 0 else 0
    watch.speed.speed_q4, watch.limited_ms = 3, 8
    m.step()
    seen = {"emf": watch.encoder.emf.expected_q15 != FOREIGN, "judge": watch.encoder.against_ms == 1,
            "phases": list(watch.phases.missing_q15) != [5, 5, 5], "speed": watch.speed.speed_q4 != 3,
            "references": turn % 2 == 0 and watch.phases.i_d_ref_q15 == axis.loop.i_d_ref_q15,
            "voltage": watch.limited_ms == 4}
    assert {name: turn in turns for name, turns in TURNS.items()} == seen and m.fault == "NONE"


@pytest.mark.parametrize("heat, name", (("winding", "OVERTEMPERATURE"), ("inverter", "INVERTER_OVERLOAD")))
def test_supervision_of_temperatures_in_each_fourth_millisecond(motor, heat, name):
    """At the limit nothing, beyond it a fault of its name; of a winding with its temperature."""
    m = motor()
    thermal = m.axis.thermal
    at = thermal.max_q4 if heat == "winding" else 2**20 + 2**20 // 20
    setattr(thermal, "winding_q4" if heat == "winding" else "inverter_q20", at)
    assert m.until_fault(8) is None
    at_turn(m, 0)
    setattr(thermal, "winding_q4" if heat == "winding" else "inverter_q20", at + 16)
    assert m.until_fault(8) == 4 and m.fault == name and m.axis.reactions.stopping
    assert list(m.axis.faults.detail) == ([thermal.max_q4 // 16 + 1, 0] if heat == "winding" else [0, 0])


def test_supervision_of_commands_in_each_fourth_millisecond(motor):
    """Silence as long as allowed is none; a millisecond more is, with how long it may last."""
    m = at_turn(motor(), 3)
    m.p.command_timeout_ms, m.axis.command_ms = 203, m.axis.time_ms + 1 - 203
    assert m.until_fault(1) is None
    assert m.until_fault(8) == 4 and m.fault == "COMMAND_TIMEOUT" and list(m.axis.faults.detail) == [203, 0]
    assert m.axis.reactions.stopping and m.fabric.gate.STATUS == 1, "a controlled stop"
    quiet = motor()
    quiet.p.command_timeout_ms = quiet.axis.command_ms = 0
    assert quiet.until_fault(8) is None, "0: nobody need speak"


@pytest.mark.parametrize("state, stops", (("OPERATION_ENABLED", True), ("QUICK_STOP", True), ("SWITCHED_ON", False),
                                          ("READY", None)))
@pytest.mark.parametrize("now_ms", (500, 2**32 + 40))
def test_supervision_of_the_thread(c, motor, state, stops, now_ms):
    """100 ms are borne; behind them it is a controlled stop, off where nothing can be controlled, and nothing while off."""
    m = motor()
    m.axis.state = getattr(c, f"AXIS_{state}")

    def after(away_ms, thread_ms=None):
        m.axis.time_ms = now_ms % 2**32
        m.axis.thread_ms = (now_ms - away_ms) % 2**32 if thread_ms is None else thread_ms
        m.axis.faults.cause, m.axis.reports.count = 0, 0
        c.supervision_step(m.axis)
        return [(r.cause, r.detail[0]) for r in m.axis.reports.report[:m.axis.reports.count]
                if r.cause == c.FAULT_THREAD_STOPPED]

    assert after(100) == [] and after(-1) == [], "the clock of the other axis may be ahead"
    assert after(0, thread_ms=0) == [], "it has not begun"
    assert after(101) == ([] if stops is None else [(c.FAULT_THREAD_STOPPED, 101)])
    if stops is not None:
        c.reaction_step(m.axis)
        assert m.fault == "THREAD_STOPPED" and bool(m.axis.reactions.stopping) == stops


@pytest.mark.parametrize("state, turn", [(state, turn) for state in ("OPERATION_ENABLED", "QUICK_STOP", "SWITCHED_ON", "READY")
                                         for turn in range(4)])
def test_supervision_of_the_speed_in_each_millisecond_with_the_bridge_on(c, motor, state, turn):
    m = at_turn(motor(), turn)
    m.axis.state = getattr(c, f"AXIS_{state}")
    m.axis.tuning.overspeed_w_q15 = m.axis.loop.pll.speed_q32 >> m.axis.loop.w_shift
    assert m.until_fault(1) is None
    at_turn(m, turn)
    m.axis.tuning.overspeed_w_q15 -= 2
    assert bool(m.until_fault(1)) == (state != "READY")
    assert m.fault == ("OVERSPEED" if state != "READY" else "NONE")


def test_supervision_step_without_an_encoder_looks_at_none(c, motor):
    """Nobody asks the encoder; all the rest has its turns."""
    for turn in range(4):
        m = at_turn(motor(), turn)
        m.axis.tuning.angle_source, encoder = 1, m.axis.supervision.encoder
        encoder.still_ms, encoder.emf.expected_q15, encoder.against_ms = 77, FOREIGN, 2
        m.step()
        assert (encoder.still_ms, encoder.emf.expected_q15, encoder.against_ms) == (77, FOREIGN, 2)


@pytest.mark.parametrize("turn", range(4))
@pytest.mark.parametrize("still_ms", (3, 4, 16))
@pytest.mark.parametrize("turns", (True, False))
def test_supervision_step_of_an_encoder_that_stands(motor, turn, still_ms, turns):
    """Its counts were due: from the fourth millisecond without any it is told, if the rotor turns."""
    m = at_turn(motor(3000, 4.0), turn)
    encoder = m.axis.supervision.encoder
    encoder.speed_moving_q32, encoder.still_ms = encoder.speed_q32, still_ms - 1
    encoder.speed_q32 = encoder.speed_before_q32 = m.shown_rpm = 0
    m.frozen, m.rpm = True, 3000 if turns else 0
    dead = turns and still_ms > 3
    assert bool(m.until_fault(1)) == dead and encoder.still_ms == still_ms
    assert m.fault == ("ENCODER_DEAD" if dead else "NONE") and encoder.stopped == (not turns and still_ms > 3)


@pytest.mark.parametrize("off, counts", ((0, False), (1, True)))
@pytest.mark.parametrize("axis, sign", (("d", 1), ("d", -1), ("q", 1), ("q", -1)))
def test_supervision_of_voltage_begins_beyond_a_tenth_of_the_largest_current(motor, axis, sign, off, counts):
    """A tenth of i_max may be missing while the modulator gives all it can; a step more counts. In its turn, by the ms."""
    m = at_turn(motor(), 3)
    loop, watch = m.axis.loop, m.axis.supervision
    m.axis.time_ms += 1
    m.look()
    loop.v_q_q15 = loop.radius_q15
    missing = m.axis.tuning.i_max_q15 // 10 + off
    setattr(loop, f"i_{axis}_q15", getattr(loop, f"i_{axis}_ref_q15") - sign * missing)
    m.c.supervision_step(m.axis)
    assert (watch.limited_ms == 4) == counts
