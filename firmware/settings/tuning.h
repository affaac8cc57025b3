/* SPDX-License-Identifier: MIT */
/*
 * Converts physical parameters to the numbers the loops use: the one place where amperes, volts and rpm meet the per-unit
 * formats of the hot path.
 *
 *   current   Q15, 1.0 = i_range            voltage  Q15, 1.0 = v_range
 *   speed     rpm in Q4 for people; w_q15 for the current loop, 1.0 = CONFIG_SPEED_BASE_HZ electrical
 */
#ifndef FIRMWARE_SETTINGS_TUNING_H
#define FIRMWARE_SETTINGS_TUNING_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/fabric/pwm.h"
#include "firmware/settings/error.h"
#include "firmware/settings/params.h"
#include "firmware/settings/rates.h"
#include "firmware/settings/scale.h"

#define TUNING_ALIGN_LEVELS 2

/* Alignment currents: i_align's, and a larger one for loads that this does not move. */
struct tuning_align {
    int32_t i_q15, i_less_q15; /* the first holds the rotor; with the second the load is measured */
    int32_t ratio_q15;         /* second over first */
    int32_t saliency_q15;      /* (Lq - Ld) i over flux */
    int32_t period_ms;         /* of the rotor's oscillation about the field, if inertia_gmm2 is right */
};

/* For the profile, in units of 2^-shift counts and milliseconds: see control/profile.h. */
struct tuning_profile {
    int32_t shift;
    int32_t v_max, a_max;
    int32_t window;     /* steps over which the acceleration rises: 1 ... PARAM_JERK_MOST_MS */
    int32_t window_q30; /* 1 / window, rounded down */
};

/* The machine in the flux observer's unit of flux: tuning_start.c. */
struct tuning_observer {
    int32_t magnet;    /* flux 14 (control/observer.h) */
    int32_t ld, lq;    /* flux 14 of a current of 1.0 */
    int32_t lq_more;   /* for saturating iron: how much larger L_q is without current, */
    int32_t iron_q15;  /* and with this q current it is lq */
    int32_t of_bus_q8; /* flux per step of voltage, on a bus of v_range, over a sample */
    int32_t r_q5;      /* flux per LSB of current through the resistance, over a sample */
    bool usable;       /* these values work at this rate */
};

/* A voltage that shows the saliency: control/injection.h. tuning_start.c. */
struct tuning_injection {
    int32_t v_q15;          /* 0: none */
    int32_t turned;         /* 0 or -1: when a voltage shows */
    int32_t silent;         /* 0 or 1: pulses in pseudo-random pairs */
    int32_t track;          /* gain of the tracking loop needed for a load step */
    int32_t track_most;     /* the largest, for currents with a strong response */
    int32_t cross_q15;      /* L_dq over L_qq at rated current */
    int32_t cross_from_q15; /* q current from which it applies */
    int32_t polarity_q15;   /* d current that tells north from south */
};

/* A prescribed field that pulls the rotor: tuning_start.c. */
struct tuning_field {
    int32_t i_align_q15;       /* current to align it */
    int32_t align_ms;          /* along each of two angles */
    int32_t i_q15;             /* current to lead it */
    int32_t ramp_q16;          /* steepest ramp, rpm Q16 a millisecond: a share of that current's acceleration */
    int32_t creep_below_q16;   /* rpm: accelerating below this speed the ramp is no steeper than */
    int32_t creep_q16;         /* this, so that a sticking rotor can follow once it breaks loose */
    int32_t rest_ms;           /* a period of the rotor's oscillation about it */
    int32_t yield_loops;       /* damping: samples in which the field moves by the rotor's whole deviation */
    int32_t speed_per_rpm_q12; /* Q32 of a turn a sample, 12 more bits, per rpm in Q16 */
};

#define TUNING_BUS_SET_PERCENT 96 /* of v_max, the highest voltage from braking: see control/torque.h */

