# SPDX-License-Identifier: MIT
"""A rotor, a spring and a load behind the encoder's registers, around the firmware's own speed loop: exact between samples."""
import math

import numpy as np

STEPS = 20  # a millisecond
STEP_S = 1e-3 / STEPS
CLOCKS = 100_000


def exponential(a):
    """Of a small matrix: the series, of a part so small that twelve terms are all."""
    halvings = max(0, math.ceil(math.log2(np.abs(a).sum(axis=1).max())) + 4)
    term = total = np.eye(len(a))
    for n in range(1, 13):
        term = term @ a / 2**halvings / n
        total = total + term
    return np.linalg.matrix_power(total, 2**halvings)


class Shaft:
    """told_ratio: the inertia that the drive is told over the one there is. hz 0: the load is rigid."""

    def __init__(self, c, hz=0.0, load_ratio=4.0, damping=0.02, told_ratio=1.0, **params):
        self.c, self.axis, self.fabric = c, c.axis(), c.fabric()
        c.drive_init(self.axis, self.fabric)
        for name, value in params.items():
            setattr(self.axis.params, name, value)
        assert c.tuning_compute(self.axis.params, self.axis.tuning).error == c.ERROR_NONE
        self.p, self.t, self.speed = self.axis.params, self.axis.tuning, self.axis.speed
        c.speed_loop_init(self.speed)
        c.speed_loop_tune(self.speed, self.t)
        self.nm_per_q15 = 1.5 * self.p.pole_pairs * self.p.flux_uwb * 1e-6 * self.p.i_range_ma * 1e-3 / 32768
        self.inertia = self.p.inertia_gmm2 * 1e-9 / told_ratio
        self.matrix = self._matrix(hz, load_ratio, damping, 1 / (2 * math.pi * self.p.current_bw_hz))
        self.state = np.zeros(5)  # torque, speed of rotor and load, twist, angle
        self.count = self.clock = self.edge = self.last = 0
        self.demands, self.rpms, self.load_nm = [], [], 0.0
        self.see()
        c.speed_estimate_reset(self.speed.estimate)

    def _matrix(self, hz, load_ratio, damping, lag_s):
        a = np.zeros((7, 7))
        a[0, 0], a[0, 5], a[4, 1] = -1 / lag_s, 1 / lag_s, 1
        if not hz:
            a[1, 0], a[1, 6] = 1 / self.inertia, -1 / self.inertia
            return exponential(a * STEP_S)
        rotor, load = self.inertia / (1 + load_ratio), self.inertia * load_ratio / (1 + load_ratio)
        both = rotor * load / (rotor + load)
        spring, damper = (2 * math.pi * hz)**2 * both, 2 * damping * 2 * math.pi * hz * both
        a[1, 0:4] = 1 / rotor, -damper / rotor, damper / rotor, -spring / rotor
        a[2, 1:4] = damper / load, -damper / load, spring / load
        a[2, 6], a[3, 1], a[3, 2] = -1 / load, 1, -1
        return exponential(a * STEP_S)

    def see(self):
        encoder = self.fabric.encoder
        encoder.LATCH_TIME, encoder.EDGE_TIME = self.clock % 2**32, self.edge % 2**32
        encoder.LATCHED = self.count % self.p.encoder_counts

    def turn(self, torque_nm):
        """One step of the shaft, and the encoder's last edge in it."""
        before = self.state[4]
        self.state = (self.matrix @ np.concatenate([self.state, (torque_nm, self.load_nm)]))[:5]
        scale = self.p.encoder_counts / (2 * math.pi)
        count = math.floor(self.state[4] * scale)
        if count != self.count:
            place = count if count > self.count else count + 1
            self.edge = self.clock + round((place / scale - before) / (self.state[4] - before) * STEP_S * 1e8)
            self.count = count
        self.clock += CLOCKS // STEPS

    def step(self, ms, reference=None):
        """reference(ms): the speed in rpm of a host that moves it itself."""
        most = self.t.i_max_q15
        limits = self.c.interval(low=-most, high=most)
        for _ in range(ms):
            self.see()
            self.c.speed_loop_measure(self.speed, self.fabric.encoder, self.t)
            if reference is None:
                demand = self.c.speed_loop_step(self.speed, self.t, self.t.ramp_q16, limits)
            else:
                now, later = (round(reference(len(self.demands) + n) * 65536) for n in (0, 1))
                demand = self.c.speed_loop_follow(self.speed, self.t, now, later - now, limits)
            demand = max(-most, min(most, demand))
            for n in range(STEPS):  # a sample passes until it acts
                self.turn((demand if n else self.last) * self.nm_per_q15)
            self.last = demand
            self.demands.append(demand / most)
            self.rpms.append(self.state[1] * 30 / math.pi)
        return self

    def swing(self, ms):
        """Peak to peak of the demand over the last milliseconds, in i_max."""
        return max(self.demands[-ms:]) - min(self.demands[-ms:])

    def go(self, rpm):
        self.speed.target_rpm_q16 = rpm * 65536
        return self
