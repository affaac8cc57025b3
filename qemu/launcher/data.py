# SPDX-License-Identifier: MIT
"""Motor and inverter data files: load, check every entry, and work out what other parts need from them.

An entry is `key = { value = 0.36, source = "..." }`; a value without a source is an error, so is an unknown key.
"""
import math
import tomllib
from dataclasses import dataclass
from pathlib import Path

from .errors import LauncherError
from .paths import INVERTERS, MOTORS, shown

_TINY = 1e-12

# table -> key -> (lowest, highest) allowed value; a key ends with its unit
MOTOR_TABLES = {
    "electrical": {"pole_pairs": (1, 50), "resistance_ohm": (1e-4, 1e3), "ld_h": (1e-7, 10), "lq_h": (1e-7, 10),
                   "flux_wb": (1e-6, 100)},
    "mechanical": {"inertia_kgm2": (1e-9, 1e3), "friction_viscous_nms": (0, 1e3), "friction_coulomb_nm": (0, 1e4),
                   "cogging_nm": (0, 1e4), "cogging_per_rev": (1, 10000)},
    "thermal": {"copper_tempco_per_k": (0, 0.01), "thermal_resistance_k_w": (1e-4, 1e4),
                "thermal_capacity_j_k": (1e-3, 1e7), "ambient_c": (-55, 125)},
    "rating": {"rated_current_a": (1e-3, 1e4), "rated_torque_nm": (1e-6, 1e5), "rated_speed_rpm": (1, 2e5),
               "max_speed_rpm": (1, 2e5)},
    "encoder": {"counts_per_rev": (4, 65536), "index_angle_rad": (0, 2 * math.pi)},
    "start": {"initial_angle_rad": (-2 * math.pi, 2 * math.pi)},
    "load": {"inertia_ratio": (0, 1e4), "viscous_nms": (0, 1e3)},
    "control": {"i_max_a": (0.01, 2000), "i_trip_a": (0.01, 2000), "i_align_a": (0.01, 2000),
                "speed_max_rpm": (1, 30000), "overspeed_rpm": (1, 32000), "ramp_rpm_s": (1, 1000000),
                "current_bw_hz": (10, 2000), "speed_bw_hz": (1, 200)},
}
INVERTER_TABLES = {
    "supply": {"vbus_v": (1, 2000), "supply_resistance_ohm": (0, 100), "supply_sinks": (0, 1),
               "bus_capacitance_f": (1e-7, 10)},
    "bridge": {"r_on_ohm": (1e-5, 100), "diode_v": (0, 10), "turn_on_delay_s": (0, 5e-6), "turn_off_delay_s": (0, 5e-6),
               "oc_trip_a": (0.01, 1e5)},
    "sensor": {"i_range_a": (0.1, 2000), "v_range_v": (1, 2000), "adc_bits": (8, 16), "adc_conversion_s": (0, 2e-6),
               "i_noise_lsb": (0, 100), "v_noise_lsb": (0, 100), "i_offset_a_lsb": (-500, 500),
               "i_offset_b_lsb": (-500, 500), "i_offset_c_lsb": (-500, 500), "i_gain_a": (0.5, 1.5),
               "i_gain_b": (0.5, 1.5), "i_gain_c": (0.5, 1.5)},
    "protection": {"v_min_v": (1, 2000), "v_max_v": (1, 2000)},
}
_INTEGERS = {"pole_pairs", "counts_per_rev", "cogging_per_rev", "supply_sinks", "adc_bits"}


@dataclass
class Check:
    """A data-sheet point and how near the model must come to it."""
    value: float
    tolerance_percent: float
    source: str


@dataclass
class Device:
    """A checked data file: `values[table][key]` are numbers, `sources[table][key]` say where they are from."""
    key: str
    name: str
    summary: str
    path: Path
    values: dict
    sources: dict
    documents: dict
    checks: dict
    inverter: str = ""

    def __getitem__(self, table):
        return self.values[table]

    def override(self, changes):
        """Replaces values: {table: {key: number}}; used by tests and sweeps."""
        tables = MOTOR_TABLES if self.inverter else INVERTER_TABLES
        for table, entries in changes.items():
            for key, value in entries.items():
                if key not in tables.get(table, {}):
                    raise LauncherError(f"{self.key}: no parameter {table}.{key} to override")
                self.values[table][key] = _checked(value, tables[table][key], key, f"{self.key}: [{table}] {key}")


def available(folder):
    """Names of the data files in a folder, sorted."""
    return sorted(path.stem for path in Path(folder).glob("*.toml"))


