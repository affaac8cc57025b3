/* SPDX-License-Identifier: MIT */
/*
 * The drive's parameters: integers; the name ends with the unit.
 *
 * They are set one at a time on the console while the bridge is off, each checked against its own range. Values derived from
 * them together (gains, thresholds, scalings) are calculated once, at switch-on: see tuning.h.
 */
#ifndef FIRMWARE_SETTINGS_PARAMS_H
#define FIRMWARE_SETTINGS_PARAMS_H

#include <stddef.h>
#include <stdint.h>

/* The speed loop stores this many torque demands. */
#define PARAM_TORQUE_MEAN_MOST_MS 4

/* The profile stores this many speeds. */
#define PARAM_JERK_MOST_MS 250

enum param_angle {
    PARAM_ANGLE_ENCODER,
    PARAM_ANGLE_SENSORLESS, /* the flux observer, and a prescribed field where that has no signal */
    PARAM_ANGLE_HALL,       /* three Hall switches */
};

struct params {
    int32_t pole_pairs;         /* pole pairs of the motor */
    int32_t encoder_counts;     /* counts per mechanical turn, counting all four edges */
    int32_t resistance_mohm;    /* one phase */
    int32_t ld_uh;              /* one phase, d axis */
    int32_t lq_uh;              /* one phase, q axis */
    int32_t ld_apparent_uh;     /* for saturating iron: flux over current at rated current, for MTPA; 0: as ld_uh */
    int32_t lq_apparent_uh;     /* the same, q axis */
    int32_t lq_rest_uh;         /* for saturating iron: q axis without current, as lq_uh is at i_rated; 0: as lq_uh */
    int32_t cross_pm;           /* L_dq over L_qq at i_rated, incremental, thousandths; has i_q's sign */
    int32_t flux_uwb;           /* flux linkage of the magnets, peak, one phase */
    int32_t inertia_gmm2;       /* rotor and load; 1e-9 kg m^2 */
    int32_t i_range_ma;         /* phase current 2048 ADC counts away from zero */
    int32_t v_range_mv;         /* bus voltage at 4096 ADC counts */
    int32_t i_max_ma;           /* limit of the current reference, peak */
    int32_t i_trip_ma;          /* software over-current threshold, any phase */
    int32_t i_align_ma;         /* d-axis current that pulls the rotor into place */
    int32_t v_min_mv;           /* under-voltage threshold */
    int32_t v_max_mv;           /* over-voltage threshold */
    int32_t chopper_on_mv;      /* bus voltage above which the brake chopper switches on; 0: none */
    int32_t chopper_off_mv;     /* and at which it switches off */
    int32_t power_max_w;        /* mechanical power, driving */
    int32_t regen_max_w;        /* and braking */
    int32_t bus_capacitance_uf; /* from the bridge to the supply, both sides of the cable */
    int32_t speed_max_rpm;      /* largest speed command */
    int32_t overspeed_rpm;      /* over-speed threshold */
    int32_t emf_beyond_v_max;   /* 1: bridge and bus withstand the EMF at overspeed_rpm */
    int32_t ramp_rpm_s;         /* slope of the speed reference */
    int32_t stop_max_ms;        /* a longer quick stop ends with the bridge off */
    int32_t current_bw_hz;      /* crossover of the current loops */
    int32_t pwm_update;  /* when voltages act: 0 from the next valley on, 1 from the next end on, 2 at once (delay.h) */
    int32_t pwm_samples; /* current samples a PWM period: 1, or 2 with in-phase sensors */
    int32_t overmodulation;  /* per cent of the way from the modulator's circle to six-step; 0: none. Sensors in line */
    int32_t low_side_shunts; /* 1: sensors see a phase while its low side conducts; 0: always, in line with it */
    int32_t modulator_osr;   /* currents from isolated modulators with this OSR; 0: serial converters */
    int32_t speed_bw_hz;     /* crossover of the speed loop */
    int32_t torque_mean_ms;  /* for a shaft that oscillates: the torque demand is averaged over this; 1: off */
    /* position */
    int32_t position_bw_hz;   /* crossover of the position loop, its stiffness; 0: a fifth of speed_bw_hz */
    int32_t profile_speed_pm; /* speed of a profile, thousandths of speed_max_rpm: the rest is for catching up */
    int32_t profile_rpm_s;    /* its acceleration; 0: ramp_rpm_s. 1000 s to speed_max_rpm at most */
    int32_t profile_jerk_ms;  /* in which the acceleration rises from 0 */
    int32_t following_mturn;  /* largest following error, thousandths of a turn */
    int32_t cyclic_ms;        /* time between set-points of csp, csv and cst */
    int32_t home_rpm;         /* speed and direction in which homing searches */
    int32_t home_pct;         /* most current it pushes with, of i_max_ma */
    int32_t home_turns;       /* and how far it searches for a block */
    int32_t learn_rpm;        /* speed at which cogging is learned */
    /* supervision: firmware/axis/ */
    int32_t i_rated_ma;         /* continuous motor current, peak */
    int32_t t_max_c;            /* winding temperature at that current, 40 degC ambient; also its limit */
    int32_t winding_share_pct;  /* share of that rise between winding and housing */
    int32_t winding_tau_s;      /* time constant, winding to housing */
    int32_t housing_tau_s;      /* and housing to air */
    int32_t inverter_ma;        /* continuous power-stage current, peak; 0: any */
    int32_t inverter_tau_ms;    /* its thermal time constant */
    int32_t deviation_pct;      /* of speed_max_rpm: largest deviation of speed from reference */
    int32_t command_timeout_ms; /* longest silence of console and bus while on; 0: any */
    int32_t angle_source;       /* enum param_angle: source of the rotor's angle */
    int32_t injection_mv;       /* without an encoder, at low EMF: voltage that shows the saliency; 0: none */
    int32_t retry_count;        /* how often the drive clears a fault and restarts by itself */
    int32_t retry_delay_ms;     /* how long after the fault */
    int32_t modbus_address;     /* of this drive on the bus; 0: it does not listen */
    int32_t modbus_baud;        /* rate of the bus */
    int32_t modbus_parity;      /* 0 none, with two stop bits; 1 odd; 2 even */
    int32_t friction_unm;       /* Coulomb friction of shaft and load, fed forward by direction; 0: none */
    /* Hall switches: hall_table.h */
    int32_t hall_states;      /* six states in forward order, a digit each: 4 C + 2 B + A */
    int32_t hall_edge_1_cdeg; /* electrical angle at which the first of them begins */
    int32_t hall_edge_2_cdeg; /* the second */
    int32_t hall_edge_3_cdeg; /* the third */
    int32_t hall_edge_4_cdeg; /* the fourth */
    int32_t hall_edge_5_cdeg; /* the fifth */
    int32_t hall_edge_6_cdeg; /* the sixth */
    int32_t injection_silent; /* the injection's pulses: 0 alternating, a tone; 1 pseudo-random, a noise */
};

struct param_info {
    const char *name;
    int32_t min;
    int32_t max;
    int32_t initial;
    size_t offset; /* of the field in struct params */
};

extern const struct param_info param_table[];
extern const size_t param_count;

/* Sets every parameter to its initial value. */
void params_init(struct params *p);

/* The table's row for a name, or NULL. */
const struct param_info *param_find(const char *name);

int32_t param_get(const struct params *p, const struct param_info *info);

/* The caller must check the range and that the bridge is off. */
void param_set(struct params *p, const struct param_info *info, int32_t value);

#endif
