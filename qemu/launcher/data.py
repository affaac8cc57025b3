# SPDX-License-Identifier: MIT
"""Motor and inverter data files: load, check every entry, and work out what other parts need from them.

An entry is `key = { value = 0.36, source = "..." }`, if need be with a tolerance (spread.py): `spread = 0.1` or
`spread_abs = 5`, and `like = "other_key"` when both lie on the same side of their ranges. A value without a source is an error,
so is an unknown key. What keys there are says schema.py; docs/motors.md is the same for readers.
"""
import math
import re
import tomllib
from dataclasses import dataclass, field, replace
from pathlib import Path

from .consistency import check_motor
from .errors import LauncherError, choice, instead
from .lot import is_lot, lot_files, lots_of
from .paths import INVERTERS, MOTORS, REPO, SENSORS, shown
from .rules import FRICTION_BY_RULE, MAX_SHARE, TRIP_SHARE, control_by_rule, friction_by_rule, inertia_ratio_by_rule, most_a
from .saturation import saturation_of
from .schema import BY_RULE, INVERTER_TABLES, MOTOR_TABLES, PLANT_TABLES
from .spread import START_ANGLE, Spread

_TINY = 1e-12
_POINT_KEYS = {"i_d_a", "i_q_a", "psi_d_wb", "psi_q_wb", "l_dd_h", "l_qq_h", "l_dq_h", "torque_nm", "ripple_pp_nm",
               "ripple_18_nm", "tolerance_percent", "source"}


@dataclass
class Check:
    """A data-sheet point and how near the model must come to it."""
    value: float
    tolerance_percent: float
    source: str


@dataclass
class Point:
    """Published values of the magnetic map at one current: {"psi_d_wb": ...}, each within tolerance_percent."""
    i_d_a: float
    i_q_a: float
    values: dict
    tolerance_percent: float
    source: str


@dataclass
class Device:
    """A checked data file: `values[table][key]` are numbers, `sources[table][key]` say where they are from, for those that the
    file gives; `spreads[table][key]` their tolerances; `pinned` holds (table, key) that no draw moves."""
    kind: str
    tables: dict
    key: str
    name: str
    summary: str
    path: Path
    values: dict
    sources: dict
    spreads: dict
    documents: dict
    checks: dict
    points: list
    inverter: str = ""
    pinned: set = field(default_factory=set)

    def __getitem__(self, table):
        return self.values[table]

    @property
    def where(self):
        """The file, as messages call it."""
        return shown(self.path)

    def override(self, changes):
        """Replaces values: {table: {key: number}}; used by tests and sweeps. No draw moves them."""
        for table, entries in changes.items():
            for key, value in entries.items():
                if key not in self.tables.get(table, {}):
                    raise LauncherError(f"{self.key}: no parameter {table}.{key} to override")
                self.values[table][key] = _checked(value, self.tables[table][key], f"{self.key}: [{table}] {key}")
                self.spreads[table].pop(key, None)
                self.pinned.add((table, key))

    def saturation(self):
        """The Saturation of a motor, or None."""
        return saturation_of(self["saturation"], self["electrical"], self["rating"]["rated_current_a"],
                             f"{self.where}: [saturation]")


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
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise LauncherError(f"{shown(path)}: {_decimal_comma(path) or error}") from error


def _decimal_comma(path):
    """The line with the first number that has one, of which the reader of the format makes a riddle; or None."""
    for number, line in enumerate(Path(path).read_text(encoding="utf-8", errors="replace").splitlines(), 1):
        found = re.search(r"=\s*([-+]?\d+),(\d+)\b(?!\s*=)", line)
        if found and "[" not in line:
            return f"line {number}: {found[1]},{found[2]} is no number: write {found[1]}.{found[2]}"
    return None


def find(name, folder, what):
    """The file of a name (or of a path ending in .toml); says what there is when there is none."""
    text, names = str(name), available(folder)
    if text.endswith(".toml"):
        if not Path(text).is_file():
            raise LauncherError(f"no {what} '{text}'; there are: {choice(Path(text).stem, names)}; {text} is no file")
        return Path(text)
    if text not in names:
        raise LauncherError(f"no {what} '{text}'; there are: {choice(text, names)}")
    return Path(folder) / f"{text}.toml"


