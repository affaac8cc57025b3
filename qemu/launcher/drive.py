# SPDX-License-Identifier: MIT
"""A motor on its inverter: what the twin is told, what a person types at the console, and names for expressions."""
import math
from dataclasses import dataclass, field

from .aligned import ON_TIME_S
from .consistency import asked_about, check_voltage
from .data import complete, lay_over, load_inverter, load_motor, load_sensors
from .effects import parse_plant
from .params import UNSAID, coarse_notes, detuned, exact_params
from .saturation import inverse_at_rest
from .schema import SECTIONS
from .shaft_margin import left_hz
from .spread import check_spread, drawn
from .stage import check_stage

RPM = math.pi / 30  # rad/s in one rpm
REST_TIME_S = 0.35  # of a start: offsets of the sensors, 0.13 s, and the wiring, up to 0.2 s
AXES_TIME_S = 0.4   # in which the axis of reluctance is measured, twice
ON_PERIODS = 28     # of the rotor swinging about the field, that an alignment takes; 15 to 20, 25 if it was just let go
WAY_SHARE = 0.016      # of speed_max, with which the field turns at most
WAY_TURNS = 2.7        # for which it does, electrical
WAY_PERIODS = 8        # of ON_PERIODS, if the way takes longer
AGAIN_PERIODS = 40  # if the inertia that was told is far too small, so that a second attempt is needed
# of the observer's tracking loop, in |w|: a fifth of its margin, within these (firmware/control/observer.c); the margin without
# current is the EMF by a 256th and a 64th of the bus (docs/sensorless.md)
OBSERVER_POLES, OBSERVER_PART, HIDDEN_BUS = (0.3, 1.5), 5, 1 / 256 + 1 / 64
OBSERVER_LEADS = 4.5  # the margin from which it does (OBSERVER_LEADS_Q8)
HALL_MEAN_S = 0.02  # over which a speed by Hall switches is averaged at most: MEAN_CLOCKS of firmware/control/hall.c
FIELD_SHARE = 0.15  # of the torque of i_max, for turning a prescribed field up
SETTLE_TAUS = 60    # of the speed loop, until nothing is left of a step or of the end of a ramp
LEFT_TAUS = 30      # the same by what a soft coupling leaves: half of that, damped by 1, leaves 0.5 % of a step
SPEED_SHARES = {"work_rpm": 0.375, "mid_rpm": 0.25, "low_rpm": 0.125, "slow_rpm": 0.0075}
_TWIN_NAMES = {"counts_per_rev": "encoder_counts"}  # where a key of the data file has another name in the twin
_TOLD = {"chopper_on_v", "chopper_off_v", "modulator_osr",  # the drive is: it switches the chopper, and sets the filters
         "fitted"}  # an event cuts the encoder's wires: config.py
_ALWAYS = {"motor.copper_tempco_per_k", "inverter.diode_v"}  # whose default in the twin is not neutral


