/* SPDX-License-Identifier: MIT */
#include "firmware/monitor/supervision.h"

#include "firmware/axis/axis.h"
#include "firmware/source/rotor.h"
#include "lib/q15.h"

/* ==== the speed ==== */

#define STEP_MS       2u /* period of the speed checks */
#define STALL_MS      500u
#define FAR_MS        4u
#define LOSING_MS     4u
#define LOOK_AHEAD_MS 10
#define DERATED_Q4    (10 * 16) /* below t_max the winding's share of the limit begins to fall (thermal.h) */
#define DERATED_PART  10        /* of i_max: derating */
#define RATE_SHIFT    1
#define TO_REST_MS    8
#define AT_REST_Q4    8  /* half a rpm a step: a reversing shaft passes 0 faster */
#define CYCLE_MIN     7u /* ms per half wave: faster ones are detected by the speed loop (control/oscillation.h) */
#define CYCLE_MAX     250u
#define CYCLE_HALVES  6u

/* Resolution of the encoder within a millisecond: two counts. */
static int32_t resolved_rpm_q4(const struct axis *a)
{
    return 2 * 60 * 1000 * 16 / a->params.encoder_counts;
}

/* Starts, from the parameters. Slow loop, when operation begins. */
static void speed_watch_begin(struct axis *a)
{
    const int32_t share_q4 = (int32_t)((int64_t)a->params.speed_max_rpm * 16 * a->params.deviation_pct / 100);
    a->supervision.speed = (struct speed_watch){.deviation_q4 = q15_max(share_q4, resolved_rpm_q4(a)),
                                                .oscillations = a->speed.oscillation.found,
                                                .speed_q4 = a->speed.speed_rpm_q4};
    a->supervision.cycle = (struct cycle_watch){.halves = 0};
}

/* Within a third, plus the error of two sampling periods at each end. */
static bool similar(uint32_t a, uint32_t b)
{
    const uint32_t longer = a > b ? a : b;
    const uint32_t shorter = a > b ? b : a;
    return shorter * 3u + 3u >= longer * 2u;
}

/* Half waves from before the speed loop has reduced its gains do not count. */
static void close_half_wave(struct axis *a, struct cycle_watch *w)
{
    const int32_t high_q15 = q15_max(w->high_q15, w->last_high_q15);
    const int32_t low_q15 = q15_min(w->low_q15, w->last_low_q15);
    const bool swings = high_q15 - low_q15 > a->tuning.i_max_q15 / 2;
    const bool answered = a->speed.oscillation.answered != w->answered;
    const bool slow = w->half_ms >= CYCLE_MIN && w->half_ms <= CYCLE_MAX;
    const bool counts = !answered && swings && slow && similar(w->half_ms, w->last_half_ms);
    w->halves = counts ? w->halves + 1u : 0u;
    w->last_half_ms = w->half_ms;
    w->last_high_q15 = w->high_q15;
    w->last_low_q15 = w->low_q15;
    w->answered = a->speed.oscillation.answered;
    w->half_ms = 0;
    w->high_q15 = a->loop.i_q_ref_q15;
    w->low_q15 = a->loop.i_q_ref_q15;
}

static void end_half_wave(struct axis *a)
{
    struct cycle_watch *const w = &a->supervision.cycle;
    close_half_wave(a, w);
    if (w->halves >= CYCLE_HALVES) {
        w->halves = 0;
        fault_report(a, FAULT_LIMIT_CYCLE, (int32_t)(1000u / (2u * w->last_half_ms)), 0);
    }
}

/* Winding or power stage are warm: the missing current is due to derating. */
static bool is_derated(const struct axis *a)
{
    const int32_t max_q15 = a->tuning.i_max_q15;
    return a->speed.at_limit && thermal_i_limit_q15(&a->thermal, max_q15) < max_q15 - max_q15 / DERATED_PART;
}

/*
 * Waits a few milliseconds for the cause: a dead encoder or Hall switch, a lost observer, an oscillation that ends, or an open
 * phase.
 */
