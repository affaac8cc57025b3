# SPDX-License-Identifier: MIT
"""A plant on the bench: a salient motor, a 24 V bridge, ideal sensors, and the fabric's registers as docs/fabric.md has them,
written down here once more on purpose: the twin's own are under test."""
import ctypes
import math

import numpy as np
import pytest

from rigs.firmware import built
from unit.cinterface import Library

NEVER = 2**63 - 1
CLOCK_PS = 10_000
PERIOD_COUNTS, DEAD_COUNTS = 5000, 100  # 20 kHz, 1 us
PERIOD_PS = PERIOD_COUNTS * CLOCK_PS


class Models(Library):
    """The models (plant.mk), made when the first of them is asked for."""
    structure = ctypes.Structure  # pairs and views are short: c.dq(d, q)

    def __init__(self):
        pass

    def __getattr__(self, name):
        if "structs" in self.__dict__ or name.startswith("__"):
            return super().__getattr__(name)
        super().__init__(built("plant.so", "twin"))
        return getattr(self, name)


c = Models()


class PWM:
    CONTROL, STATUS, PERIOD, DEAD, MIN_PULSE, MODE, PHASE, TRIGGER_1, TRIGGER_2, COUNT, COMPARE_A, COMPARE_B, COMPARE_C = range(
        0x000, 0x034, 4)


class ADC:
    (CONTROL, STATUS, IA, IB, IC, VBUS, SEQUENCE, OFFSET_A, OFFSET_B, OFFSET_C, I_TRIP, SUM_TRIP, V_MIN, V_MAX, TEMP, VALID,
     GAIN_A, GAIN_B, GAIN_C, SETTLE, MODULATOR, MODULATOR_TRIP) = range(0x100, 0x158, 4)


class ENC:
    CONTROL, COUNTS, POSITION, LATCHED, INDEX, STATUS, EDGE_TIME, LATCH_TIME, FILTER, HALL, HALL_TIME = range(0x200, 0x22C, 4)


class GATE:
    CONTROL, STATUS, ID, CHOPPER, CHOPPER_ON, CHOPPER_OFF, AXES, WATCH_TIME, WATCH, PROOF = range(0x300, 0x328, 4)


def high(phase):
    return 1 << 2 * phase


def low(phase):
    return 2 << 2 * phase


ALL_LOW, BC_LOW = low(0) | low(1) | low(2), low(1) | low(2)
A_HIGH_BC_LOW = high(0) | BC_LOW

# Ld 0.3 mH, Lq 0.4 mH, 0.3 ohm, 7.5 mWb, 4 pole pairs; no friction, no cogging, no warming; rotor at angle 0
_WARMTH = {"ambient_c": 25, "thermal_resistance_k_w": 1, "thermal_capacity_j_k": 1e4}
MOTOR = {"pole_pairs": 4, "resistance_ohm": 0.3, "ld_h": 0.3e-3, "lq_h": 0.4e-3, "flux_wb": 7.5e-3, "inertia_kgm2": 1e-5,
         **_WARMTH, "thermal_resistance_k_w": 2, "thermal_capacity_j_k": 50}
# machines with a published saturation map (M. Hinkkanen et al. 2017; L. Lelli et al. 2024; SyR-e's THOR, fitted): the 6.7 kW
# synchronous reluctance machine, Baldor ECS101M0H7EF4 and THOR with magnets; no losses, no harmonics
SYRM = {"pole_pairs": 2, "resistance_ohm": 0.54, "sat_a_d0": 17.4, "sat_a_dd": 373, "sat_s": 5, "sat_a_q0": 52.1,
        "sat_a_qq": 658, "sat_t": 1, "sat_a_dq": 1120, "sat_u": 1, "sat_w": 2, "inertia_kgm2": 0.015, **_WARMTH}
BALDOR = {"pole_pairs": 2, "resistance_ohm": 0.63, "sat_a_d0": 3.96, "sat_a_dd": 28.46, "sat_s": 4, "sat_a_q0": 5.89,
          "sat_a_qq": 2.672, "sat_t": 6, "sat_a_dq": 41.52, "sat_u": 1, "sat_v": 1, "sat_a_b": 81.75, "sat_a_bp": 1,
          "sat_w": 2, "sat_k_q": 0.1, "sat_psi_n_wb": 0.804, "inertia_kgm2": 0.05, **_WARMTH}
