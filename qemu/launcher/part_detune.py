# SPDX-License-Identifier: MIT
"""PART=detune: a drive that is told wrong resistance, inductance, flux or inertia still works, if not as well.

WHAT is SCENARIO/NAME. All limits of the scenario hold but those that say how good the speed loop is: with another inertia than
it was told it is another loop.
"""
from .errors import LauncherError, choice
from .part import PartCase, Setup, Verdict

NAME = "detune"
MOTORS = ("teknic_m2310p", "maxon_ec22", "hoverboard_350w")  # a servo, a spindle of little inertia, a hub motor
SCENARIO_NAMES = ("default", "reversal_under_load", "low_speed")
QUALITY = {"load_dip", "recovery", "ramp_overshoot"}  # kinds of figures that are not judged
_PARAMETERS = {"R": ("resistance_mohm",), "L": ("ld_uh", "lq_uh"), "flux": ("flux_uwb",), "J": ("inertia_gmm2",)}
NAMES = ("R*0.5", "R*2", "L*0.5", "L*2", "flux*0.5", "flux*2", "J*0.2", "J*0.5", "J*2", "J*5", "R*2_L*0.5", "R*0.5_L*2",
         "flux*2_J*0.2", "flux*0.5_J*5", "R*0.5_L*0.5_flux*0.5_J*0.2", "R*2_L*2_flux*2_J*5")


def detune_of(name):
    """What DETUNE is for it: L*2 is ld_uh*2 lq_uh*2."""
    items = []
    for word in name.split("_"):
        what, _, factor = word.partition("*")
        if what not in _PARAMETERS or not factor:
            raise LauncherError(f"no detuning '{name}'; there are: {choice(name, NAMES)}")
        items += [f"{parameter}*{factor}" for parameter in _PARAMETERS[what]]
    return " ".join(items)


def plan(motors, options):
    """Every name with each scenario, on the three motors unless others are asked for."""
    scenarios = (options.get("scenarios") or "").split() or SCENARIO_NAMES
    return [PartCase(NAME, motor, f"{scenario}/{name}") for motor in (motors if options.get("motors") else MOTORS)
            for scenario in scenarios for name in NAMES]


def setup(what, _drive):
    """The run of one case."""
    scenario, _, name = what.partition("/")
    return Setup(scenario, judge, {"detune": detune_of(name)})


def judge(run):
    """The scenario's own limits."""
    wrong = [f"{figure.name}: {_text(figure.value)} {figure.unit}, limit {figure.limit_text}".replace(" ,", ",")
             for figure in run.figures.values() if figure.passed is False and figure.kind not in QUALITY]
    fault = next((figure.value for figure in run.figures.values() if figure.kind == "all_faults"), "NONE")
    figures = {f"{figure.name}, {figure.unit}".rstrip(", "): figure.value for figure in run.figures.values()
               if figure.kind in ("speed_error", "peak_current", "angle_error", "load_dip")}
    outcome = "within limits" if not wrong else "outside limits" if fault == "NONE" else fault
    return Verdict(outcome, "; ".join(wrong), figures)


def _text(value):
    return value if isinstance(value, str) or value is None else f"{value:.4g}"