@dataclass
class Drive:
    """The pair, with the load's inertia and the console parameters worked out. `params` may be changed before a run.

    `motor` and `inverter` are nominal, as the firmware knows them. The plant is what `plant`, `spread` and `seed` make of them:
    see plant_items(). `notes` are lines for the report; `changed` says which parameters are not from the data files, and why.
    `aligned`: the firmware gets to know where the rotor stands (aligned.py).
    """
    motor: object
    inverter: object
    plant: object = field(default_factory=parse_plant)
    spread: float = 0.0
    seed: int = 1
    detune: str = ""
    params: dict = field(default_factory=dict)
    changed: dict = field(default_factory=dict)
    notes: list = field(default_factory=list)
    aligned: bool = False

    @property
    def load_inertia_kgm2(self):
        return self.motor["load"]["inertia_ratio"] * self.motor["mechanical"]["inertia_kgm2"]

    @property
    def inertia_kgm2(self):
        return self.motor["mechanical"]["inertia_kgm2"] + self.load_inertia_kgm2

    @property
    def torque_per_ampere(self):
        """N m per peak ampere of i_q while i_d = 0: 1.5 p psi (amplitude-invariant transform)."""
        return 1.5 * self.motor["electrical"]["pole_pairs"] * self.motor["electrical"]["flux_wb"]

    @property
    def on_time_s(self):
        """From `on` to operation without load, as scenarios plan it: what the firmware's alignment makes of its parameters.

        Most starts are shorter. One that needs a further attempt may be longer: 9.2 s of abb_m2bj100l with seed 2.

        The rotor hangs on the current like a pendulum, w0^2 = p Kt I / J; firmware/settings/tuning_start.c has the same.
        """
        if self.aligned:
            return ON_TIME_S
        told, true = (self._swing_s(inertia) for inertia in (self.params["inertia_gmm2"] * 1e-9, self.inertia_kgm2))
        rest_s = REST_TIME_S + (AXES_TIME_S if self.is_reluctant else 0)
        way_hz = WAY_SHARE * self.params["speed_max_rpm"] / 60 * self.params["pole_pairs"]
        slow_s = max(WAY_TURNS / way_hz - WAY_PERIODS * told, 0)
        return rest_s + slow_s + ON_PERIODS * told + (AGAIN_PERIODS * true if told < 0.6 * true else 0)

    def _swing_s(self, inertia_kgm2):
        stiffness = self.motor["electrical"]["pole_pairs"] * self.torque_per_ampere * self._holding_a
        return min(max(2 * math.pi * math.sqrt(inertia_kgm2 / stiffness), 0.03), 1.5)

    @property
    def inverse_at_rest(self):
        """(1 / Ld, 1 / Lq) without current, for small changes."""
        saturation, electrical = self.motor.saturation(), self.motor["electrical"]
        if saturation is None:
            return 1 / electrical["ld_h"], 1 / electrical["lq_h"]
        return inverse_at_rest(saturation, electrical["flux_wb"])

    @property
    def stiffer(self):
        """(d, q): the inductances that the current loop is tuned for, by those without current; 1 where iron saturates little.

        A data file with a measured map has those of the rated current, where there is least. At a smaller current the loop's
        crossover lies between what it was tuned to and this share of it. In q it follows the current if lq_rest_h is told.
        """
        electrical = self.motor["electrical"]
        if self.motor.saturation() is None:
            return 1.0, 1.0
        by_ld, by_lq = self.inverse_at_rest
        tuned_lq_h = max(electrical["lq_h"], self.motor["control"]["lq_rest_h"])
        return min(1.0, electrical["ld_h"] * by_ld), min(1.0, tuned_lq_h * by_lq)

    @property
    def _turns_away_a(self):
        """The current at which reluctance holds the rotor across it as firmly as magnets hold it along: psi / (Lq - Ld)."""
        flux, ld, lq = self.params["flux_uwb"], *(
            self.params[f"{axis}_apparent_uh"] or self.params[f"{axis}_uh"] for axis in ("ld", "lq"))
        return flux / (lq - ld) if lq > ld else math.inf

    @property
    def is_reluctant(self):
        """Reluctance outweighs the magnets, by what the drive is told."""
        return self._param_a("i_max_ma") > 1.5 * self._turns_away_a

    @property
    def _holding_a(self):
        """What the rotor hangs on at the start: i_align, or that with which magnets alone would hold it as reluctance does."""
        if not self.is_reluctant:
            return self._param_a("i_align_ma")
        current = min(3 * self._turns_away_a, self._param_a("i_max_ma"))
        share = self._turns_away_a / current
        return current * (1 - share * share) / share

    @property
    def slower(self):
        """The speed loop takes its gain from inertia and flux as told; its bandwidth follows from those there are."""
        told = self.params["inertia_gmm2"] * 1e-9 / (self.params["flux_uwb"] * 1e-6)
        return max(1.0, self.inertia_kgm2 / self.motor["electrical"]["flux_wb"] / told)

    @property
    def sensed_deg(self):
        """What the sensor of the angle leaves open, electrical: see names()."""
        count_deg = 360 * self.motor["electrical"]["pole_pairs"] / self.motor["encoder"]["counts_per_rev"]
        hall_deg = 35.0 + math.degrees(self.motor["hall"]["hall_hysteresis_rad"])  # by which each edge comes late, either way
        return {0: min(count_deg, 90.0), 1: 90.0, 2: hall_deg}[int(self.motor["control"]["angle_source"])]

    @property
    def starts_by_field(self):
        """With neither sensor nor injection, up to where the observer takes over."""
        return self.motor["control"]["angle_source"] == 1 and not self.motor["control"]["injection_v"]

    def is_led_by_field(self, turn_s):
        """Whether it still is at this speed, without current: the EMF is too little to be seen."""
        return self.starts_by_field and self._margin(turn_s) < OBSERVER_LEADS

    def _margin(self, turn_s):
        w = 2 * math.pi / turn_s * self.motor["electrical"]["pole_pairs"]
        return w * self.motor["electrical"]["flux_wb"] / (HIDDEN_BUS * self.inverter["supply"]["vbus_v"])

    def heard_s(self, turn_s):
        """By how much speed is known late at the earliest: one and a half counts; with Hall switches, half a sector, and half
        of the electrical turn, or of 20 ms, over which their places average out; without a sensor, the lag of a tracking loop
        which is the slower the less EMF there is beside what dead time hides, or a swing on the field that leads."""
        electrical_s = turn_s / self.motor["electrical"]["pole_pairs"]
        if self.is_led_by_field(turn_s):
            return math.sqrt(self.inertia_kgm2 / self.motor["electrical"]["pole_pairs"] / self.torque_per_ampere
                             / self._param_a("i_max_ma"))
        poles = min(max(self._margin(turn_s) / OBSERVER_PART, OBSERVER_POLES[0]), OBSERVER_POLES[1])
        return {0: 1.5 * turn_s / self.motor["encoder"]["counts_per_rev"],
                1: 2 / poles * electrical_s / (2 * math.pi),
                2: electrical_s / 12 + min(electrical_s, HALL_MEAN_S) / 2}[self.motor["control"]["angle_source"]]

    @property
    def holds_rad_s2(self):
        """With what acceleration the position loop's gain answers a radian: the crossovers of the position and speed loops,
        told of the inertia there is."""
        speed_hz = self.motor["control"]["speed_bw_hz"]
        return (2 * math.pi) ** 2 * speed_hz * (self.params.get("position_bw_hz", 0) or speed_hz / 5)

    @property
    def stuck_deg(self):
        """As far off its position friction, stiction and cogging hold the shaft against that."""
        shaft, load = self.motor["mechanical"], self.motor["load"]
        holds_nm = shaft["friction_coulomb_nm"] + max(load["coulomb_nm"], load["stiction_nm"]) + shaft["cogging_nm"]
        return math.degrees(holds_nm / self.inertia_kgm2 / self.holds_rad_s2)

    @property
    def swing_s(self):
        """1 / (resonance of the coupling, rad/s), or 0 where it is rigid."""
        stiffness, load = self.motor["load"]["stiffness_nm_rad"], self.load_inertia_kgm2
        if not stiffness or not load:
            return 0.0
        rotor = self.motor["mechanical"]["inertia_kgm2"]
        return math.sqrt(rotor * load / (rotor + load) / stiffness)

    @property
    def left_tau_s(self):
        """Of the speed loop as told, or with what a coupling too soft to be filtered leaves of its bandwidth."""
        hz, rotor, load = self.motor["control"]["speed_bw_hz"], self.motor["mechanical"]["inertia_kgm2"], self.motor["load"]
        if load["stiffness_nm_rad"] and self.load_inertia_kgm2:
            hz = left_hz(hz, rotor, self.load_inertia_kgm2, load["stiffness_nm_rad"], load["damping_nms"])
        return 1 / (2 * math.pi * hz)

    @property
    def field_accel_rad_s2(self):
        """The most that a prescribed field is turned up with: settings/tuning_start.c."""
        return FIELD_SHARE * 1.5 * self.params["pole_pairs"] * self.params["flux_uwb"] * 1e-6 * self._param_a("i_max_ma") / (
            self.params["inertia_gmm2"] * 1e-9)

    @property
    def linear_step_a(self):
        """The largest current step that stays a linear one.

        A loop of crossover w answers a step D of its reference with w L D volts at once; that, plus the resistive drop
        at rated current, may use 80 % of what the bus gives (vbus/sqrt(3)). At most 60 % of rated current.
        """
        electrical, rated = self.motor["electrical"], self.motor["rating"]["rated_current_a"]
        available_v = 0.8 * self.inverter["supply"]["vbus_v"] / math.sqrt(3)
        headroom_v = max(available_v - electrical["resistance_ohm"] * rated, 0.0)
        crossover = 2 * math.pi * self.motor["control"]["current_bw_hz"]
        return min(0.6 * rated, headroom_v / (crossover * electrical["lq_h"]))

    def names(self):
        """What expressions in scenario files may use. Nominal values, which neither SPREAD nor DETUNE moves, but for `slower`.

        ratings    rated_torque_Nm, rated_current_A (peak), rated_speed_rpm, pole_pairs, torque_per_ampere (N m per peak
                   ampere, linear machine with i_d = 0), max_torque_Nm (what i_max then gives; by reluctance it may be more)
        limits     speed_max_rpm, overspeed_rpm, ramp_rpm_s, i_max_A, i_trip_A, i_align_A, v_min_V, v_max_V, oc_trip_A
        stage      vbus_V, i_range_A, v_range_V, encoder_counts
        loops      current_bw_hz, speed_bw_hz, speed_tau_s (1 / (2 pi speed_bw_hz)), left_tau_s (the same, or longer where a
                   coupling too soft to be filtered leaves less bandwidth), linear_step_A (see there), slower (by how much
                   less the speed loop answers if DETUNE tells a smaller inertia or a larger flux than there is; or 1),
                   stiffer_d, stiffer_q (inductances as tuned for, by those without current, where iron saturates; or 1)
        speeds     whole rpm, shares of speed_max_rpm: work_rpm 0.375 (1500 of 4000), mid_rpm 0.25, low_rpm 0.125,
                   slow_rpm 0.0075 (30 of 4000; at least 1)
        inertia    inertia_kgm2 (rotor and load), rotor_inertia_kgm2, t_mech_s (inertia * rated speed / rated torque: from 0 to
                   rated speed with rated torque), accel_torque_Nm (what the ramp takes), load_accel_rad_s2 (rated torque /
                   inertia)
        losses     resistance_ohm, bus_energy_J (what brings the bus from vbus_V to v_max_V)
        times      ramp_time_s (0 to work_rpm at the ramp), field_ramp_s (the same with a prescribed field), rise_time_s
                   (which of them it is: a field leads where there is neither sensor nor injection),
                   max_ramp_time_s (0 to speed_max_rpm), turn_time_s (one turn at
                   work_rpm), electrical_tau_s (lq_h / resistance_ohm), on_time_s (from `on` to OPERATION_ENABLED with
                   alignment, as planned: few starts take longer), settle_s (after a step or a ramp), steady_s (a window of
                   rest: a turn or more)
        sensor     sensed_deg (electrical, between what the sensor of the angle tells apart: a count; half a sector of Hall
                   switches, 5 degrees and their hysteresis; 90 without either, where a field leads), sensed_share (its
                   sine), heard_s (by how much speed is known late at work_rpm: see there), led_share (1 if a field leads
                   there, or 0)
        position   stuck_deg (as far off friction, stiction and cogging hold the shaft against the position loop's gain alone),
                   lag_deg (as far behind it takes that to follow ramp_rpm_s: what the feed-forward leaves is a part of it)
        shaft      swing_s (1 / resonance in rad/s of the coupling, or 0: a load step falls on the load first, and comes back)
        units      rad_s_per_rpm
        """
        rating, control, electrical = self.motor["rating"], self.motor["control"], self.motor["electrical"]
        speeds = {name: max(1, round(share * control["speed_max_rpm"])) for name, share in SPEED_SHARES.items()}
        ramp, speed_tau_s, supply = control["ramp_rpm_s"], 1 / (2 * math.pi * control["speed_bw_hz"]), self.inverter["supply"]
        turn_time_s, left_tau_s = 60 / speeds["work_rpm"], self.left_tau_s
        field_ramp_s = speeds["work_rpm"] * RPM / min(ramp * RPM, self.field_accel_rad_s2)
        return {
            "rated_torque_Nm": rating["rated_torque_nm"], "rated_current_A": rating["rated_current_a"],
            "rated_speed_rpm": rating["rated_speed_rpm"], "pole_pairs": electrical["pole_pairs"],
            "torque_per_ampere": self.torque_per_ampere, "max_torque_Nm": self.torque_per_ampere * self._param_a("i_max_ma"),
            "speed_max_rpm": self.params["speed_max_rpm"], "overspeed_rpm": self.params["overspeed_rpm"],
            "ramp_rpm_s": self.params["ramp_rpm_s"], "i_max_A": self._param_a("i_max_ma"),
            "i_trip_A": self._param_a("i_trip_ma"), "i_align_A": self._param_a("i_align_ma"),
            "v_min_V": self._param_a("v_min_mv"), "v_max_V": self._param_a("v_max_mv"),
            "oc_trip_A": self.inverter["bridge"]["oc_trip_a"], "vbus_V": self.inverter["supply"]["vbus_v"],
            "i_range_A": self.inverter["sensor"]["i_range_a"], "v_range_V": self.inverter["sensor"]["v_range_v"],
            "encoder_counts": self.motor["encoder"]["counts_per_rev"], "current_bw_hz": control["current_bw_hz"],
            "speed_bw_hz": control["speed_bw_hz"], "speed_tau_s": speed_tau_s,
            "stiffer_d": self.stiffer[0], "stiffer_q": self.stiffer[1], "linear_step_A": self.linear_step_a,
            "left_tau_s": left_tau_s, "slower": self.slower, **speeds,
            "inertia_kgm2": self.inertia_kgm2, "rotor_inertia_kgm2": self.motor["mechanical"]["inertia_kgm2"],
            "t_mech_s": self.inertia_kgm2 * rating["rated_speed_rpm"] * RPM / rating["rated_torque_nm"],
            "accel_torque_Nm": self.inertia_kgm2 * ramp * RPM,
            "load_accel_rad_s2": rating["rated_torque_nm"] / self.inertia_kgm2,
            "field_ramp_s": field_ramp_s, "rise_time_s": field_ramp_s if self.starts_by_field else speeds["work_rpm"] / ramp,
            "ramp_time_s": speeds["work_rpm"] / ramp, "max_ramp_time_s": control["speed_max_rpm"] / ramp,
            "turn_time_s": turn_time_s, "on_time_s": self.on_time_s,
            "settle_s": max(0.2, SETTLE_TAUS * speed_tau_s, LEFT_TAUS * left_tau_s), "steady_s": max(0.25, turn_time_s),
            "resistance_ohm": electrical["resistance_ohm"],
            "bus_energy_J": supply["bus_capacitance_f"] / 2 * (self._param_a("v_max_mv") ** 2 - supply["vbus_v"] ** 2),
            "sensed_deg": self.sensed_deg, "sensed_share": math.sin(math.radians(self.sensed_deg)),
            "heard_s": self.heard_s(turn_time_s), "swing_s": self.swing_s,
            "led_share": float(self.is_led_by_field(turn_time_s)),
            "stuck_deg": self.stuck_deg, "lag_deg": math.degrees(ramp * RPM / self.holds_rad_s2),
            "electrical_tau_s": electrical["lq_h"] / electrical["resistance_ohm"], "rad_s_per_rpm": RPM,
        }

    def _param_a(self, name):
        """A parameter in thousandths, as amperes or volts."""
        return self.params[name] / 1000