def load_motor(name):
    """The motor `name` (a file of qemu/motors/, a path to a .toml, or a lot). Its [control] may lack what follows by rule."""
    motor = _load(*_read(name, MOTORS, "motor"), "motor", MOTOR_TABLES)
    rating, electrical, load = motor["rating"], motor["electrical"], motor["load"]
    where = motor.where
    if load["inertia_ratio"] is BY_RULE:
        load["inertia_ratio"] = inertia_ratio_by_rule(motor)
        motor.sources["load"]["inertia_ratio"] = "by rule: qemu/launcher/rules.py"
    if motor["mechanical"]["friction_coulomb_nm"] is BY_RULE:
        motor["mechanical"]["friction_coulomb_nm"] = friction_by_rule(motor)
        motor.sources["mechanical"]["friction_coulomb_nm"] = FRICTION_BY_RULE
    if electrical["lq_h"] < electrical["ld_h"] * 0.5:
        raise LauncherError(f"{where}: lq_h is less than half of ld_h: are the axes exchanged?")
    if rating["rated_speed_rpm"] > rating["max_speed_rpm"]:
        raise LauncherError(f"{where}: rated_speed_rpm is above max_speed_rpm")
    if load["stiction_nm"] and load["stiction_nm"] < load["coulomb_nm"]:
        raise LauncherError(f"{where}: [load] stiction_nm is below coulomb_nm")
    if load["stiffness_nm_rad"] and not load["inertia_ratio"]:
        raise LauncherError(f"{where}: [load] stiffness_nm_rad needs an inertia_ratio behind it")
    check_motor(motor)
    motor.saturation()
    return motor


def motors_named(words):
    """The motors that words name: names of qemu/motors, paths of files (as seen from the repository), lot:7, lot:1-200."""
    names = []
    for word in words or []:
        if is_lot(word):
            names += lots_of(word)
            continue
        path = find(word, MOTORS, "motor").resolve()
        inside = path.is_relative_to(REPO)
        names.append(word if not word.endswith(".toml") else str(path.relative_to(REPO) if inside else path))
    return names


def files_of(name):
    """The files that a motor is read from: its own and its inverter's."""
    path = find(name, MOTORS, "motor")
    motor = _load(path, read_toml(path), "motor", MOTOR_TABLES)
    if is_lot(motor.inverter):
        return [path]
    return [path, find(_beside(motor.inverter, path), INVERTERS, "inverter")]


def _beside(name, beside):
    """The path of an inverter that stands beside its motor, otherwise its name."""
    if beside is not None and str(name).endswith(".toml") and (Path(beside).parent / name).is_file():
        return Path(beside).parent / name
    return name


def load_inverter(name, beside=None):
    """The inverter `name` (a file of qemu/inverters/, a path to a .toml, or a lot; `beside`: from its folder, too)."""
    inverter = _load(*_read(_beside(name, beside), INVERTERS, "inverter"), "inverter", INVERTER_TABLES)
    supply, protection = inverter["supply"], inverter["protection"]
    if not protection["v_min_v"] < supply["vbus_v"] < protection["v_max_v"] < inverter["sensor"]["v_range_v"]:
        raise LauncherError(f"{inverter.where}: v_min_v < vbus_v < v_max_v < v_range_v does not hold")
    if bool(supply["supply_r2_ohm"]) != bool(supply["supply_c2_f"]):
        raise LauncherError(f"{inverter.where}: supply_r2_ohm and supply_c2_f go together")
    if not supply["supply_resistance_ohm"] and not supply["supply_inductance_h"]:
        raise LauncherError(f"{inverter.where}: [supply] needs a supply_resistance_ohm or a supply_inductance_h")
    if supply["chopper_ohm"] and not supply["vbus_v"] < supply["chopper_off_v"] < supply["chopper_on_v"]:
        raise LauncherError(f"{inverter.where}: vbus_v < chopper_off_v < chopper_on_v does not hold")
    return inverter


def load_sensors(name):
    """The [sensor] table of `name` (a file of qemu/sensors/, or a path to a .toml): no key of it is required."""
    keys = {key: replace(meaning, default=0.0) for key, meaning in INVERTER_TABLES["sensor"].items()}
    return _load(*_read(name, SENSORS, "sensors"), "sensors", {"sensor": keys})


def lay_over(inverter, sensors):
    """What the sensors' file gives takes the place of what the inverter's does."""
    for key, source in sensors.sources["sensor"].items():
        inverter["sensor"][key] = sensors["sensor"][key]
        inverter.sources["sensor"][key] = f"{sensors.where}: {source}"
        inverter.spreads["sensor"].pop(key, None)
    inverter.spreads["sensor"].update(sensors.spreads["sensor"])


