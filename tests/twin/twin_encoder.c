/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Slot 2, ENC, against docs/fabric.md: random motion against a counter that takes edge by edge, and by hand. */
#include <stdlib.h>

#include "bench.h"
#include "check.h"

#define PI 3.141592653589793

/* The counter as the page describes it, edge by edge. */
struct counter {
    int64_t edge, position, counts, index;
    bool enabled, reverse, index_seen;
};

static bool pulse_is_high(const struct counter *c, const struct index_pulse *pulse)
{
    int64_t beyond_first = (((c->edge - pulse->first) % pulse->turn) + pulse->turn) % pulse->turn;
    return beyond_first <= pulse->last - pulse->first;
}

static void counter_step(struct counter *c, int direction, const struct index_pulse *pulse)
{
    bool was_high = pulse_is_high(c, pulse);
    c->edge += direction;
    if (!c->enabled) {
        return;
    }
    c->position += c->reverse ? -direction : direction;
    c->position = (c->position + c->counts) % c->counts;
    if (pulse_is_high(c, pulse) && !was_high) {
        c->index = c->position;
        c->index_seen = true;
    }
}

static void counter_set(struct counter *c, struct encoder *e)
{
    switch (any_between(0, 7)) {
    case 0:
        c->enabled = !c->enabled;
        break;
    case 1:
        c->reverse = !c->reverse;
        break;
    case 2:
        c->counts = any_between(4, 100);
        c->position = 0;
        encoder_write(e, 0x04, (uint32_t)c->counts);
        return;
    case 3:
        c->index_seen = false;
        encoder_write(e, 0x14, 1);
        return;
    default:
        return;
    }
    encoder_write(e, 0x00, (c->enabled ? 1 : 0) | (c->reverse ? 2 : 0));
}

static void encoder_against_counting(const struct index_pulse *pulse)
{
    struct encoder e = {0};
    struct counter c = {.counts = 4096};
    int64_t wrong = 0, indices = 0;
    encoder_reset(&e, 0);
    for (int n = 0; n < 20000; n++) {
        counter_set(&c, &e);
        int jump = any_between(-120, 120);
        int64_t before = c.index;
        for (int k = 0; k < abs(jump); k++) {
            counter_step(&c, jump > 0 ? 1 : -1, pulse);
        }
        encoder_follow(&e, c.edge, pulse);
        indices += c.index != before;
        wrong += encoder_read(&e, 0x08) != c.position || encoder_read(&e, 0x10) != c.index ||
                 encoder_read(&e, 0x14) != c.index_seen || encoder_read(&e, 0x04) != c.counts;
    }
    check_true("encoder: indices seen", indices > 1000);
    check_equal("encoder: jumps that differ from counting edge by edge", wrong, 0);
}

static void encoder_registers(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    params.motor.initial_angle_rad = 1.0;
    bench_before_trigger(&p, &params);
    check_equal("ENC.COUNTS after reset", bench_read(&p, ENC_COUNTS), 4096);
    check_equal("POSITION starts at 0 wherever the rotor stands", bench_read(&p, ENC_POSITION), 0);
    bench_write(&p, ENC_COUNTS, 4000);
    bench_write(&p, ENC_CONTROL, 0xFFFFFFFF);
    check_hex("ENC.CONTROL: unused bits read 0", bench_read(&p, ENC_CONTROL), 3);
    bench_write(&p, ENC_CONTROL, 1);

    const double edge_per_us_rad_s = 2 * PI / 4000 / 1e-6;
    motor_spin(&p.motor, edge_per_us_rad_s);
    bench_run(&p, 41e-6); /* the trigger was 1 us after the start */
    check_near("POSITION counts up with the angle", bench_read(&p, ENC_POSITION), 41, 1);
    check_near("LATCHED is of the trigger", bench_read(&p, ENC_LATCHED), 1, 1);
    bench_run(&p, 50e-6);
    check_near("and of the next one", bench_read(&p, ENC_LATCHED), 51, 1);
    bench_write(&p, ENC_CONTROL, 3);
    bench_run(&p, 100e-6);
    check_near("REVERSE counts down, through 0 to COUNTS-1", bench_read(&p, ENC_POSITION), 4000 - 9, 1);
    bench_write(&p, ENC_POSITION, 5);
    check_near("POSITION is read-only", bench_read(&p, ENC_POSITION), 4000 - 9, 1);
    bench_write(&p, ENC_COUNTS, 8000);
    check_equal("writing COUNTS zeroes POSITION", bench_read(&p, ENC_POSITION), 0);
    plant_reset_fabric(&p);
    check_equal("reset of COUNTS", bench_read(&p, ENC_COUNTS), 4096);
}

