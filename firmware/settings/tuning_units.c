/* SPDX-License-Identifier: MIT */
#include "firmware/settings/scale.h"
#include "firmware/settings/tuning.h"

int32_t tuning_q15_from_milli(int32_t milli, int32_t range_milli)
{
    const int64_t magnitude = scale(milli < 0 ? -(int64_t)milli : milli, 32768, range_milli);
    return (int32_t)(milli < 0 ? -magnitude : magnitude);
}
