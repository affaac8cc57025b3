// SPDX-License-Identifier: MIT
#include "traffic.h"

namespace
{
enum { PWM = 0x000, ADC = 0x100, ENC = 0x200, GATE = 0x300 };
enum { SET_UP = 18 };
enum { RUN = 1, TRIGGER_BITS = 0x30000, AT_VALLEY = 0x10000, NO_MODULATORS = 0x7 };

uint32_t any_trigger(random_source &r, const manner &m)
{
    return r.below(m.period + 2) | (r.word() & TRIGGER_BITS);
}

uint32_t any_compare(random_source &r, const manner &m)
{
    return r.one_in(20) ? r.word() & 0xFFFF : r.below(m.period + m.period / 4 + 3);
}

bus_access pwm_access(random_source &r, const manner &m)
{
    switch (r.below(12)) {
    case 0:
        return {true, PWM + 0x00, r.one_in(5) ? r.word() : (uint32_t)RUN};
    case 1:
        return {true, PWM + 0x08 + 4 * r.below(5), r.below(m.period)};
    case 2:
        return {true, PWM + 0x1C + 4 * r.below(2), any_trigger(r, m)};
    default:
        return {true, PWM + 0x28 + 4 * r.below(3), any_compare(r, m)};
    }
}

bus_access adc_access(random_source &r, const manner &)
{
    switch (r.below(10)) {
    case 0:
        return {true, ADC + 0x00, (r.one_in(8) ? r.word() : r.word() | 1) & NO_MODULATORS};
    case 1:
    case 2:
    case 3:
    case 4:
        return {true, ADC + 0x04, r.one_in(3) ? r.word() : 1};
    case 5:
        return {true, ADC + 0x1C + 4 * r.below(3), r.one_in(3) ? r.word() : 32768 + r.below(2000) - 1000};
    case 6:
        return {true, ADC + 0x28 + 4 * r.below(4), r.one_in(3) ? r.word() : r.below(32768)};
    case 7:
        return {true, ADC + 0x40 + 4 * r.below(3), r.word()};
    case 8:
        return {true, ADC + 0x4C, r.one_in(3) ? r.word() : r.below(60)};
    default:
        return {true, ADC + 0x50 + 4 * r.below(2), r.word()};
    }
}

bus_access encoder_access(random_source &r, const manner &)
{
    static const uint32_t common[] = {4, 40, 4096, 65536};
    switch (r.below(6)) {
    case 0:
        return {true, ENC + 0x00, r.one_in(4) ? r.word() : r.word() | 1};
    case 1:
        return {true, ENC + 0x04, r.one_in(3) ? r.word() & 0x1FFFF : common[r.below(4)]};
    case 2:
        return {true, ENC + 0x20, r.one_in(8) ? r.word() : r.below(6) | r.below(3) << 8};
    default:
        return {true, ENC + 0x14, r.word()};
    }
}

bus_access gate_access(random_source &r, const manner &)
{
    switch (r.below(9)) {
    case 0:
        return {true, GATE + 0x0C, r.word()};
    case 1:
        return {true, GATE + 0x10 + 4 * r.below(2), r.below(32768)};
    case 2:
        return {true, GATE + 0x00, r.word()};
    case 3:
    case 4:
        return {true, GATE + 0x04, r.one_in(2) ? r.word() : 0xFFFFFFFF};
    case 5:
        return {true, GATE + (r.one_in(8) ? 0x1Cu : 0x24u),
                r.one_in(4)  ? r.word()
                : r.below(2) ? 0x5A17C300u
                             : 0xA5E83C00u};
    default:
        return {true, GATE + 0x00, 1};
    }
}
} // namespace

manner any_manner(random_source &r)
{
    uint32_t period = r.one_in(4) ? 2 + r.below(30) : r.one_in(6) ? 5000 : 30 + r.below(400);
    return {period,
            r.below(period / 3 + 2),
            r.below(period / 4 + 2),
            1 + r.below(r.one_in(3) ? 3 : 40),
            period >= 30 && r.one_in(2) ? 200 + r.below(6000) : 0,
            r.one_in(12)};
}

bool first_access(random_source &r, const manner &m, unsigned n, bus_access *a)
{
    const bus_access all[] = {{true, PWM + 0x08, m.period},
                              {true, PWM + 0x0C, m.dead},
                              {true, PWM + 0x10, m.pulse},
                              {true, PWM + 0x14, r.word() & 3},
                              {true, PWM + 0x18, m.period},
                              {true, PWM + 0x1C, m.dozes ? m.period | AT_VALLEY : any_trigger(r, m)},
                              {true, PWM + 0x28, m.period / 2},
                              {true, PWM + 0x2C, m.period / 3},
                              {true, PWM + 0x30, m.period / 4},
                              {true, ENC + 0x04, r.one_in(2) ? 40u : 4096u},
                              {true, ENC + 0x00, 1},
                              {true, ADC + 0x00, 3},
                              {true, GATE + 0x0C, 1},
                              {true, GATE + 0x10, m.dozes ? 0u : 20000u},
                              {true, GATE + 0x14, m.dozes ? 0u : 15000u},
                              {true, m.watch ? GATE + 0x1Cu : GATE + 0x0Cu, m.watch ? m.watch : 1},
                              {true, GATE + 0x00, 1},
                              {true, PWM + 0x00, RUN}};
    constexpr unsigned COUNT = sizeof all / sizeof all[0];
    static_assert(COUNT == SET_UP, "the rests below count on it");
    *a = n < COUNT ? all[n] : bus_access{true, ADC + 0x00, 0};
    return n < COUNT + m.dozes;
}

uint32_t rest_after(random_source &r, const manner &m, unsigned n)
{
    if (n < SET_UP) {
        return 0;
    }
    return m.dozes && n <= SET_UP + 1 ? (n == SET_UP ? 3 * m.period : 70000) : r.below(m.gap);
}

bus_access any_access(random_source &r, const manner &m, uint32_t proof)
{
    if (m.watch && r.one_in(8)) { /* as a program that lives */
        return r.one_in(3) ? bus_access{true, GATE + 0x24, proof} : bus_access{true, PWM + 0x30, any_compare(r, m)};
    }
    if (r.one_in(30)) { /* anywhere, of any alignment */
        return {r.one_in(2), r.below(0x400), r.word() & ~8u};
    }
    if (r.one_in(2)) {
        return {false, (uint32_t)(0x100 * r.below(4) + 4 * r.below(r.one_in(9) ? 64 : 22)), 0};
    }
    switch (r.below(4)) {
    case 0:
        return adc_access(r, m);
    case 1:
        return encoder_access(r, m);
    case 2:
        return gate_access(r, m);
    default:
        return pwm_access(r, m);
    }
}
