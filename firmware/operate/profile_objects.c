/* SPDX-License-Identifier: MIT */
#include "firmware/operate/profile_objects.h"

#include "firmware/operate/objects.h"
#include "lib/q15.h"

#define QUICK_STOP_FACTOR 4

enum { RO, RW };

/* clang-format off */
#define PROFILE_ROW(index, subindex, type, access, name, initial, how, fixed) \
    {index, subindex, OBJECT_TYPE_##type, PROFILE_##how, access == RW, fixed},
const struct profile_object profile_objects[] = {
    PROFILE_OBJECTS(PROFILE_ROW)
};
/* clang-format on */

const uint32_t profile_object_count = sizeof profile_objects / sizeof profile_objects[0];

/* Milliseconds. */
static int32_t power_of(int32_t exponent)
{
    static const int16_t powers[] = {1, 10, 100, 1000};
    return powers[q15_clamp(exponent + 3, 0, 3)];
}

/* The object is the parameter, `by` / `of` times. */
struct ratio {
    const char *name; /* NULL: no parameter is behind it */
    int32_t param, by, of;
};

static struct ratio ratio_of(const struct profile_object *o, const struct params *p, int32_t exponent)
{
    switch ((enum profile_how)o->how) {
    case PROFILE_RAMP:
        return (struct ratio){"ramp_rpm_s", p->ramp_rpm_s, 1, 1};
    case PROFILE_SPEED:
        return (struct ratio){"profile_speed_pm", p->profile_speed_pm, p->speed_max_rpm, 1000};
    case PROFILE_HOME:
        return (struct ratio){"home_rpm", q15_abs(p->home_rpm), 1, 1};
    case PROFILE_FOLLOWING:
        return (struct ratio){"following_mturn", p->following_mturn, p->encoder_counts, 1000};
    case PROFILE_TORQUE:
        return (struct ratio){"i_max_ma", p->i_max_ma, 1000, p->i_rated_ma};
    case PROFILE_CYCLE:
        return (struct ratio){"cyclic_ms", p->cyclic_ms, 1, power_of(exponent)};
    case PROFILE_QUICK:
        return (struct ratio){NULL, p->ramp_rpm_s, QUICK_STOP_FACTOR, 1};
    case PROFILE_EXPONENT:
        return (struct ratio){NULL, exponent, 1, 1};
    default:
        return (struct ratio){NULL, o->fixed, 1, 1};
    }
}

int32_t profile_value(const struct profile_object *o, const struct params *p, int32_t exponent)
{
    const struct ratio r = ratio_of(o, p, exponent);
    const int64_t found = (int64_t)r.param * r.by / r.of;
    const int32_t most = o->type == OBJECT_TYPE_U8 ? UINT8_MAX : o->type == OBJECT_TYPE_U16 ? UINT16_MAX : INT32_MAX;
    return found > most ? most : (int32_t)found;
}

/* What does not fit 32 bits fits no parameter. */
const char *profile_param(const struct profile_object *o, const struct params *p, int32_t exponent, int32_t value,
                          int32_t *wanted)
{
    const struct ratio r = ratio_of(o, p, exponent);
    if (o->how == PROFILE_EXPONENT) {
        *wanted = p->cyclic_ms / power_of(exponent) * power_of(value);
        return "cyclic_ms";
    }
    const int64_t found = ((int64_t)value * r.of + r.by / 2) / r.by;
    *wanted = found > INT32_MAX ? INT32_MAX : (int32_t)found;
    *wanted = o->how == PROFILE_HOME && p->home_rpm < 0 ? -*wanted : *wanted;
    return r.name;
}
