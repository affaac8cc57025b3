/* SPDX-License-Identifier: MIT */
#include "firmware/commission/encoder_sense.h"

#include "lib/q15.h"
#include "lib/trig.h"

void encoder_sense_start(struct encoder_sense *s)
{
    *s = (struct encoder_sense){0};
}

void encoder_sense_step(struct encoder_sense *s, int32_t e_d_q15, int32_t e_q_q15, uint32_t field_q32,
                        uint32_t angle_q32, int32_t moved)
{
    const cossin_t f = cossin_q15(field_q32);
    const cossin_t x = cossin_q15(angle_q32);
    const int64_t d = (int64_t)((e_d_q15 * f.cos - e_q_q15 * f.sin) >> 15) * moved;
    const int64_t q = (int64_t)((e_q_q15 * f.cos + e_d_q15 * f.sin) >> 15) * moved;
    s->cd += d * x.cos;
    s->sd += d * x.sin;
    s->cq += q * x.cos;
    s->sq += q * x.sin;
}

/* Shifted right by this much, all four fit in 15 bits and a sign. */
static uint32_t places(const struct encoder_sense *s)
{
    const int64_t bits =
        (s->cd ^ (s->cd >> 63)) | (s->sd ^ (s->sd >> 63)) | (s->cq ^ (s->cq >> 63)) | (s->sq ^ (s->sq >> 63));
    uint32_t n = 0;
    while (bits >> n > Q15_ONE) {
        n++;
    }
    return n;
}

int32_t encoder_sense_q15(const struct encoder_sense *s)
{
    const uint32_t n = places(s);
    const int32_t cd = (int32_t)(s->cd >> n), sd = (int32_t)(s->sd >> n);
    const int32_t cq = (int32_t)(s->cq >> n), sq = (int32_t)(s->sq >> n);
    const int32_t size_q30 = (cd * cd >> 2) + (sd * sd >> 2) + (cq * cq >> 2) + (sq * sq >> 2);
    const int32_t difference_q30 = (cd * sq >> 1) - (cq * sd >> 1);
    return size_q30 == 0 ? 0 : difference_q30 / (size_q30 / (1 << 15) + 1);
}
