/* SPDX-License-Identifier: MIT */
/*
 * What the parts of the alignment share; nobody else includes this. Each part has a file: pulling (alignment_pull.c), the
 * encoder's sense (alignment_sense.c), turning and what it proves (alignment_turns.c), the axis of reluctant machines
 * (alignment_reluctant.c). Slow loop.
 */
#ifndef FIRMWARE_COMMISSION_ALIGNMENT_PARTS_H
#define FIRMWARE_COMMISSION_ALIGNMENT_PARTS_H

#include "firmware/commission/alignment.h"

#define ALIGNMENT_ATTEMPTS 2u
#define RATIO_ONE          8u
#define DEGREES_45_Q32     0x20000000
#define QUARTER_Q32        0x40000000u

enum stage {
    STAGE_PULL,   /* current rises a quarter turn before the first angle, the rotor swings and settles */
    STAGE_SECOND, /* the field goes to the first angle */
    STAGE_PASS,
    STAGE_SOLVE,
    STAGE_RELEASE, /* current down to nothing */
    STAGE_DROP,    /* the same, at once, and the rotor comes to rest */
    STAGE_AXIS, /* of reluctant machines, before the pull and after the passes: where the magnets are, but for half a turn */
};

enum pass {
    PASS_FORTH,
    PASS_BACK,
    PASS_FORTH_LESS, /* less current */
    PASS_BACK_LESS,
};

static inline void alignment_enter(struct alignment *a, enum stage stage)
{
    a->stage = stage;
    a->stage_ms = 0;
}

/* ---- pulling ---- */

/* From where the rotor and the field are now. */
void alignment_begin_attempt(struct alignment *a, const struct tuning *t, uint32_t attempt, uint32_t angle_q32);

/* The next attempt, if there is one; `otherwise` the verdict stands. */
enum alignment_result alignment_again(struct alignment *a, const struct tuning *t, uint32_t angle_q32,
                                      enum alignment_result otherwise);

/* Before each step: the current on its way, and whether a load takes the rotor away. */
void alignment_follow_current(struct alignment *a, const struct tuning *t);
int32_t alignment_pull_current_q15(const struct alignment *a, const struct tuning *t);
bool alignment_carried_away(struct alignment *a, const struct tuning *t);

/* One step of STAGE_PULL or STAGE_SECOND. */
enum alignment_result alignment_step_pull(struct alignment *a, const struct tuning *t, uint32_t angle_q32);

/* ---- the encoder's sense ---- */

/* The field is at rest from here on, and the rotor may swing. */
void alignment_begin_swing(struct alignment *a);

/* Before each step, the encoder having moved by `moved` counts to `angle_q32`. */
void alignment_feel_sense(struct alignment *a, const volatile struct current_loop *c, const struct tuning *t,
                          int32_t moved, uint32_t angle_q32);

/* ---- turning ---- */

/* Of enum pass. */
void alignment_begin_pass(struct alignment *a, const struct tuning *t, uint32_t pass);

/* One step of STAGE_PASS or STAGE_SOLVE. */
enum alignment_result alignment_step_turns(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                           uint32_t angle_q32);

/* ---- reluctant machines ---- */

/* Current off; when the rotor rests its axis is measured. `turned`: the passes are done. */
void alignment_begin_drop(struct alignment *a, bool turned);

/* Reluctance holds the rotor ahead of the field, seen the way in which the field is about to turn. */
bool alignment_leads_the_field(const struct alignment *a);

/* One step of STAGE_DROP or STAGE_AXIS. */
enum alignment_result alignment_step_reluctant(struct alignment *a, volatile struct current_loop *c,
                                               const struct tuning *t, uint32_t angle_q32);

#endif
