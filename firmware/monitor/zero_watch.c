/* SPDX-License-Identifier: MIT */
#include "firmware/monitor/zero_watch.h"

#include "firmware/axis/axis.h"
#include "lib/q15.h"

#define LOOK_HZ     500                                          /* every second millisecond */
#define TRAVEL_Q15  (4 * LOOK_HZ * 32768 / CONFIG_SPEED_BASE_HZ) /* four turns of the field, as a sum of w_q15 */
#define LEAST       128                                          /* samples: a quarter of a second */
#define MOST        4096                                         /* what takes longer says nothing */
#define ALLOWED_Q15 (32768 / 32)                                 /* 3 % of the range */

void zero_watch_begin(struct zero_watch *z)
{
    *z = (struct zero_watch){0};
}

void zero_watch_step(struct zero_watch *z, struct axis *a)
{
    const struct adc_regs *const adc = &a->fabric->adc;
    const struct adc_sample now = adc_read(adc);
    z->travel_q15 = q15_min(z->travel_q15 + q15_abs(current_loop_w_q15(&a->loop)), TRAVEL_Q15);
    if (adc_sees_all(adc)) {
        z->sum_q15 += now.ia_q15 + now.ib_q15 + now.ic_q15;
        z->samples++;
    }
    if (z->samples >= LEAST && z->travel_q15 >= TRAVEL_Q15) {
        const int32_t mean_q15 = z->sum_q15 / z->samples;
        if (q15_abs(mean_q15) > ALLOWED_Q15) {
            fault_report(a, FAULT_CURRENT_OFFSET, (int32_t)((int64_t)mean_q15 * a->params.i_range_ma / 32768), 0);
        }
        zero_watch_begin(z);
    } else if (z->samples >= MOST) {
        zero_watch_begin(z);
    }
}
