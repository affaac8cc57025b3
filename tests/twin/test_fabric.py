# SPDX-License-Identifier: MIT
"""Slots 1 and 3, ADC and GATE, in the plant, against docs/fabric.md; the watch over the program, the brake chopper, two plants
behind one fabric. That each block is the RTL's to the bit, whatever is written: tests/fabric/lockstep."""
import pytest

from twin.bench import ADC, CLOCK_PS, ENC, GATE, NEVER, PERIOD_PS, PWM, Plant, c, near, ps, signed

PERIOD_S = 50e-6
VBUS = 24 / 50 * 32768


# ---- slot 1: ADC ----

def test_conversion():
    p = Plant().to_trigger()
    assert p.read(ADC.CONTROL) == p.read(ADC.SEQUENCE) == 0, "ADC off: no conversion"
    assert c.plant_next_conversion_end(p.p) == NEVER
    p.write(ADC.CONTROL, -1)
    assert p.read(ADC.CONTROL) == 0xF
    p.write(ADC.CONTROL, 3)
    ends_at = p.next_trigger() + ps(1.5e-6)
    assert c.plant_next_conversion_end(p.p) == ends_at
    p.run(2.4e-6)
    assert c.plant_next_conversion_end(p.p) == ends_at
    assert p.read(ADC.STATUS) == p.read(ADC.VBUS) == 0 and not c.adc_interrupt(p.model.adc), "1.4 us after the trigger"
    p.run(0.2e-6)
    assert p.read(ADC.STATUS) == p.read(ADC.SEQUENCE) == 1 and c.adc_interrupt(p.model.adc), "1.6 us after it"
    assert p.read(ADC.VBUS) == near(VBUS, 8) and signed(p.read(ADC.IA)) == near(0, 16)
    p.write(ADC.CONTROL, 1)
    assert not c.adc_interrupt(p.model.adc), "no interrupt without IRQ_ENABLE"
    p.write(ADC.STATUS, 2)
    assert p.read(ADC.STATUS) == 1
    p.write(ADC.STATUS, 1)
    assert p.read(ADC.STATUS) == 0
    p.write(ADC.VBUS, 5)
    p.write(ADC.SEQUENCE, 5)
    assert p.read(ADC.VBUS) == near(VBUS, 8) and p.read(ADC.SEQUENCE) == 1


def test_overrun():
    p = Plant().to_trigger()
    p.write(ADC.CONTROL, 1)
    p.run(3e-6)
    p.sensors.current[0].stuck_code = 77  # so that the second set is another
    p.run(PERIOD_S)
    assert p.read(ADC.STATUS) == 3 and signed(p.read(ADC.IA)) == 16 * 77 - 32768, "newer results replace the older"
    assert p.read(GATE.STATUS) == 0x48 and p.gates == 0, "LOOP_LOST beside OVERRUN as it is"
    p.write(ADC.STATUS, 3)
    assert p.read(ADC.STATUS) == 0 and p.read(GATE.STATUS) == 0x8, "OVERRUN follows, the latch stays"
    p.write(GATE.STATUS, 0x8)
    p.run(2 * PERIOD_S)
    assert p.read(ADC.STATUS) == 3 and p.read(GATE.STATUS) == 0x40, "while LIVE is 0 it latches nothing"


def test_off_drops_what_is_under_way():
    p = Plant().to_trigger()
    p.write(ADC.CONTROL, 1)
    p.run(1.5e-6)
    p.write(ADC.CONTROL, 0)
    p.write(ADC.CONTROL, 1)
    p.run(10e-6)
    assert p.read(ADC.SEQUENCE) == 0


EOC, CURRENT, SUM, HIGH, LOW = 0x01, 0x10, 0x20, 0x40, 0x80


@pytest.mark.parametrize("register, value, flag, off", [
    (ADC.I_TRIP, 5000, CURRENT, 0x1FFFF), (ADC.SUM_TRIP, 5000, SUM, 0x1FFFF), (ADC.V_MAX, 5000, HIGH, 0x1FFFF),
    (ADC.V_MIN, 0x1FFFF, LOW, 0)])
