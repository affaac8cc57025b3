# SPDX-License-Identifier: MIT
"""What a data file may hold: every table and key with its range, its default, and what it means.

A key without a default must be given. The default of an optional key is neutral: the effect it describes is absent. The
page docs/motors.md has these tables as text (`qemu/run.py keys` prints them); the firmware's own ranges are not repeated
here, see ranges.py.
"""
import math
from dataclasses import dataclass

REQUIRED = None
BY_RULE = "by rule"  # left out, it follows from the others: see rules.py
_TURN = 2 * math.pi


@dataclass(frozen=True)
class Key:
    """A number: allowed range, default, meaning; `integer` ones are whole, and no draw moves them."""
    low: float
    high: float
    default: object
    meaning: str
    integer: bool = False

    @property
    def required(self):
        return self.default is REQUIRED


def _whole(low, high, default, meaning):
    return Key(low, high, default, meaning, integer=True)


def _cogging(prefix):
    which = "cogging torque" if prefix == "cogging" else "a further one"
    return {f"{prefix}_nm": Key(0, 1e3, 0.0, f"{which}: amplitude of nm * sin(per_rev * angle + rad)"),
            f"{prefix}_per_rev": _whole(1, 10000, 1, "its periods in one turn: a multiple of poles and slots"),
            f"{prefix}_rad": Key(-_TURN, _TURN, 0.0, "its phase")}


# x = psi_d less psi_f, q = psi_q: docs/plant.md
SLOT_FORMS = {"xx": "x^2 cos", "qq": "q^2 cos", "xqq": "x q^2 cos", "q4": "q^4 cos", "xq": "x q sin", "q3": "q^3 sin"}

