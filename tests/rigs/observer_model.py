# SPDX-License-Identifier: MIT
"""The flux observer's step in exact integers, for many machines at once, and an ideal machine for it to look at.

The equations are those of firmware/control/observer.h, written from there and not from the C. `Observer` has a member for
each of the C's, as arrays of int64.
"""
import numpy as np

STATE = ("flux_alpha", "flux_beta", "v_alpha_steps", "v_beta_steps")
GAINS = ("of_newest", "of_older", "r_q5", "magnet", "lq", "saliency", "along_d", "along_q", "back_d", "back_q", "back_shift",
         "track", "track_speed_q8")


def sat(x, bits):
    return np.clip(x, -(1 << (bits - 1)), (1 << (bits - 1)) - 1)


def cos_sin(angle_q32, table):
    """As lib/trig.h has them, from its table."""
    index, part = angle_q32 >> 22, (angle_q32 >> 10) & 0xFFF

    def chord(word):
        slope = ((word & 0xFFF) ^ 0x800) - 0x800
        return (word + slope * (part - 1)) >> 15
    return chord(table[index + 256]), chord(table[index])


class Observer:
    def __init__(self, count, table):
        self.table = table
        for name in (*STATE, *GAINS, "angle_q32", "speed_q32"):
            setattr(self, name, np.zeros(count, dtype=np.int64))

    def step(self, i_alpha, i_beta, v_alpha, v_beta):
        cosine, sine = cos_sin(self.angle_q32, self.table)
        active_alpha = (self.flux_alpha >> 14) - (self.lq * i_alpha >> 15)
        active_beta = (self.flux_beta >> 14) - (self.lq * i_beta >> 15)
        i_d = (i_alpha * cosine + i_beta * sine) >> 15
        e_d = sat(self.magnet - (self.saliency * i_d >> 15) - ((active_alpha * cosine + active_beta * sine) >> 15), 16)
        e_q = sat((active_alpha * sine - active_beta * cosine) >> 15, 16)
        rho = sat((e_d * self.along_d + e_q * self.along_q) >> 10, 16)
        nu = sat((e_q * self.along_d - e_d * self.along_q) >> 10, 16)
        back_d, back_q = self.back_d * rho >> 15, self.back_q * rho >> 15
        back = ((back_d * cosine - back_q * sine) >> self.back_shift, (back_d * sine + back_q * cosine) >> self.back_shift)
        for axis, i, v, put in (("alpha", i_alpha, v_alpha, back[0]), ("beta", i_beta, v_beta, back[1])):
            flux, before = getattr(self, f"flux_{axis}"), getattr(self, f"v_{axis}_steps")
            by_voltage = self.of_newest * v + self.of_older * before
            setattr(self, f"flux_{axis}", sat(flux + by_voltage - (self.r_q5 * i >> 5) + put, 29))
            setattr(self, f"v_{axis}_steps", v)
        self.speed_q32 = ((self.speed_q32 - (self.track_speed_q8 * nu >> 8) + 2**31) & 0xFFFFFFFF) - 2**31
        self.angle_q32 = (self.angle_q32 + self.speed_q32 - self.track * nu) & 0xFFFFFFFF
        self.rho_q15 = rho


class Machine:
    """Magnets, inductances and a resistance at a constant electrical speed, on an inverter that errs by rounding alone.

    A current controller without error keeps i_d, i_q in the frame that the observer believes in; all in SI units.
    """

    def __init__(self, speed, flux_wb, ld_h, lq_h, resistance_ohm, period_s):
        self.speed, self.flux_wb, self.ld_h, self.lq_h = speed, flux_wb, ld_h, lq_h
        self.resistance_ohm, self.period_s = resistance_ohm, period_s
        self.angle = np.zeros_like(speed)

    def flux(self, i, angle):
        in_rotor = i * np.exp(-1j * angle)
        return (self.flux_wb + self.ld_h * in_rotor.real + 1j * self.lq_h * in_rotor.imag) * np.exp(1j * angle)

    def advance(self, i_now, i_next):
        """The voltage that takes the current from the one to the other while the rotor turns on."""
        angle = self.angle + self.speed * self.period_s
        u = (self.flux(i_next, angle) - self.flux(i_now, self.angle)) / self.period_s
        self.angle = angle
        return u + self.resistance_ohm * (i_now + i_next) / 2


def chords(c):
    return np.array(c.trig_chords[:1280] if hasattr(c.trig_chords, "__len__") else [c.trig_chords[n] for n in range(1280)],
                    dtype=np.int64)


def any_of(draw, low, high):
    return draw.choice((low, high)) if draw.random() < 0.2 else draw.randint(low, high)
