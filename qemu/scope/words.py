# SPDX-License-Identifier: MIT
"""What the page says of parameters and of identify: from the firmware's sources, and the groups, which only people need."""
import re

from rows import faults
from launcher.paths import REPO

from . import limit

GROUPS = {
    "Motor": "pole_pairs resistance_mohm ld_uh lq_uh ld_apparent_uh lq_apparent_uh lq_rest_uh cross_pm flux_uwb inertia_gmm2"
             " friction_unm i_rated_ma",
    "Limits": "i_max_ma i_trip_ma v_min_mv v_max_mv power_max_w regen_max_w speed_max_rpm overspeed_rpm emf_beyond_v_max"
              " ramp_rpm_s stop_max_ms",
    "Power stage": "i_range_ma v_range_mv bus_capacitance_uf chopper_on_mv chopper_off_mv low_side_shunts modulator_osr"
                   " pwm_update pwm_samples overmodulation",
    "Loops": "current_bw_hz speed_bw_hz torque_mean_ms position_bw_hz",
    "Angle": "angle_source direction encoder_counts i_align_ma injection_mv injection_silent hall_states hall_edge_1_cdeg"
             " hall_edge_2_cdeg hall_edge_3_cdeg hall_edge_4_cdeg hall_edge_5_cdeg hall_edge_6_cdeg",
    "Position": "profile_speed_pm profile_rpm_s profile_jerk_ms following_mturn cyclic_ms home_rpm home_pct home_turns"
                " learn_rpm",
    "Supervision": "t_max_c winding_share_pct winding_tau_s housing_tau_s inverter_ma inverter_tau_ms deviation_pct"
                   " command_timeout_ms retry_count retry_delay_ms",
    "Modbus": "modbus_address modbus_baud modbus_parity",
    "CAN": "can_node can_kbit can_recover can_heartbeat_ms",
}
OTHERS = "Others"  # of a firmware that is newer than these lists

GROUP_OF = {name: group for group, names in GROUPS.items() for name in names.split()}
ROW = re.compile(r'^ +PARAM\((\w+), -?\w+, -?\w+, (-?\d+), "([^"]*)"\) \\\n +/\* \S+: (.*) \*/', re.MULTILINE)
STATE = re.compile(r"^    (AXIS_\w+),$", re.MULTILINE)
STATE_TEXT = re.compile(r'\[(AXIS_\w+)\] = "([^"]+)"')
STEP = re.compile(r'^ +STEP\(\w+, \w+, "([^"]+)"', re.MULTILINE)


def _source(path):
    return (REPO / "firmware" / path).read_text(encoding="utf-8")


def parameters():
    """{name: {"group", "initial", "meaning"}}; `initial` of the limit that a session lends is what it lends."""
    lent = {limit.NAME: limit.LENT_MS}
    return {name: {"group": GROUP_OF.get(name, OTHERS), "initial": lent.get(name, int(initial)),
                   "meaning": f"{what}. Affects: {affects}."}
            for name, initial, what, affects in ROW.findall(_source("settings/params.h"))}


def enumerations():
    """{signal: {number: word}} of those whose numbers are names."""
    states = _source("axis/axis.h").partition("enum axis_state {")[2].partition("}")[0]
    texts = dict(STATE_TEXT.findall(_source("operate/messages.c")))
    return {"state": {number: texts[name] for number, name in enumerate(STATE.findall(states))},
            "fault": {0: "none", **{row.number: row.text for row in faults().values()}}}


def identify_steps():
    """Their names, in their order."""
    return STEP.findall(_source("commission/identify.h"))
