/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Slot 1's limits and slot 3's mirror of them, against docs/fabric.md. Currents are set by codes and offsets, so that every
 * Q15 value can be had. */
#include <stdlib.h>

#include "bench.h"
#include "check.h"

enum { STATUS = 0x04, OFFSET_A = 0x1C, I_TRIP = 0x28, SUM_TRIP = 0x2C, V_MIN = 0x30, V_MAX = 0x34 };
enum { EOC = 0x01, OVERRUN = 0x02, CURRENT = 0x10, SUM = 0x20, VBUS_HIGH = 0x40, VBUS_LOW = 0x80 };

#define NEVER 0x1FFFFu /* beyond it is nothing */

static const uint32_t limit_offsets[4] = {I_TRIP, SUM_TRIP, V_MIN, V_MAX};

static void set_limits(struct adc *a, uint32_t i_trip, uint32_t sum_trip, uint32_t v_min, uint32_t v_max)
{
    adc_write(a, I_TRIP, i_trip);
    adc_write(a, SUM_TRIP, sum_trip);
    adc_write(a, V_MIN, v_min);
    adc_write(a, V_MAX, v_max);
}

static struct adc with_limits(uint32_t i_trip, uint32_t sum_trip, uint32_t v_min, uint32_t v_max)
{
    struct adc a;
    adc_reset(&a);
    set_limits(&a, i_trip, sum_trip, v_min, v_max);
    return a;
}

/* One conversion with these results; returns STATUS, EOC taken. */
static uint32_t convert(struct adc *a, int32_t ia, int32_t ib, int32_t ic, uint32_t vbus)
{
    const int32_t i_q15[3] = {ia, ib, ic};
    uint32_t code[4] = {0, 0, 0, vbus / 8};
    for (uint32_t k = 0; k < 3; k++) {
        code[k] = i_q15[k] > 0 ? 4095 : 0;
        adc_write(a, OFFSET_A + 4 * k, 16 * code[k] - (uint32_t)i_q15[k]);
    }
    adc_start(a, code, 0, 0);
    adc_finish(a);
    uint32_t status = adc_read(a, STATUS);
    adc_write(a, STATUS, EOC);
    return status;
}

static uint32_t convert_sum(struct adc *a, int32_t sum)
{
    return convert(a, sum / 3, sum / 3, sum - sum / 3 * 2, 8000);
}

/* ---- registers ---- */

static void registers(void)
{
    static const uint32_t reset[4] = {NEVER, NEVER, 0, NEVER};
    struct adc a;
    adc_reset(&a);
    for (uint32_t k = 0; k < 4; k++) {
        check_hex("I_TRIP SUM_TRIP V_MIN V_MAX after reset", adc_read(&a, limit_offsets[k]), reset[k]);
    }
    for (uint32_t k = 0; k < 4; k++) {
        adc_write(&a, limit_offsets[k], 0xFFFE0000 + 0x10101 * (k + 1));
    }
    adc_write(&a, 0x38, 0x12345);
    for (uint32_t k = 0; k < 4; k++) {
        check_hex("each is a register of 17 bits", adc_read(&a, limit_offsets[k]), 0x10101 * (k + 1) & 0x1FFFF);
    }
    check_equal("which leave OFFSET_C", adc_read(&a, 0x24), 32768);
    check_equal("and the block ends behind them", adc_read(&a, 0x38), 0);
    adc_reset(&a);
    for (uint32_t k = 0; k < 4; k++) {
        check_hex("reset brings them back", adc_read(&a, limit_offsets[k]), reset[k]);
    }
}

static void nothing_is_beyond_after_reset(void)
{
    struct adc a;
    adc_reset(&a);
    check_hex("after reset: no flag", adc_read(&a, STATUS), 0);
    for (int n = 0; n < 3; n++) {
        check_hex("highest currents and voltage", convert(&a, 32767, 32767, 32767, 32760), EOC);
        check_hex("lowest", convert(&a, -32767, -32767, -32767, 0), EOC);
    }
}