THOR = {"pole_pairs": 2, "resistance_ohm": 0.2, "sat_a_d0": 28.51, "sat_a_dd": 128.8, "sat_s": 2, "sat_a_q0": 20.64,
        "sat_a_qq": 5756, "sat_t": 6, "sat_a_dq": 4247, "sat_u": 1, "sat_v": 1, "sat_a_b": 7360, "sat_a_bp": 17.69,
        "sat_w": 2, "sat_k_q": 0.1398, "sat_psi_n_wb": 0.2196, "inertia_kgm2": 4.228e-3, **_WARMTH}
# 24 V behind 50 mohm, 1 mF, switches of 5 mohm without delays, diodes of 0.8 V, comparators at 1000 A
INVERTER = {"vbus_v": 24, "supply_resistance_ohm": 0.05, "supply_sinks": 1, "bus_capacitance_f": 1e-3, "r_on_ohm": 5e-3,
            "diode_v": 0.8, "oc_trip_a": 1000}
STIFF = {**INVERTER, "supply_resistance_ohm": 0}
# +-25 A, 50 V, no noise, 4000 counts
SENSORS = {"i_range_a": 25, "v_range_v": 50, "adc_bits": 12, "adc_conversion_s": 1.5e-6, "i_gain_a": 1, "i_gain_b": 1,
           "i_gain_c": 1, "encoder_counts": 4000, "encoder_index_counts": 1}
# one code is 10 mA and 10 mV
CENTI = {**SENSORS, "i_range_a": 20.48, "v_range_v": 40.96, "adc_conversion_s": 0}


def near(value, within, rel=None):
    return pytest.approx(value, abs=within, rel=rel)


def ps(duration_s):
    return round(duration_s * 1e12)


def signed(word):
    return word - (1 << 32) if word >> 31 else word


def triple(function, *arguments):
    """What a function writes into an array of three, its last argument."""
    values = (ctypes.c_double * 3)()
    function(*arguments, values)
    return np.array(values)


def copy(structure):
    return type(structure).from_buffer_copy(structure)


def address(function):
    return ctypes.cast(function, ctypes.c_void_p)


# ---- a motor alone ----

def motor(electrical_rad=0.0, base=MOTOR, load=None, **changes):
    """It, turned to an electrical angle."""
    values = {**base, **changes}
    values.setdefault("initial_angle_rad", electrical_rad / values["pole_pairs"])
    m = c.motor()
    c.motor_init(m, c.motor_params(**values), c.load_params(**(load or {})))
    return m


def currents(m):
    return triple(c.motor_currents, m)


def vector(v, rad, r_ohm=0.0):
    """A voltage vector along an electrical angle as three phases see it, behind a resistance in each."""
    source = c.motor_source()
    for k in range(3):
        source.emf_v[k], source.r_ohm[k][k] = v * math.cos(rad - k * 2 * math.pi / 3), r_ohm
    return source


def terminals(*emf_v, held=()):
    source = c.motor_source()
    source.emf_v[:] = emf_v
    for k in held:
        source.held[k] = True
    return source


def shorted():
    return terminals(0, 0, 0)


def coast(m, duration_s, source=None):
    """With open terminals."""
    c.bench_run_motor(m, source or terminals(0, 0, 0, held=(0, 1, 2)), duration_s)


# ---- a bridge and a motor without a fabric ----

class Bridge:
    def __init__(self, base=INVERTER, machine=None, locked=False, **changes):
        self.b = c.bench_bridge()
        self.inv, self.m = self.b.inv, self.b.m
        c.inverter_init(self.inv, c.inverter_params(**{**base, **changes}))
        m = machine or motor()
        ctypes.memmove(ctypes.addressof(self.m), ctypes.addressof(m), ctypes.sizeof(m))
        c.motor_lock(self.m, locked)

    def gates(self, mask):
        c.inverter_command(self.inv, mask, self.b.now)
        c.inverter_switch(self.inv, self.b.now)

    def advance(self, duration_s):
        c.bench_bridge_advance(self.b, duration_s)

    def current(self, phase=0):
        return currents(self.m)[phase]

    def legs(self):
        return triple(c.inverter_leg_currents, self.inv, self.m)

    def copied(self):
        other = Bridge.__new__(Bridge)
        other.b = copy(self.b)
        other.inv, other.m = other.b.inv, other.b.m
        return other


