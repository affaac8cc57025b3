/* SPDX-License-Identifier: MIT */
#include "firmware/settings/tuning.h"

#include "drivers/fabric/adc.h"
#include "firmware/settings/config.h"
#include "firmware/settings/features.h"
#include "firmware/settings/hall_table.h"
#include "firmware/settings/margins.h"
#include "firmware/settings/scale.h"
#include "firmware/settings/tuning_parts.h"

/* From the trigger to the last compare: bits, filter, arithmetic and handler. */
static int32_t modulator_counts(int32_t osr)
{
    return 3 * osr * ADC_MODULATOR_CLOCKS + 300;
}

/* The first that holds is the problem. */
struct inconsistency {
    bool holds;
    enum error error;
    int64_t value; /* the limit, where the text names one */
};

static struct outcome first_of(const struct inconsistency *list, size_t count)
{
    for (size_t n = 0; n < count; n++) {
        if (list[n].holds) {
            return (struct outcome){list[n].error, (int32_t)list[n].value};
        }
    }
    return OUTCOME_OK;
}

/*
 * Inductances of the same iron: by how much saturation at rated current may bring the incremental ones below flux over
 * current, and below those without current. Motors with measured maps have 3.8 and 6.8 (qemu/motors/thor_pmsyrm.toml).
 */
#define APPARENT_MOST 8LL
#define REST_MOST     16LL

static struct outcome check_limits(const struct params *p)
{
    const int64_t trip_most_ma = p->i_range_ma * 95LL / 100;
    const int64_t max_most_ma = p->i_trip_ma * 85LL / 100;
    const int64_t v_most_mv = p->v_range_mv * 98LL / 100;
    const int64_t rpm_most = 60LL * CONFIG_SPEED_BASE_HZ * 95 / 100 / p->pole_pairs;
    const struct inconsistency list[] = {
        {p->i_trip_ma > trip_most_ma, ERROR_I_TRIP_BEYOND_RANGE, trip_most_ma},
        {p->i_max_ma > max_most_ma, ERROR_I_MAX_BEYOND_TRIP, max_most_ma},
        {p->i_align_ma > p->i_max_ma, ERROR_I_ALIGN_BEYOND_MAX, p->i_max_ma},
        {p->v_min_mv >= p->v_max_mv || p->v_max_mv > v_most_mv, ERROR_V_LIMITS, v_most_mv},
        {p->chopper_on_mv != 0 && (p->chopper_on_mv >= p->v_max_mv || p->chopper_off_mv == 0 ||
                                   p->chopper_off_mv > p->chopper_on_mv - p->v_range_mv / 1000),
         ERROR_CHOPPER_LEVELS, 0},
        {p->speed_max_rpm >= p->overspeed_rpm, ERROR_SPEED_MAX_BEYOND_OVERSPEED, p->overspeed_rpm - 1},
        {p->v_min_mv < p->v_range_mv / 4, ERROR_V_MIN_BELOW_MODULATOR, p->v_range_mv / 4},
        {p->overspeed_rpm > rpm_most, ERROR_SPEED_BEYOND_OBSERVER, rpm_most},
        {p->ld_apparent_uh > APPARENT_MOST * p->ld_uh, ERROR_LD_APPARENT, APPARENT_MOST * p->ld_uh},
        {p->lq_apparent_uh > APPARENT_MOST * p->lq_uh, ERROR_LQ_APPARENT, APPARENT_MOST * p->lq_uh},
        {p->lq_rest_uh > REST_MOST * p->lq_uh, ERROR_LQ_REST, REST_MOST * p->lq_uh},
    };
    return first_of(list, sizeof list / sizeof list[0]);
}

static struct outcome check_sampling(const struct params *p)
{
    const bool shunts = p->low_side_shunts != 0;
    const bool twice = p->pwm_samples != 1;
    const int32_t osr = p->modulator_osr;
    const struct inconsistency list[] = {
        {shunts && p->overmodulation != 0, ERROR_OVERMODULATION_OF_SHUNTS, 0},
        {shunts && twice, ERROR_SAMPLES_OF_SHUNTS, 0},
        {twice && p->pwm_update == PWM_UPDATE_VALLEY, ERROR_SAMPLES_AT_VALLEY, 0},
        {twice && p->pwm_samples * CONFIG_PWM_HZ > CONFIG_LOOP_HZ_MAX, ERROR_SAMPLES_TOO_FAST, 0},
        {osr != 0 && (osr < 32 || (osr & (osr - 1)) != 0), ERROR_MODULATOR_OSR, 0},
        {osr != 0 && shunts, ERROR_MODULATOR_OF_SHUNTS, 0},
        {osr != 0 && modulator_counts(osr) > CONFIG_PWM_COUNTS / p->pwm_samples, ERROR_MODULATOR_TOO_SLOW, 0},
    };
    return first_of(list, sizeof list / sizeof list[0]);
}

/*
 * The fast path has fewer bits and more noise: a sixteenth of the range is kept for it. Beyond 95 % no modulator is reliable.
 */