def test_a_flag_in_the_plant(register, value, flag, off):
    """10 A on each sensor, 24 V: every conversion has the one flag."""
    p = Plant().to_trigger()
    for k in range(3):
        p.sensors.current[k].add_a = 10
    p.write(ADC.CONTROL, 1)
    p.write(register, value)

    def later(duration_s, expected):
        p.run(duration_s)
        assert p.read(GATE.STATUS) == expected
        p.write(ADC.STATUS, EOC)
    later(3e-6, 0x01 if flag == SUM else 0x81)
    p.run(49.6e-6)  # the second conversion, for a sum, has ended 0.1 us ago
    assert p.read(ADC.STATUS) == EOC | flag
    p.write(ADC.STATUS, 0xFF)
    p.write(GATE.STATUS, 0xFF)
    assert p.read(GATE.STATUS) == 0x81, "LIMIT, not cleared by writing; no latch, LIVE stays"
    for enable in (0, 1):
        p.write(GATE.CONTROL, enable)
        assert p.read(GATE.STATUS) == 0x80 | enable, "it shows while off, and does not hold back ENABLE"
    p.write(register, off)
    later(49.8e-6, 0x81)  # 0.1 us before the next conversion ends
    later(0.2e-6, 0x01)
    p.write(register, value)
    later(1e-6, 0x01)
    p.run(50e-6)
    p.write(ADC.STATUS, EOC)
    later(50e-6, 0x81)
    c.plant_reset_fabric(p.p)
    assert p.read(GATE.STATUS) == 0


# ---- slot 3: GATE ----

def test_six_gates_and_no_more():
    gate = c.gate()
    c.gate_reset(gate)
    c.gate_write(gate, 0x00, 1, 0)
    assert c.gate_follow(gate, 0x6A) == 0x2A


@pytest.mark.parametrize("first", (0, 1))
def test_an_input_of_safe_torque_off_asks_by_itself_and_both_should(first):
    """Two flip-flops, then as many clocks as the filter has; apart for longer than they may is told, until both ask."""
    s, clock = c.sto(longest=5, patience=20), 100
    (asks, apart) = (1, 2), 4
    c.sto_reset(s, clock)

    def changes(*pins):
        """{clock: what is asked for} from now on."""
        for pin, low in pins:
            c.sto_pin(s, pin, low, clock)
        seen = {}
        while (due := c.sto_due(s)) != NEVER and len(seen) < 9:
            c.sto_take(s, due)
            seen[due] = c.sto_asks(s)
        return {at: what for (at, what), before in zip(seen.items(), [0, *seen.values()]) if what != before}
    one, both = asks[first], 3
    assert changes((first, True)) == {108: one, 129: one | apart}
    clock = 200
    assert changes((1 - first, True))[208] == both | apart and c.sto_asks(s) == both
    clock = 300
    assert list(changes((0, False), (1, False)).values())[-1] == 0 and c.sto_asks(s) == 0


@pytest.mark.parametrize("latch", [c.GATE_DRIVER_FAULT, c.GATE_CLOCK_LOST])
def test_from_a_pin_to_the_switches(latch):
    p = Plant()
    p.run(1e-3)
    assert p.gates & 0x3F == 0x2A, "live in the valley: the low sides"
    c.plant_stop(p.p, latch, True)
    assert p.gates == p.inverter.gates == 0 and p.read(GATE.STATUS) & 0x1CFF == latch
    p.run(1e-4)
    c.plant_stop(p.p, latch, False)
    p.write(GATE.STATUS, latch)
    p.run(1e-4)
    assert p.gates == 0, "not by clearing alone"
    p.write(GATE.CONTROL, 1)
    assert p.gates == 0, "a dead time passes"
    p.run(2e-6)
    assert p.gates


def test_gate_status_shows_the_encoder():
    """What ENC.STATUS shows is in GATE.STATUS, and no more; no latch, LIVE stays."""
    p = Plant()
    p.run(1e-3)
    p.write(ENC.CONTROL, 1)
    e = p.model.encoder

    def status(register=None, value=None):
        if register:
            p.write(register, value)
        return p.read(GATE.STATUS)
    e.status |= 1
    assert status() == 0x01, "INDEX_SEEN is nothing wrong"
    c.encoder_illegal(e)
    assert status() == status(GATE.STATUS, 0x20) == 0x21 and p.read(ENC.STATUS) == 0x3, "not cleared here"
    p.write(GATE.CONTROL, 0)
    assert status(GATE.CONTROL, 1) == 0x21 and status(ENC.STATUS, 0x2) == 0x01
    c.encoder_cut(e, True)
    assert status() == status(ENC.STATUS, 0x4) == 0x21, "SIGNAL_LOST as long as it lasts"
    c.encoder_cut(e, False)
    assert status(ENC.STATUS, 0x4) == 0x01
    assert p.read(0x400) == 0, "slots end at 256 bytes"