# ---- a plant behind its registers ----

class Plant:
    """Switches at 20 kHz with these on-times, LIVE, triggers in the middle of the low sides' time, ADC off. `rtl`: the library
    of the RTL, in place of its models."""
    def __init__(self, on=(2500, 2500, 2500), motor=None, load=None, inverter=None, sensors=None, seed=1, rtl=None):
        sensors = c.sensor_params(**{**SENSORS, **(sensors or {})})
        in_en = (inverter or {}).get("in_en", 0) != 0
        fabric = c.fabric_rtl_open(str(rtl).encode(), sensors, in_en, seed) if rtl else None
        self.params = c.plant_params(
            motor=c.motor_params(**{**MOTOR, **(motor or {})}), load=c.load_params(**(load or {})),
            inverter=c.inverter_params(**{**INVERTER, **(inverter or {})}), sensors=sensors, seed=1, fabric=fabric)
        self.p, self.kept = c.plant(), c.bench_rows()
        c.plant_init(self.p, self.params)
        self.p.on_trigger, self.p.context = address(c.bench_keep), ctypes.addressof(self.kept)
        if on:
            self.write(PWM.PERIOD, PERIOD_COUNTS // 2)
            self.write(PWM.DEAD, DEAD_COUNTS)
            self.write(PWM.MIN_PULSE, 1)
            self.legs(*on)
            self.trigger_at(0)
            self.write(PWM.CONTROL, 1)
            self.write(GATE.CONTROL, 1)

    def __getattr__(self, name):
        return getattr(self.p, name)

    def read(self, register):
        return c.plant_read(self.p, register, self.p.now)

    def write(self, register, value):
        c.plant_write(self.p, register, value & 0xFFFFFFFF, self.p.now)

    def to(self, at_ps):
        c.plant_advance(self.p, at_ps)

    def run(self, duration_s):
        self.to(self.p.now + ps(duration_s))

    def next_trigger(self):
        return c.plant_next_trigger(self.p)

    def to_trigger(self):
        """A microsecond before the next one, with steady legs."""
        self.run(0.98e-3)
        self.to(self.next_trigger() - ps(1e-6))
        return self

    def compares(self, *counts):
        """In effect from the next valley on."""
        for k, count in enumerate(counts):
            self.write(PWM.COMPARE_A + 4 * k, count)

    def legs(self, *on_counts):
        """The same for an on-time of the high sides, dead time taken off."""
        self.compares(*((on + DEAD_COUNTS) // 2 for on in on_counts))

    def trigger_at(self, count):
        """Where in the period: 0 is the middle of the low sides' time, which lies half a dead time behind the valley; triggers
        and gates come a clock behind their counts."""
        half, place = PERIOD_COUNTS // 2, (count + DEAD_COUNTS // 2) % PERIOD_COUNTS
        self.write(PWM.TRIGGER_1, (half - place) | 1 << 16 if place < half else (place - half) | 1 << 17)

    def convert(self):
        """The next conversion while the ADC is off: the truth at its trigger, and the codes from the middle."""
        self.kept.count = 0
        self.write(ADC.CONTROL, 1)
        while self.read(ADC.STATUS) == 0:
            self.run(1e-6)
        codes = [signed(self.read(ADC.IA + 4 * k)) / 16 for k in range(3)]
        self.write(ADC.STATUS, 3)
        self.write(ADC.CONTROL, 0)
        return copy(self.kept.row[0]), codes

    @property
    def row(self):
        """That of the last trigger."""
        return self.kept.row[(self.kept.count - 1) % 1024]

    @property
    def rows(self):
        return [self.kept.row[n % 1024] for n in range(max(0, self.kept.count - 1024), self.kept.count)]
