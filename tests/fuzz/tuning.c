/* SPDX-License-Identifier: MIT */
/*
 * Sets of parameters, evenly over the decades of their ranges and at their edges: what the tuning accepts drives the slow loop
 * through measurements that make no sense, in every mode, with every source; nothing overflows, divides by 0 or leaves an
 * array.
 */
#include "drive.h"
#include "firmware/control/torque_build.h"
#include "firmware/drive/modes.h"
#include "firmware/drive/retune.h"

#define STEPS    200
#define PER_MODE 12

static struct torque_builder builder;
static struct input draws;
static uint32_t seed;

/* The input's bytes first; behind them the same numbers in each run: xorshift (G. Marsaglia, J. Stat. Softw. 8(14), 2003). */
static uint32_t any(uint32_t below)
{
    if (draws.at < draws.end) {
        seed ^= (uint32_t)*draws.at << 24;
        const uint32_t high = next_byte(&draws);
        return (below > 256u ? high << 8 | next_byte(&draws) : high) % below;
    }
    seed = seed != 0u ? seed : 2463534242u;
    seed ^= seed << 13;
    seed ^= seed >> 17;
    seed ^= seed << 5;
    return seed % below;
}

static void enter(void)
{
}

static void (*vector)(void) = enter;
static const struct loop_handlers handlers = {.vector = &vector,
                                              .handler = {enter, enter, enter, enter, enter},
                                              .weakening = enter,
                                              .overmodulating = enter,
                                              .rippled = enter};

static uint32_t word(void)
{
    return any(65536u) << 16 | any(65536u);
}

/* Evenly over the binary decades, of either sign: small numbers come as often as large ones. */
static int32_t within(int64_t least, int64_t most)
{
    const int64_t value = (int64_t)(word() >> any(32)) * (least < 0 && any(2) != 0u ? -1 : 1);
    return (int32_t)(value < least ? least : value > most ? most : value);
}

static int32_t percent(int32_t of, uint32_t from, uint32_t to)
{
    return (int32_t)((int64_t)of * (from + any(to - from + 1u)) / 100);
}

/* Of most sets some values are the initial ones, so that the rest is not refused for these. */
static void draw(struct params *p)
{
    const uint32_t changed = 1u + any(100);
    for (size_t n = 0; n < param_count; n++) {
        const struct param_info *const info = &param_table[n];
        const uint32_t kind = any(10);
        if (any(100) < changed) {
            param_set(p, info, kind == 0u ? info->min : kind == 1u ? info->max : within(info->min, info->max));
        }
    }
}

static void order(struct params *p)
{
    const int64_t range_ma =
        p->v_range_mv * 1000LL / (1 + (int64_t)(word() >> (12 + any(20)))); /* an impedance of 1 mohm to 1 kohm */
    p->i_range_ma = scale_clamp(range_ma, 100, 2000000);
    p->i_trip_ma = percent(p->i_range_ma, 50, 95);
    p->i_max_ma = percent(p->i_trip_ma, 10, 85);
    p->i_align_ma = percent(p->i_max_ma, 10, 100);
    p->v_max_mv = percent(p->v_range_mv, 60, 98);
    p->v_min_mv = percent(p->v_range_mv, 25, 50);
    p->chopper_off_mv = percent(p->v_max_mv, 80, 90);
    p->chopper_on_mv = any(2) != 0u ? percent(p->v_max_mv, 95, 99) : 0;
    const int32_t rpm_most = 60 * 1187 / p->pole_pairs;
    p->overspeed_rpm = q15_clamp(p->overspeed_rpm, 2, rpm_most);
    p->speed_max_rpm = q15_min(p->speed_max_rpm, p->overspeed_rpm - 1);
    p->ld_apparent_uh = q15_min(p->ld_apparent_uh, 8 * p->ld_uh);
    p->lq_apparent_uh = q15_min(p->lq_apparent_uh, 8 * p->lq_uh);
    p->lq_rest_uh = q15_min(p->lq_rest_uh, 16 * p->lq_uh);
    p->modulator_osr = p->low_side_shunts != 0 ? 0 : p->modulator_osr & 96;
    if (p->low_side_shunts != 0) {
        p->pwm_samples = 1;
        p->overmodulation = 0;
    } else if (p->pwm_samples == 2 && p->pwm_update == 0) {
        p->pwm_update = 1;
    }
}

/* What a refusal says would work is tried, so that what is refused first does not hide the rest. */
static void yield_to(struct params *p, struct outcome o)
{
    int32_t *const yielding[ERROR_COUNT] = {
        [ERROR_CURRENT_INTEGRAL_GAIN] = &p->resistance_mohm,
        [ERROR_DECOUPLING] = &p->flux_uwb,
        [ERROR_SPEED_GAIN] = &p->inertia_gmm2,
        [ERROR_CURRENT_MARGIN] = &p->current_bw_hz,
        [ERROR_SPEED_MARGIN] = &p->speed_bw_hz,
        [ERROR_SPEED_RESOLUTION] = &p->speed_bw_hz,
        [ERROR_POSITION_MARGIN] = &p->position_bw_hz,
        [ERROR_INERTIA] = &p->inertia_gmm2,
    };
    if (yielding[o.error] != NULL) {
        *yielding[o.error] = o.value;
    } else if (o.error == ERROR_CURRENT_GAIN) {
        int32_t *const all[] = {&p->ld_uh, &p->lq_uh, &p->ld_apparent_uh, &p->lq_apparent_uh};
        for (size_t n = 0; n < sizeof all / sizeof all[0]; n++) {
            *all[n] = q15_min(*all[n], o.value);
        }
        p->lq_rest_uh = 0;
    } else if (o.error == ERROR_EMF_BEYOND_V_MAX) {
        p->emf_beyond_v_max = 1;
    } else if (o.error == ERROR_ENCODER_COARSE || o.error == ERROR_SPEED_UNRESOLVED) {
        p->angle_source = PARAM_ANGLE_SENSORLESS;
    } else if (o.error == ERROR_HALL_STATES || o.error == ERROR_HALL_EDGES) {
        p->angle_source = PARAM_ANGLE_ENCODER;
    }
}

