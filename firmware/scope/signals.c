/* SPDX-License-Identifier: MIT */
#include "firmware/scope/signals.h"

#include "firmware/settings/config.h"

_Static_assert(sizeof(struct axis) < 65536u && sizeof(struct fabric) < 65536u, "offsets have 16 bits");

/* clang-format off */
#define OF_AXIS(name, member, format) { name, format, (uint16_t)offsetof(struct axis, member), 0u, false, false }
#define DIRECTED(name, member, format) { name, format, (uint16_t)offsetof(struct axis, member), 0u, false, true }
#define OF_TWO(name, member, other, format) \
    { name, format, (uint16_t)offsetof(struct axis, member), (uint16_t)offsetof(struct axis, other), false, false }
#define OF_FABRIC(name, member, format) { name, format, (uint16_t)offsetof(struct fabric, member), 0u, true, false }

const struct signal_info signal_table[] = {
    /* updated each sample of the current loop */
    OF_FABRIC("i_a", adc.IA, SIGNAL_CURRENT),
    OF_FABRIC("i_b", adc.IB, SIGNAL_CURRENT),
    OF_FABRIC("i_c", adc.IC, SIGNAL_CURRENT),
    OF_FABRIC("vbus", adc.VBUS, SIGNAL_VOLTAGE),
    OF_FABRIC("count", encoder.LATCHED, SIGNAL_COUNTS),
    OF_FABRIC("gate", gate.STATUS, SIGNAL_NUMBER),
    OF_FABRIC("sequence", adc.SEQUENCE, SIGNAL_NUMBER),
    OF_AXIS("i_d", loop.i_d_q15, SIGNAL_CURRENT),
    DIRECTED("i_q", loop.i_q_q15, SIGNAL_CURRENT),
    OF_AXIS("i_d_ref", loop.i_d_ref_q15, SIGNAL_CURRENT),
    DIRECTED("i_q_ref", loop.i_q_ref_q15, SIGNAL_CURRENT),
    OF_AXIS("v_d", loop.v_d_steps, SIGNAL_STEPS),
    DIRECTED("v_q", loop.v_q_steps, SIGNAL_STEPS),
    OF_TWO("angle", loop.pll.angle_q32, loop.angle_offset_q32, SIGNAL_ANGLE),
    OF_AXIS("turning", loop.pll.speed_q32, SIGNAL_FREQUENCY),
    OF_AXIS("field", loop.field_angle_q32, SIGNAL_ANGLE),
    OF_AXIS("flux_a", loop.flux.flux_alpha, SIGNAL_NUMBER),
    OF_AXIS("flux_b", loop.flux.flux_beta, SIGNAL_NUMBER),
    /* updated each millisecond */
    DIRECTED("speed", speed.speed_rpm_q4, SIGNAL_RPM_Q4),
    DIRECTED("speed_ref", speed.speed_ref_rpm_q4, SIGNAL_RPM_Q4),
    DIRECTED("target", speed.target_rpm_q16, SIGNAL_RPM_Q16),
    DIRECTED("position", motion.turns.counts, SIGNAL_COUNTS),
    DIRECTED("error", motion.position.error_counts, SIGNAL_COUNTS),
    OF_AXIS("winding", thermal.winding_q4, SIGNAL_KELVIN_Q4),
    OF_AXIS("state", state, SIGNAL_NUMBER),
    OF_AXIS("fault", faults.cause, SIGNAL_NUMBER),
    OF_AXIS("time", time_ms, SIGNAL_NUMBER),
};
/* clang-format on */

const size_t signal_count = sizeof signal_table / sizeof signal_table[0];

static const struct signal_info word_info = {"word", SIGNAL_WORD, 0u, 0u, false, false};

const struct signal_info *signal_of(uint32_t which)
{
    return which < signal_count ? &signal_table[which] : &word_info;
}

#define RAM 0x20000000u

/* "2000a1bc", or "a1bc" of the same word, so that eight fit on a line; signal_count if it is something else. */
static uint32_t address_of(const char *digits, size_t length)
{
    uint32_t address = 0;
    for (size_t i = 0; i < length; i++) {
        const char c = digits[i];
        if ((c < '0' || c > '9') && (c < 'a' || c > 'f')) {
            return (uint32_t)signal_count;
        }
        address = address << 4 | (uint32_t)(c <= '9' ? c - '0' : c - 'a' + 10);
    }
    return length >= 1u && length <= 8u ? RAM | address : (uint32_t)signal_count;
}