# ---- the brake chopper ----

def chops_at(p, bus_v):
    p.inverter.p.vbus_v = bus_v  # the supply sinks and has little resistance
    for _ in range(5):
        p.run(0.4e-3)
        p.convert()
    return p.read(GATE.CHOPPER) >> 1 & 1


def test_chopper():
    def share(v):
        return int(v * 32768) // 50
    p = Plant(inverter={"chopper_ohm": 100})
    p.write(GATE.CONTROL, 0)  # it needs neither LIVE nor the legs
    assert p.read(GATE.CHOPPER_ON) == p.read(GATE.CHOPPER_OFF) == 0x7FFF
    p.write(GATE.CHOPPER_ON, 0xFFFF0000 | share(28))
    p.write(GATE.CHOPPER_OFF, share(26))
    assert p.read(GATE.CHOPPER_ON) == share(28) and not chops_at(p, 30), "not enabled"
    p.write(GATE.CHOPPER, 3)
    assert p.read(GATE.CHOPPER) == 1
    for bus_v, on in ((27, False), (30, True), (27.3, True), (25, False), (30, True)):
        assert chops_at(p, bus_v) == on
        p.run(1e-4)
        assert p.inverter.supply.chopper_on == on, "and so is the resistor"
    p.run(0.5e-3)
    assert p.read(GATE.CHOPPER) == 3, "0.6 ms after the last sample: still"
    p.run(0.1e-3)
    assert p.read(GATE.CHOPPER) == 1 and not p.inverter.supply.chopper_on, "0.7 ms after it: off"
    chops_at(p, 30)
    c.plant_stop(p.p, c.GATE_CLOCK_LOST, True)
    assert p.read(GATE.CHOPPER) == 1, "no clock, no chopping"


# ---- the winding's sensor ----

def thermometer(winding_c, **changes):
    t = c.thermometer()
    c.thermometer_init(t, c.motor_params(**{"temperature_sensor": 1, "temperature_lag_s": 2, **changes}), winding_c)
    return t


@pytest.mark.parametrize("winding_c, changes, code", [
    (0, {}, 800), (100, {}, 2400), (100.04, {}, 2401), (-80, {}, 1), (400, {}, 4095),
    (100, {"temperature_offset_k": -3}, 2400 - 48), (100, {"temperature_sensor": 0}, 0)])
def test_codes_of_the_winding_s_sensor(winding_c, changes, code):
    t = thermometer(winding_c, **changes)
    assert c.thermometer_code(t) == code
    c.thermometer_hold(t, 150)
    assert c.thermometer_code(t) == 3200
    c.thermometer_let_go(t)
    assert c.thermometer_code(t) == code


def test_its_lag():
    t = thermometer(20)
    for n in range(1, 4001):
        c.thermometer_follow(t, 120, n * 10 * PERIOD_PS)
    assert t.shown_c == near(120 - 100 * 2.718281828459045**-1, 1e-6)
    c.thermometer_follow(t, 120, 40000 * PERIOD_PS + ps(2))
    assert t.shown_c == near(120 - 100 * 2.718281828459045**-2, 1e-6), "whatever the steps"


def test_the_winding_s_sensor_in_the_plant():
    p = Plant(motor={"temperature_sensor": 1, "temperature_lag_s": 2, "ambient_c": 40, "winding_rise_k": 20}).to_trigger()
    p.write(ADC.CONTROL, 1)
    for later_s in (0, 2e-6, 1e-6):
        p.run(later_s)
        assert p.read(ADC.TEMP) == 0, "it follows the conversion"
    p.run(50e-6)
    p.write(ADC.TEMP, 5)
    assert p.read(ADC.TEMP) == near(800 + 60 * 16, 1), "and shows with the next one's results"
    p.motor.winding_c = 160
    p.run(0.1)
    expected_c = 160 - 100 * 2.718281828459045**-0.05
    assert p.read(ADC.TEMP) == near(800 + 16 * expected_c, 2)
    c.plant_reset_fabric(p.p)
    assert p.read(ADC.TEMP) == 0 and p.thermometer.shown_c == near(expected_c, 0.1), "which the sensor does not notice"


