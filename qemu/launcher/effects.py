# SPDX-License-Identifier: MIT
"""PLANT: which of the plant's effects are on.

    full                    everything the data files describe (default)
    ideal                   sine EMF, no saturation, prompt sensors, stiff bus: noise, offsets, cogging and friction remain
    rtl                     the motor in RTL, which needs FABRIC=rtl: as "ideal" but for heat, with all friction
    full,-saturation,-bus   everything but these
    ideal,+saturation       these besides

Taken away, an effect is gone whole; what "ideal" keeps of it (the second column of EFFECTS) goes too.
"""
from dataclasses import dataclass

from .errors import LauncherError, choice
from .schema import SLOT_FORMS


def _zero(*keys):
    return dict.fromkeys(keys, 0.0)


# effect -> (neutral values of what "ideal" leaves out, neutral values of what "ideal" keeps); keys as the twin has them
EFFECTS = {
    "saturation": (_zero("motor.sat_a_d0"), {}),
    "harmonics": (_zero(*(f"motor.emf_{n}" for n in (5, 7, 11, 13, 17, 19))), {}),
    "permeance": (_zero("motor.permeance_6", "motor.permeance_12"), {}),
    "slots": (_zero(*(f"motor.slots{n}_{form}" for n in (6, 12, 18, 36) for form in SLOT_FORMS)), {}),
    "cogging": (_zero("motor.cogging2_nm", "motor.cogging3_nm"), _zero("motor.cogging_nm")),
    "iron": (_zero("motor.iron_hysteresis_nm", "motor.iron_eddy_nms"), {}),
    "temperature": (_zero("motor.magnet_tempco_per_k", "motor.winding_rise_k", "motor.temperature_offset_k"),
                    _zero("motor.copper_tempco_per_k")),
    "shaft": (_zero("load.stiffness_nm_rad", "load.damping_nms"), {}),
    "friction": (_zero("load.coulomb_nm", "load.stiction_nm", "load.fan_nms2"),
                 _zero("motor.friction_coulomb_nm", "motor.friction_viscous_nms", "load.viscous_nms")),
    "edges": (_zero("inverter.coss_c"), {}),
    "switching": (_zero("inverter.switching_s"), {}),
    "drops": (_zero("inverter.diode_ohm", "inverter.switch_v"), _zero("inverter.diode_v")),
    "comparators": (_zero("inverter.oc_blanking_s", "inverter.oc_delay_s"), {}),
    "bus": (_zero("inverter.bus_esr_ohm"), {}),
    "supply": (_zero("inverter.supply_inductance_h", "inverter.rectifier_hz", "inverter.supply_r2_ohm",
                     "inverter.supply_c2_f", "inverter.chopper_ohm"), {}),
    "shunts": (_zero("sensor.shunt"), {}),
    "amplifier": (_zero("sensor.amp_hz"), {}),
    "ringing": (_zero("sensor.ring_lsb"), {}),
    "edge_noise": (_zero("sensor.edge_noise_lsb"), {}),
    "skew": (_zero("sensor.skew_b_s", "sensor.skew_c_s"), {}),
    "drift": (_zero("sensor.i_offset_drift_lsb_s", "sensor.i_gain_drift_per_s"), {}),
    "noise": ({}, _zero("sensor.i_noise_lsb", "sensor.v_noise_lsb", "sensor.modulator_noise")),
    "offsets": ({}, _zero("sensor.i_offset_a_lsb", "sensor.i_offset_b_lsb", "sensor.i_offset_c_lsb")),
    "gains": ({}, dict.fromkeys(("sensor.i_gain_a", "sensor.i_gain_b", "sensor.i_gain_c"), 1.0)),
    "encoder": ({**_zero("sensor.encoder_asymmetry", "sensor.encoder_phase", "sensor.encoder_ecc_rad",
                         "sensor.encoder_lost_per_rev", "sensor.encoder_extra_per_rev", "sensor.hall_error_a_rad",
                         "sensor.hall_error_b_rad", "sensor.hall_error_c_rad", "sensor.hall_hysteresis_rad"),
                 "sensor.encoder_index_counts": 1.0}, {}),
}
_OFF, _KEPT, _ON = range(3)


@dataclass(frozen=True)
class Plant:
    """A checked PLANT: `text` as given, and how much of each effect there is."""
    text: str
    levels: tuple

    def apply(self, items):
        """Neutral values in place of what is off; `items` is {key of the twin: value}, keys that are absent stay so."""
        result = dict(items)
        for effect, level in self.levels:
            beyond, kept = EFFECTS[effect]
            for neutral, gone in ((beyond, level < _ON), (kept, level < _KEPT)):
                if gone:
                    result.update({key: value for key, value in neutral.items() if key in result})
        return result

    @property
    def in_rtl(self):
        """Whether the motor is the one in RTL."""
        return self.text.startswith("rtl")

    def has(self, effect):
        """Whether all of it is on."""
        return dict(self.levels)[effect] == _ON


def parse_plant(text="full"):
    """The Plant of a text, or one line that says what is wrong with it."""
    base, *changes = [word.strip() for word in str(text or "full").split(",")]
    if base not in ("full", "ideal", "rtl"):
        raise LauncherError(f"PLANT '{text}' begins with neither 'full' nor 'ideal' nor 'rtl'")
    levels = dict.fromkeys(EFFECTS, _ON if base == "full" else _KEPT)
    if base == "rtl":
        levels.update(friction=_ON, temperature=_OFF)
    for change in changes:
        sign, effect = change[:1], change[1:].strip()
        if sign not in ("+", "-"):
            raise LauncherError(f"PLANT '{text}': '{change}' is neither +effect nor -effect")
        if effect not in EFFECTS:
            raise LauncherError(f"PLANT '{text}': no effect '{effect}'; there are: {choice(effect, EFFECTS)}")
        levels[effect] = _ON if sign == "+" else _OFF
    return Plant(str(text or "full"), tuple(levels.items()))