MOTOR_TABLES = {
    "electrical": {
        "pole_pairs": _whole(1, 100, REQUIRED, "pairs of poles"),
        "resistance_ohm": Key(1e-4, 1e3, REQUIRED, "of one phase of a star at 25 degC"),
        "ld_h": Key(1e-7, 10, REQUIRED, "inductance of one phase, d axis (along the magnets)"),
        "lq_h": Key(1e-7, 10, REQUIRED, "the same, q axis"),
        "flux_wb": Key(1e-6, 10, REQUIRED, "flux linkage of the magnets, one phase, peak")},
    "saturation": {
        "loss_d": Key(0, 0.9, 0.0, "short form: share of ld_h that is lost at i_d = at_a, i_q = 0"),
        "loss_q": Key(0, 0.9, 0.0, "short form: share of lq_h (incremental) that is lost at i_q = at_a, i_d = 0"),
        "loss_flux": Key(0, 0.9, 0.0, "short form: share of the magnets' flux, so of torque, lost at i_q = at_a, i_d = 0"),
        "at_a": Key(1e-3, 1e4, BY_RULE, "short form: the current of the three above; 1.5 times rated_current_a if left out"),
        "sat_a_d0": Key(0, 1e9, 0.0, "full form: coefficients of the current as a function of flux (A/Vs^n), below"),
        "sat_a_dd": Key(0, 1e15, 0.0, "full form"),
        "sat_s": _whole(0, 8, 0, "full form: exponent S"),
        "sat_a_q0": Key(0, 1e9, 0.0, "full form"),
        "sat_a_qq": Key(0, 1e15, 0.0, "full form"),
        "sat_t": _whole(0, 8, 0, "full form: exponent T"),
        "sat_a_dq": Key(0, 1e15, 0.0, "full form"),
        "sat_u": _whole(0, 8, 0, "full form: exponent U"),
        "sat_v": _whole(0, 8, 0, "full form: exponent V"),
        "sat_a_b": Key(0, 1e15, 0.0, "full form: iron bridges beside the magnets"),
        "sat_a_bp": Key(0, 1e15, 0.0, "full form: iron bridges"),
        "sat_w": _whole(2, 4, 2, "full form: exponent W, 2 or 4"),
        "sat_k_q": Key(0, 100, 0.0, "full form: how much of the q flux passes the bridges"),
        "sat_psi_n_wb": Key(0, 10, 0.0, "full form: flux of the magnets behind the bridges"),
        "sat_i_f_a": Key(0, 1e5, 0.0, "full form: magnets in series with a linear gap, i_d -= sat_i_f_a")},
    "harmonics": {
        **{f"emf_{n}": Key(-0.5, 0.5, 0.0, f"harmonic {n} of the phase EMF, share of the fundamental, signed")
           for n in (5, 7, 11, 13, 17, 19)},
        "permeance_6": Key(-0.3, 0.3, 0.0, "6th harmonic of the inverse inductances over the electrical angle, relative"),
        "permeance_12": Key(-0.3, 0.3, 0.0, "12th, relative"),
        **{f"slots{order}_{form}": Key(-1e6, 1e6, 0.0, f"energy over the angle, order {order}: of {SLOT_FORMS[form]}, J")
           for order in (6, 12, 18, 36) for form in SLOT_FORMS}},
    "iron": {
        "iron_hysteresis_nm": Key(0, 1e3, 0.0, "drag torque of hysteresis, with the magnets' flux"),
        "iron_eddy_nms": Key(0, 1e3, 0.0, "drag torque of eddy currents over speed (rad/s)"),
        "iron_hysteresis_power": Key(0, 1, 0.0, "hysteresis drags with this power of the speed"),
        "iron_hysteresis_rad_s": Key(1e-3, 1e5, 1.0, "speed at which iron_hysteresis_nm is given, if it depends on it"),
        "iron_flux_power": Key(0, 2, 0.0, "iron drags with this power of the flux linkage; 0: its square"),
        "iron_teeth_per_a": Key(0, 10, 0.0, "what i_d drives through the teeth beside it, share of the loss without current")},
    "mechanical": {
        "inertia_kgm2": Key(1e-9, 1e3, REQUIRED, "of the rotor"),
        "friction_viscous_nms": Key(0, 1e3, 0.0, "torque over speed (rad/s), bearings"),
        "friction_coulomb_nm": Key(0, 1e3, BY_RULE, "constant part of the friction, bearings"),
        **_cogging("cogging"), **_cogging("cogging2"), **_cogging("cogging3")},
    "thermal": {
        "copper_tempco_per_k": Key(0, 0.01, 0.0, "of the resistance; copper has 0.0039"),
        "thermal_resistance_k_w": Key(1e-3, 1e4, 5.0, "winding to ambient"),
        "thermal_capacity_j_k": Key(1e-2, 1e6, 50.0, "of winding and housing, all that is warm"),
        "winding_resistance_k_w": Key(0, 1e4, 0.0, "winding to housing, a part of thermal_resistance_k_w"),
        "winding_capacity_j_k": Key(0, 1e6, 0.0, "of the winding alone; 0: winding and housing are one"),
        "ambient_c": Key(-55, 125, 25.0, "temperature around the motor"),
        "winding_rise_k": Key(0, 200, 0.0, "winding above ambient at the start"),
        "magnet_tempco_per_k": Key(-0.01, 0, 0.0, "of the flux: NdFeB -0.0011, ferrite -0.002; reference 25 degC"),
        "magnet_share": Key(0, 1, 0.5, "magnets: ambient + share * (winding - ambient)"),
        "temperature_sensor": _whole(0, 1, 1, "1: there is a temperature sensor in the winding"),
        "temperature_offset_k": Key(-50, 50, 0.0, "by which it is off"),
        "temperature_lag_s": Key(1e-3, 1e3, 2.0, "with which it follows the copper")},
    "rating": {
        "rated_current_a": Key(1e-3, 1e4, REQUIRED, "continuous, one phase, peak"),
        "rated_torque_nm": Key(1e-6, 1e5, REQUIRED, "continuous"),
        "rated_speed_rpm": Key(1, 2e5, REQUIRED, "at rated torque"),
        "max_speed_rpm": Key(1, 2e5, REQUIRED, "mechanical limit")},
    "encoder": {
        "counts_per_rev": _whole(4, 1000000, REQUIRED, "all four edges of A and B counted"),
        "index_angle_rad": Key(-_TURN, _TURN, 0.0, "of the index pulse"),
        "encoder_asymmetry": Key(-0.125, 0.125, 0.0, "A and B are high for half a line and twice this, share of a line"),
        "encoder_phase": Key(-0.2, 0.2, 0.0, "B away from 90 degrees after A, share of a line"),
        "encoder_ecc_rad": Key(0, 0.1, 0.0, "eccentricity: error once a turn, amplitude, mechanical"),
        "encoder_ecc_phase_rad": Key(-_TURN, _TURN, 0.0, "its phase"),
        "encoder_lost_per_rev": Key(0, 1000, 0.0, "counts lost in a turn"),
        "encoder_extra_per_rev": Key(0, 1000, 0.0, "counts too many in a turn"),
        "encoder_index_counts": Key(1, 1000, 1.0, "width of the index pulse"),
        "fitted": _whole(0, 1, 1, "0: there is none, and its inputs are open")},
    "hall": {
        "hall_angle_rad": Key(-_TURN, _TURN, 0.0, "electrical angle of the first edge"),
        "hall_error_a_rad": Key(-0.5, 0.5, 0.0, "placement of sensor A, electrical"),
        "hall_error_b_rad": Key(-0.5, 0.5, 0.0, "sensor B"),
        "hall_error_c_rad": Key(-0.5, 0.5, 0.0, "sensor C"),
        "hall_hysteresis_rad": Key(0, 0.4, 0.0, "by which each edge comes late, either way")},
    "start": {
        "initial_angle_rad": Key(-_TURN, _TURN, 0.0, "mechanical; SEED draws it over the whole turn")},
    "load": {
        "inertia_ratio": Key(0, 1e4, BY_RULE, "inertia of the load, as a multiple of the rotor's"),
        "viscous_nms": Key(0, 1e3, 0.0, "its friction over speed"),
        "stiffness_nm_rad": Key(0, 1e8, 0.0, "of the coupling; 0: rigid"),
        "damping_nms": Key(0, 1e3, 0.0, "of the coupling"),
        "coulomb_nm": Key(0, 1e3, 0.0, "its friction while it slides"),
        "stiction_nm": Key(0, 1e3, 0.0, "what breaks it away; at least coulomb_nm"),
        "stribeck_rad_s": Key(1e-3, 1e4, 1.0, "speed over which stiction gives way to sliding"),
        "fan_nms2": Key(0, 1e3, 0.0, "torque over speed squared")},
    "control": {
        "i_max_a": Key(1e-3, 1e4, BY_RULE, "limit of the current reference, peak"),
        "i_trip_a": Key(1e-3, 1e4, BY_RULE, "over-current threshold of the firmware"),
        "i_align_a": Key(1e-3, 1e4, BY_RULE, "d current that pulls the rotor into place"),
        "speed_max_rpm": Key(1, 1e6, BY_RULE, "largest command"),
        "overspeed_rpm": Key(1, 1e6, BY_RULE, "over-speed threshold"),
        "ramp_rpm_s": Key(1e-3, 1e9, BY_RULE, "slope of the speed reference"),
        "ld_apparent_h": Key(0, 10, 0.0, "flux over current at rated current, for MTPA, where iron saturates; 0: as ld_h"),
        "lq_apparent_h": Key(0, 10, 0.0, "the same, q axis"),
        "lq_rest_h": Key(0, 10, 0.0, "where lq_h is that of rated current: of q without current, incremental; 0: as lq_h"),
        "cross_saturation": Key(-0.249, 0.249, 0.0, "incremental L_dq by L_qq at rated current, where injection needs it"),
        "angle_source": _whole(0, 2, 0, "of the rotor: 0 the encoder, 1 the observer, 2 three Hall switches"),
        "injection_v": Key(0, 1000, 0.0, "without an encoder: voltage that shows the saliency; 0: none"),
        "injection_silent": _whole(0, 1, 0, "1: its pulses in drawn order, a noise; 0: in turn, a tone"),
        "stop_max_s": Key(0.1, 3600, BY_RULE, "a quick stop that takes longer ends with the bridge off"),
        "current_bw_hz": Key(1, 1e5, BY_RULE, "crossover of the current loops"),
        "pwm_update": _whole(0, 2, 0, "when voltages act: 0 from the next valley on, 1 from the next end on, 2 at once"),
        "pwm_samples": _whole(1, 2, 1, "of the currents, a PWM period; 2: with pwm_update 1 or 2, and no shunts"),
        "speed_bw_hz": Key(1e-2, 1e4, BY_RULE, "crossover of the speed loop"),
        "torque_mean_s": Key(1e-3, 4e-3, 1e-3, "where a shaft swings: the speed loop asks for the mean torque over so long")},
}

