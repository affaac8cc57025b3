/* SPDX-License-Identifier: MIT */
/*
 * The current loop's interrupt, bit for bit. The assembly runs on a loop and a fabric of the test's own, its counterpart in C
 * (current_loop_step.h) on copies of them, and everything either has written is compared (the other instances in C:
 * tests/unit/test_handlers.py). Random data over the whole ranges and their corners. And what must hold of the compares
 * whatever the data: room for dead times and a pulse on either side.
 */
#include "firmware/control/current_loop_step.h"

#include "drivers/mss/watchdog.h"
#include "lib/limit.h"
#include "tests/target/harness.h"
#include "tests/target/random.h"

#define STEPS 100000u

uint32_t axes[1]; /* what the handler itself would use; not touched here */

static volatile uint32_t faults;

void current_loop_fault(void);
void current_loop_fault(void)
{
    faults++;
}

#define TEXT(x)   #x
#define NUMBER(x) TEXT(x)

/* The handler after its first four instructions, with both bases given: it returns to the caller as from the interrupt. */
void run_body(struct current_loop *loop, struct fabric *fabric);
__asm__(".text\n"
        ".syntax unified\n"
        ".thumb_func\n"
        ".global run_body\n"
        ".type run_body, %function\n"
        "run_body: push {r4-r11, lr}\n"
        "add r11, r0, #1\n"
        "mov r10, r1\n"
        "b FabricIrq0_IRQHandler + " NUMBER(LOOP_BODY) "\n");

static uint32_t random_state = RANDOM_SEED;

static uint32_t next(void)
{
    return random_next(&random_state);
}

static int32_t any(int32_t limit)
{
    return random_any(&random_state, limit);
}

/* The circle of a modulator that uses all but its dead times, as the firmware's. */
static void prepare(struct current_loop *c)
{
    const int32_t rest = 2 * CONFIG_MIN_PULSE_COUNTS + 4;
    const int32_t radius = (CONFIG_PWM_COUNTS - 4 * CONFIG_DEAD_COUNTS - rest) * 18919 / 65536 * (1 << CONFIG_V_SHIFT);
    *c = (struct current_loop){.sine = trig_chords, .status_max = 1u};
    for (int32_t n = 0; n < 512; n++) {
        const int32_t low = (n - LOOP_CIRCLE_ZERO) * (1 << LOOP_CIRCLE_SHIFT);
        c->circle_steps[n] = (uint16_t)circle_rest_q15(low < 0 ? -low : low + (1 << LOOP_CIRCLE_SHIFT) - 1, radius);
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
    c->integral_d_q9 = any(PI_INTEGRAL_MAX_Q9);
    c->integral_q_q9 = any(PI_INTEGRAL_MAX_Q9);
    c->turn_q15 = any(ADVANCE_MAX_Q15);
    c->encoder_scale_q32 = next();
    c->field_angle_q32 = next();
    c->field_speed_q32 = any(1 << 28);
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

/* Both sides of a phase are on for the shortest pulse at least, with a dead time before each. */
static bool has_room(uint32_t compare)
{
    const uint32_t taken = CONFIG_DEAD_COUNTS + CONFIG_MIN_PULSE_COUNTS;
    return compare <= CONFIG_HALF_COUNTS && 2u * compare >= taken && 2u * (CONFIG_HALF_COUNTS - compare) >= taken;
}

struct side {
    struct current_loop loop;
    struct fabric fabric;
};

/* Two alike, ready for a sample whose gate status is a fault or not. */
static void draw(struct side *x, struct side *y, uint32_t gate)
{
    fill(&x->loop);
    copy(&y->loop, &x->loop);
    const struct adc_sample i = {.ia_q15 = any(32767), .ib_q15 = any(32767), .ic_q15 = any(32767)};
    const uint32_t latched = next() % 65536u;
    struct fabric *const fabrics[2] = {&x->fabric, &y->fabric};
    for (uint32_t n = 0; n < 2u; n++) {
        uint32_t *const words = (uint32_t *)fabrics[n];
        words[offsetof(struct fabric, adc.IA) / 4u] = (uint32_t)i.ia_q15;
        words[offsetof(struct fabric, adc.IB) / 4u] = (uint32_t)i.ib_q15;
        words[offsetof(struct fabric, adc.IC) / 4u] = (uint32_t)i.ic_q15;
        words[offsetof(struct fabric, encoder.LATCHED) / 4u] = latched;
        fabrics[n]->gate.STATUS = gate;
        fabrics[n]->pwm.COMPARE_A = fabrics[n]->pwm.COMPARE_B = fabrics[n]->pwm.COMPARE_C = UINT32_MAX;
        fabrics[n]->adc.STATUS = 98u;
    }
}

/* What the register makes of what was written: a 1 clears what is to be cleared, and nothing else. */
static bool acknowledged(const struct side *s)
{
    return (s->fabric.adc.STATUS & (ADC_STATUS_EOC | ADC_STATUS_OVERRUN | ADC_STATUS_TRIP)) == ADC_STATUS_EOC;
}

static bool all_have_room(const struct side *s)
{
    const struct pwm_regs *const pwm = &s->fabric.pwm;
    return has_room(pwm->COMPARE_A) && has_room(pwm->COMPARE_B) && has_room(pwm->COMPARE_C);
}

static bool same_compares(const struct side *x, const struct side *y)
{
    return differences((const uint32_t *)&x->fabric + offsetof(struct fabric, pwm.COMPARE_A) / 4u,
                       (const uint32_t *)&y->fabric + offsetof(struct fabric, pwm.COMPARE_A) / 4u, 3u) == 0u;
}

static bool same_state(const struct side *x, const struct side *y)
{
    return differences(&x->loop, &y->loop, LOOP_CIRCLE / 4u) == 0u;
}

struct count {
    uint32_t state, compares, cramped, not_acknowledged, faults;
};

static void compare(struct count *wrong, const struct side *tested, const struct side *expected)
{
    wrong->state += same_state(tested, expected) ? 0u : 1u;
    wrong->compares += same_compares(tested, expected) ? 0u : 1u;
    wrong->cramped += all_have_room(tested) ? 0u : 1u;
    wrong->not_acknowledged += acknowledged(tested) ? 0u : 1u;
}

static _Alignas(512) struct side tested; /* as handlers.h has it: where the assembly's acknowledge comes from */
static struct side expected;

static void test_assembly(void)
{
    struct count wrong = {0};
    for (uint32_t step = 0; step < STEPS; step++) {
        const uint32_t gate = (next() & 3u) == 0u ? 2u : 1u;
        draw(&tested, &expected, gate);
        faults = 0;
        run_body(&tested.loop, &tested.fabric);
        const bool fault = current_loop_step(&expected.loop, &expected.fabric, LOOP_ENCODER);
        compare(&wrong, &tested, &expected);
        wrong.faults += faults == gate - 1u && fault == (gate > 1u) ? 0u : 1u;
        watchdog_refresh();
    }
    harness_note("assembly against C: steps", STEPS);
    harness_equal("nothing beyond the members of the interrupt has changed",
                  differences(&tested.loop, &expected.loop, sizeof tested.loop / 4u), 0u);
    harness_equal("states that differ", wrong.state, 0u);
    harness_equal("compares that differ", wrong.compares, 0u);
    harness_equal("compares without room", wrong.cramped, 0u);
    harness_equal("samples not acknowledged", wrong.not_acknowledged, 0u);
    harness_equal("faults missed or made up", wrong.faults, 0u);
}

int main(void)
{
    harness_begin();
    prepare(&tested.loop);
    prepare(&expected.loop);
    test_assembly();
    harness_end();
}