/* ---- each limit at its boundary ---- */

static void current(void)
{
    static const int32_t values[6] = {1, 15000, 32767, -1, -15000, -32767};
    for (int n = 0; n < 6; n++) {
        uint32_t size = (uint32_t)abs(values[n]);
        for (int phase = 0; phase < 3; phase++) {
            int32_t i[3] = {0};
            i[phase] = values[n];
            struct adc a = with_limits(size, NEVER, 0, NEVER);
            check_hex("a current at I_TRIP is not beyond it", convert(&a, i[0], i[1], i[2], 8000), EOC);
            set_limits(&a, size - 1, NEVER, 0, NEVER);
            check_hex("one more is", convert(&a, i[0], i[1], i[2], 8000), EOC | CURRENT);
            check_hex("no longer than it lasts", convert(&a, 0, 0, 0, 8000), EOC);
        }
    }
    struct adc a = with_limits(0, NEVER, 0, NEVER);
    check_hex("no current is not beyond 0", convert(&a, 0, 0, 0, 8000), EOC);
    set_limits(&a, 0x10000, NEVER, 0, NEVER);
    check_hex("the highest bits count", convert(&a, 32767, -32767, 32767, 8000), EOC);
}

static void sum(void)
{
    static const int32_t values[6] = {1, 8000, 98301, -1, -8000, -98301};
    for (int n = 0; n < 6; n++) {
        uint32_t size = (uint32_t)abs(values[n]);
        struct adc a = with_limits(NEVER, size, 0, NEVER);
        convert_sum(&a, values[n]);
        check_hex("a sum at SUM_TRIP is not beyond it", convert_sum(&a, values[n]), EOC);
        set_limits(&a, NEVER, size - 1, 0, NEVER);
        check_hex("beyond it once", convert_sum(&a, values[n]), EOC);
        check_hex("twice in a row", convert_sum(&a, values[n]), EOC | SUM);
        check_hex("three times", convert_sum(&a, values[n]), EOC | SUM);
        check_hex("no longer", convert_sum(&a, 0), EOC);
        check_hex("every other", convert_sum(&a, values[n]), EOC);
        check_hex("conversion", convert_sum(&a, 0), EOC);
        check_hex("is never twice in a row", convert_sum(&a, values[n]), EOC);
        check_hex("in either direction", convert_sum(&a, -values[n]), EOC | SUM);
    }
    struct adc a = with_limits(NEVER, 0, 0, NEVER);
    convert(&a, 30000, -10000, -20000, 8000);
    check_hex("large currents may add up to nothing", convert(&a, -32767, 32767, 0, 8000), EOC);
    for (int phase = 0; phase < 3; phase++) {
        int32_t i[3] = {0};
        i[phase] = 101;
        set_limits(&a, NEVER, 100, 0, NEVER);
        convert(&a, 0, 0, 0, 8000);
        convert(&a, i[0], i[1], i[2], 8000);
        check_hex("each phase is part of it", convert(&a, i[0], i[1], i[2], 8000), EOC | SUM);
    }
}

/* Each conversion is compared with the limits that held at its own end. */
static void limits_take_effect(void)
{
    struct adc a = with_limits(NEVER, NEVER, 0, NEVER);
    convert(&a, 5000, 5000, 5000, 8000);
    set_limits(&a, 100, 100, 9000, 100);
    check_hex("new limits leave the flags of older results", adc_read(&a, STATUS), 0);
    check_hex("the next has them; a sum that was within its limit is the first beyond",
              convert(&a, 5000, 5000, 5000, 8000), EOC | CURRENT | VBUS_HIGH | VBUS_LOW);
    check_hex("all four at once", convert(&a, 5000, 5000, 5000, 8000), EOC | CURRENT | SUM | VBUS_HIGH | VBUS_LOW);
    set_limits(&a, NEVER, NEVER, 0, NEVER);
    check_hex("limits taken away leave them, too", adc_read(&a, STATUS), CURRENT | SUM | VBUS_HIGH | VBUS_LOW);
    check_hex("until the next", convert(&a, 5000, 5000, 5000, 8000), EOC);
    set_limits(&a, NEVER, 100, 0, NEVER);
    check_hex("and a sum begins anew", convert(&a, 5000, 5000, 5000, 8000), EOC);
    adc_reset(&a);
    set_limits(&a, NEVER, 100, 0, NEVER);
    check_hex("after a reset as well", convert(&a, 5000, 5000, 5000, 8000), EOC);
}

