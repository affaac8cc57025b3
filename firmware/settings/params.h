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

/* clang-format off */
/*
 * PARAM(name, least, most, initial). The order is that of the Modbus registers (docs/modbus.md): append new rows, or the
 * addresses controllers use will shift.
 *
 * The initial values are a Teknic M-2310P-LN-04K on the 24 V inverter: qemu/motors/ and qemu/inverters/ have the sources.
 * Those of Modbus are the standard's.
 */
#define PARAMS(PARAM) \
    PARAM(pole_pairs, 1, 50, 4)                /* pole pairs of the motor */ \
    PARAM(encoder_counts, 64, 65536, 4000)     /* counts per mechanical turn, counting all four edges */ \
    PARAM(resistance_mohm, 1, 100000, 360)     /* one phase */ \
    PARAM(ld_uh, 1, 1000000, 200)              /* one phase, d axis */ \
    PARAM(lq_uh, 1, 1000000, 200)              /* one phase, q axis */ \
    PARAM(ld_apparent_uh, 0, 1000000, 0)       /* saturating iron: flux over current at rated current, for MTPA; 0: ld_uh */ \
    PARAM(lq_apparent_uh, 0, 1000000, 0)       /* the same, q axis */ \
    PARAM(lq_rest_uh, 0, 1000000, 0)           /* saturating iron: q axis without current, as lq_uh is at i_rated; 0: lq_uh */ \
    PARAM(cross_pm, -249, 249, 0)              /* L_dq over L_qq at i_rated, incremental, thousandths; has i_q's sign */ \
    PARAM(flux_uwb, 10, 10000000, 6395)        /* flux linkage of the magnets, peak, one phase */ \
    PARAM(inertia_gmm2, 1, 2100000000, 56493)  /* rotor and load; 1e-9 kg m^2 */ \
    PARAM(i_range_ma, 100, 2000000, 23571)     /* phase current 2048 ADC counts away from zero */ \
    PARAM(v_range_mv, 1000, 2000000, 57528)    /* bus voltage at 4096 ADC counts */ \
    PARAM(i_max_ma, 10, 2000000, 10650)        /* limit of the current reference, peak */ \
    PARAM(i_trip_ma, 10, 2000000, 15000)       /* software over-current threshold, any phase */ \
    PARAM(i_align_ma, 10, 2000000, 5000)       /* d-axis current that pulls the rotor into place */ \
    PARAM(v_min_mv, 1000, 2000000, 18000)      /* under-voltage threshold */ \
    PARAM(v_max_mv, 1000, 2000000, 36000)      /* over-voltage threshold */ \
    PARAM(chopper_on_mv, 0, 2000000, 0)        /* bus voltage above which the brake chopper switches on; 0: none */ \
    PARAM(chopper_off_mv, 0, 2000000, 0)       /* and at which it switches off */ \
    PARAM(power_max_w, 1, 2000000, 2000000)    /* mechanical power, driving */ \
    PARAM(regen_max_w, 0, 2000000, 2000000)    /* and braking */ \
    PARAM(bus_capacitance_uf, 1, 1000000, 1000) /* from the bridge to the supply, both sides of the cable */ \
    PARAM(speed_max_rpm, 1, 30000, 4000)       /* largest speed command */ \
    PARAM(overspeed_rpm, 1, 32000, 4800)       /* over-speed threshold */ \
    PARAM(emf_beyond_v_max, 0, 1, 0)           /* 1: bridge and bus withstand the EMF at overspeed_rpm */ \
    PARAM(ramp_rpm_s, 1, 1000000, 5000)        /* slope of the speed reference */ \
    PARAM(stop_max_ms, 100, 3600000, 60000)    /* a longer quick stop ends with the bridge off */ \
    PARAM(current_bw_hz, 10, 6400, 1000)       /* crossover of the current loops */ \
    PARAM(pwm_update, 0, 2, 0)                 /* when voltages act: 0 from the next valley, 1 from the next end, 2 at once */ \
    PARAM(pwm_samples, 1, 2, 1)                /* current samples a PWM period: 1, or 2 with in-phase sensors */ \
    PARAM(overmodulation, 0, 100, 0)           /* per cent of the way from the circle to six-step; 0: none. Sensors in line */ \
    PARAM(low_side_shunts, 0, 1, 1)            /* 1: sensors see a phase while its low side conducts; 0: always, in line */ \
    PARAM(modulator_osr, 0, 256, 0)            /* currents from isolated modulators with this OSR; 0: serial converters */ \
    PARAM(speed_bw_hz, 1, 200, 60)             /* crossover of the speed loop */ \
    PARAM(torque_mean_ms, 1, PARAM_TORQUE_MEAN_MOST_MS, 1) /* an oscillating shaft: mean of the torque demand; 1: off */ \
    /* position */ \
    PARAM(position_bw_hz, 0, 100, 0)           /* crossover of the position loop, its stiffness; 0: a fifth of speed_bw_hz */ \
    PARAM(profile_speed_pm, 1, 1000, 900)      /* speed of a profile, thousandths of speed_max_rpm: the rest is to catch up */ \
    PARAM(profile_rpm_s, 0, 1000000, 0)        /* its acceleration; 0: ramp_rpm_s. 1000 s to speed_max_rpm at most */ \
    PARAM(profile_jerk_ms, 1, PARAM_JERK_MOST_MS, 50) /* in which the acceleration rises from 0 */ \
    PARAM(following_mturn, 1, 10000000, 100)   /* largest following error, thousandths of a turn */ \
    PARAM(cyclic_ms, 1, 1000, 10)              /* time between set-points of csp, csv and cst */ \
    PARAM(home_rpm, -30000, 30000, 30)         /* speed and direction in which homing searches */ \
    PARAM(home_pct, 1, 100, 20)                /* most current it pushes with, of i_max_ma */ \
    PARAM(home_turns, 1, 10000, 10)            /* and how far it searches for a block */ \
    PARAM(learn_rpm, 1, 100, 10)               /* speed at which cogging is learned */ \
    /* supervision: firmware/axis/ */ \
    PARAM(i_rated_ma, 10, 2000000, 7100)       /* continuous motor current, peak */ \
    PARAM(t_max_c, 60, 250, 130)               /* winding temperature at that current, 40 degC ambient; also its limit */ \
    PARAM(winding_share_pct, 1, 99, 40)        /* share of that rise between winding and housing */ \
    PARAM(winding_tau_s, 1, 10000, 60)         /* time constant, winding to housing */ \
    PARAM(housing_tau_s, 1, 100000, 1200)      /* and housing to air */ \
    PARAM(inverter_ma, 0, 2000000, 0)          /* continuous power-stage current, peak; 0: any */ \
    PARAM(inverter_tau_ms, 100, 1000000, 1000) /* its thermal time constant */ \
    PARAM(deviation_pct, 1, 100, 20)           /* of speed_max_rpm: largest deviation of speed from reference */ \
    PARAM(command_timeout_ms, 0, 60000, 0)     /* longest silence of console and bus while on; 0: any */ \
    PARAM(angle_source, 0, 2, 0)               /* enum param_angle: source of the rotor's angle */ \
    PARAM(injection_mv, 0, 2000000, 0)         /* without an encoder, at low EMF: voltage that shows the saliency; 0: none */ \
    PARAM(retry_count, 0, 100, 0)              /* how often the drive clears a fault and restarts by itself */ \
    PARAM(retry_delay_ms, 10, 60000, 1000)     /* how long after the fault */ \
    PARAM(modbus_address, 0, 247, 1)           /* of this drive on the bus; 0: it does not listen */ \
    PARAM(modbus_baud, 9600, 921600, 19200)    /* rate of the bus */ \
    PARAM(modbus_parity, 0, 2, 2)              /* 0 none, with two stop bits; 1 odd; 2 even */ \
    PARAM(friction_unm, 0, 50000000, 0)        /* Coulomb friction of shaft and load, fed forward by direction; 0: none */ \
    /* Hall switches: hall_table.h */ \
    PARAM(hall_states, 1234, 765432, 513264)   /* six states in forward order, a digit each: 4 C + 2 B + A */ \
    PARAM(hall_edge_1_cdeg, 0, 35999, 0)       /* electrical angle at which the first of them begins */ \
    PARAM(hall_edge_2_cdeg, 0, 35999, 6000)    /* the second */ \
    PARAM(hall_edge_3_cdeg, 0, 35999, 12000)   /* the third */ \
    PARAM(hall_edge_4_cdeg, 0, 35999, 18000)   /* the fourth */ \
    PARAM(hall_edge_5_cdeg, 0, 35999, 24000)   /* the fifth */ \
    PARAM(hall_edge_6_cdeg, 0, 35999, 30000)   /* the sixth */ \
    PARAM(injection_silent, 0, 1, 0)           /* the injection's pulses: 0 alternating, a tone; 1 pseudo-random, a noise */ \
    PARAM(can_node, 0, 127, 0)                 /* of this drive on the CAN bus; 0: it is not there */ \
    PARAM(can_kbit, 20, 1000, 500)             /* rate of that bus: 20, 50, 125, 250, 500, 800, 1000; else the next below */ \
    PARAM(can_recover, 0, 1, 0)                /* back from bus-off: 0 when one of these is set, 1 by itself */ \
    PARAM(can_heartbeat_ms, 0, 65535, 0)       /* object 0x1017 at first: time between its heartbeats; 0: none */
/* clang-format on */

#define PARAM_FIELD(name, least, most, initial) int32_t name;

struct params {
    PARAMS(PARAM_FIELD)
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