def load_drive(motor_name, overrides=None, plant="full", spread=0, seed=1, detune="", aligned=False, sensors=""):
    """The motor by name, its inverter, and overrides: {"motor": {table: {key: value}}, "inverter": ..., "params": ...}.

    plant, spread, seed, detune   as PLANT (effects.py), SPREAD (spread.py), SEED and DETUNE (params.py)
    sensors   a file of qemu/sensors, or path to one, laid over what the inverter's file says of its sensors
    """
    overrides = overrides or {}
    motor = load_motor(motor_name)
    inverter = load_inverter(motor.inverter, motor.path)
    check_voltage(motor, inverter)
    motor.override(overrides.get("motor", {}))
    if sensors:
        lay_over(inverter, load_sensors(sensors))
    inverter.override(overrides.get("inverter", {}))
    check_stage(motor, inverter)
    complete(motor, inverter)
    drive = Drive(motor, inverter, parse_plant(plant), check_spread(spread), seed, str(detune or "").strip(), aligned=aligned)
    exact = exact_params(drive)
    drive.notes = coarse_notes(exact) + asked_about(motor, inverter)
    drive.params, drive.changed = detuned({name: round(value) for name, value in exact.items()}, drive.detune)
    drive.params.update(overrides.get("params", {}))
    drive.changed.update(dict.fromkeys(overrides.get("params", {}), "override"))
    return drive