static bool tuned(void)
{
    struct outcome o = OUTCOME_OK;
    for (int attempt = 0; attempt < 20; attempt++) {
        o = tuning_compute(&axis.params, &axis.switching.tuning);
        o = o.error == ERROR_NONE ? tuning_check_motor(&axis.params) : o;
        if (o.error == ERROR_NONE) {
            return true;
        }
        yield_to(&axis.params, o);
    }
    return false;
}

static void operate(void)
{
    axis.faults = (struct fault_record){.count = axis.faults.count};
    axis.reactions.stopping = false;
    axis.loop.locked_out = 0;
    axis.request = AXIS_REQUEST_NONE;
    axis.state = any(8) == 0u ? AXIS_QUICK_STOP : AXIS_OPERATION_ENABLED;
    PUT(fabric.gate.CONTROL, 1u);
    PUT(fabric.gate.STATUS, 1u);
}

/* What the interrupt and the fabric leave, in the ranges that their types have (control/current_loop.h, drivers/fabric/). */
static void measure(bool wild)
{
    struct current_loop *const c = &axis.loop;
    const int32_t counts = axis.tuning.encoder_counts;
    const uint32_t latched = fabric.encoder.LATCHED;
    const uint32_t clock = fabric.encoder.LATCH_TIME + 100000u + any(64);
    PUT(fabric.adc.SEQUENCE, fabric.adc.SEQUENCE + (uint32_t)c->loops_per_slow);
    PUT(fabric.adc.IA, within(-32768, 32752));
    PUT(fabric.adc.IB, within(-32768, 32752));
    PUT(fabric.adc.IC, within(-32768, 32752));
    PUT(fabric.adc.VBUS, wild ? (int32_t)any(4096) << 3 : axis.tuning.v_min_q15);
    PUT(fabric.adc.TEMP, any(4096));
    PUT(fabric.encoder.LATCHED, (wild ? word() : latched + any(4)) % (uint32_t)counts);
    PUT(fabric.encoder.LATCH_TIME, clock);
    PUT(fabric.encoder.EDGE_TIME, clock - (word() >> any(32)) % (wild ? UINT32_MAX : 100000u));
    PUT(fabric.encoder.HALL, any(8));
    PUT(fabric.encoder.HALL_TIME, clock - (word() >> any(32)));
    c->i_d_q15 = within(-65534, 65534);
    c->i_q_q15 = within(-65534, 65534);
    c->v_d_steps = within(-CONFIG_RADIUS_STEPS, CONFIG_RADIUS_STEPS);
    c->v_q_steps = within(-CONFIG_RADIUS_STEPS, CONFIG_RADIUS_STEPS);
    c->pll.speed_q32 = within(-INT32_MAX, INT32_MAX);
    c->pll.angle_q32 = word();
    c->field_angle_q32 = word();
}

static void ask(void)
{
    const struct params *const p = &axis.params;
    const int32_t here = (int32_t)axis.motion.turns.counts;
    axis.set_point.waits = false;
    switch (any(8)) {
    case 0:
        (void)drive_command_speed(&axis, within(-p->speed_max_rpm, p->speed_max_rpm));
        break;
    case 1:
        (void)drive_command_current(&axis, within(-p->i_max_ma, p->i_max_ma));
        break;
    case 2:
        (void)drive_command_position(&axis, within(INT32_MIN, INT32_MAX), any(2) != 0u);
        break;
    case 3:
        (void)drive_command_cyclic_speed(&axis, (any(2) != 0u ? 1 : -1) * p->speed_max_rpm);
        break;
    case 4:
        (void)drive_command_cyclic_current(&axis, within(-p->i_max_ma, p->i_max_ma));
        break;
    case 5:
        (void)drive_command_home(&axis, any(2) != 0u ? HOMING_INDEX : HOMING_BLOCK);
        break;
    case 6:
        (void)drive_learn_cogging(&axis);
        break;
    default:
        (void)drive_command_cyclic_position(
            &axis, (int32_t)((uint32_t)here + (uint32_t)within(-2 * p->encoder_counts, 2 * p->encoder_counts)));
    }
}

static void play(void)
{
    apply_tuning(&axis, &axis.switching.tuning);
    axis.tuning.weakens = axis.switching.tuning.weakens;
    current_loop_follow(&axis.loop, axis.fabric, &axis.tuning);
    for (int n = 0; n < STEPS; n++) {
        operate();
        measure(any(4) == 0u);
        if (n % PER_MODE == 0) {
            ask();
        }
        drive_step(&axis);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t count)
{
    draws = (struct input){data, data + count};
    seed = 0;
    begin_drive(false);
    axis.loop.handlers = &handlers;
    draw(&axis.params);
    if (any(8) != 0u) {
        order(&axis.params);
    }
    if (!tuned()) {
        see("refused");
        return 0;
    }
    torque_build_begin(&builder, &axis.torque, &axis.params, &axis.switching.tuning,
                       axis.switching.tuning.v_min_q15 + (int32_t)any(8192));
    while (torque_build_step(&builder, &axis.torque, &axis.params, &axis.switching.tuning)) {
    }
    play();
    see("driven");
    return 0;
}