# ---- the watch over the program ----

STARTED, WATCHED, SLOW_KEY, THREAD_KEY = 1 << 31, 350_000, 0x5A17C300, 0xA5E83C00  # 3.5 ms
LIVE, LOOP_LOST, SLOW_LOST, THREAD_LOST, THREADS_TURN = 1, 1 << 3, 1 << 15, 1 << 16, 0x100


class Program:
    """The program's parts, each of which lives or not."""
    def __init__(self):
        self.p, self.alive, self.us, self.last_on = Plant((2600, 2500, 2400)), {"loop", "slow", "thread"}, 0, 0
        p = self.p
        self.run(6000)
        assert p.read(GATE.STATUS) == LIVE, "not started, nothing is watched"
        p.write(GATE.WATCH_TIME, WATCHED)
        assert p.read(GATE.WATCH_TIME) == 0, "it does not start while the bridge is on"
        p.write(GATE.CONTROL, 0)
        p.write(GATE.WATCH_TIME, WATCHED)
        p.write(GATE.WATCH_TIME, 2 * WATCHED)
        assert p.read(GATE.WATCH_TIME) == STARTED | WATCHED, "it starts once, and keeps its time"
        self.alive = {"loop", "slow"}
        self.run(6000)
        assert p.read(GATE.STATUS) == 0, "nothing is missed while the bridge is off"
        self.alive = {"loop", "slow", "thread"}
        p.write(GATE.CONTROL, 1)
        self.run(6000)
        assert p.read(GATE.STATUS) == LIVE, "a program that lives keeps the bridge on"

    def prove(self, key, turn):
        word = self.p.read(GATE.WATCH)
        if word & THREADS_TURN == turn:
            self.p.write(GATE.PROOF, key | word & 0xFF)

    def run(self, us, looks=False):
        end = self.us + us
        for self.us in range(self.us, end):
            due = [part for part, every, at in (("loop", 50, 4), ("slow", 1000, 0), ("thread", 1300, 7))
                   if part in self.alive and self.us % every == at]
            if due or looks:
                self.p.to(self.us * 10**6)
            self.last_on = self.us if looks and self.p.p.gates else self.last_on
            if looks and self.us % 500 == 0:
                self.p.write(GATE.CONTROL, 1)  # which is no sign of life
            for part in due:
                if part == "loop":
                    self.p.write(PWM.COMPARE_C, self.p.read(PWM.COMPARE_C))
                else:
                    self.prove(*((SLOW_KEY, 0) if part == "slow" else (THREAD_KEY, THREADS_TURN)))
        self.us = end
        self.p.to(self.us * 10**6)

    def to_slow_s_turn(self):
        while self.p.read(GATE.WATCH) & THREADS_TURN:
            self.run(1)
        return self.p.read(GATE.WATCH)


@pytest.mark.parametrize("after_us", range(0, 1300, 650))
@pytest.mark.parametrize("part, latch, most_us", [
    ("loop", LOOP_LOST, 100), ("slow", SLOW_LOST, 3501), ("thread", THREAD_LOST, 4501)])
def test_a_part_hangs(part, latch, most_us, after_us):
    """The current loop alone: off by the end of the period that it does not answer; the slow loop: within 3.5 ms; the thread: a
    millisecond later."""
    g = Program()
    g.run(after_us)
    g.alive.remove(part)
    since = g.us
    g.run(7000, looks=True)
    assert 0 <= g.last_on - since <= most_us and g.p.read(GATE.STATUS) == latch
    g.p.write(GATE.CONTROL, 1)
    assert g.p.read(GATE.CONTROL) == 0
    g.alive.add(part)
    g.run(7000)
    g.p.write(GATE.STATUS, latch)
    g.p.write(GATE.CONTROL, 1)
    g.run(6000)
    assert g.p.read(GATE.STATUS) == LIVE, "cleared and enabled, it goes on"


