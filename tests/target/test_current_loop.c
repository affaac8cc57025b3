/* SPDX-License-Identifier: MIT */
/*
 * The current loop's interrupt against its definition, bit for bit: the assembly runs on a loop and a fabric of the test's own,
 * current_loop_step.h on copies of them, and everything either has written is compared. Random data over the whole ranges
 * and their corners. And what must hold of the edges whatever the data: inside the period, in order, a dead time apart.
 */
#include "firmware/control/current_loop_step.h"

#include "drivers/fabric/offsets.h"
#include "drivers/mss/watchdog.h"
#include "lib/limit.h"
#include "tests/target/harness.h"

#define STEPS        200000u
#define FABRIC_WORDS 0x100u

uint32_t axes[1]; /* what the handler itself would use; not touched here */

static volatile uint32_t faults;

void current_loop_fault(void);
void current_loop_fault(void)
{
    faults++;
}

/* The handler after its first four instructions, with both bases given: it returns to the caller as from the interrupt. */
void run_body(struct current_loop *loop, uint32_t *fabric);
__asm__(".text\n"
        ".syntax unified\n"
        ".thumb_func\n"
        ".global run_body\n"
        ".type run_body, %function\n"
        "run_body: push {r4-r11, lr}\n"
        "mov r11, r0\n"
        "mov r10, r1\n"
        "b current_loop_body\n");

static uint32_t random_state = 0x2545F491u;

static uint32_t next(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return random_state;
}

/* -limit ... limit, every fourth time one of the ends, 0 or next to it. */
static int32_t any(int32_t limit)
{
    const uint32_t choice = next() & 15u;
    if (choice < 4u) {
        const int32_t corners[4] = {-limit, limit, 0, -1};
        return corners[choice];
    }
    return (int32_t)(next() % (2u * (uint32_t)limit + 1u)) - limit;
}

/* The circle of a modulator that uses all but its dead times, as the firmware's, in sixteenths of a count. */
static void prepare(struct current_loop *c)
{
    const int32_t radius_q4 = (LOOP_PWM_COUNTS - 4 * LOOP_DEAD_COUNTS - 8) * 8 * 18919 / 32768;
    *c = (struct current_loop){.sine = trig_chords, .status_max = 1u};
    for (int32_t n = 0; n < 512; n++) {
        const int32_t low = (n - LOOP_CIRCLE_ZERO) * (1 << LOOP_CIRCLE_SHIFT);
        c->circle_q4[n] = (uint16_t)circle_rest_q15(low < 0 ? -low : low + (1 << LOOP_CIRCLE_SHIFT) - 1, radius_q4);
    }
}

static void fill(struct current_loop *c)
{
    c->pll.angle_q32 = next();
    c->pll.speed_q32 = any(1 << 28);
    c->angle_offset_q32 = next();
    c->i_d_ref_q15 = any(32767);
    c->i_q_ref_q15 = any(32767);
    c->kp_d_q9 = (int32_t)(next() % (PI_KP_MAX_Q9 + 1));
    c->kp_q_q9 = (next() & 7u) != 0u ? (int32_t)(next() % 1024u) : PI_KP_MAX_Q9;
    c->ki_q15 = (next() & 7u) != 0u ? (int32_t)(next() % 4096u) : PI_KI_MAX_Q15;
    c->integral_d_q9 = any(50000000);
    c->integral_q_q9 = any(50000000);
    c->turn_q15 = any(ADVANCE_MAX_Q15);
    c->encoder_scale_q32 = next();
}

/* What changes from step to step; the circle does not. */
static void copy(struct current_loop *to, const struct current_loop *from)
{
    const uint32_t *const a = (const uint32_t *)from;
    uint32_t *const b = (uint32_t *)to;
    for (uint32_t n = 0; n < LOOP_CIRCLE / 4u; n++) {
        b[n] = a[n];
    }
}

static uint32_t differences(const void *x, const void *y, uint32_t words)
{
    const uint32_t *const a = x;
    const uint32_t *const b = y;
    uint32_t count = 0;
    for (uint32_t n = 0; n < words; n++) {
        count += a[n] != b[n] ? 1u : 0u;
    }
    return count;
}

/* Rises and falls of the high side at edges[0] and [1], falls and rises of the low side at [3] and [2]. */
static bool in_order(const uint32_t *edges)
{
    return edges[3] >= 1u && edges[3] + LOOP_DEAD_COUNTS == edges[0] && edges[0] < edges[1] &&
           edges[1] + LOOP_DEAD_COUNTS == edges[2] && edges[2] <= LOOP_PWM_COUNTS - 1u;
}

int main(void)
{
    static struct current_loop loop, expected;
    static uint32_t fabric[FABRIC_WORDS];
    uint32_t wrong_state = 0, wrong_edges = 0, disordered = 0, unsynchronised = 0, wrong_faults = 0;

    harness_begin();
    prepare(&loop);
    prepare(&expected);
    for (uint32_t step = 0; step < STEPS; step++) {
        struct current_edges edges;
        const uint32_t fault = (next() & 3u) == 0u ? 2u : 1u;
        fill(&loop);
        copy(&expected, &loop);
        fabric[FABRIC_ADC_IA / 4] = (uint32_t)any(32767);
        fabric[FABRIC_ADC_IB / 4] = (uint32_t)any(32767);
        fabric[FABRIC_ENC_LATCHED / 4] = next() % 65536u;
        fabric[FABRIC_GATE_STATUS / 4] = fault;
        fabric[FABRIC_SYNC_UPDATE / 4] = 99u;
        fabric[FABRIC_ADC_STATUS / 4] = 99u;
        faults = 0;
        current_loop_step(&expected, (int32_t)fabric[FABRIC_ADC_IA / 4], (int32_t)fabric[FABRIC_ADC_IB / 4],
                          fabric[FABRIC_ENC_LATCHED / 4], &edges);
        run_body(&loop, fabric);
        wrong_state += differences(&loop, &expected, LOOP_CIRCLE / 4u) != 0u ? 1u : 0u;
        wrong_edges += differences(&fabric[FABRIC_PWM1_POSEDGE / 4], &edges, 12u) != 0u ? 1u : 0u;
        disordered += in_order(&edges.count[0]) && in_order(&edges.count[4]) && in_order(&edges.count[8]) ? 0u : 1u;
        unsynchronised += fabric[FABRIC_SYNC_UPDATE / 4] == 1u && fabric[FABRIC_ADC_STATUS / 4] == 1u ? 0u : 1u;
        wrong_faults += faults == fault - 1u ? 0u : 1u;
        watchdog_refresh();
    }
    harness_note("steps", STEPS);
    harness_equal("nothing else has changed", differences(&loop, &expected, sizeof loop / 4u), 0u);
    harness_equal("states that differ from the definition", wrong_state, 0u);
    harness_equal("edges that differ from the definition", wrong_edges, 0u);
    harness_equal("edges out of the period or out of order", disordered, 0u);
    harness_equal("samples not taken or edges not handed over", unsynchronised, 0u);
    harness_equal("faults missed or made up", wrong_faults, 0u);
    harness_end();
}