def complete(motor, inverter):
    """Fills in what [control] leaves to rules.py, and checks that the motor's limits fit the inverter."""
    control, by_rule = motor["control"], control_by_rule(motor, inverter)
    for key, value in by_rule.items():
        if control[key] is BY_RULE:
            if value <= 0:
                raise LauncherError(f"{motor.where}: the bus of {inverter.key} cannot even drive rated current at standstill:"
                                    " rated_torque_nm, resistance_ohm, vbus_v?")
            control[key] = value
            motor.sources["control"][key] = "by rule: qemu/launcher/rules.py"
    _check_currents(motor, inverter)
    if control["speed_max_rpm"] > motor["rating"]["max_speed_rpm"]:
        raise LauncherError(f"{motor.where}: [control] speed_max_rpm is above max_speed_rpm")


def _check_currents(motor, inverter):
    control, rating, sensor = motor["control"], motor["rating"], inverter["sensor"]
    trip_a, max_a, rated_a = control["i_trip_a"], control["i_max_a"], rating["rated_current_a"]
    limits = f"range {sensor['i_range_a']:g} A, comparators {inverter['bridge']['oc_trip_a']:g} A"
    left_a = most_a(inverter)
    if rated_a > left_a:
        raise LauncherError(
            f"{motor.where}: rated_current_a {rated_a:g} is too much for inverter {inverter.key}, which leaves {left_a:g} A"
            f" ({limits}): an inverter with {1.01 * rated_a / MAX_SHARE / TRIP_SHARE:.3g} A of both, or rated_current_a"
            f" {left_a:g} with rated_torque_nm {rating['rated_torque_nm'] * left_a / rated_a:.3g} would fit")
    if trip_a > TRIP_SHARE * sensor["i_range_a"] * (1 + _TINY) or trip_a >= inverter["bridge"]["oc_trip_a"]:
        raise LauncherError(f"{motor.where}: [control] i_trip_a {trip_a:g} A does not fit inverter {inverter.key} ({limits})")
    if max_a > MAX_SHARE * trip_a + _TINY:
        raise LauncherError(f"{motor.where}: [control] i_max_a {max_a:g} is above {100 * MAX_SHARE:g} % of i_trip_a {trip_a:g}:"
                            f" at most {MAX_SHARE * trip_a:.4g} would fit")
    if rated_a > max_a:
        raise LauncherError(f"{motor.where}: [control] i_max_a {max_a:g} is below rated_current_a {rated_a:g}, which scenarios"
                            f" ask for: rated_current_a {max_a:g} with rated_torque_nm"
                            f" {rating['rated_torque_nm'] * max_a / rated_a:.3g} would fit")
    if control["i_align_a"] > max_a:
        raise LauncherError(f"{motor.where}: [control] i_align_a {control['i_align_a']:g} is above i_max_a {max_a:g}")


def _read(name, folder, what):
    """(path, contents) of a data file, or of what a lot has in its place."""
    if is_lot(name) and what != "sensors":
        motor, inverter = lot_files(str(name))
        return Path(str(name)), motor if what == "motor" else inverter
    path = find(name, folder, what)
    return path, read_toml(path)


def _load(path, raw, kind, tables):
    where = shown(path)
    texts = ["name", "summary"] + (["inverter"] if kind == "motor" else [])
    for key in raw:
        if key not in (entries := [*texts, *tables, "documents", "check", "point"]):
            raise LauncherError(f"{where}: unknown entry '{key}'"
                                + instead(key, entries, {f"[{table}]": keys for table, keys in tables.items()}))
    for key in texts:
        if not isinstance(raw.get(key), str) or not raw[key].strip():
            raise LauncherError(f"{where}: '{key}' is missing")
    device = Device(kind=kind, tables=tables, key=path.stem, path=path, values={}, sources={}, spreads={},
                    documents=_documents(raw.get("documents", {}), where), checks=_checks(raw.get("check", {}), where),
                    points=_points(raw.get("point", []), where), **{key: raw[key] for key in texts})
    for table, keys in tables.items():
        device.values[table], device.sources[table], device.spreads[table] = _table(raw.get(table), tables, table, where)
    return device


def _table(raw, tables, table, where):
    """(values, sources, spreads) of one table; what it lacks has its default."""
    keys, others = tables[table], {f"[{other}]": names for other, names in tables.items() if other != table}
    where = f"{where}: [{table}]"
    if raw is None:
        if any(key.required for key in keys.values()):
            raise LauncherError(f"{where} is missing")
        raw = {}
    if not isinstance(raw, dict):
        raise LauncherError(f"{where} is not a table")
    for name in raw:
        if name not in keys:
            raise LauncherError(f"{where}: unknown key '{name}'" + instead(name, keys, others))
    values, sources, spreads = {}, {}, {}
    for name, key in keys.items():
        if name in raw:
            values[name], sources[name] = _entry(raw[name], key, f"{where} {name}")
            spread = _spread(raw[name], name, key, table, keys, where)
            if spread is not None:
                spreads[name] = spread
        elif key.required:
            raise LauncherError(f"{where}: '{name}' is missing")
        else:
            values[name] = key.default
    return values, sources, spreads


