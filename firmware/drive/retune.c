/* SPDX-License-Identifier: MIT */
#include "firmware/drive/retune.h"

#include "firmware/axis/axis.h"
#include "firmware/settings/config.h"
#include "firmware/settings/features.h"
#include "lib/q15.h"

#define REDUCED_Q8 179 /* 0.7 */

void retune_all(struct axis *a, const struct tuning *t)
{
    a->tuning = *t;
    speed_loop_tune(&a->speed, t);
}

void retune_source(struct axis *a, uint32_t angle_source, int32_t speed_ki_min_q16)
{
    a->tuning.angle_source = angle_source;
    a->tuning.speed_ki_min_q16 = speed_ki_min_q16;
}

static int32_t gain_reductions(int32_t gain)
{
    return q15_max((int32_t)(((int64_t)gain * REDUCED_Q8) >> 8), 1);
}

void retune_reduced_gains(struct axis *a)
{
    struct tuning *const t = &a->tuning;
    t->speed_accel_q8 = gain_reductions(t->speed_accel_q8);
    t->speed_kp_q16 = gain_reductions(t->speed_kp_q16);
    t->speed_ki_q16 = gain_reductions(gain_reductions(t->speed_ki_q16));
    speed_loop_soften(&a->speed, gain_reductions(a->speed.kp_q16), gain_reductions(gain_reductions(a->speed.ki_q16)));
}

#define LATCH_POLLS (2u * CONFIG_PWM_COUNTS) /* each takes longer than a count */

/*
 * Waits for the next conversion, within a PWM period: until then the fabric's latched count has the old setting, and the slow
 * loop would report an over-speed.
 */
static void wait_for_count(const struct encoder_regs *encoder)
{
    const uint32_t latched = encoder_latch_clock(encoder);
    for (uint32_t poll = 0; poll < LATCH_POLLS && encoder_latch_clock(encoder) == latched; poll++) {
    }
}

/* Any change of the encoder's setting invalidates the alignment. */
void apply_tuning(struct axis *a, const struct tuning *t)
{
    if (t->angle_source != a->tuning.angle_source) {
        start_forget(a);
        current_loop_offset(&a->loop, 0);
        current_loop_run(&a->loop, 0);
        speed_estimate_reset(&a->speed.estimate);
    }
    if (t->encoder_scale_q32 != a->tuning.encoder_scale_q32 || t->encoder_counts != a->tuning.encoder_counts ||
        (FEATURE_IN(IDENTIFY) && identify_in_rotor_frame(&a->identify))) {
        identify_leave(&a->identify);
        start_forget(a);
        (void)encoder_init(&a->fabric->encoder, (uint32_t)t->encoder_counts, false);
        wait_for_count(&a->fabric->encoder);
        speed_estimate_reset(&a->speed.estimate);
        turns_begin(&a->motion.turns, 0);
        a->motion.homed = false;
        cogging_forget(&a->motion.cogging);
    }
    if (source_has(t->angle_source, SOURCE_SWITCHES)) {
        struct hall_table table;
        (void)hall_table_of(&a->params, &table); /* checked with the tuning */
        hall_take_table(&a->hall, &table, t);
    }
    a->start.recheck_wiring = a->start.recheck_wiring || t->samples > a->tuning.samples;
    retune_all(a, t);
    thermal_tune(&a->thermal, &a->params);
}