struct tuning {
    /* rate of current sampling and current loop */
    int32_t samples; /* a PWM period */
    int32_t loop_hz, loops_per_slow;
    int32_t loop_counts; /* fabric clocks from a sample to the next */
    /* current loop */
    enum pwm_update update;
    int32_t delay_halves;       /* from sample to voltage, halves of the time between two samples: margins.h */
    int32_t current_margin_u16; /* phase margin, in 65536ths of a turn */
    int32_t kp_d_q12, kp_q_q12; /* V/A per unit */
    int32_t ki_q17;             /* per sample */
    int32_t iron_rest_q15;      /* L_q at rated current over that at current i: this at i = 0, */
    int32_t iron_grows_q10;     /* plus this times i^2; 0: iron does not saturate */
    int32_t x_d_q11, x_q_q11;   /* reactance at the base speed, per unit; 17 bits */
    int32_t x_q_apparent_q11;   /* the same as flux over current, for saturating iron */
    int32_t r_q12;              /* resistance, per unit */
    int32_t emf_q12;            /* back-EMF at the base speed, per unit */
    int32_t i_trip_q15, i_sum_q15;
    int16_t modulator_osr;      /* 0: currents from the serial converters */
    uint16_t settle_counts;     /* of a low-side shunt's amplifier; 0: sensors in line with the phases */
    int32_t modulator_trip_q15; /* of the modulators' fast path */
    int32_t early_counts;       /* how long before its window's middle a sample is triggered */
    int32_t v_min_q15, v_max_q15;
    int32_t chopper_on_q15, chopper_off_q15; /* 0: none */
    int32_t overspeed_w_q15;
    uint32_t encoder_scale_q32; /* electrical turns per encoder count */
    int32_t ripple_q10;         /* of a phase's current at zero crossing, amplitude per voltage; 0: negligible */
    /* torque: see control/torque.h */
    int32_t torque_emf_q11;     /* power, per torque and speed */
    int32_t bus_energy_q10;     /* energy of the bus capacitor at v_range */
    int32_t bus_set_energy_q25; /* at TUNING_BUS_SET_PERCENT of v_max */
    int32_t burn_max_q15;       /* largest d current for dissipating power: cancels the magnets' flux, at most i_max */
    int32_t saliency_q11;       /* apparent x_q - x_d */
    int32_t speed_max_rpm_q4;
    bool weakens; /* rated torque at speed_max needs a weaker field: determined at `on`, for the present bus */
    int32_t power_max_q15, regen_max_q15; /* mechanical, driving and braking: 1.0 = 1.5 v_range i_range */
    /* speed estimate: units and derivation in tuning_speed.c */
    int32_t encoder_counts;
    int32_t travel_per_count_q12;  /* rpm Q15 times milliseconds per 256th of a count */
    int32_t counts_per_travel_q16; /* the inverse, to 65536ths of a count */
    /* speed loop: its current is the torque of mtpa.h */
    int32_t i_max_q15;
    int32_t radius_steps;     /* of the voltage circle: the modulator's, or overmodulation's in field weakening */
    int32_t speed_kp_q16;     /* current Q15 per rpm Q4 */
    int32_t speed_ki_q16;     /* the same, per slow period */
    int32_t speed_ki_min_q16; /* its minimum while edges are far apart */
    int32_t speed_accel_q8;   /* current (Q15, 16 fraction bits) per slope (rpm Q16 per millisecond) */
    int32_t torque_mean_ms;   /* the torque demand is averaged over this many steps */
    int32_t friction_q15;     /* torque, fed forward; 0: none */
    int32_t ramp_q16;         /* rpm in Q16 per millisecond */
    int32_t rpm_q4_per_w_q32; /* see tuning_rpm_q15() */
    /* position: control/position.h */
    struct tuning_profile profile;
    int32_t rpm_per_unit_q20;  /* rpm Q16 per unit a millisecond */
    int32_t position_gain_q21; /* the same per unit of error */
    int64_t following_units;   /* the largest error */
    int32_t cyclic_ms;
    int32_t home_rpm_q16;
    int32_t home_i_q15;
    int32_t learn_rpm_q16;
    uint32_t turn_scale_q32; /* mechanical turns per encoder count */
    /* without an encoder */
    uint32_t angle_source; /* enum param_angle */
    struct tuning_observer observer;
    struct tuning_injection injection;
    struct tuning_field field;
    /* start */
    int32_t wiring_i_q15, wiring_v_q15; /* test current, and its voltage drop at one phase's resistance */
    int32_t pole_pairs;
    uint32_t align_levels; /* how many of those below are used */
    struct tuning_align align[TUNING_ALIGN_LEVELS];
    int32_t align_speed_q32; /* electrical turns per millisecond: the fastest a field may pull the rotor */
    int32_t align_speed_ms;  /* over which the encoder measures that speed */
    bool reluctant;  /* reluctance outweighs the magnets: it holds the rotor at the start and shows their axis */
    bool shows_axis; /* the magnets hold it, but an alternating voltage shows their axis better than a pull does */
    int32_t saliency_v_q15; /* that voltage, and the peak-to-peak current */
    int32_t saliency_i_q15;
};

/*
 * Calculates `t` from `p`. An error names the inconsistent parameters and leaves `t` unusable. Thread; takes some thousand
 * cycles (64-bit divisions).
 */
struct outcome tuning_compute(const struct params *p, struct tuning *t);

/*
 * Checks that the bus stays below v_max if the bridge goes off at overspeed_rpm and the diodes rectify the EMF: sqrt(3) w psi
 * between two phases, peak; skipped if the parameters allow more. And that i_max accelerates the inertia to speed_max within
 * five minutes, which a wrong unit does not. Thread, for parameters with a tuning.
 */
struct outcome tuning_check_motor(const struct params *p);

/* A reactance of the tuning at a speed w <= 1.0, per unit. Any context. */
static inline int32_t tuning_reactance_q11(int32_t w_q15, int32_t x_q11)
{
    return (int32_t)(((int64_t)w_q15 * x_q11) >> 15);
}

/* w L i, a voltage: up to 19 bits. Any context. */
static inline int32_t tuning_reactive_q15(int32_t w_q15, int32_t i_q15, int32_t x_q11)
{
    return (int32_t)(((int64_t)((w_q15 * i_q15) >> 15) * x_q11) >> 11);
}

/* Speed in rpm from the observer's speed in electrical turns per sample (Q32), saturated: 65535 rpm. Any context. */
static inline int32_t tuning_rpm_q15(const struct tuning *t, int32_t speed_q32)
{
    return scale_clamp(((int64_t)speed_q32 * t->rpm_q4_per_w_q32) >> 21, -INT32_MAX, INT32_MAX);
}

#endif
