/* SPDX-License-Identifier: MIT */
#include "firmware/settings/params.h"

#include <stdbool.h>

/* clang-format off */
#define PARAM(field, low, high, start) {#field, (low), (high), (start), offsetof(struct params, field)}
/* clang-format on */

/*
 * The order is that of the Modbus registers (docs/modbus.md): append new rows, or the addresses controllers use will shift.
 *
 * The initial values are a Teknic M-2310P-LN-04K on the 24 V inverter: qemu/motors/ and qemu/inverters/ have the sources.
 * Those of Modbus are the standard's.
 */
const struct param_info param_table[] = {
    PARAM(pole_pairs, 1, 50, 4),
    PARAM(encoder_counts, 64, 65536, 4000),
    PARAM(resistance_mohm, 1, 100000, 360),
    PARAM(ld_uh, 1, 1000000, 200),
    PARAM(lq_uh, 1, 1000000, 200),
    PARAM(ld_apparent_uh, 0, 1000000, 0),
    PARAM(lq_apparent_uh, 0, 1000000, 0),
    PARAM(lq_rest_uh, 0, 1000000, 0),
    PARAM(cross_pm, -249, 249, 0),
    PARAM(flux_uwb, 10, 10000000, 6395),
    PARAM(inertia_gmm2, 1, 2100000000, 56493),
    PARAM(i_range_ma, 100, 2000000, 23571),
    PARAM(v_range_mv, 1000, 2000000, 57528),
    PARAM(i_max_ma, 10, 2000000, 10650),
    PARAM(i_trip_ma, 10, 2000000, 15000),
    PARAM(i_align_ma, 10, 2000000, 5000),
    PARAM(v_min_mv, 1000, 2000000, 18000),
    PARAM(v_max_mv, 1000, 2000000, 36000),
    PARAM(chopper_on_mv, 0, 2000000, 0),
    PARAM(chopper_off_mv, 0, 2000000, 0),
    PARAM(power_max_w, 1, 2000000, 2000000),
    PARAM(regen_max_w, 0, 2000000, 2000000),
    PARAM(bus_capacitance_uf, 1, 1000000, 1000),
    PARAM(speed_max_rpm, 1, 30000, 4000),
    PARAM(overspeed_rpm, 1, 32000, 4800),
    PARAM(emf_beyond_v_max, 0, 1, 0),
    PARAM(ramp_rpm_s, 1, 1000000, 5000),
    PARAM(stop_max_ms, 100, 3600000, 60000),
    PARAM(current_bw_hz, 10, 6400, 1000),
    PARAM(pwm_update, 0, 2, 0),
    PARAM(pwm_samples, 1, 2, 1),
    PARAM(overmodulation, 0, 100, 0),
    PARAM(low_side_shunts, 0, 1, 1),
    PARAM(modulator_osr, 0, 256, 0),
    PARAM(speed_bw_hz, 1, 200, 60),
    PARAM(torque_mean_ms, 1, PARAM_TORQUE_MEAN_MOST_MS, 1),
    PARAM(position_bw_hz, 0, 100, 0),
    PARAM(profile_speed_pm, 1, 1000, 900),
    PARAM(profile_rpm_s, 0, 1000000, 0),
    PARAM(profile_jerk_ms, 1, PARAM_JERK_MOST_MS, 50),
    PARAM(following_mturn, 1, 10000000, 100),
    PARAM(cyclic_ms, 1, 1000, 10),
    PARAM(home_rpm, -30000, 30000, 30),
    PARAM(home_pct, 1, 100, 20),
    PARAM(home_turns, 1, 10000, 10),
    PARAM(learn_rpm, 1, 100, 10),
    PARAM(i_rated_ma, 10, 2000000, 7100),
    PARAM(t_max_c, 60, 250, 130),
    PARAM(winding_share_pct, 1, 99, 40),
    PARAM(winding_tau_s, 1, 10000, 60),
    PARAM(housing_tau_s, 1, 100000, 1200),
    PARAM(inverter_ma, 0, 2000000, 0),
    PARAM(inverter_tau_ms, 100, 1000000, 1000),
    PARAM(deviation_pct, 1, 100, 20),
    PARAM(command_timeout_ms, 0, 60000, 0),
    PARAM(angle_source, 0, 2, 0),
    PARAM(injection_mv, 0, 2000000, 0),
    PARAM(retry_count, 0, 100, 0),
    PARAM(retry_delay_ms, 10, 60000, 1000),
    PARAM(modbus_address, 0, 247, 1),
    PARAM(modbus_baud, 9600, 921600, 19200),
    PARAM(modbus_parity, 0, 2, 2),
    PARAM(friction_unm, 0, 50000000, 0),
    PARAM(hall_states, 1234, 765432, 513264),
    PARAM(hall_edge_1_cdeg, 0, 35999, 0),
    PARAM(hall_edge_2_cdeg, 0, 35999, 6000),
    PARAM(hall_edge_3_cdeg, 0, 35999, 12000),
    PARAM(hall_edge_4_cdeg, 0, 35999, 18000),
    PARAM(hall_edge_5_cdeg, 0, 35999, 24000),
    PARAM(hall_edge_6_cdeg, 0, 35999, 30000),
    PARAM(injection_silent, 0, 1, 0),
};

const size_t param_count = sizeof param_table / sizeof param_table[0];

static int32_t *field(struct params *p, const struct param_info *info)
{
    return (int32_t *)(void *)((char *)p + info->offset);
}

void params_init(struct params *p)
{
    for (size_t i = 0; i < param_count; i++) {
        *field(p, &param_table[i]) = param_table[i].initial;
    }
}

static bool same(const char *a, const char *b)
{
    while (*a != '\0' && *a == *b) {
        a++;
        b++;
    }
    return *a == *b;
}

const struct param_info *param_find(const char *name)
{
    for (size_t i = 0; i < param_count; i++) {
        if (same(param_table[i].name, name)) {
            return &param_table[i];
        }
    }
    return NULL;
}

int32_t param_get(const struct params *p, const struct param_info *info)
{
    return *(const int32_t *)(const void *)((const char *)p + info->offset);
}

void param_set(struct params *p, const struct param_info *info, int32_t value)
{
    *field(p, info) = value;
}