uint32_t signal_find(const char *name, size_t length)
{
    if (length > 0u && name[0] == '@') {
        return address_of(name + 1, length - 1u);
    }
    for (uint32_t i = 0; i < signal_count; i++) {
        const char *const known = signal_table[i].name;
        size_t same = 0;
        while (same < length && known[same] != '\0' && known[same] == name[same]) {
            same++;
        }
        if (same == length && known[same] == '\0') {
            return i;
        }
    }
    return (uint32_t)signal_count;
}

struct signal_source signal_source(uint32_t which, const struct axis *a, const int32_t *zero)
{
    if (which >= signal_count) {
        return (struct signal_source){.word = (signal_word *)(uintptr_t)which, .added = zero};
    }
    const struct signal_info *const info = &signal_table[which];
    const char *const base = info->of_fabric ? (const char *)a->fabric : (const char *)a;
    return (struct signal_source){
        .word = (const volatile int32_t *)(const volatile void *)(base + info->offset),
        .added = info->added == 0u ? zero : (const volatile int32_t *)(const volatile void *)(base + info->added),
    };
}

/* A value in thousandths is raw * milli / per, times a word of the axis if its offset is not 0. */
static const struct {
    const char *unit;
    int32_t milli;
    uint32_t per;
    uint16_t times;
} signal_formats[] = {
    [SIGNAL_CURRENT] = {"A", 1, 32768u, offsetof(struct axis, params.i_range_ma)},
    [SIGNAL_VOLTAGE] = {"V", 1, 32768u, offsetof(struct axis, params.v_range_mv)},
    [SIGNAL_STEPS] = {"%_of_bus", 100000, CONFIG_BUS_STEPS, 0u},
    [SIGNAL_ANGLE] = {"deg", 360000 / 8, 1u << 29, 0u},
    [SIGNAL_FREQUENCY] = {"Hz", 15625, 1u << 26, offsetof(struct axis, loop.loops_per_slow)},
    [SIGNAL_RPM_Q4] = {"rpm", 1000, 16u, 0u},
    [SIGNAL_RPM_Q16] = {"rpm", 1000, 65536u, 0u},
    [SIGNAL_COUNTS] = {"counts", 1000, 1u, 0u},
    [SIGNAL_NUMBER] = {"none", 1000, 1u, 0u},
    [SIGNAL_KELVIN_Q4] = {"degC", 1000, 16u, 0u},
    [SIGNAL_WORD] = {"none", 1, 1u, 0u},
};

struct signal_scale signal_scale(const struct signal_info *info, const struct axis *a)
{
    const uint32_t times = signal_formats[info->format].times;
    const int32_t *const word = (const int32_t *)(const void *)((const char *)a + times);
    const int32_t milli = signal_formats[info->format].milli * (times == 0u ? 1 : *word);
    return (struct signal_scale){info->directed ? axis_forward(a) * milli : milli, signal_formats[info->format].per};
}

const char *signal_unit(enum signal_format format)
{
    return signal_formats[format].unit;
}

/* Not inline: the compiler would use an unsigned 64-bit division, which nothing else in the image needs. */
static __attribute__((noinline)) int32_t quotient(int64_t value, int64_t by)
{
    const int64_t nearest = (value < 0 ? value - by / 2 : value + by / 2) / by;
    return nearest > INT32_MAX ? INT32_MAX : nearest < INT32_MIN ? INT32_MIN : (int32_t)nearest;
}

int32_t signal_milli(struct signal_scale scale, int32_t raw)
{
    return quotient((int64_t)raw * scale.milli, scale.per);
}

int32_t signal_raw(struct signal_scale scale, int32_t milli)
{
    const int64_t sign = scale.milli < 0 ? -1 : 1;
    return quotient(sign * milli * (int64_t)scale.per, sign * scale.milli);
}

struct signal_choice signal_default(void)
{
    static const char *const names[SIGNALS_MAX] = {"i_d",   "i_q",       "i_q_ref", "vbus",
                                                   "speed", "speed_ref", "v_q",     "angle"};
    struct signal_choice choice = {.count = SIGNALS_MAX};
    for (size_t i = 0; i < SIGNALS_MAX; i++) {
        choice.which[i] = signal_find(names[i], text_length(names[i]));
    }
    return choice;
}
