/* SPDX-License-Identifier: MIT */
#include "firmware/monitor/zero_watch.h"

#include "firmware/axis/axis.h"
#include "lib/q15.h"

#define LOOK_HZ     1000
#define TRAVEL_Q15  (4 * LOOK_HZ * 32768 / CONFIG_SPEED_BASE_HZ) /* four turns of the field, as a sum of w_q15 */
#define LEAST       256                                          /* samples: a quarter of a second */
#define MOST        8192                                         /* what takes longer says nothing */
#define ALLOWED_Q15 (32768 / 32)                                 /* 3 % of the range */
#define BEAT_HZ     8

void zero_watch_begin(struct zero_watch *z)
{
    *z = (struct zero_watch){0};
}

/* A field that turns almost as often as it is looked at shows the same angle each time. */
static bool seems_to_stand(int32_t w_q15)
{
    const int32_t hz = (q15_abs(w_q15) * CONFIG_SPEED_BASE_HZ) >> 15;
    return hz > LOOK_HZ / 2 && q15_abs((hz + LOOK_HZ / 2) % LOOK_HZ - LOOK_HZ / 2) < BEAT_HZ;
}

/* The mean over the angle: each sample counts by how far the field turns with it, back as well as forth. */
static void judge(const struct zero_watch *z, struct axis *a)
{
    const int32_t mean_q15 = (int32_t)(z->sum_q30 / z->travel_q15);
    if (q15_abs(mean_q15) > ALLOWED_Q15) {
        fault_report(a, FAULT_CURRENT_OFFSET, (int32_t)((int64_t)mean_q15 * a->params.i_range_ma / 32768), 0);
    }
}

void zero_watch_step(struct zero_watch *z, struct axis *a)
{
    const struct adc_regs *const adc = &a->fabric->adc;
    const struct adc_sample now = adc_read(adc);
    const int32_t w_q15 = current_loop_w_q15(&a->loop);
    if (!adc_sees_all(adc) || seems_to_stand(w_q15)) {
        return;
    }
    z->sum_q30 += (int64_t)(now.ia_q15 + now.ib_q15 + now.ic_q15) * w_q15;
    z->travel_q15 += w_q15;
    z->samples++;
    const bool turned = z->samples >= LEAST && q15_abs(z->travel_q15) >= TRAVEL_Q15;
    if (turned) {
        judge(z, a);
    }
    if (turned || z->samples >= MOST) {
        zero_watch_begin(z);
    }
}