static void bus_voltage(void)
{
    static const uint32_t values[4] = {0, 8, 16000, 32760};
    for (int n = 0; n < 4; n++) {
        struct adc a = with_limits(NEVER, NEVER, values[n], values[n]);
        check_hex("a voltage at V_MIN and V_MAX is within", convert(&a, 0, 0, 0, values[n]), EOC);
        set_limits(&a, NEVER, NEVER, values[n] + 1, NEVER);
        check_hex("below V_MIN", convert(&a, 0, 0, 0, values[n]), EOC | VBUS_LOW);
        if (values[n] > 0) {
            set_limits(&a, NEVER, NEVER, 0, values[n] - 1);
            check_hex("above V_MAX", convert(&a, 0, 0, 0, values[n]), EOC | VBUS_HIGH);
        }
    }
}

/* ---- all together ---- */

static uint32_t any_limit(uint32_t value)
{
    switch (any_between(0, 4)) {
    case 0:
        return value;
    case 1:
        return value + 1;
    case 2:
        return value > 0 ? value - 1 : 0;
    case 3:
        return (uint32_t)any_between(0, 0x1FFFF);
    default:
        return 0;
    }
}

static uint32_t size_of(int32_t value)
{
    return (uint32_t)abs(value);
}

/* Any results, with limits at and beside them, against the rules written down once more. */
static void any_results(void)
{
    int wrong = 0, seen[4] = {0}, sums_once = 0;
    bool was_off = false;
    struct adc a;
    adc_reset(&a);
    for (int n = 0; n < 100000; n++) {
        int32_t i[3] = {any_between(-32767, 32767), any_between(-32767, 32767), any_between(-32767, 32767)};
        uint32_t vbus = 8u * (uint32_t)any_between(0, 4095), total = size_of(i[0] + i[1] + i[2]);
        uint32_t i_trip = any_limit(size_of(i[any_between(0, 2)])), sum_trip = any_limit(total);
        uint32_t v_min = any_limit(vbus), v_max = any_limit(vbus);
        bool high = size_of(i[0]) > i_trip || size_of(i[1]) > i_trip || size_of(i[2]) > i_trip;
        bool off = total > sum_trip;
        uint32_t expected = EOC | (high ? CURRENT : 0u) | (off && was_off ? SUM : 0u) |
                            (vbus > v_max ? VBUS_HIGH : 0u) | (vbus < v_min ? VBUS_LOW : 0u);
        set_limits(&a, i_trip, sum_trip, v_min, v_max);
        wrong += convert(&a, i[0], i[1], i[2], vbus) != expected;
        sums_once += off && !was_off;
        was_off = off;
        for (int k = 0; k < 4; k++) {
            seen[k] += expected >> (4 + k) & 1;
        }
    }
    check_equal("any results and limits: wrong flags", wrong, 0);
    check_between("sums that were off once", sums_once, 10000, 90000);
    for (int k = 0; k < 4; k++) {
        check_between("each flag was set and was not", seen[k], 10000, 90000);
    }
}

/* ---- what flags do to the rest ---- */