def _entry(raw, key, where):
    if not isinstance(raw, dict) or not {"value", "source"} <= set(raw) <= {"value", "source", "spread", "spread_abs", "like"}:
        raise LauncherError(f"{where}: write {{ value = ..., source = \"...\" }} (and spread or spread_abs, like)")
    if not isinstance(raw["source"], str) or not raw["source"].strip():
        raise LauncherError(f"{where}: the source is empty")
    return _checked(raw["value"], key, where), raw["source"]


def _spread(raw, name, key, table, keys, where):
    """The Spread of an entry, or None."""
    given = {"spread", "spread_abs", "like"} & set(raw)
    if not given:
        return None
    where = f"{where} {name}"
    if key.integer or (table not in PLANT_TABLES and (table, name) != START_ANGLE):
        raise LauncherError(f"{where}: takes no spread")
    if raw.get("like", name) not in keys:
        raise LauncherError(f"{where}: like = {raw['like']!r} is no key of [{table}]" + instead(str(raw["like"]), keys))
    relative, absolute = (_number(raw.get(word, 0), f"{where}: {word}") for word in ("spread", "spread_abs"))
    if relative == 0 and absolute == 0:
        raise LauncherError(f"{where}: like without spread or spread_abs")
    if not 0 <= relative < 1 or absolute < 0:
        raise LauncherError(f"{where}: spread must be 0 or more and below 1, spread_abs 0 or more")
    return Spread(relative, absolute, raw.get("like", ""))


def _number(value, where):
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise LauncherError(f"{where}: {value!r} is not a number")
    return float(value)


def _checked(value, key, where):
    number = _number(value, where)
    if not key.low - _TINY <= number <= key.high + _TINY:
        raise LauncherError(f"{where}: {number:g} is outside {key.low:g}..{key.high:g}")
    if not key.integer:
        return number
    if number != int(number):
        raise LauncherError(f"{where}: {number:g} is not a whole number")
    return int(number)


def _documents(raw, where):
    if not isinstance(raw, dict) or not all(isinstance(text, str) for text in raw.values()):
        raise LauncherError(f"{where}: [documents] holds texts: TAG = \"...\"")
    return raw


def _tolerance(raw, where):
    value = _number(raw, f"{where}: tolerance_percent")
    if not 0 <= value <= 100:
        raise LauncherError(f"{where}: tolerance_percent {value:g} is outside 0..100")
    return value


def _published(raw, where):
    """A value that deviations are relative to."""
    value = _number(raw, where)
    if value == 0:
        raise LauncherError(f"{where}: 0 has no relative tolerance")
    return value


def _checks(raw, where):
    if not isinstance(raw, dict):
        raise LauncherError(f"{where}: [check] is not a table")
    checks = {}
    for key, entry in raw.items():
        place = f"{where}: [check] {key}"
        if not isinstance(entry, dict) or set(entry) != {"value", "tolerance_percent", "source"}:
            raise LauncherError(f"{place}: write {{ value = ..., tolerance_percent = ..., source = ... }}")
        checks[key] = Check(_published(entry["value"], place), _tolerance(entry["tolerance_percent"], place),
                            str(entry["source"]))
    return checks


def _points(raw, where):
    if not isinstance(raw, list) or not all(isinstance(entry, dict) for entry in raw):
        raise LauncherError(f"{where}: write [[point]]")
    points = []
    for index, entry in enumerate(raw):
        place = f"{where}: point {index + 1}"
        for key in entry:
            if key not in _POINT_KEYS:
                raise LauncherError(f"{place}: unknown key '{key}'" + instead(key, sorted(_POINT_KEYS)))
        for key in ("i_d_a", "i_q_a", "tolerance_percent", "source"):
            if key not in entry:
                raise LauncherError(f"{place}: '{key}' is missing")
        numbers = {key: _number(value, f"{place}: {key}") for key, value in entry.items() if key != "source"}
        tolerance = _tolerance(numbers.pop("tolerance_percent"), place)
        points.append(Point(numbers.pop("i_d_a"), numbers.pop("i_q_a"), numbers, tolerance, str(entry["source"])))
        for key, value in numbers.items():
            _published(value, f"{place}: {key}")
    return points
