/* SPDX-License-Identifier: MIT */
/* The drive's raw values in thousandths of their units, for console and bus. Thread. */
#ifndef FIRMWARE_OPERATE_QUANTITIES_H
#define FIRMWARE_OPERATE_QUANTITIES_H

#include "firmware/drive/drive.h"

static inline int32_t quantity_milli_rpm(int32_t rpm_q4)
{
    return (int32_t)((int64_t)rpm_q4 * 1000 / 16);
}

static inline int32_t quantity_milliamp(const struct axis *a, int32_t q15)
{
    return tuning_milli_from_q15(q15, a->params.i_range_ma);
}

static inline int32_t quantity_millivolt(const struct axis *a, int32_t q15)
{
    return tuning_milli_from_q15(q15, a->params.v_range_mv);
}

#endif
