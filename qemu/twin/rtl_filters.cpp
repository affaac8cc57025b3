// SPDX-License-Identifier: GPL-2.0-or-later
// The modulators' filters while they rest: clock divider, counts of bits, and nine integrators, as adc_modulators.v and sinc3.v
// have them. Only a promise: rtl_glide.cpp holds it against the RTL in each stretch.
#include "rtl_names.h"

#ifdef INNER_NAMES
namespace
{
constexpr uint32_t INTEGRAL_BITS = 0x1FFFFFF;

struct integrators {
    uint32_t &first, &second, &third;

    void take(uint32_t bit)
    {
        third = (third + second) & INTEGRAL_BITS;
        second = (second + first) & INTEGRAL_BITS;
        first = (first + bit) & INTEGRAL_BITS;
    }
};
} // namespace

#define INTEGRATOR(root, k, name) FILTER(root, k, integrators__DOT__##name)
#define CLOCK_PHASE(k) \
    if (strobe) { \
        integrators{INTEGRATOR(root, k, first), INTEGRATOR(root, k, second), INTEGRATOR(root, k, integral)}.take( \
            FILTER(root, k, sync) >> 1); \
        FILTER(root, k, integral) = INTEGRATOR(root, k, integral); \
    } \
    FILTER(root, k, sync) = (CData)((FILTER(root, k, sync) << 1 & 2) | (root->pin_mod_data >> k & 1));

void rtl_filters_clock(root_type *root)
{
    const bool strobe = FILTERS(root, strobe);
    const uint32_t count = FILTERS(root, count), last = FILTERS(root, last);
    CLOCK_PHASE(0)
    CLOCK_PHASE(1)
    CLOCK_PHASE(2)
    if (strobe) {
        FILTERS(root, trip_bits)--;
        FILTERS(root, bits) = (CData)(FILTERS(root, bits) - (FILTERS(root, bits) != 0));
    }
    FILTERS(root, strobe) = FILTERS(root, pin_clock) && count == 0;
    if (count >= last) {
        FILTERS(root, pin_clock) = 1;
    } else if (count == last >> 1) {
        FILTERS(root, pin_clock) = 0;
    }
    root->pin_mod_clock = FILTERS(root, pin_clock);
    FILTERS(root, count) = (CData)(count >= last ? 0 : count + 1);
}
#endif