static void flags_are_read_only(void)
{
    struct adc a = with_limits(100, 100, 9000, 100);
    adc_write(&a, 0x00, 2);
    convert(&a, 5000, 5000, 5000, 8000);
    convert(&a, 5000, 5000, 5000, 8000);
    check_hex("flags alone", adc_read(&a, STATUS), CURRENT | SUM | VBUS_HIGH | VBUS_LOW);
    check_true("are no interrupt", !adc_interrupt(&a));
    adc_write(&a, STATUS, 0xFFFFFFFF);
    check_hex("and not cleared by writing", adc_read(&a, STATUS), CURRENT | SUM | VBUS_HIGH | VBUS_LOW);
    check_true("nor an overrun", !adc_overran(&a));
    adc_start(&a, (uint32_t[4]){2048, 2048, 2048, 0}, 0, 0);
    adc_finish(&a);
    adc_start(&a, (uint32_t[4]){2048, 2048, 2048, 0}, 0, 0);
    adc_finish(&a);
    check_hex("EOC and OVERRUN stand beside them", adc_read(&a, STATUS) & (EOC | OVERRUN | VBUS_LOW), 0x83);
    adc_write(&a, STATUS, OVERRUN);
    check_hex("and are cleared alone", adc_read(&a, STATUS) & (EOC | OVERRUN | VBUS_LOW), 0x81);
}

/* A plant whose every conversion has the one flag: 10 A on each sensor, 24 V. */
static void flag_in_the_plant(enum bench_register limit, uint32_t value, uint32_t flag)
{
    struct plant_params params = bench_plant();
    struct plant p;
    bench_before_trigger(&p, &params);
    for (int k = 0; k < 3; k++) {
        p.sensors.current[k].add_a = 10;
    }
    bench_write(&p, ADC_CONTROL, 1);
    bench_write(&p, limit, value);
    bench_run(&p, 3e-6);
    bench_write(&p, ADC_STATUS, EOC);
    bench_run(&p, 49.6e-6); /* the second conversion, for a sum, has ended 0.1 us ago */
    check_hex("a flag in ADC.STATUS", bench_read(&p, ADC_STATUS), EOC | flag);
    check_hex("is LIMIT in GATE.STATUS; no latch, LIVE stays", bench_read(&p, GATE_STATUS), 0x81);
    bench_write(&p, ADC_STATUS, 0xFF);
    bench_write(&p, GATE_STATUS, 0xFF);
    check_hex("it is not cleared by writing", bench_read(&p, GATE_STATUS), 0x81);
    bench_write(&p, GATE_CONTROL, 0);
    check_hex("it shows while off", bench_read(&p, GATE_STATUS), 0x80);
    bench_write(&p, GATE_CONTROL, 1);
    check_hex("and does not hold back ENABLE", bench_read(&p, GATE_STATUS), 0x81);
    bench_write(&p, limit, limit == ADC_V_MIN ? 0 : NEVER);
    check_hex("it stays until the next conversion ends", bench_read(&p, GATE_STATUS), 0x81);
    bench_run(&p, 49.8e-6); /* 0.1 us before that */
    check_hex("not a moment less", bench_read(&p, GATE_STATUS), 0x81);
    bench_run(&p, 0.2e-6);
    check_hex("and goes with it", bench_read(&p, GATE_STATUS), 0x01);
    bench_write(&p, limit, value);
    bench_run(&p, 1e-6);
    bench_write(&p, ADC_STATUS, EOC);
    bench_run(&p, 50e-6);
    bench_write(&p, ADC_STATUS, EOC);
    bench_run(&p, 50e-6);
    check_hex("it comes again", bench_read(&p, GATE_STATUS), 0x81);
    plant_reset_fabric(&p);
    check_hex("a reset of the fabric takes it away", bench_read(&p, GATE_STATUS), 0x00);
}

int main(void)
{
    registers();
    nothing_is_beyond_after_reset();
    current();
    sum();
    limits_take_effect();
    bus_voltage();
    any_results();
    flags_are_read_only();
    flag_in_the_plant(ADC_I_TRIP, 5000, CURRENT);
    flag_in_the_plant(ADC_SUM_TRIP, 5000, SUM);
    flag_in_the_plant(ADC_V_MAX, 5000, VBUS_HIGH);
    flag_in_the_plant(ADC_V_MIN, 0x1FFFF, VBUS_LOW);
    return check_end();
}