def console_params(drive):
    """The firmware's parameters as the data files have them: integers in the unit that ends their name."""
    return {name: round(value) for name, value in exact_params(drive).items()}


def preamble(drive):
    """The console lines that tell the firmware which motor and inverter it has."""
    return [f"set {name} {value}" for name, value in drive.params.items() if UNSAID.get(name) != value]


def twin_items(drive):
    """(section.key, value) pairs of the plant for the twin's configuration. What is at its neutral default is left out."""
    items, defaults = {}, {}
    for device in (drive.motor, drive.inverter):
        values = drawn(device, drive.seed, drive.spread)
        for table, key, item in _plant_keys(device):
            items[item], defaults[item] = values[table][key], device.tables[table][key].default
        if device.kind == "motor":
            items["load.inertia_kgm2"] = values["mechanical"]["inertia_kgm2"] * values["load"]["inertia_ratio"]
            items.update(_saturation_items(device, values["electrical"]))
    return [(item, value) for item, value in drive.plant.apply(items).items()
            if item in _ALWAYS or value != defaults.get(item)]


def _plant_keys(device):
    """(table, key, section.key of the twin) of everything the twin takes as it stands in the file."""
    for table, keys in device.tables.items():
        if table in SECTIONS and table != "saturation":
            for key in keys:
                if key != "inertia_ratio" and key not in _TOLD:
                    yield table, key, f"{SECTIONS[table]}.{_TWIN_NAMES.get(key, key)}"


def _saturation_items(motor, electrical):
    """The map's coefficients; tolerances of the inductances and of the magnets stretch it as a whole."""
    saturation, nominal = motor.saturation(), motor["electrical"]
    if saturation is None:
        return {}
    ratio = {key: electrical[key] / nominal[key] for key in ("ld_h", "lq_h", "flux_wb")}
    scaled = saturation.scaled(ratio["ld_h"], ratio["lq_h"], ratio["flux_wb"])
    return {f"motor.{key}": value for key, value in scaled.keys().items()}
