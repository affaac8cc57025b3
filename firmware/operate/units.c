/* SPDX-License-Identifier: MIT */
#include "firmware/operate/units.h"

#include "firmware/operate/text.h"

/* Name endings; a longer ending comes before any that it ends with. */
static const struct {
    const char *end, *unit;
} units[] = {
    {"_rpm_s", "rpm/s"},   {"_rpm", "rpm"},     {"_ms", "ms"},
    {"_s", "s"},           {"_ma", "mA"},       {"_mv", "mV"},
    {"_mohm", "mohm"},     {"_uh", "uH"},       {"_uwb", "uWb"},
    {"_uf", "uF"},         {"_hz", "Hz"},       {"_w", "W"},
    {"_gmm2", "g mm2"},    {"_pct", "%"},       {"_pm", "0.1 %"},
    {"_c", "degC"},        {"_turns", "turns"}, {"_mturn", "0.001 turns"},
    {"_counts", "counts"}, {"_baud", "baud"},   {"_unm", "uNm"},
    {"_cdeg", "0.01 deg"},
};

static size_t length_of(const char *s)
{
    size_t length = 0;
    while (s[length] != '\0') {
        length++;
    }
    return length;
}

const char *unit_of(const struct param_info *info)
{
    const size_t length = length_of(info->name);
    for (size_t i = 0; i < sizeof units / sizeof units[0]; i++) {
        const size_t end = length_of(units[i].end);
        if (end < length && text_equal(info->name + length - end, units[i].end)) {
            return units[i].unit;
        }
    }
    return "";
}
