/* SPDX-License-Identifier: MIT */
#include "firmware/settings/params.h"

#include <stdbool.h>

#include "firmware/settings/slots.h"

#define PARAM_ROW(field, least, most, initial, what) \
    {#field, (least), (most), (initial), offsetof(struct params, field)},

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
        if (record_name_is(param_table[i].name, name)) {
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