static void lose_speed(struct axis *a)
{
    int32_t phase;
    if (rotor_has_hall(a) && hall_edge_is_overdue(&a->hall.speed)) {
        return;
    }
    if (lock_watch_suspects(a) || encoder_watch_may_be_dead(a) || oscillation_is_answered(&a->speed.oscillation)) {
        return;
    }
    if (phase_watch_suspects(a, &phase)) {
        fault_report(a, FAULT_OPEN_PHASE, phase, 0);
    } else if (is_derated(a)) {
        const bool winding = a->thermal.winding_q4 > a->thermal.max_q4 - DERATED_Q4;
        fault_report(a, winding ? FAULT_OVERTEMPERATURE : FAULT_INVERTER_OVERLOAD, a->thermal.winding_q4 / 16, 0);
    } else if (rotor_has_encoder(a) && encoder_watch_has_stopped(&a->supervision.encoder)) {
        fault_report(a, FAULT_STALL, 0, 0);
    } else {
        const int32_t missing_q4 = a->speed.speed_ref_rpm_q4 - a->speed.speed_rpm_q4;
        fault_report(a, FAULT_SPEED_DEVIATION, axis_forward(a) * missing_q4 / 16, 0);
    }
}

static void watch_cycle(struct axis *a, struct cycle_watch *w)
{
    const bool below = a->speed.speed_rpm_q4 < a->speed.speed_ref_rpm_q4;
    const int32_t i_q_q15 = a->loop.i_q_ref_q15;
    w->half_ms += STEP_MS;
    w->high_q15 = q15_max(w->high_q15, i_q_q15);
    w->low_q15 = q15_min(w->low_q15, i_q_q15);
    if (below != w->error_below) {
        w->error_below = below;
        end_half_wave(a);
    }
}

/*
 * A shaft that is stopped within milliseconds and held is at an end stop: a stall, not a lost speed. One that reverses is
 * driven by a load. False once that is known, or if the shaft turns on.
 */
static bool comes_to_rest(struct axis *a, struct speed_watch *s, bool lost)
{
    const int32_t size_q4 = q15_abs(a->speed.speed_rpm_q4);
    const bool turned = (a->speed.speed_rpm_q4 ^ a->speed.speed_ref_rpm_q4) < 0;
    if (size_q4 >= AXIS_STANDSTILL_RPM_Q4) {
        const bool slower = !turned && size_q4 < q15_abs(a->speed.speed_ref_rpm_q4);
        s->coming_to_rest = slower && size_q4 < TO_REST_MS / (int32_t)STEP_MS * s->rate_q4;
        return s->coming_to_rest;
    }
    if (lost && s->coming_to_rest && s->rate_q4 <= AT_REST_Q4) {
        fault_report(a, FAULT_STALL, 0, 0);
    }
    return s->coming_to_rest;
}

/*
 * Speed is lost if the deviation is too large, or will be in LOOK_AHEAD_MS with the torque at its limit. The latter considers
 * the shaft's acceleration only, not that of the reference.
 */
static void watch_deviation(struct axis *a, struct speed_watch *s)
{
    const int32_t error_q4 = a->speed.speed_ref_rpm_q4 - a->speed.speed_rpm_q4;
    const int32_t distance_q4 = q15_abs(error_q4);
    const int32_t gained_q4 = a->speed.speed_rpm_q4 - s->speed_q4;
    const bool same_side = !s->crossed; /* else it oscillates about the reference */
    const int32_t away_q4 = !same_side ? 0 : error_q4 < 0 ? gained_q4 : -gained_q4;
    const int32_t rate_q4 = s->rate_q4 + ((away_q4 - s->rate_q4) >> RATE_SHIFT);
    const bool helpless = a->speed.at_limit && (error_q4 < 0) == (a->loop.i_q_ref_q15 < 0);
    const bool losing =
        helpless && rate_q4 > 0 && distance_q4 + LOOK_AHEAD_MS / (int32_t)STEP_MS * rate_q4 > s->deviation_q4;
    const uint32_t losing_ms = losing ? s->losing_ms + STEP_MS : 0u;
    const uint32_t far_ms = distance_q4 > s->deviation_q4 ? (same_side ? s->far_ms : 0u) + STEP_MS : 0u;
    s->crossed = false;
    s->rate_q4 = rate_q4;
    s->speed_q4 = a->speed.speed_rpm_q4;
    s->losing_ms = losing_ms;
    s->far_ms = far_ms;
    const bool lost = far_ms >= FAR_MS || losing_ms >= LOSING_MS;
    if (!comes_to_rest(a, s, lost) && lost) {
        lose_speed(a);
    }
}