static void tune_sensors(const struct params *p, struct tuning *t)
{
    const int32_t trip_q15 = t->i_trip_q15 + 32768 / 16, most_q15 = 32768 * 95 / 100;
    t->modulator_osr = (int16_t)p->modulator_osr;
    t->settle_counts = p->low_side_shunts != 0 ? CONFIG_SETTLE_COUNTS : 0u;
    t->modulator_trip_q15 = trip_q15 < most_q15 ? trip_q15 : most_q15;
    t->early_counts = 3 * p->modulator_osr * ADC_MODULATOR_CLOCKS / 2;
}

/* Before the speed loop's gains, which depend on the limits. */
static void tune_limits(const struct params *p, struct tuning *t)
{
    t->i_trip_q15 = tuning_q15_from_milli(p->i_trip_ma, p->i_range_ma);
    t->i_max_q15 = tuning_q15_from_milli(p->i_max_ma, p->i_range_ma);
    tune_sensors(p, t);
    t->i_sum_q15 = t->i_trip_q15 / 4;
    t->v_min_q15 = tuning_q15_from_milli(p->v_min_mv, p->v_range_mv);
    t->v_max_q15 = tuning_q15_from_milli(p->v_max_mv, p->v_range_mv);
    t->chopper_on_q15 = tuning_q15_from_milli(p->chopper_on_mv, p->v_range_mv);
    t->chopper_off_q15 = tuning_q15_from_milli(p->chopper_off_mv, p->v_range_mv);
    t->overspeed_w_q15 = (int32_t)scale((int64_t)p->overspeed_rpm * p->pole_pairs, 32768, 60LL * CONFIG_SPEED_BASE_HZ);
    t->encoder_scale_q32 = (uint32_t)scale(p->pole_pairs, 1LL << 32, p->encoder_counts);
}

/* Checks the bandwidths' margins and the encoder's resolution. */
static struct outcome check_margins(const struct params *p, struct tuning *t)
{
    const bool counts = source_has((uint32_t)p->angle_source, SOURCE_COUNTS);
    const int32_t current_bw_hz = margin_current_bw_hz(t->update, t->samples);
    if (p->current_bw_hz > current_bw_hz) {
        return (struct outcome){ERROR_CURRENT_MARGIN, current_bw_hz};
    }
    t->current_margin_u16 = margin_of_current_u16(p->current_bw_hz, t->update, t->samples);
    const int32_t least_counts = MARGIN_COUNTS_A_POLE_PAIR * p->pole_pairs;
    if (counts && p->encoder_counts < least_counts) {
        return (struct outcome){ERROR_ENCODER_COARSE, least_counts};
    }
    const int32_t resolved_hz = margin_resolution_bw_hz(p, t);
    if (counts && p->speed_bw_hz > resolved_hz) {
        return resolved_hz < 1 ? outcome_of(ERROR_SPEED_UNRESOLVED)
                               : (struct outcome){ERROR_SPEED_RESOLUTION, resolved_hz};
    }
    const int32_t speed_bw_hz = margin_speed_bw_hz(p->current_bw_hz, p->torque_mean_ms);
    if (p->speed_bw_hz > speed_bw_hz) {
        return speed_bw_hz < 1 ? outcome_of(ERROR_CURRENT_TOO_SLOW) : (struct outcome){ERROR_SPEED_MARGIN, speed_bw_hz};
    }
    if (p->position_bw_hz != 0 && p->position_bw_hz > margin_position_bw_hz(p)) {
        return (struct outcome){ERROR_POSITION_MARGIN, margin_position_bw_hz(p)};
    }
    return OUTCOME_OK;
}

struct outcome tuning_compute(const struct params *p, struct tuning *t)
{
    struct outcome found = check_limits(p);
    if (found.error == ERROR_NONE) {
        found = check_sampling(p);
    }
    if (found.error == ERROR_NONE) {
        tuning_rates(p, t);
        tune_limits(p, t);
        found = tuning_current(p, t);
    }
    if (found.error == ERROR_NONE) {
        found = tuning_torque(p, t);
    }
    if (found.error == ERROR_NONE) {
        found = tuning_speed(p, t);
    }
    if (found.error != ERROR_NONE) {
        return found;
    }
    tuning_position(p, t);
    tuning_start(p, t);
    struct hall_table hall;
    enum error problem = FEATURE_IN(HALL) ? hall_table_of(p, &hall) : ERROR_NONE;
    if (problem != ERROR_NONE && source_has((uint32_t)p->angle_source, SOURCE_SWITCHES)) {
        return outcome_of(problem);
    }
    problem = tuning_observer(p, t);
    if (problem != ERROR_NONE && source_has((uint32_t)p->angle_source, SOURCE_ESTIMATES)) {
        return outcome_of(problem);
    }
    const struct outcome absent = features_allow_source(p->angle_source); /* not before: the loops run by it even so */
    return absent.error != ERROR_NONE ? absent : check_margins(p, t);
}
