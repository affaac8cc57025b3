# SPDX-License-Identifier: MIT
"""What a run says of a drive on a motor that nobody listed: it works; or it refused or gave up for a reason that is true of
this plant; or it is wrong.

The drive names the reason, the plant decides whether it is true: drawn values (SEED, SPREAD), not those that the drive was
told. A reason that is not in TRUTHS is never true: a limit of the firmware's own numbers is none of the plant. A run whose
limits fail although the drive says nothing is excused only where the plant lacks the torque that the scenario asks for. One
whose drive warned of an oscillation may answer load and ramp more slowly, or lose the speed to them, if the shaft leaves the
told bandwidth no margin.
"""
import math
import re
from dataclasses import dataclass

from .capability import CIRCLE, KEPT, machine_of
from .kinds_protection import enumerator
from .refusals import NAME, refusals, typed
from .ripple import largest_ripple_a
from .rules import RPM
from .shaft_margin import MARGIN, swings_up
from .spread import drawn

WORKS, TRUE, WRONG, NOT_SET_UP = "works", "true reason", "wrong", "not set up"
# scenario -> the most that it asks of the machine at once: share of rated torque, name of the speed
ASKS = {"default": (1.0, "work_rpm"), "sensorless": (1.0, "work_rpm"), "power_limit": (1.0, "work_rpm"),
        "low_speed": (0.5, "slow_rpm"), "reversal_under_load": (0.6, "mid_rpm"), "position": (0.5, "slow_rpm"),
        "high_speed": (0.0, "speed_max_rpm")}
HALL_SHARE = 0.955      # of the torque, from sectors: the mean of a cosine over 60 degrees
PERIOD_S, LOOP_S = 50e-6, 2e-3
DEVIATION = 0.2         # of speed_max: deviation_pct
LAST_HZ = 1187.0        # electrical, of the firmware's speeds
WARM_K = 80.0           # of the winding, above ambient
ANSWER_LSB = 4.0        # firmware/source/injection_start.c: RADIAN_MIN, by degrees
PUSH_SHARE, PUSH_S, PUSH_SEEN = 2 / 3, 0.256, math.radians(24)  # firmware/source/injection_start.c
WARNED = "warning: oscillation"
# what less gain makes worse; and the torque's swing before that steps the reference of i_d
SLOWER = ("speed dip", "recovery", "speed overshoot", "speed error, steady, rated load", "speed error, steady, no load, mean",
          "speed error, steady, reverse, mean", "i_d error, whole run, largest")

# what a loop cannot help whose current is gone within a PWM period
OF_CURRENT = ("i_d error", "current distortion", "torque ripple")


@dataclass(frozen=True)
class Judged:
    """`cause` is what the drive said, or which limits failed; `truth` why that is true of the plant, or empty."""
    word: str
    cause: str = ""
    truth: str = ""