INVERTER_TABLES = {
    "supply": {
        "vbus_v": Key(1, 2000, REQUIRED, "of the supply without load; of a rectifier, the peak of its pulses"),
        "bus_capacitance_f": Key(1e-7, 10, REQUIRED, "of the bus"),
        "supply_resistance_ohm": Key(0, 100, 0.05, "with leads"),
        "supply_sinks": _whole(0, 1, 1, "1: takes current back"),
        "supply_inductance_h": Key(0, 1, 0.0, "with leads"),
        "bus_esr_ohm": Key(0, 10, 0.0, "of the bus capacitor"),
        "rectifier_hz": Key(0, 1000, 0.0, "mains frequency of a six-pulse rectifier, which never sinks; 0: direct current"),
        "supply_r2_ohm": Key(0, 100, 0.0, "battery: its slow branch"),
        "supply_c2_f": Key(0, 1e6, 0.0, "battery: its slow branch"),
        "chopper_ohm": Key(0, 1e4, 0.0, "brake resistor; 0: none"),
        "chopper_on_v": Key(0, 2000, 0.0, "bus voltage above which the drive switches it on"),
        "chopper_off_v": Key(0, 2000, 0.0, "and off")},
    "bridge": {
        "r_on_ohm": Key(1e-5, 10, REQUIRED, "of a conducting switch"),
        "oc_trip_a": Key(1e-3, 1e5, REQUIRED, "of the comparators"),
        "oc_blanking_s": Key(0, 1e-4, 0.0, "how long a comparator must see it"),
        "oc_delay_s": Key(0, 1e-4, 0.0, "from there to the gates"),
        "switch_v": Key(0, 10, 0.0, "constant part of a conducting switch's drop (IGBT)"),
        "diode_v": Key(0, 5, 0.8, "of a diode"),
        "diode_ohm": Key(0, 10, 0.0, "slope of a diode"),
        "coss_c": Key(0, 3e-5, 0.0, "charge of one switch's output capacitance at vbus_v, coulomb"),
        "switching_s": Key(0, 1e-5, 0.0, "both hard edges of a switch, at full voltage and full current: heat out of the bus"),
        "in_en": _whole(0, 1, 0, "1: an input and an enable for each leg; the driver's dead time is in turn_on_delay_s, too"),
        "turn_on_delay_s": Key(0, 5e-6, 0.0, "of driver and switch"),
        "turn_off_delay_s": Key(0, 5e-6, 0.0, "of driver and switch")},
    "sensor": {
        "i_range_a": Key(0.1, 1e4, REQUIRED, "phase current 2048 counts from the middle"),
        "v_range_v": Key(1, 1e4, REQUIRED, "bus voltage at 4096 counts"),
        "adc_bits": _whole(8, 12, 12, "of the converter"),
        "adc_conversion_s": Key(1e-8, 2e-6, 4e-7, "of the converter"),
        "shunt": _whole(0, 1, 0, "1: low-side shunts, which see a phase only while its low side conducts"),
        "amp_hz": Key(0, 1e9, 0.0, "bandwidth of the amplifiers; 0: ideal"),
        "ring_lsb": Key(0, 2048, 0.0, "ringing after an own edge: amplitude"),
        "ring_hz": Key(0, 1e9, 0.0, "its frequency"),
        "ring_tau_s": Key(1e-9, 1e-3, 1e-7, "its decay"),
        "edge_noise_lsb": Key(0, 2048, 0.0, "disturbance after any edge, rms"),
        "edge_noise_tau_s": Key(1e-9, 1e-3, 1e-7, "its decay"),
        "skew_b_s": Key(0, 2e-6, 0.0, "B is sampled this much after A"),
        "skew_c_s": Key(0, 2e-6, 0.0, "C after A"),
        "i_noise_lsb": Key(0, 100, 0.0, "noise of the currents, rms"),
        "v_noise_lsb": Key(0, 100, 0.0, "noise of the voltage, rms"),
        "modulators": _whole(0, 1, 0, "1: isolated modulators measure the currents; with FABRIC=rtl (docs/fabric.md)"),
        "modulator_noise": Key(0, 0.1, 0.0, "noise at each of their bits, rms, share of i_range_a"),
        "modulator_osr": _whole(0, 256, 0, "bits of their filter that the firmware is told: 32, 64, 128 or 256"),
        **{f"i_offset_{k}_lsb": Key(-500, 500, 0.0, f"offset of phase {k.upper()}") for k in "abc"},
        **{f"i_gain_{k}": Key(0.5, 1.5, 1.0, f"gain of phase {k.upper()}") for k in "abc"},
        "i_offset_drift_lsb_s": Key(-1000, 1000, 0.0, "offsets drift, per second"),
        "i_gain_drift_per_s": Key(-1, 1, 0.0, "gains drift, per second")},
    "protection": {
        "v_min_v": Key(1, 2000, REQUIRED, "under-voltage threshold"),
        "v_max_v": Key(1, 2000, REQUIRED, "over-voltage threshold")},
}

# tables that describe the plant: only their values may have a spread
PLANT_TABLES = {"electrical", "harmonics", "iron", "mechanical", "thermal", "encoder", "hall", "load",
                "supply", "bridge", "sensor"}
# section of the twin's configuration that a table's keys go to
SECTIONS = {**dict.fromkeys(("electrical", "saturation", "harmonics", "iron", "mechanical", "thermal", "start"), "motor"),
            "load": "load", "hall": "sensor", "encoder": "sensor", "supply": "inverter", "bridge": "inverter",
            "sensor": "sensor"}


def default_text(key):
    """The default as the page of keys shows it."""
    if key.required:
        return "required"
    return key.default if key.default is BY_RULE else f"{key.default:g}"


def page_lines():
    """The tables as markdown."""
    for title, tables in (("Motor", MOTOR_TABLES), ("Inverter", INVERTER_TABLES)):
        yield f"### {title} file"
        for table, keys in tables.items():
            yield ""
            yield f"| `[{table}]` | range | default | |"
            yield "|---|---|---|---|"
            for name, key in keys.items():
                whole = ", whole" if key.integer else ""
                yield f"| `{name}` | {key.low:.4g}...{key.high:.4g}{whole} | {default_text(key)} | {key.meaning} |"
        yield ""
