# SPDX-License-Identifier: MIT
"""What a lot has around its machine: sensor of the angle, load and coupling, friction, cogging, harmonics, temperatures."""
import math

from .lot_draw import digits

COUNTS = (64, 128, 256, 400, 512, 1000, 1024, 2000, 2048, 4000, 4096, 8192, 10000, 16384, 20000, 32768, 65536)
COUNTS_A_TURN = 16      # electrical, at least: nobody commutates by fewer
EDGES_HZ = 5e6          # at the largest speed: what the fabric's filter passes, with room
BARE, RIGID = 0.15, 0.5  # shares of the lots
RATIO, RESONANCE_HZ, FRICTION = (0.3, 100), (20, 800), (0.003, 0.15)


def angle_sensor(draw, kind, pole_pairs, max_rpm, entry):
    """(tables, angle_source): an incremental encoder, Hall switches alone, or nothing."""
    what = draw.weighted("angle sensor", kind.sensors)
    counts = [n for n in COUNTS if n >= COUNTS_A_TURN * pole_pairs and n * max_rpm / 60 <= EDGES_HZ]
    tables = {"encoder": {"counts_per_rev": entry(draw.pick("counts", counts), "by lot")}}
    if what != "encoder":
        tables = {"encoder": {"counts_per_rev": entry(4000, "none is fitted: the firmware's initial value"),
                              "fitted": entry(0, "by lot: no encoder")}}
    if what == "encoder":
        tables["encoder"] |= {
            "index_angle_rad": entry(digits(draw.between("index", -3, 3), 3), "by lot"),
            "encoder_asymmetry": entry(0.01, "as the shipped motors: HEDS-9140", spread_abs=0.015),
            "encoder_phase": entry(0.006, "as the shipped motors", spread_abs=0.015),
            "encoder_ecc_rad": entry(digits(draw.log("eccentricity", 3e-4, 3e-3), 3), "by lot: a fifth to twice as shipped",
                                     spread=0.8),
            "encoder_ecc_phase_rad": entry(0.7, "arbitrary")}
    if what == "hall":
        placed = {k: digits(draw.between(f"hall {k}", -0.08, 0.08), 3) for k in "abc"}
        tables["hall"] = {f"hall_error_{k}_rad": entry(rad, "by lot: up to 5 degrees") for k, rad in placed.items()}
        tables["hall"]["hall_hysteresis_rad"] = entry(digits(draw.between("hysteresis", 0.01, 0.06), 3), "by lot")
    return tables, {"encoder": 0, "none": 1, "hall": 2}[what]


def friction_share(draw):
    """(of the bearings, of the load), by rated torque."""
    whole = draw.log("friction", *FRICTION)
    bearings = min(whole, draw.log("bearings", 0.003, 0.03))
    return bearings, whole - bearings


def load(draw, machine, torque_nm, entry):
    """The table [load]: bare rotor to 100 times its inertia, rigid or on a coupling that swings."""
    bare = draw.chance("bare", BARE)
    ratio = 0.0 if bare else digits(draw.log("load", *RATIO), 3)
    slides_nm = friction_share(draw)[1] * torque_nm
    table = {"inertia_ratio": entry(ratio, "by lot: none" if bare else "by lot", spread=0.1),
             "coulomb_nm": entry(digits(slides_nm), "by lot: with the bearings' up to 15 % of rated torque"),
             "stiction_nm": entry(digits(slides_nm * draw.between("stiction", 1.0, 1.5)), "by lot: up to 1.5 times"),
             "stribeck_rad_s": entry(1.0, "assumed")}
    if ratio and not draw.chance("rigid", RIGID):
        hz = draw.log("resonance", *RESONANCE_HZ)
        reduced = machine.inertia_kgm2 * ratio / (1 + ratio)
        stiffness = (2 * math.pi * hz)**2 * reduced
        damping = 2 * draw.between("damping", 0.01, 0.05) * 2 * math.pi * hz * reduced
        table |= {"stiffness_nm_rad": entry(digits(stiffness), f"by lot: resonance at {hz:.0f} Hz", spread=0.2),
                  "damping_nms": entry(digits(damping), "by lot: 1 to 5 % of critical", spread=0.5)}
    return table


def mechanical(draw, kind, machine, torque_nm, entry):
    """The table [mechanical]: inertia, bearings, cogging."""
    shape, rated_nm = machine.shape, digits(torque_nm)
    share = 0.0 if kind.slotless else draw.log("cogging", 0.002, 0.03)
    bearings_nm = friction_share(draw)[0] * rated_nm
    poles, slots = 2 * shape.pole_pairs, max(3, round(6 * shape.pole_pairs * shape.slots / 3) * 3)
    order = min(math.lcm(poles, slots), 5000)
    speed = machine.speed_rpm * math.pi / 30
    table = {"inertia_kgm2": entry(digits(machine.inertia_kgm2), "law: rotor", spread=0.05),
             "friction_coulomb_nm": entry(digits(bearings_nm), "by lot", spread=0.4),
             "friction_viscous_nms": entry(digits(draw.log("viscous", 0.002, 0.01) * rated_nm / speed), "by lot", spread=0.4)}
    if share:
        table |= {"cogging_nm": entry(digits(share * rated_nm), "by lot: 0.2 to 3 % of rated torque", spread=0.4),
                  "cogging_per_rev": entry(order, f"least common multiple of {poles} poles and {slots} slots"),
                  "cogging2_nm": entry(digits(0.3 * share * rated_nm), "30 % of the first, at twice its order", spread=0.5),
                  "cogging2_per_rev": entry(2 * order, "as before"), "cogging2_rad": entry(1.0, "arbitrary")}
    return table


def harmonics(draw, kind, entry):
    """The table [harmonics]."""
    most = 0.003 if kind.slotless else 0.02 if kind.slots[0] >= 1 else 0.04
    fifth = draw.between("emf 5", -most, most)
    table = {"emf_5": entry(digits(fifth, 3), "by lot", spread=0.5),
             "emf_7": entry(digits(-fifth * draw.between("emf 7", 0.2, 0.6), 3), "by lot", spread=0.5)}
    return table if kind.slotless else table | {
        "permeance_6": entry(digits(draw.log("permeance", 0.003, 0.03), 3), "by lot", spread=0.5)}


def thermal(machine, entry):
    """The table [thermal]."""
    return {"copper_tempco_per_k": entry(3.9e-3, "copper"),
            "thermal_resistance_k_w": entry(digits(machine.thermal_k_w), "law: outer surface"),
            "thermal_capacity_j_k": entry(digits(machine.heat_j_k), "law: iron and copper"),
            "ambient_c": entry(25.0, "the temperature of the resistance", spread_abs=15),
            "winding_rise_k": entry(30, "it has been running", spread_abs=30),
            "magnet_tempco_per_k": entry(-0.0011, "NdFeB"),
            "magnet_share": entry(0.6, "as the shipped motors", spread=0.3),
            "temperature_offset_k": entry(0, "as the shipped motors", spread_abs=3)}
