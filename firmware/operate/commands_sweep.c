/* SPDX-License-Identifier: MIT */
/* Frequency responses at the console: begin, how far it is, the result. */
#include "firmware/operate/commands.h"
#include "firmware/operate/quantities.h"
#include "lib/polar.h"

static const char *const loop_names[] = {[SWEEP_D] = "d", [SWEEP_Q] = "q", [SWEEP_SPEED] = "speed"};
static const char *const state_names[] = {
    [SWEEP_NONE] = "none", [SWEEP_RUNS] = "runs", [SWEEP_DONE] = "done", [SWEEP_ENDED] = "ended before its end"};

static void run_sweep(struct session *s, const struct arguments *a)
{
    answer(s, scope_sweep(s->scope, (enum sweep_loop)a->value[1], a->value[2]));
}

static void put_state(struct text *out, const struct sweep *w)
{
    text_print(out, "sweep: %s, loop: %s, amplitude: %.3d A, points: %u\n", state_names[w->state], loop_names[w->loop],
               quantity_milliamp(w->axis, w->amplitude_q15), w->count);
}

static void run_sweep_state(struct session *s, const struct arguments *a)
{
    (void)a;
    put_state(&s->out, &s->scope->sweep);
}

static void put_point(struct text *out, const struct sweep_point *p)
{
    const int32_t size_q14 = magnitude_q15(q15_sat16(p->re_q14), q15_sat16(p->im_q14));
    const int32_t angle_q32 = (int32_t)atan2_q32(p->im_q14, p->re_q14);
    text_print(out, "%.3d Hz: %.3d, %.3d deg\n", p->millihertz, size_q14 * 1000 / SWEEP_UNITY,
               (int32_t)(((int64_t)angle_q32 * 360000) >> 32));
}

static void put_frequency(struct text *out, const char *what, int32_t millihertz)
{
    if (millihertz == 0) {
        text_print(out, "%s: not among these frequencies\n", what);
    } else {
        text_print(out, "%s: %.3d Hz\n", what, millihertz);
    }
}

static void put_response(struct session *s)
{
    const struct sweep *const w = &s->scope->sweep;
    const struct sweep_summary found = sweep_summary(w);
    put_state(&s->out, w);
    for (uint32_t n = 0; n < w->count; n++) {
        put_point(&s->out, &w->points[n]);
    }
    put_frequency(&s->out, "closed loop, -3 dB", found.bandwidth_mhz);
    put_frequency(&s->out, "closed loop, -90 degrees", found.lag_mhz);
    put_frequency(&s->out, "open loop, crossover", found.crossover_mhz);
    if (found.crossover_mhz != 0) {
        text_print(&s->out, "phase margin: %.3d degrees\n", found.margin_ddeg * 100);
    }
}

static void run_sweep_do(struct session *s, const struct arguments *a)
{
    if (a->value[1] == 0) {
        put_response(s);
    } else {
        sweep_end(&s->scope->sweep);
        answer(s, OUTCOME_OK);
    }
}

/* clang-format off */
const struct command commands_sweep[] = {
    {"sweep", " d|q|speed A", "the frequency response of a loop in operation, by a sine of A peak amperes",
     {ARGUMENT_CHOICE, ARGUMENT_AMPERES}, .run = run_sweep, .begins = PROGRESS_SWEEP},
    {"sweep", " read|off", "what it found: the closed loop by frequency, bandwidth, phase margin; or end it",
     {ARGUMENT_CHOICE}, .run = run_sweep_do},
    {"sweep", "", "how far it is", .run = run_sweep_state},
};
/* clang-format on */