static void encoder_index(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    params.sensors.index_angle_rad = 1.0; /* at edge 636 of 4000 */
    bench_before_trigger(&p, &params);
    bench_write(&p, ENC_COUNTS, 4000);
    bench_write(&p, ENC_CONTROL, 1);
    motor_spin(&p.motor, 500);
    bench_run(&p, 0.9 / 500);
    check_hex("no index before its angle", bench_read(&p, ENC_STATUS), 0);
    bench_run(&p, 0.2 / 500);
    check_hex("INDEX_SEEN after it", bench_read(&p, ENC_STATUS), 1);
    check_equal("INDEX is its position", bench_read(&p, ENC_INDEX), 636);
    bench_run(&p, 3 * 2 * PI / 500);
    check_equal("three turns later too", bench_read(&p, ENC_INDEX), 636);
    bench_write(&p, ENC_STATUS, 1);
    check_hex("INDEX_SEEN clears", bench_read(&p, ENC_STATUS), 0);
}

static void encoder_cable(void)
{
    const struct index_pulse far_away = {1000, 1000, 4000};
    struct encoder e = {0};
    encoder_reset(&e, 0);
    encoder_write(&e, 0x00, 1);
    encoder_illegal(&e);
    check_hex("ILLEGAL", encoder_read(&e, 0x14), 2);
    encoder_write(&e, 0x14, 4);
    check_hex("stays until written", encoder_read(&e, 0x14), 2);
    encoder_write(&e, 0x14, 2);
    check_hex("and clears", encoder_read(&e, 0x14), 0);
    encoder_cut(&e, true);
    encoder_write(&e, 0x14, 7);
    check_hex("SIGNAL_LOST stays while it lasts", encoder_read(&e, 0x14), 4);
    encoder_follow(&e, 10, &far_away);
    check_equal("a cut pair does not count", encoder_read(&e, 0x08), 0);
    encoder_cut(&e, false);
    check_hex("and it is a latch", encoder_read(&e, 0x14), 4);
    encoder_write(&e, 0x14, 4);
    check_hex("that clears afterwards", encoder_read(&e, 0x14), 0);
    encoder_freeze(&e, true);
    encoder_follow(&e, 30, &far_away);
    check_equal("frozen A and B do not count", encoder_read(&e, 0x08), 0);
    encoder_freeze(&e, false);
    encoder_follow(&e, 35, &far_away);
    check_equal("what was missed stays missed", encoder_read(&e, 0x08), 5);
    encoder_slip(&e, -7);
    check_equal("a slip shifts the count", encoder_read(&e, 0x08), 4094);
    encoder_reset(&e, 0);
    encoder_reverse(&e, true);
    encoder_write(&e, 0x00, 1);
    encoder_follow(&e, 9, &(struct index_pulse){5, 5, 4000});
    check_equal("A and B exchanged count backwards", encoder_read(&e, 0x08), 4096 - 9);
    check_equal("the index is found where it is", encoder_read(&e, 0x10), 4096 - 5);
    encoder_write(&e, 0x00, 3);
    encoder_follow(&e, 11, &far_away);
    check_equal("which REVERSE puts right", encoder_read(&e, 0x08), 4096 - 7);
    encoder_reset(&e, 11);
    encoder_write(&e, 0x00, 1);
    encoder_follow(&e, 12, &far_away);
    check_equal("and a reset does not", encoder_read(&e, 0x08), 4095);
    encoder_write(&e, 0x04, 1);
    check_equal("COUNTS is at least 4", encoder_read(&e, 0x04), 4);
    encoder_write(&e, 0x04, 100000);
    check_equal("and at most 65536", encoder_read(&e, 0x04), 65536);
}

int main(void)
{
    encoder_against_counting(&(struct index_pulse){13, 13, 40});
    encoder_against_counting(&(struct index_pulse){13, 20, 40});
    encoder_against_counting(&(struct index_pulse){35, 44, 40});
    encoder_registers();
    encoder_index();
    encoder_cable();
    return check_end();
}