class Plant:
    """What is true of the motor, stage and load of a drive, as drawn."""

    def __init__(self, drive):
        self.drive = drive
        self.motor, self.stage = (drawn(device, drive.seed, drive.spread) for device in (drive.motor, drive.inverter))
        self.names = drive.names()

    def lacks(self, share=1.0, speed="work_rpm"):
        """Why a share of rated load at a speed is beyond the plant, or an empty text."""
        rating, shaft, load = self.drive.motor["rating"], self.motor["mechanical"], self.motor["load"]
        rpm, loaded_nm = self.names[speed], share * rating["rated_torque_nm"]
        w = rpm * RPM
        needs = loaded_nm + shaft["friction_coulomb_nm"] + load["coulomb_nm"] + self.motor["iron"]["iron_hysteresis_nm"]
        needs += w * (shaft["friction_viscous_nms"] + self.motor["iron"]["iron_eddy_nms"])
        supply, winding_c = self.stage["supply"], self.motor["thermal"]["ambient_c"] + WARM_K
        bus_v = supply["vbus_v"] - supply["supply_resistance_ohm"] * needs * w / supply["vbus_v"]
        best = machine_of(self.drive, winding_c).most_torque(rpm, CIRCLE * KEPT * bus_v, self.names["i_max_A"])
        has = 0.0 if best is None else best.torque_nm * (HALL_SHARE if self.source == 2 else 1.0)
        return f"load and friction take {needs:.3g} N m, i_max gives {has:.3g}" if has < needs else ""

    @property
    def source(self):
        return self.drive.motor["control"]["angle_source"]

    def step_is_too_fast(self, share=1.0, _speed=""):
        """The load slows the shaft beyond the watched deviation before a coupling has passed it on, the sensor has told of it
        and two periods of the speed loop are over."""
        inertia = self.motor["mechanical"]["inertia_kgm2"] * (1 + self.motor["load"]["inertia_ratio"])
        late_s = LOOP_S + self.names["heard_s"] + self.names["swing_s"]
        falls = share * self.drive.motor["rating"]["rated_torque_nm"] / inertia * late_s / RPM
        limit = DEVIATION * self.names["speed_max_rpm"]
        return f"the load takes {falls:.3g} rpm in {1000 * late_s:.2g} ms, {limit:.3g} are watched" if falls > limit else ""

    def sticks(self, *_):
        """What holds the rotor at rest is more than i_max turns."""
        shaft, load = self.motor["mechanical"], self.motor["load"]
        holds = shaft["friction_coulomb_nm"] + max(load["coulomb_nm"], load["stiction_nm"]) + shaft["cogging_nm"]
        turns = self.drive.torque_per_ampere * self.names["i_max_A"]
        return f"friction and cogging hold with {holds:.3g} N m, i_max turns {turns:.3g}" if holds > turns else ""

    def sags(self, *_):
        """The supply falls below v_min at rated power."""
        supply, rating = self.stage["supply"], self.drive.motor["rating"]
        amperes = rating["rated_torque_nm"] * self.names["work_rpm"] * RPM / supply["vbus_v"]
        left = supply["vbus_v"] - supply["supply_resistance_ohm"] * amperes
        return f"{left:.3g} V are left at rated load" if left < self.names["v_min_V"] else ""

    def forgets_in_a_period(self, *_):
        """The winding's current decays within a PWM period."""
        e = self.motor["electrical"]
        tau_s = e["ld_h"] / e["resistance_ohm"]
        return f"L / R is {tau_s * 1e6:.3g} us" if tau_s < PERIOD_S else ""

    def is_reluctant(self, *_):
        """Reluctance outweighs the magnets."""
        e = self.motor["electrical"]
        lq_h = self.motor["control"]["lq_rest_h"] or e["lq_h"]
        turns_a = e["flux_wb"] / (lq_h - e["ld_h"]) if lq_h > e["ld_h"] else math.inf
        return f"psi / (L_q - L_d) is {turns_a:.3g} A" if self.names["i_max_A"] > 1.5 * turns_a else ""

    def is_too_quick(self, *_):
        """Over-speed is beyond the speeds that the firmware has."""
        hz = self.names["overspeed_rpm"] / 60 * self.names["pole_pairs"]
        return f"{hz:.4g} Hz electrical" if hz > LAST_HZ else ""

    def is_not_resolved(self, *_):
        """A count of the encoder within a millisecond asks for more than ten times i_max at the bandwidth that is told."""
        count_rad_s = 2 * math.pi / self.names["encoder_counts"] * 1000
        asks = self.names["inertia_kgm2"] * 2 * math.pi * self.names["speed_bw_hz"] * count_rad_s
        has = 10 * self.names["i_max_A"] * self.drive.torque_per_ampere
        return f"a count asks for {asks:.3g} N m" if asks > has else ""

    def charges_the_bus(self, *_):
        """The magnets at over-speed raise the bus beyond v_max."""
        w = self.names["overspeed_rpm"] * RPM * self.names["pole_pairs"]
        volts = math.sqrt(3) * self.motor["electrical"]["flux_wb"] * w
        return f"{volts:.4g} V of EMF" if volts > self.names["v_max_V"] else ""

    def swings(self, *_):
        """The coupling takes the margin of the speed loop at the bandwidth that is told."""
        load, rotor = self.motor["load"], self.motor["mechanical"]["inertia_kgm2"]
        if not load["stiffness_nm_rad"] or not load["inertia_ratio"]:
            return ""
        hz, shaft = self.names["speed_bw_hz"], (load["stiffness_nm_rad"], load["damping_nms"])
        swings = swings_up(hz, rotor, rotor * load["inertia_ratio"], *shaft)
        return f"a speed loop of {hz:.3g} Hz swings with the coupling at {MARGIN:g} times its gain" if swings else ""

    def trips_by_ripple(self, _share=1.0, speed="work_rpm"):
        """The current that the drive may ask for reaches, within PWM periods at the scenario's speed, the stage's own limit."""
        e, trip_a = self.motor["electrical"], self.stage["bridge"]["oc_trip_a"]
        volts = self.names[speed] * RPM * e["pole_pairs"] * e["flux_wb"] + e["resistance_ohm"] * self.names["i_max_A"]
        ripple_a = largest_ripple_a(self.stage["supply"]["vbus_v"], e["ld_h"], PERIOD_S, volts)
        peak_a = self.names["i_max_A"] + ripple_a
        text = f"{peak_a:.3g} A at i_max, {ripple_a:.3g} A of it ripple; the stage trips at {trip_a:.3g}"
        return text if peak_a > trip_a else ""

    def shows_too_little(self, *_):
        """The saliency answers even the largest voltage of injection by less per degree than the drive asks for."""
        by_ld, by_lq = self.drive.inverse_at_rest
        swing_a = 2 * self.names["v_min_V"] / math.sqrt(3) * PERIOD_S * (by_ld - by_lq)
        lsb = math.radians(swing_a) / self.names["i_range_A"] * 2**15
        return f"the current answers by {lsb:.2g} LSB a degree at most" if lsb < ANSWER_LSB else ""

    def cannot_be_pushed(self, *_):
        """A torque of two thirds of i_max through the magnets, 256 ms either way, turns it by less than is asked for."""
        shaft, load = self.motor["mechanical"], self.motor["load"]
        inertia = shaft["inertia_kgm2"] * (1 + load["inertia_ratio"])
        e = self.motor["electrical"]
        torque = 1.5 * e["pole_pairs"] * e["flux_wb"] * self.names["i_max_A"] * PUSH_SHARE
        sticks = torque <= load["stiction_nm"] + shaft["friction_coulomb_nm"]
        left = 0.0 if sticks else torque - load["coulomb_nm"] - shaft["friction_coulomb_nm"]
        turned = 4 * left / inertia * PUSH_S ** 2 * e["pole_pairs"]
        return f"pushes turn it by {math.degrees(turned):.3g} degrees" if turned < PUSH_SEEN else ""


