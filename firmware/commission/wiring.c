/* SPDX-License-Identifier: MIT */
#include "firmware/commission/wiring.h"

#include <stddef.h>

#include "firmware/settings/config.h"
#include "lib/q15.h"

/* The whole bus in the loop's steps: half the on-time. */
#define V_FULL_STEPS ((int32_t)CONFIG_PWM_COUNTS << (CONFIG_V_SHIFT - 1))

#define THIRD_Q32      0x55555555u              /* 120 degrees */
#define LARGEST_256THS (V_FULL_STEPS / 5 * 256) /* a fifth of the bus */
#define RISE_MS        40u /* a quarter more each: from the first voltage to the largest, and a while there */
#define FALL_MS        25u
#define SHARE_TENTH    3

const struct tuning wiring_tuning = {.v_min_q15 = Q15_ONE / 4};

void wiring_start(struct wiring *w)
{
    *w = (struct wiring){0};
}

static void hold_voltage(const struct wiring *w, volatile struct current_loop *c)
{
    current_loop_field(c, w->along * THIRD_Q32, 0);
    c->integral_q_q9 = 0;
    c->integral_d_q9 = (w->v_256ths >> 8) * 512;
}

static int32_t largest(const int32_t of_q15[3])
{
    return q15_max(q15_max(q15_abs(of_q15[0]), q15_abs(of_q15[1])), q15_abs(of_q15[2]));
}

static void keep(struct wiring *w, const int32_t i_q15[3])
{
    w->own_q15[w->along] = i_q15[w->along];
    for (size_t k = 0; k < 3u; k++) {
        w->largest_q15[k] = q15_max(w->largest_q15[k], q15_abs(i_q15[k]));
    }
    w->v_256ths = 0;
    w->ms = 0;
}

/* The voltage that resistance alone would take for a quarter of the current. */
static int32_t first_256ths(const struct tuning *t, const volatile struct current_loop *c)
{
    const int32_t v_steps = t->wiring_v_q15 / 4 * (V_FULL_STEPS / 16) / (c->vbus_q15 / 16 + 1);
    return q15_clamp(v_steps, 8, LARGEST_256THS / 256) * 256;
}

static enum wiring_result judge(struct wiring *w, const struct tuning *t)
{
    const int32_t most_q15 = largest(w->largest_q15);
    if (most_q15 < t->wiring_i_q15 / 2) {
        return WIRING_OPEN;
    }
    for (size_t k = 0; k < 3u; k++) {
        w->phase = (int32_t)k + 1;
        if (w->largest_q15[k] * 10 < most_q15 * SHARE_TENTH) {
            return WIRING_OPEN;
        }
        if (w->own_q15[k] < 0) {
            return WIRING_SIGN;
        }
    }
    return WIRING_GOOD;
}

enum wiring_result wiring_step(struct wiring *w, volatile struct current_loop *c, const struct tuning *t,
                               const struct adc_regs *adc)
{
    const struct adc_sample s = adc_read(adc);
    const int32_t i_q15[3] = {s.ia_q15, s.ib_q15, s.ic_q15};
    const int32_t now_q15 = largest(i_q15);
    w->ms++;
    if (w->v_256ths == 0 && (w->ms > FALL_MS || now_q15 < t->wiring_i_q15 / 4)) {
        if (w->along == 3u) {
            return judge(w, t);
        }
        w->v_256ths = first_256ths(t, c);
        w->ms = 0;
    } else if (w->v_256ths != 0 && (now_q15 >= t->wiring_i_q15 || w->ms > RISE_MS)) {
        keep(w, i_q15);
        w->along++;
    } else {
        w->v_256ths = q15_min(w->v_256ths + w->v_256ths / 4, LARGEST_256THS);
    }
    hold_voltage(w, c);
    return WIRING_RUNNING;
}
