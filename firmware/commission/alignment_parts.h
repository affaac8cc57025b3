/* SPDX-License-Identifier: MIT */
/*
 * Shared by the alignment's two files only: the encoder's direction, attempts, turning and its checks (alignment_turns.c);
 * the magnets' axis, pulling and the stages (alignment.c). Slow loop.
 */
#ifndef FIRMWARE_COMMISSION_ALIGNMENT_PARTS_H
#define FIRMWARE_COMMISSION_ALIGNMENT_PARTS_H

#include <stdint.h>

#include "firmware/commission/alignment.h"

/* ==== the encoder against the field ==== */

/*
 * Compares the counts per electrical turn with what pole_pairs and encoder_counts predict. If they do not fit, one of the two
 * is wrong, and one electrical turn may not show which: if another whole number of pole pairs would fit, that is reported
 * first, since wrong counts rarely give a whole number; four times the counts means that lines were entered as counts. In any
 * case both values that would fit are reported.
 */

enum encoder_fit_verdict {
    ENCODER_FITS,
    ENCODER_POLE_PAIRS,
    ENCODER_COUNTS,
};

struct encoder_fit {
    enum encoder_fit_verdict verdict;
    int32_t pole_pairs;     /* that would fit if encoder_counts is right; 0: none would */
    int32_t encoder_counts; /* that would fit if pole_pairs is right */
};

/*
 * `two_turns_q4`: sixteenths of a count in two electrical turns, one in each direction, positive. The threshold is 1.3 % and
 * half a count: disc eccentricity and oscillation are below the first, uneven edges below the second; an error of two counts in
 * a hundred is above. Slow loop; 32-bit divisions.
 */
struct encoder_fit encoder_fit(int32_t two_turns_q4, int32_t pole_pairs, int32_t encoder_counts);

#define ALIGNMENT_ATTEMPTS 2u
#define RATIO_ONE          8u
#define DEGREES_45_Q32     0x20000000
#define QUARTER_Q32        0x40000000u

enum stage {
    STAGE_PULL,   /* current ramps up a quarter turn before the first angle; the rotor oscillates and settles */
    STAGE_SECOND, /* the field moves to the first angle */
    STAGE_PASS,
    STAGE_SOLVE,
    STAGE_RELEASE, /* current ramps down to zero */
    STAGE_DROP,    /* the same, without a ramp, and the rotor comes to rest */
    STAGE_AXIS, /* the magnets' axis, up to half a turn: after the passes, and of reluctance machines before the pull */
};

enum pass {
    PASS_FORWARD,
    PASS_BACK,
    PASS_FORWARD_REDUCED, /* less current */
    PASS_BACK_REDUCED,
};

static inline void alignment_enter(struct alignment *a, enum stage stage)
{
    a->stage = stage;
    a->stage_ms = 0;
}

/* ---- pulling ---- */

/* Starts from the present rotor and field. */
void alignment_begin_attempt(struct alignment *a, const struct tuning *t, uint32_t attempt, uint32_t angle_q32);

/* Begins the next attempt, if there is one, else returns the verdict `otherwise`. */
enum alignment_result alignment_again(struct alignment *a, const struct tuning *t, uint32_t angle_q32,
                                      enum alignment_result otherwise);

/* Before each step: whether a load drives the rotor away; a falling load is held. */
bool alignment_check_external_drive(struct alignment *a, const struct tuning *t);

/* One step of STAGE_PULL or STAGE_SECOND. */
enum alignment_result alignment_step_pull(struct alignment *a, const struct tuning *t, uint32_t angle_q32);

/* ---- the encoder's direction ---- */

/* The field is at rest from now on, and the rotor may oscillate. */
void alignment_begin_swing(struct alignment *a);

/* Before each step; the encoder has moved by `moved` counts to `angle_q32`. */
void alignment_observe_direction(struct alignment *a, const volatile struct current_loop *c, const struct tuning *t,
                                 int32_t moved, uint32_t angle_q32);

/* ---- turning ---- */

/* Begins a pass, enum pass. */
void alignment_begin_pass(struct alignment *a, const struct tuning *t, uint32_t pass);

/* One step of STAGE_PASS or STAGE_SOLVE. */
enum alignment_result alignment_step_turns(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                           uint32_t angle_q32);

/* Whether the passes alone give the offset, once they are evaluated. */
bool load_is_identified(struct alignment *a, const struct tuning *t);

/* ---- the magnets' axis ---- */

/* One step of STAGE_DROP or STAGE_AXIS. */
enum alignment_result alignment_step_axis(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                          uint32_t angle_q32);

#endif