/* A toggle by one count, of an elastic shaft, does not restart it. */
static void watch_stall(struct axis *a, struct speed_watch *s)
{
    const bool stuck = a->speed.at_limit && q15_abs(a->speed.speed_rpm_q4) < AXIS_STANDSTILL_RPM_Q4;
    if (!stuck && s->stalled_ms == 0u) {
        return;
    }
    s->stalled_ms += stuck ? STEP_MS : -STEP_MS;
    if (s->stalled_ms >= STALL_MS) {
        fault_report(a, FAULT_STALL, 0, 0);
    }
}

/* The speed loop detects it, and has reduced its gains if allowed (control/oscillation.h). */
static void look_for_oscillation(struct axis *a, struct speed_watch *s)
{
    const struct oscillation *const o = &a->speed.oscillation;
    if (o->found != s->oscillations) {
        s->oscillations = o->found;
        fault_report(a, FAULT_OSCILLATION, o->hz, 0);
    }
}

/* Homing has its own check for a blocked shaft. */
static bool applies(const struct axis *a)
{
    return a->state == AXIS_OPERATION_ENABLED && !axis_mode_is_torque(a->mode) && a->mode != AXIS_MODE_HOMING;
}

/* Slow loop, every millisecond, for oscillations of up to 500 Hz. */
static void speed_watch_side(struct axis *a)
{
    struct speed_watch *const s = &a->supervision.speed;
    const bool below = a->speed.speed_ref_rpm_q4 < a->speed.speed_rpm_q4;
    s->crossed = s->crossed || below != s->below;
    s->below = below;
}

void speed_watch_step(struct axis *a)
{
    look_for_oscillation(a, &a->supervision.speed);
    if (applies(a)) {
        watch_cycle(a, &a->supervision.cycle);
        watch_deviation(a, &a->supervision.speed);
        watch_stall(a, &a->supervision.speed);
    }
}

/* ==== all monitors ==== */

#define TURNS      4u /* milliseconds for a cycle of all parts */
#define SLOW_TURN  3u
#define LIMITED_MS 100u

void supervision_begin_again(struct axis *a)
{
    lock_watch_begin(&a->lock_watch);
    field_watch_reset(&a->field_watch);
    phase_watch_begin(a);
    zero_watch_begin(&a->supervision.zeros);
    speed_watch_begin(a);
    a->supervision.limited_ms = 0;
}

void supervision_begin(struct axis *a)
{
    encoder_watch_begin(a);
    supervision_begin_again(a);
}

static void watch_overspeed(struct axis *a)
{
    if (q15_abs(current_loop_w_q15(&a->loop)) > a->tuning.overspeed_w_q15) {
        fault_report(a, FAULT_OVERSPEED, axis_forward(a) * a->speed.speed_rpm_q4 / 16, 0);
    }
}

/* The modulator is at its limit, and the current is off by a tenth of i_max. */
static bool voltage_is_short(const struct axis *a)
{
    const volatile struct current_loop *const c = &a->loop;
    const int32_t radius_q15 = c->radius_q15 - (c->radius_q15 >> 5);
    if (c->v_d_q15 * c->v_d_q15 + c->v_q_q15 * c->v_q_q15 <= radius_q15 * radius_q15) {
        return false;
    }
    const int32_t missing_q15 = q15_abs(c->i_q_ref_q15 - c->i_q_q15) + q15_abs(c->i_d_ref_q15 - c->i_d_q15);
    return missing_q15 > a->tuning.i_max_q15 / 10;
}

