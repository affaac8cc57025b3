/* SPDX-License-Identifier: MIT */
#include "firmware/settings/params.h"

#include <stdbool.h>

#include "firmware/settings/features.h"

#define PARAM_ROW(field, min, max, initial, text) {#field, (min), (max), (initial), offsetof(struct params, field)},

const struct param_info param_table[] = {PARAMS(PARAM_ROW)};

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

const struct param_info *param_find(const char *name)
{
    for (size_t i = 0; i < param_count; i++) {
        if (text_equal(param_table[i].name, name)) {
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

bool text_equal(const char *a, const char *b)
{
    while (*a != '\0' && *a == *b) {
        a++;
        b++;
    }
    return *a == *b;
}

size_t text_length(const char *s)
{
    size_t length = 0;
    while (s[length] != '\0') {
        length++;
    }
    return length;
}

/* ==== what a build allows ==== */

#define FROM_TO(first, last) offsetof(struct params, first), offsetof(struct params, last)

/* Parameters that only one feature reads. */
static const struct {
    uint16_t first, last; /* offset */
    uint8_t feature;
} param_features[] = {
    {FROM_TO(hall_states, hall_edge_6_cdeg), FEATURE_HALL},
    {FROM_TO(injection_mv, injection_mv), FEATURE_INJECTION},
    {FROM_TO(injection_silent, injection_silent), FEATURE_INJECTION},
    {FROM_TO(overmodulation, overmodulation), FEATURE_WEAKENING},
    {FROM_TO(position_bw_hz, following_mturn), FEATURE_POSITION},
    {FROM_TO(home_rpm, home_turns), FEATURE_POSITION},
    {FROM_TO(learn_rpm, learn_rpm), FEATURE_LEARN},
    {FROM_TO(modbus_address, modbus_parity), FEATURE_MODBUS},
    {FROM_TO(can_node, can_heartbeat_ms), FEATURE_CAN},
};

static struct outcome unless_absent(enum feature f)
{
    return FEATURE_IS_IN(f) ? OUTCOME_OK : feature_absent(f);
}

#define SOURCE_FEATURE(name, feature, start, properties) FEATURE_##feature,

struct outcome features_allow_source(int32_t source)
{
    static const uint8_t of_source[] = {SOURCES(SOURCE_FEATURE)};
    return unless_absent((enum feature)of_source[source]);
}

struct outcome features_allow(const struct param_info *info, int32_t value)
{
    if (info->offset == offsetof(struct params, angle_source)) {
        return features_allow_source(value);
    }
    for (size_t n = 0; n < sizeof param_features / sizeof param_features[0]; n++) {
        const bool its = info->offset >= param_features[n].first && info->offset <= param_features[n].last;
        if (its && value != info->initial) {
            return unless_absent((enum feature)param_features[n].feature);
        }
    }
    return OUTCOME_OK;
}
