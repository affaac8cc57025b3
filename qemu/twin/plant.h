/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The fabric and the physics behind it, advanced from event to event. Knows nothing of QEMU. */
#ifndef TWIN_PLANT_H
#define TWIN_PLANT_H

#include <stdbool.h>
#include <stdint.h>

#include "fabric_model.h"
#include "inverter.h"
#include "meter.h"
#include "motor.h"
#include "sensors.h"
#include "simtime.h"
#include "thermometer.h"

/* The truth at an ADC trigger; mean values are over the time since the trigger before. */
struct plant_row {
    double t_s;
    double v_mean_v[3];
    double i_a[3];
    double theta_mech_rad, speed_rad_s, torque_nm, load_nm;
    double bus_v;
    double duty[3];
    unsigned gates;
    bool live;
    double winding_c;
    double i_rms_a[3];     /* over the time since the trigger before, ripple included */
    double i_peak_a[3];    /* largest |i| of that time */
    double torque_mean_nm; /* of that time */
    double load_speed_rad_s, magnet_c;
    double i_mean_a[3]; /* of that time */
    unsigned hall;
};

struct plant {
    struct fabric *fabric;
    struct fabric_model model;
    struct inverter inverter;
    struct motor motor;
    struct sensors sensors;
    struct thermometer thermometer;
    struct meter meter;

    sim_ps sample_at[3]; /* of a current that the running conversion has not sampled yet; else SIM_NEVER */
    sim_ps next_sample;  /* the first of them */
    sim_ps now;          /* how far the physics has come */
    double stepped_ps;   /* and within an integration */
    unsigned gates;      /* as the inverter knows them */
    unsigned hall;       /* as the fabric was shown it */
    int64_t edges;       /* of the encoder, likewise */
    sim_ps row_start;
    sim_ps high_time[3]; /* of the high-side gates from row_start to high_counted */
    sim_ps high_counted;
    double row_alpha_vs, row_beta_vs;

    void (*on_trigger)(void *context, const struct plant_row *row);
    void *context;
};

struct plant_params {
    struct motor_params motor;
    struct load_params load;
    struct inverter_params inverter;
    struct sensor_params sensors;
    uint64_t seed;
    struct fabric *fabric; /* NULL: the C models */
};

void plant_init(struct plant *p, const struct plant_params *params);
/* One of several behind the same fabric, as C models: which, of how many, and that of axis 0, NULL for that itself. */
void plant_join(struct plant *p, unsigned axis, unsigned axes, const struct plant *leader);
/* Its carrier waits for that of the leader, which must not be advanced beyond this plant until that has happened. */
bool plant_waits(const struct plant *p);
/* Brings events and physics to `to`; events at `to` are included. */
void plant_advance(struct plant *p, sim_ps to);
/* Reset of the fabric: every block, at the present time. Physics goes on. */
void plant_reset_fabric(struct plant *p);

/* Fabric registers, by offset from the window's base, at time now, which is never earlier than in the call before. */
uint32_t plant_read(struct plant *p, uint32_t offset, sim_ps now);
void plant_write(struct plant *p, uint32_t offset, uint32_t value, sim_ps now);

/* When somebody outside may have to look: no later than the next trigger, and than the next end of a conversion. */
sim_ps plant_next_trigger(const struct plant *p);
sim_ps plant_next_conversion_end(const struct plant *p);

/* A pin of the fabric asks to stop, or no longer: driver fault, STO, clock. */
void plant_stop(struct plant *p, enum gate_latch which, bool stops);

#endif