static void watch_voltage(struct axis *a)
{
    uint32_t *const limited_ms = &a->supervision.limited_ms;
    if (voltage_is_short(a)) {
        *limited_ms += TURNS;
    } else if (*limited_ms != 0u) {
        *limited_ms -= TURNS;
    }
    if (*limited_ms >= LIMITED_MS) {
        fault_report(a, FAULT_VOLTAGE_LIMIT, 0, 0);
        *limited_ms = 0;
    }
}

static void watch_temperature(struct axis *a)
{
    if (thermal_winding_too_hot(&a->thermal)) {
        fault_report(a, FAULT_OVERTEMPERATURE, a->thermal.winding_q4 / 16, 0);
    }
    if (thermal_inverter_too_hot(&a->thermal)) {
        fault_report(a, FAULT_INVERTER_OVERLOAD, 0, 0);
    }
}

bool supervision_is_silent(const struct axis *a)
{
    const int32_t limit_ms = a->params.command_timeout_ms;
    return limit_ms != 0 && a->time_ms - a->command_ms > (uint32_t)limit_ms;
}

static void watch_commands(struct axis *a)
{
    if (supervision_is_silent(a)) {
        fault_report(a, FAULT_COMMAND_TIMEOUT, a->params.command_timeout_ms, 0);
    }
    if (a->master_lost != 0u) {
        fault_report(a, FAULT_MASTER_LOST, (int32_t)a->master_lost, 0);
    }
}

/*
 * Without the thread no interface can stop the motor. Two axes share a thread, whose clock is the first axis': so -1 is
 * allowed.
 */
static void watch_thread(struct axis *a)
{
    const int32_t away_ms = (int32_t)(a->time_ms - a->thread_ms);
    if (away_ms > CONFIG_THREAD_MS && a->thread_ms != 0u) {
        fault_report(a, FAULT_THREAD_STOPPED, away_ms, 0);
    }
}

/* False if the measured speed is suspect, or the bridge may be off: then nothing else is checked. */
static bool speed_is_valid(struct axis *a, uint32_t turn)
{
    return rotor_has_encoder(a) ? encoder_watch_step(a, turn) : lock_watch_step(a);
}

/* The parts alternate, to spread the load: phases and speed every second millisecond, the slow ones every fourth. */
static void step_running(struct axis *a, uint32_t turn)
{
    if (!speed_is_valid(a, turn)) {
        return;
    }
    watch_overspeed(a);
    speed_watch_side(a);
    zero_watch_step(&a->supervision.zeros, a);
    if (turn % 2u == 0u) {
        phase_watch_expect(a);
        speed_watch_step(a);
        return;
    }
    phase_watch_step(a);
    if (turn == SLOW_TURN) {
        watch_voltage(a);
        watch_temperature(a);
        watch_commands(a);
    }
}

/* No current is commanded; or identify plays a burst, where samples differ from the mean. */
static bool no_current_is_commanded(const struct axis *a)
{
    const volatile struct current_loop *const c = &a->loop;
    const bool bursts = a->identify.running && (c->kp_d_q9 == 0 || c->kp_q_q9 == 0);
    return bursts || (c->i_d_ref_q15 == 0 && c->i_q_ref_q15 == 0);
}

/*
 * Before operation: open phases are detected whenever a current is commanded, which the wiring test does not; and the command
 * time-out applies.
 */
static void watch_start(struct axis *a, uint32_t turn)
{
    watch_overspeed(a);
    if (turn == SLOW_TURN) {
        watch_commands(a);
    }
    if (no_current_is_commanded(a)) {
        phase_watch_begin(a);
    } else if (turn % 2u == 0u) {
        phase_watch_expect(a);
    } else {
        phase_watch_step(a);
    }
}

void supervision_step(struct axis *a)
{
    if (a->state == AXIS_OPERATION_ENABLED || a->state == AXIS_QUICK_STOP) {
        step_running(a, a->time_ms % TURNS);
    } else if (a->state == AXIS_SWITCHED_ON) {
        watch_start(a, a->time_ms % TURNS);
    } else {
        return;
    }
    watch_thread(a);
}
