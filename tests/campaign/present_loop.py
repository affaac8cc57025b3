# SPDX-License-Identifier: MIT
"""The same machine with the gains, rate and lag that the firmware's documented rules give it today, to hold against the twin:
firmware/settings/margins.h and tuning_speed.c (gains, delays), control/speed_loop.h (less gain while edges are rare),
docs/hall.md and docs/sensorless.md (speed without an encoder). And what its sensor lets any loop know: the lag for best_loop.

Not of two masses and a delay, so not here: the notch and the smaller gains after a warning of an oscillation, limits of
torque, and what Hall switches and observer are fed with. Without an encoder the prediction is a guess by lag alone."""
import math

import best_loop

RATE_HZ, PWM_S = 1000.0, 50e-6
MEMORY = 0.25           # of the crossover, below which the integral acts: tuning_speed.c
FULL_GAIN_S = 1.5e-3    # between edges: speed_loop.h
HALL_MEAN_S = 20e-3     # a turn if it takes no longer, or half of one, or two sectors: hall.md
POLES = (0.3, 1.5)      # of the observer's tracking loop, by its speed, and a fifth of its margin: sensorless.md
MAGNETS_C = 25.0        # of the flux in a motor's file
ENCODER, OBSERVER, HALL = 0, 1, 2
NAMES = {ENCODER: "encoder", OBSERVER: "observer", HALL: "Hall"}


def shaft_of(plant):
    """The Shaft of a plant's tables, nominal or drawn."""
    load, rotor = plant["load"], plant["mechanical"]["inertia_kgm2"]
    return best_loop.Shaft(rotor, rotor * load["inertia_ratio"], load["stiffness_nm_rad"], load["damping_nms"])


def torque_share(drive, plant):
    """The torque that a current makes in a plant by what the drive was told: flux as drawn, and as warm as its magnets are."""
    warm_k = plant["thermal"]["ambient_c"] + plant["thermal"]["magnet_share"] * plant["thermal"]["winding_rise_k"] - MAGNETS_C
    flux_wb = plant["electrical"]["flux_wb"] * (1 + plant["thermal"]["magnet_tempco_per_k"] * warm_k)
    return flux_wb / drive.motor["electrical"]["flux_wb"]


def turn_s(drive):
    return 60 / drive.names()["work_rpm"]


def electrical_s(drive):
    return turn_s(drive) / drive.motor["electrical"]["pole_pairs"]


def sensor_lag_s(drive, source, rate_hz):
    """By how much the speed of a period is late because of the sensor, at the working speed. Edges: the last is half of their
    interval old, and where none comes in a period, the speed is that of an interval. Observer: a double pole at the electrical
    speed, as it has little time to tell its flux from drift (an assumption)."""
    if source == OBSERVER:
        return 2 * electrical_s(drive) / (2 * math.pi)
    edge_s = electrical_s(drive) / 6 if source == HALL else turn_s(drive) / drive.motor["encoder"]["counts_per_rev"]
    return edge_s / 2 + max(edge_s - 1 / rate_hz, 0.0) / 2


def torque_lag_s(drive):
    """From sample to torque of a mechanical loop beside the current loop: a PWM period, and the current loop's answer."""
    return PWM_S + 1 / (2 * math.pi * drive.motor["control"]["current_bw_hz"])


def best_of(drive, shaft, rate_hz, source=None):
    """best_loop's Figures of a drive with its own sensor, or as if it had another."""
    source = drive.motor["control"]["angle_source"] if source is None else source
    return best_loop.best(shaft, rate_hz, torque_lag_s(drive) + sensor_lag_s(drive, source, rate_hz))


def measured_s(drive):
    """(time over which today's speed is a mean, its age) at the working speed."""
    source, period_s = drive.motor["control"]["angle_source"], 1 / RATE_HZ
    if source == ENCODER:
        edge_s = turn_s(drive) / drive.motor["encoder"]["counts_per_rev"]
        return max(edge_s, period_s), edge_s / 2
    if source == OBSERVER:
        w, margin = 2 * math.pi / electrical_s(drive), drive._margin(turn_s(drive))
        return 2 / (min(max(margin / 5, POLES[0]), POLES[1]) * w), 0.0
    edge_s = electrical_s(drive) / 6
    return next((edges * edge_s for edges in (6, 3) if edges * edge_s <= HALL_MEAN_S), 2 * edge_s), edge_s / 2


def figures_of(drive, shaft, share=1.0, passed=0.5):
    """best_loop's Figures with today's gains; `share`: torque_share(); `passed`: when in a period the load steps, as the twin's
    instant is arbitrary."""
    told_kgm2, bandwidth = drive.params["inertia_gmm2"] * 1e-9, 2 * math.pi * drive.motor["control"]["speed_bw_hz"]
    slower = min(1.0, FULL_GAIN_S / measured_s(drive)[0])
    kp = told_kgm2 * bandwidth * slower * share
    return best_loop.figures(shaft, RATE_HZ, late_s(drive), best_loop.Gains(kp, MEMORY * kp * bandwidth * slower),
                             passed=passed)


def late_s(drive):
    """From the angle to the torque that answers it, beyond the speed's own period."""
    window_s, age_s = measured_s(drive)
    return torque_lag_s(drive) + age_s + max(window_s - 1 / RATE_HZ, 0.0) / 2


def first_crossover(drive, shaft, gains):
    """(Hz, margin in degrees) where the gain first passes 1, seen from standstill."""
    sampled = best_loop.Sampled(shaft, RATE_HZ, late_s(drive))
    hz = sampled.frequencies()
    return best_loop.crossovers(hz, sampled.loop(hz, sampled.response(hz), gains))[0]


def ring_hz(drive, shaft, gains):
    """At which it swings most, as sampled."""
    return best_loop.Sampled(shaft, RATE_HZ, late_s(drive)).ring_hz(gains)
