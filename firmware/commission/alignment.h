/* SPDX-License-Identifier: MIT */
/*
 * Finds the magnets with a direct current, since an incremental encoder does not know their position.
 *
 * The current pulls the rotor to two angles 90 degrees apart, because there is no pull from the opposite side; then the field
 * turns one electrical turn forward and back, and a part of one with less current. Counts per turn check pole_pairs and
 * encoder_counts, their sign gives the direction, the field's lead over the encoder the offset (field_pass.h), and the lead's
 * growth with less current the load (load_angle.h). Nothing is taken for granted: every failed check has its own result.
 *
 * The rotor turns by two and a half electrical turns, according to pole_pairs, to either side of its starting point; one that
 * turns by more than ALIGNMENT_TURNS is driven by a load, and let go.
 * The pull uses i_align, the turns up to i_max; a second attempt uses that from the beginning.
 */
#ifndef FIRMWARE_COMMISSION_ALIGNMENT_H
#define FIRMWARE_COMMISSION_ALIGNMENT_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/commission/encoder_sense.h"
#include "firmware/commission/field_pass.h"
#include "firmware/commission/load_angle.h"
#include "firmware/commission/pendulum.h"
#include "firmware/commission/pull_speed.h"
#include "firmware/commission/saliency.h"
#include "firmware/control/current_loop.h"
#include "firmware/settings/tuning.h"

#define ALIGNMENT_TURNS 6

/* Load angle reported in a fault if the rotor did not stay with the field at all. */
#define ALIGNMENT_OUT_DEGREES 180

enum alignment_result {
    ALIGNMENT_RUNNING,
    ALIGNMENT_DONE,
    ALIGNMENT_ENCODER_DEAD, /* the field turned, the magnets induced a voltage, but no counts came */
    ALIGNMENT_DIRECTION,    /* encoder reversed or two phases swapped */
    ALIGNMENT_POLE_PAIRS,   /* detail: pole pairs and counts that would fit */
    ALIGNMENT_COUNTS,       /* the same */
    ALIGNMENT_BLOCKED,      /* nothing turned, or not evenly */
    ALIGNMENT_LOAD,         /* detail: load angle in degrees at the larger current */
};

struct alignment {
    uint32_t stage;
    uint32_t attempt;
    uint32_t level; /* of TUNING_ALIGN_LEVELS: how much current */
    uint32_t pass;
    uint32_t stage_ms;
    int32_t period_ms; /* the rotor's, or longer: times scale with it */
    int32_t counts;    /* of the encoder since the start */
    struct encoder_sense turned_with;
    int64_t sense_sum; /* q voltage times the encoder's motion since the field was last at rest */
    int32_t v_q_sum_q15;
    uint32_t swing_ms;
    int32_t swing_from;  /* counts then */
    int32_t furthest;    /* from there since then */
    int32_t fastest_q32; /* since then */
    int32_t origin;      /* counts when this attempt began */
    int32_t jump_from;   /* counts when the field jumped */
    uint32_t ratio;      /* the rotor's motion over what it should be as the field jumped; 8: right, or not known */
    uint32_t latched;    /* counter at the last step */
    uint32_t field_q32;
    int32_t current_q15, target_q15;
    int32_t pull_q15; /* as much of it as the rotor's speed allows */
    struct pull_speed speed;
    bool gripped; /* it fell, and more current caught it */
    bool even;    /* the whole turns were even */
    bool lost;    /* with less current the rotor did not follow */
    struct pendulum rotor;
    struct field_pass passing;
    int32_t turn_counts_q4[2]; /* of the whole turns, forward and back */
    int32_t turn_v_q_q15[2];
    struct load_angle load;
    struct saliency axis;
    uint32_t first_offset_q32; /* of the axis, before anything turned */
    int32_t stood_at;          /* counts when the axis began to be measured, */
    bool stood;                /* and it has stayed there */
    uint32_t still_ms;         /* since the encoder's last count */
    bool turned;               /* the passes are done */
    bool silent;               /* and the encoder did not count */
    int32_t detail[2];
};

/* `latched`: the encoder's counter. Slow loop, before the bridge is switched on. */
void alignment_start(struct alignment *a, volatile struct current_loop *c, const struct tuning *t, uint32_t latched);

/* One step a millisecond; sets the current references and the angle. Slow loop, bridge on. */
enum alignment_result alignment_step(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                     uint32_t latched);

/* True if the current loop must hold voltages (wiring_tuning). Slow loop, after the step. */
bool alignment_holds_voltage(const struct alignment *a);

#endif