@pytest.mark.parametrize("key, further", [(SLOW_KEY, 1), (THREAD_KEY, 0)])
def test_a_wrong_word(key, further):
    """A number that is not the next; the thread's word in the slow loop's turn."""
    g = Program()
    g.p.write(GATE.PROOF, key | (g.to_slow_s_turn() + further & 0xFF))
    assert g.p.read(GATE.STATUS) == SLOW_LOST and g.p.gates == 0


def test_a_repeated_word_and_a_reset():
    g = Program()
    word = SLOW_KEY | g.to_slow_s_turn() & 0xFF
    for expected in (LIVE, THREAD_LOST):
        g.p.write(GATE.PROOF, word)
        assert g.p.read(GATE.STATUS) == expected
    c.plant_reset_fabric(g.p.p)
    assert g.p.read(GATE.WATCH_TIME) == g.p.read(GATE.WATCH) == 0


# ---- two plants behind one fabric ----

HALF, RUN, FOLLOW = 2500, 1, 4


class Pair:
    """The first runs from its valley at time 0 on, or rests; the second begins to wait a little later."""
    def __init__(self, first_runs=True):
        self.first, self.second = Plant(on=None), Plant(on=None)
        c.plant_join(self.first.p, 0, 2, None)
        c.plant_join(self.second.p, 1, 2, self.first.p)
        self.set_up(self.first, HALF)
        self.set_up(self.second, HALF // 2)
        self.first.write(PWM.CONTROL, RUN if first_runs else 0)
        self.second.to(100 * CLOCK_PS)
        self.second.write(PWM.CONTROL, RUN | FOLLOW)

    @staticmethod
    def set_up(p, phase):
        for register, value in ((PWM.PERIOD, HALF), (PWM.PHASE, phase), (PWM.TRIGGER_1, HALF | 1 << 16)):
            p.write(register, value)


def runs(p):
    return p.read(PWM.STATUS) & 1


def test_the_second_starts_with_the_first_s_valley():
    """In the clock of the write the first carrier rests, then it passes its valley, and the next one a period later."""
    two, valley = Pair(), PERIOD_PS + CLOCK_PS
    assert (two.first.read(GATE.AXES), two.second.read(GATE.AXES)) == (0x20, 0x21)
    assert c.plant_waits(two.second.p) and not c.plant_waits(two.first.p)
    assert two.second.next_trigger() == valley + PERIOD_PS - PERIOD_PS // 4 + CLOCK_PS, "a quarter before the first's"
    two.second.to(valley - CLOCK_PS)
    assert not runs(two.second)
    two.second.to(valley)
    two.first.to(valley)
    assert runs(two.second) and (two.second.read(PWM.COUNT), two.first.read(PWM.COUNT)) == (HALF // 2, HALF)
    for p in (two.first, two.second):
        p.to(valley + 1000 * PERIOD_PS + PERIOD_PS // 4)
    assert two.first.next_trigger() - two.second.next_trigger() == PERIOD_PS // 4, "a thousand periods later as far apart"


def test_it_waits_for_a_start():
    two = Pair(first_runs=False)
    assert two.second.next_trigger() == NEVER
    two.second.to(10 * PERIOD_PS)
    two.first.to(10 * PERIOD_PS)
    assert not runs(two.second)
    two.first.write(PWM.CONTROL, RUN)
    two.second.to(11 * PERIOD_PS)
    assert not runs(two.second), "the first's start at its valley is no valley"
    two.second.to(11 * PERIOD_PS + CLOCK_PS)
    assert runs(two.second)


def test_resets_and_stops_are_its_own():
    two = Pair()
    c.plant_reset_fabric(two.second.p)
    assert not c.plant_waits(two.second.p)
    two.set_up(two.second, HALF)
    two.second.write(PWM.CONTROL, RUN | FOLLOW)
    assert c.plant_waits(two.second.p), "it can follow anew"
    for p in (two.first, two.second):
        p.write(GATE.CONTROL, 1)
    c.plant_stop(two.second.p, c.GATE_DRIVER_FAULT, True)
    assert not two.second.fabric.contents.live and two.first.fabric.contents.live


def test_the_first_follows_nobody():
    two = Pair(first_runs=False)
    two.first.write(PWM.CONTROL, RUN | FOLLOW)
    two.first.to(2 * CLOCK_PS)
    assert runs(two.first)
