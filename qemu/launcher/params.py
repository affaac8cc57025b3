# SPDX-License-Identifier: MIT
"""The firmware's parameters: which key of which data file each is told from, its range, and DETUNE.

The ranges are the firmware's own: they are read from param_table of the image (firmware/settings/params.c), so that no
copy can differ.
What the firmware is told are the data sheets' values: neither PLANT nor SPREAD moves them. DETUNE does, to see what a wrong
value costs: "resistance_mohm*1.3 flux_uwb*0.8 pole_pairs=5 encoder_counts+96".
"""
import re
from dataclasses import dataclass

from .errors import LauncherError, choice

# parameter -> (file, table, key, units of the parameter in one of the key's)
SOURCES = {
    "pole_pairs": ("motor", "electrical", "pole_pairs", 1),
    "encoder_counts": ("motor", "encoder", "counts_per_rev", 1),
    "resistance_mohm": ("motor", "electrical", "resistance_ohm", 1e3),
    "ld_uh": ("motor", "electrical", "ld_h", 1e6),
    "lq_uh": ("motor", "electrical", "lq_h", 1e6),
    "ld_apparent_uh": ("motor", "control", "ld_apparent_h", 1e6),
    "lq_apparent_uh": ("motor", "control", "lq_apparent_h", 1e6),
    "lq_rest_uh": ("motor", "control", "lq_rest_h", 1e6),
    "flux_uwb": ("motor", "electrical", "flux_wb", 1e6),
    "inertia_gmm2": ("motor", "mechanical", "inertia_kgm2", 1e9),
    "i_range_ma": ("inverter", "sensor", "i_range_a", 1e3),
    "v_range_mv": ("inverter", "sensor", "v_range_v", 1e3),
    "i_max_ma": ("motor", "control", "i_max_a", 1e3),
    "i_trip_ma": ("motor", "control", "i_trip_a", 1e3),
    "i_align_ma": ("motor", "control", "i_align_a", 1e3),
    "v_min_mv": ("inverter", "protection", "v_min_v", 1e3),
    "v_max_mv": ("inverter", "protection", "v_max_v", 1e3),
    "chopper_on_mv": ("inverter", "supply", "chopper_on_v", 1e3),
    "chopper_off_mv": ("inverter", "supply", "chopper_off_v", 1e3),
    "bus_capacitance_uf": ("inverter", "supply", "bus_capacitance_f", 1e6),
    "speed_max_rpm": ("motor", "control", "speed_max_rpm", 1),
    "overspeed_rpm": ("motor", "control", "overspeed_rpm", 1),
    "ramp_rpm_s": ("motor", "control", "ramp_rpm_s", 1),
    "stop_max_ms": ("motor", "control", "stop_max_s", 1e3),
    "current_bw_hz": ("motor", "control", "current_bw_hz", 1),
    "pwm_update": ("motor", "control", "pwm_update", 1),
    "speed_bw_hz": ("motor", "control", "speed_bw_hz", 1),
    "torque_mean_ms": ("motor", "control", "torque_mean_s", 1e3),
    "i_rated_ma": ("motor", "rating", "rated_current_a", 1e3),
}
# told besides where a period has two samples; the firmware's initial values are one, and low-side shunts
SOURCES_OF_TWO = {
    "pwm_samples": ("motor", "control", "pwm_samples", 1),
    "low_side_shunts": ("inverter", "sensor", "shunt", 1),
}
# told besides where modulators measure the currents
SOURCES_OF_MODULATORS = {
    "modulator_osr": ("inverter", "sensor", "modulator_osr", 1),
    "low_side_shunts": ("inverter", "sensor", "shunt", 1),
}
# told besides where the saliency is to tell the angle without an encoder; the firmware's initial values are 0
SOURCES_OF_INJECTION = {
    "injection_mv": ("motor", "control", "injection_v", 1e3),
    "injection_silent": ("motor", "control", "injection_silent", 1),
    "cross_pm": ("motor", "control", "cross_saturation", 1e3),
}
# told besides where it is not the encoder that tells the angle
SOURCES_OF_ANGLE = {"angle_source": ("motor", "control", "angle_source", 1)}
# the firmware's initial values, which are not typed: what follows would come later, and each start be another one
UNSAID = {"injection_silent": 0}
COARSE_PERCENT = 2.0  # of a value, lost to the firmware's whole units, which the report mentions
_ITEM = re.compile(r"([a-z_0-9]+)([*/=+-])([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)")


