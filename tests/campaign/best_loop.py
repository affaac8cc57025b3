# SPDX-License-Identifier: MIT
"""What the best speed loop of a machine does at a rate and a lag: two masses on a spring, a sensor that tells the angle late, a
torque that comes late. It knows nothing of any firmware, so that a design and its judge have one reference.

The loop is a PI whose speed is the way of one or more of its periods, by their time; its memory is then the angle itself.
Everything is exact at and between the samples (matrix exponentials), so a coupling above half the rate is folded as the loop
sees it. A lag of the sensor commutes with that of the torque, so one delay has both. The only filter is a mean over several
periods, or the mean of such means: a slow loop has two of a period for nothing, its speed's and its torque's, which hide a
stiff coupling. A quick one that could not do the same would be worse.

Best is the smallest dip after a step of the load's torque among all gains that leave a disk margin of MARGIN and are stable
with a coupling STIFFER and SOFTER than thought. A dip is told as a time, dip * J / T: how long the step T alone would take
the whole inertia J as far.
"""
import itertools
import math
from dataclasses import dataclass, replace

import numpy as np

MARGIN = 0.5                 # S - T never beyond 2 / MARGIN: gains of 0.6 to 1.67, or 28 degrees, and what mixes them
SOFTER, STIFFER = 0.8, 1.25  # times the stiffness
MEMORY = (0.1, 0.25, 0.5)    # of the integral, by kp and the bandwidth: damped by 0.7 or more where rigid
# periods of a speed's mean, and of the mean of such means; how long both are together
MEANS = [(n, 1) for n in (1, 2, 3, 4, 6, 8, 12, 16)] + [(n, m) for n in (2, 3, 4, 6, 8, 12, 16) for m in (n // 2, n) if m > 1]
MEAN_S = 3e-3
GAINS, REFINED, KEPT = 48, 7, 2  # proportional gains looked at, then between two of them; how many of each memory are played
FREQUENCIES, AROUND = 400, 120   # of the loop; more around a resonance
PARTS = 4                        # of a period, in which a dip is looked for
DOUBLINGS, OVER, HORIZON_S = 8, 0.3, 4.0  # it is, where so many periods (2^) do not reach this share of it


@dataclass(frozen=True)
class Shaft:
    """Rotor, and a load on a spring; rigid where stiffness is 0."""
    rotor_kgm2: float
    load_kgm2: float = 0.0
    stiffness_nm_rad: float = 0.0
    damping_nms: float = 0.0

    @property
    def total_kgm2(self):
        return self.rotor_kgm2 + self.load_kgm2

    @property
    def is_rigid(self):
        return not (self.stiffness_nm_rad and self.load_kgm2)

    @property
    def resonance_hz(self):
        """0 if rigid."""
        if self.is_rigid:
            return 0.0
        return math.sqrt(self.stiffness_nm_rad * self.total_kgm2 / self.rotor_kgm2 / self.load_kgm2) / (2 * math.pi)

    def stiffened(self, factor):
        return replace(self, stiffness_nm_rad=factor * self.stiffness_nm_rad)

    def rates(self):
        """d/dt of (angle, speed of the rotor, then speed of the load and twist; torque of the motor, torque of the load)."""
        if self.is_rigid:
            return np.array([[0, 1, 0, 0], [0, 0, 1 / self.total_kgm2, -1 / self.total_kgm2], [0] * 4, [0] * 4], float)
        rotor, load, spring, damper = self.rotor_kgm2, self.load_kgm2, self.stiffness_nm_rad, self.damping_nms
        return np.array([[0, 1, 0, 0, 0, 0], [0, -damper / rotor, damper / rotor, -spring / rotor, 1 / rotor, 0],
                         [0, damper / load, -damper / load, spring / load, 0, -1 / load], [0, 1, -1, 0, 0, 0],
                         [0] * 6, [0] * 6], float)


@dataclass(frozen=True)
class Gains:
    """Of a speed and of its integral."""
    kp_nms: float
    ki_nm: float


@dataclass(frozen=True)
class Figures:
    """`dip_s` is infinite where the loop is not stable. Crossover and phase margin are those with the least margin. `mean`: as
    one of MEANS."""
    gains: Gains
    mean: tuple
    dip_s: float
    disk_margin: float
    phase_margin_deg: float
    crossover_hz: float

    def bandwidth_hz(self, shaft):
        """Where a rigid sum of inertias would cross over: what a user tells."""
        return self.gains.kp_nms / shaft.total_kgm2 / (2 * math.pi)


class NoGain(ValueError):
    """None leaves the margin."""


def after(rates, time_s):
    """exp(rates t), by halving the time until a series of few terms is enough."""
    halvings = max(0, math.ceil(math.log2(max(np.abs(rates).max() * time_s, 1e-9))) + 6)
    part, term, total = rates * (time_s / 2 ** halvings), np.eye(len(rates)), np.eye(len(rates))
    for n in range(1, 12):
        term = term @ part / n
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total


def taps(mean):
    """Of the angles, latest first, whose sum is the mean of a speed by periods of 1 s."""
    first, second = mean
    return np.convolve([1 / first] + [0.0] * (first - 1) + [-1 / first], np.full(second, 1 / second))


class Sampled:
    """A shaft as a loop of `rate_hz` sees it whose torque comes `late_s` after the angle that it answers, and whose speed is a
    mean of periods.

    State: the shaft's, torques asked for before, latest first, angles before, the same, and the load's torque.
    """

    def __init__(self, shaft, rate_hz, late_s, mean=(1, 1)):
        self.shaft, self.period_s, self.taps = shaft, 1 / rate_hz, taps(mean) * rate_hz
        self.whole, self.rest_s = int(late_s * rate_hz), late_s % self.period_s
        self.rates = shaft.rates()
        self.moving = len(self.rates) - 2
        self.angles = self.moving + self.whole + 1
        self.load = self.angles + len(self.taps) - 1
        self.size = self.load + 1
        self.angle_row, self.speed_row = np.eye(self.size)[0], np.zeros(self.size)
        self.speed_row[[0, *range(self.angles, self.load)]] = self.taps
        self.open, self.input = self._period()

    def within(self, time_s):
        """(matrix, input): the shaft's state this long after a sample, by the state at it and the torque asked for at it."""
        first = after(self.rates, min(time_s, self.rest_s))
        then = after(self.rates, max(time_s - self.rest_s, 0.0))
        n, oldest = self.moving, self.moving + self.whole
        matrix, now = np.zeros((n, self.size)), np.zeros(n)
        matrix[:, :n] = then[:n, :n] @ first[:n, :n]
        matrix[:, oldest] = then[:n, :n] @ first[:n, n]
        matrix[:, self.load] = then[:n, :n] @ first[:n, n + 1] + then[:n, n + 1]
        if self.whole:
            matrix[:, oldest - 1] += then[:n, n]
        else:
            now = then[:n, n]
        return matrix, now

    def _period(self):
        n = self.moving
        matrix, asked = np.zeros((self.size, self.size)), np.zeros(self.size)
        matrix[:n], asked[:n] = self.within(self.period_s)
        asked[n] = 1
        for k in range(self.whole):
            matrix[n + k + 1, n + k] = 1
        matrix[self.angles, 0] = 1
        for k in range(self.angles + 1, self.load):
            matrix[k, k - 1] = 1
        matrix[self.load, self.load] = 1
        return matrix, asked

    def answer(self, gains):
        """The torque asked for, as a row by the state."""
        return -(gains.kp_nms * self.speed_row + gains.ki_nm * self.angle_row)

    def closed(self, gains):
        """From sample to sample."""
        return self.open + np.outer(self.input, self.answer(gains))

    def is_stable(self, gains):
        inner = self.closed(gains)[:self.load, :self.load]
        return bool(np.abs(np.linalg.eigvals(inner)).max() < 1 - 1e-9)

    def ring_hz(self, gains):
        """The frequency of the least damped swing."""
        poles = np.linalg.eigvals(self.closed(gains)[:self.load, :self.load])
        worst = poles[np.argmax(np.abs(poles))]
        return abs(np.angle(worst)) / (2 * math.pi * self.period_s)

    def frequencies(self):
        """In Hz: to half the rate, close together where the coupling is seen."""
        half = 0.5 / self.period_s
        grid = [np.geomspace(half * 1e-4, half * 0.9999, FREQUENCIES)]
        if not self.shaft.is_rigid:
            held = math.sqrt(self.shaft.rotor_kgm2 / self.shaft.total_kgm2)  # the load alone, while the rotor stays
            for hz in (self.shaft.resonance_hz, self.shaft.resonance_hz * held):
                seen = abs((hz + half) % (2 * half) - half)
                grid.append(np.clip(seen + hz * np.linspace(-0.2, 0.2, AROUND), half * 1e-4, half * 0.9999))
        return np.unique(np.concatenate(grid))

    def response(self, hz):
        """Angle by torque asked for, complex, at these frequencies."""
        z = np.exp(2j * math.pi * np.asarray(hz) * self.period_s)
        inner = self.open[:self.angles, :self.angles]
        asked = np.tile(self.input[:self.angles, None], (len(z), 1, 1))
        return np.linalg.solve(z[:, None, None] * np.eye(self.angles) - inner, asked)[:, 0, 0]

    def loop(self, hz, response, gains):
        """The open loop's gain."""
        back = np.exp(-2j * math.pi * hz * self.period_s)
        return (gains.kp_nms * np.polyval(self.taps[::-1], back) + gains.ki_nm) * response

    def dip_s(self, gains, passed=0.0):
        """The largest deviation of the rotor's speed after a step of the load; `passed`: the share of a period that is over
        by then."""
        row = self.answer(gains)
        rows = np.array([(matrix + np.outer(now, row))[1] for matrix, now in
                         (self.within(self.period_s * k / PARTS) for k in range(PARTS))])
        closed, state = self.closed(gains), np.zeros(self.size)
        early = after(self.rates, (1 - passed) * self.period_s)
        state[:self.moving], state[self.load] = early[:self.moving, -1], 1
        for _ in range(DOUBLINGS):  # rows of ever later samples
            rows, closed = np.vstack([rows, rows @ closed]), closed @ closed
        largest, begun = 0.0, 0.0
        while begun < HORIZON_S:
            seen = np.abs(rows @ state).max()
            if seen < OVER * largest:
                break
            largest = max(largest, seen)
            state = closed @ state
            begun += 2 ** DOUBLINGS * self.period_s
        return largest * self.shaft.total_kgm2


def disk_margin(loop):
    """Along the last axis."""
    return 2 / np.abs((1 - loop) / (1 + loop)).max(axis=-1)


def crossovers(hz, loop):
    """[(Hz, phase margin in degrees)] where the gain passes 1, in the order of frequency."""
    size, angle, found = np.log(np.abs(loop)), np.unwrap(np.angle(loop)), []
    for k in np.flatnonzero(size[:-1] * size[1:] < 0):
        share = size[k] / (size[k] - size[k + 1])
        lag = math.degrees(angle[k] + share * (angle[k + 1] - angle[k]))
        found.append((hz[k] + share * (hz[k + 1] - hz[k]), abs((lag + 360) % 360 - 180)))
    return found


def figures(shaft, rate_hz, late_s, gains, mean=(1, 1), passed=0.0):
    """The Figures of given gains."""
    sampled = Sampled(shaft, rate_hz, late_s, mean)
    hz = sampled.frequencies()
    loop = sampled.loop(hz, sampled.response(hz), gains)
    crossover, margin = min(crossovers(hz, loop), key=lambda found: found[1], default=(0.0, 180.0))
    dip = sampled.dip_s(gains, passed) if sampled.is_stable(gains) else math.inf
    return Figures(gains, mean, dip, float(disk_margin(loop)), margin, crossover)


def best(shaft, rate_hz, late_s):
    """The Figures of the best loop."""
    quickest = 1 / (late_s + 1 / rate_hz)  # rad/s: nothing crosses over beyond
    low, high = 1e-3 * quickest * shaft.rotor_kgm2, quickest * shaft.total_kgm2
    step = (high / low) ** (1 / GAINS)
    found, response = (math.inf, None, None, None), None
    for mean in MEANS:
        if mean != MEANS[0] and sum(mean) > MEAN_S * rate_hz:
            continue
        shafts = [shaft] if shaft.is_rigid else [shaft, *(shaft.stiffened(by) for by in (SOFTER, STIFFER))]
        plants = [Sampled(shaft_as, rate_hz, late_s, mean) for shaft_as in shafts]
        hz = plants[0].frequencies()
        response = plants[0].response(hz) if response is None else response
        tried = [(memory, low * step ** np.arange(GAINS + 1)) for memory in MEMORY]
        here = _least(plants, hz, response, tried)
        if here[0] < math.inf:
            closer = here[2].kp_nms * step ** np.linspace(-1, 1, REFINED)
            found = min(found, (*min(here, _least(plants, hz, response, [(here[1], closer)]), key=_dip), mean), key=_dip)
    if found[0] == math.inf:
        raise NoGain(f"at {rate_hz:g} Hz, late by {late_s:g} s")
    return figures(shaft, rate_hz, late_s, found[2], found[3])


def _dip(entry):
    return entry[0]


def _least(plants, hz, response, tried):
    """(dip, memory, Gains) with the least dip of all (memory, proportional gains) that leave the margin; infinite if none does.
    Of each memory the largest KEPT are played."""
    found = (math.inf, None, None)
    for memory, kps in tried:
        gains = [Gains(kp, memory * kp * kp / plants[0].shaft.total_kgm2) for kp in kps[::-1]]
        margins = disk_margin(np.array([plants[0].loop(hz, response, each) for each in gains]))
        allowed = (each for each, margin in zip(gains, margins) if margin >= MARGIN and all(p.is_stable(each) for p in plants))
        played = ((plants[0].dip_s(each), memory, each) for each in itertools.islice(allowed, KEPT))
        found = min([found, *played], key=_dip)
    return found
