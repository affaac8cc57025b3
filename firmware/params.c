/* SPDX-License-Identifier: MIT */
#include "firmware/params.h"

#include "firmware/text.h"

#define PARAM(field, low, high, start) \
    { \
#field, (low), (high), (start), offsetof(struct params, field) \
    }

/* The initial values are a Teknic M-2310P-LN-04K on the 24 V inverter: qemu/motors/ and qemu/inverters/ have the sources. */
const struct param_info param_table[] = {
    PARAM(pole_pairs, 1, 50, 4),
    PARAM(encoder_counts, 64, 65536, 4000),
    PARAM(resistance_mohm, 1, 100000, 360),
    PARAM(ld_uh, 1, 1000000, 200),
    PARAM(lq_uh, 1, 1000000, 200),
    PARAM(flux_uwb, 10, 10000000, 6300),
    PARAM(inertia_gcm2, 1, 50000000, 420),
    PARAM(i_range_ma, 100, 2000000, 20000),
    PARAM(v_range_mv, 1000, 2000000, 60000),
    PARAM(i_max_ma, 10, 2000000, 10000),
    PARAM(i_trip_ma, 10, 2000000, 14000),
    PARAM(i_align_ma, 10, 2000000, 4000),
    PARAM(v_min_mv, 1000, 2000000, 18000),
    PARAM(v_max_mv, 1000, 2000000, 32000),
    PARAM(speed_max_rpm, 1, 30000, 4000),
    PARAM(overspeed_rpm, 1, 32000, 5000),
    PARAM(ramp_rpm_s, 1, 1000000, 4000),
    PARAM(current_bw_hz, 10, 2000, 1000),
    PARAM(speed_bw_hz, 1, 200, 60),
};

const size_t param_count = sizeof param_table / sizeof param_table[0];

struct params params;

static int32_t *field(const struct param_info *info)
{
    return (int32_t *)(void *)((char *)&params + info->offset);
}

void params_init(void)
{
    for (size_t i = 0; i < param_count; i++) {
        *field(&param_table[i]) = param_table[i].initial;
    }
}

const struct param_info *param_find(const char *name)
{
    for (size_t i = 0; i < param_count; i++) {
        if (text_equal(param_table[i].name, name)) {
            return &param_table[i];
        }
    }
    return NULL;
}

int32_t param_get(const struct param_info *info)
{
    return *field(info);
}

void param_set(const struct param_info *info, int32_t value)
{
    *field(info) = value;
}