@dataclass(frozen=True)
class Range:
    """Of a parameter, in its own unit."""
    low: int
    high: int


def ranges_of(symbols):
    """{parameter: Range} as the image's param_table has them."""
    count = symbols.integer("param_count", 4)
    ranges = {}
    for index in range(count):
        row = f"param_table[{index}]"
        name = symbols.text(symbols.integer(f"{row}.name", 4))
        ranges[name] = Range(symbols.integer(f"{row}.min", 4, signed=True), symbols.integer(f"{row}.max", 4, signed=True))
    return ranges


def exact_params(drive):
    """{parameter: value before rounding}, from the nominal data."""
    devices = {"motor": drive.motor, "inverter": drive.inverter}
    told = {**SOURCES, **(SOURCES_OF_TWO if drive.motor["control"]["pwm_samples"] != 1 else {}),
            **(SOURCES_OF_MODULATORS if drive.inverter["sensor"]["modulator_osr"] != 0 else {}),
            **(SOURCES_OF_INJECTION if drive.motor["control"]["injection_v"] != 0 else {}),
            **(SOURCES_OF_ANGLE if drive.motor["control"]["angle_source"] != 0 else {})}
    exact = {name: devices[file][table][key] * units for name, (file, table, key, units) in told.items()}
    exact["inertia_gmm2"] = drive.inertia_kgm2 * 1e9  # rotor and load
    return exact


def coarse_notes(exact):
    """A line for each parameter that rounding to whole units changes by more than COARSE_PERCENT."""
    notes = []
    for name, value in exact.items():
        change = 100 * (round(value) / value - 1) if value else 0.0
        if abs(change) > COARSE_PERCENT:
            notes.append(f"{name}: the firmware takes whole units, {value:.4g} becomes {round(value)} ({change:+.1f} %)")
    return notes


def check_ranges(drive, ranges):
    """One line that names the file's key when the firmware would refuse a value."""
    missing = sorted(set(drive.params) - set(ranges))
    if missing:
        raise LauncherError(f"the image has no parameter '{missing[0]}'")
    for name, value in drive.params.items():
        limits = ranges[name]
        if limits.low <= value <= limits.high:
            continue
        if name in drive.changed:
            raise LauncherError(f"{drive.changed[name]}: the firmware takes {name} {limits.low}..{limits.high}, not {value}")
        file, table, key, units = {**SOURCES, **SOURCES_OF_TWO, **SOURCES_OF_MODULATORS, **SOURCES_OF_INJECTION,
                                   **SOURCES_OF_ANGLE}[name]
        device = drive.motor if file == "motor" else drive.inverter
        raise LauncherError(f"{device.where}: [{table}] {key} {device[table][key]:g}: the firmware takes"
                            f" {limits.low / units:g}..{limits.high / units:g} (parameter {name} {limits.low}..{limits.high},"
                            f" here {value})")


def detuned(params, text):
    """(params as DETUNE changes them, {parameter: "DETUNE item"})."""
    result, changed = dict(params), {}
    for item in str(text or "").replace(",", " ").split():
        match = _ITEM.fullmatch(item)
        if match is None:
            raise LauncherError(f"DETUNE '{item}' is none of name*1.3, name/2, name=5, name+2, name-2")
        name, sign, number = match.group(1), match.group(2), float(match.group(3))
        if name not in result:
            raise LauncherError(f"DETUNE '{item}': no parameter '{name}'; there are: {choice(name, params)}")
        if sign == "/" and number == 0:
            raise LauncherError(f"DETUNE '{item}': division by zero")
        value = {"*": lambda a, b: a * b, "/": lambda a, b: a / b, "=": lambda a, b: b, "+": lambda a, b: a + b,
                 "-": lambda a, b: a - b}[sign](result[name], number)
        if abs(value) > 2**31:
            raise LauncherError(f"DETUNE '{item}': {value:g} is beyond 32 bits")
        result[name], changed[name] = round(value), f"DETUNE {item}"
    return result, changed