# what the drive says -> what of the plant makes it true
TRUTHS = {
    r"do not fit one another at this PWM rate": Plant.forgets_in_a_period,
    r"reluctance outweighs": Plant.is_reluctant,
    r"1187 Hz": Plant.is_too_quick,
    r"too much for encoder_counts|encoder_counts is too small": Plant.is_not_resolved,
    r"emf_beyond_v_max": Plant.charges_the_bus,
    r"SPEED_DEVIATION": lambda plant, *asks: plant.step_is_too_fast(*asks) or plant.lacks(*asks),
    r"VOLTAGE_LIMIT|STALL|OUT_OF_STEP": Plant.lacks,
    r"LOAD_TOO_HIGH|LOAD$|BLOCKED": Plant.sticks,
    r"UNDERVOLTAGE": Plant.sags,
    r"OVERCURRENT_HARDWARE": Plant.trips_by_ripple,
    r"SALIENCY": Plant.shows_too_little,
    r"POLARITY": Plant.cannot_be_pushed,
    r"OSCILLATION|LIMIT_CYCLE": Plant.swings,
}


def judged(result):
    """The Judged of a Result."""
    if result.passed:
        return Judged(WORKS)
    asks, said = ASKS.get(result.scenario.key), said_by(result)
    plant = Plant(result.drive)
    if said:
        softened = WARNED in result.console and re.search("SPEED_DEVIATION", said)
        truth = truth_of(said, plant, asks) or (plant.swings() if softened else "")
        return Judged(TRUE if truth else WRONG, said, truth)
    truth = ((plant.lacks(*asks) if asks else "") or (plant.swings() if is_slower(result) else "")
             or (plant.forgets_in_a_period() if all_failed(result, OF_CURRENT) else ""))
    return Judged(TRUE if truth else WRONG, failed(result), truth)


def is_slower(result):
    """The drive has lowered its gains, has said so, and nothing else is amiss."""
    return WARNED in result.console and all_failed(result, SLOWER)


def all_failed(result, names):
    """Whether nothing but these has failed."""
    return all(name.startswith(names) for name, figure in result.figures.items() if figure.passed is False)


def truth_of(said, plant, asks=None):
    """What of the plant makes true what was said, or an empty text."""
    true = next((true for pattern, true in TRUTHS.items() if said and re.search(pattern, said)), None)
    return true(plant, *(asks or ())) if true else ""


WORKING = ("operation", "runs", "known")  # outcomes of parts in which the drive did what was asked


def judged_part(result, verdict):
    """The Judged of a part's case: the part says whether it is as it should be, the plant whether a reason is true."""
    if verdict.passed and verdict.outcome in WORKING:
        return Judged(WORKS)
    said = said_by(result)
    truth = truth_of(said, Plant(result.drive), (0.0, "work_rpm"))
    cause = "; ".join(text for text in (said or verdict.outcome, verdict.why) if text)
    return Judged(TRUE if truth else WRONG, cause, truth)


def said_by(result):
    """The first fault, or the first line that the drive refused, or an empty text."""
    found = result.trace["fault"][result.trace["fault"] != 0]
    if len(found):
        return enumerator(result, "fault", found[0])
    first = next(iter(refusals(result.console, typed(result.scenario, result.drive))), None)
    return str(first) if first else ""


def failed(result):
    """The limits that failed, in a few words."""
    return "; ".join(name for name, figure in result.figures.items() if figure.passed is False and name != NAME)