def read_toml(path):
    """A TOML file as a dict, or one clear line."""
    try:
        with open(path, "rb") as file:
            return tomllib.load(file)
    except OSError as error:
        raise LauncherError(f"cannot read {shown(path)}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise LauncherError(f"{shown(path)}: {error}") from error


def find(name, folder, what):
    """The file of a name (or of a path ending in .toml); says what there is when there is none."""
    text = str(name)
    path = Path(text) if text.endswith(".toml") else Path(folder) / f"{text}.toml"
    if not path.is_file() or (not text.endswith(".toml") and Path(text).name != text):
        raise LauncherError(f"no {what} '{text}'; there are: {', '.join(available(folder))}")
    return path


def load_motor(name):
    """The motor `name` (a file of qemu/motors/, or a path to a .toml)."""
    motor = _load(find(name, MOTORS, "motor"), MOTOR_TABLES, needs_inverter=True)
    rating, control = motor["rating"], motor["control"]
    where = shown(motor.path)
    if motor["electrical"]["lq_h"] < motor["electrical"]["ld_h"] * 0.5:
        raise LauncherError(f"{where}: lq_h is less than half of ld_h: are the axes exchanged?")
    if control["i_max_a"] > control["i_trip_a"]:
        raise LauncherError(f"{where}: [control] i_max_a is above i_trip_a")
    if rating["rated_speed_rpm"] > rating["max_speed_rpm"] or control["speed_max_rpm"] > rating["max_speed_rpm"]:
        raise LauncherError(f"{where}: rated_speed_rpm or speed_max_rpm is above max_speed_rpm")
    return motor


def load_inverter(name):
    """The inverter `name` (a file of qemu/inverters/, or a path to a .toml)."""
    inverter = _load(find(name, INVERTERS, "inverter"), INVERTER_TABLES, needs_inverter=False)
    supply, protection = inverter["supply"], inverter["protection"]
    if not protection["v_min_v"] < supply["vbus_v"] < protection["v_max_v"] < inverter["sensor"]["v_range_v"]:
        raise LauncherError(f"{shown(inverter.path)}: v_min_v < vbus_v < v_max_v < v_range_v does not hold")
    return inverter


def check_pair(motor, inverter):
    """The motor's limits must fit the inverter's sensors and comparators."""
    control, sensor = motor["control"], inverter["sensor"]
    if control["i_trip_a"] > 0.95 * sensor["i_range_a"] or control["i_trip_a"] >= inverter["bridge"]["oc_trip_a"]:
        raise LauncherError(f"{motor.key}: i_trip_a {control['i_trip_a']} A does not fit inverter {inverter.key}"
                            f" (range {sensor['i_range_a']} A, comparators {inverter['bridge']['oc_trip_a']} A)")


def _load(path, tables, needs_inverter):
    where = shown(path)
    raw = read_toml(path)
    known = set(tables) | {"name", "summary", "documents", "check"} | ({"inverter"} if needs_inverter else set())
    for key in raw:
        if key not in known:
            raise LauncherError(f"{where}: unknown entry '{key}'")
    texts = {}
    for key in ["name", "summary"] + (["inverter"] if needs_inverter else []):
        if not isinstance(raw.get(key), str) or not raw[key]:
            raise LauncherError(f"{where}: '{key}' is missing")
        texts[key] = raw[key]
    values, sources = {}, {}
    for table, keys in tables.items():
        values[table], sources[table] = _table(raw.get(table), keys, f"{where}: [{table}]")
    return Device(key=path.stem, path=path, values=values, sources=sources, documents=raw.get("documents", {}),
                  checks=_checks(raw.get("check", {}), where), **texts)


def _table(raw, keys, where):
    if not isinstance(raw, dict):
        raise LauncherError(f"{where} is missing")
    for key in raw:
        if key not in keys:
            raise LauncherError(f"{where}: unknown key '{key}'")
    values, sources = {}, {}
    for key, limits in keys.items():
        if key not in raw:
            raise LauncherError(f"{where}: '{key}' is missing")
        entry = raw[key]
        if not isinstance(entry, dict) or set(entry) != {"value", "source"}:
            raise LauncherError(f"{where} {key}: write {{ value = ..., source = \"...\" }}")
        if not isinstance(entry["source"], str) or not entry["source"].strip():
            raise LauncherError(f"{where} {key}: the source is empty")
        values[key] = _checked(entry["value"], limits, key, f"{where} {key}")
        sources[key] = entry["source"]
    return values, sources


def _checked(value, limits, key, where):
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise LauncherError(f"{where}: {value!r} is not a number")
    if not limits[0] - _TINY <= value <= limits[1] + _TINY:
        raise LauncherError(f"{where}: {value:g} is outside {limits[0]:g}..{limits[1]:g}")
    if key in _INTEGERS:
        if value != int(value):
            raise LauncherError(f"{where}: {value:g} is not a whole number")
        return int(value)
    return float(value)


def _checks(raw, where):
    checks = {}
    for key, entry in raw.items():
        if not isinstance(entry, dict) or set(entry) != {"value", "tolerance_percent", "source"}:
            raise LauncherError(f"{where}: [check] {key}: write {{ value = ..., tolerance_percent = ..., source = ... }}")
        place = f"{where}: [check] {key}"
        checks[key] = Check(_checked(entry["value"], (-1e9, 1e9), key, place),
                            _checked(entry["tolerance_percent"], (0, 100), key, place), str(entry["source"]))
    return checks
