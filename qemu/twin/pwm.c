/* SPDX-License-Identifier: GPL-2.0-or-later */
/* state(n + 1) = step(state(n)), where n counts clocks. quiet() says for how many clocks step() would do nothing but count;
 * glide() does these at once. A write acts on the state at its time: what the RTL does in the clock of the access. */
#include "pwm.h"

enum { CONTROL = 0x00, STATUS = 0x04, PERIOD = 0x08, DEAD = 0x0C, MIN_PULSE = 0x10, MODE = 0x14, PHASE = 0x18 };
enum { TRIGGER_1 = 0x1C, TRIGGER_2 = 0x20, COUNT = 0x24, COMPARE_A = 0x28, COMPARE_C = PWM_COMPARE_C_OFFSET };
enum { RUN = 1u << 0, BRAKE = 1u << 1, FOLLOW = 1u << 2 };
enum { RUNNING = 1u << 0, RISING = 1u << 1, WAITING = 1u << 2, FELL_BACK_A = 1u << 4 };
enum { MODE_VALLEY = 0, MODE_ONCE = 1u << 1 };
enum { AT_FALLING = 1u << 16, AT_RISING = 1u << 17, START_RISING = 1u << 16, COUNT_BITS = 0xFFFF };

#define PERIOD_AFTER_RESET 2500
#define LONGEST            255
#define FOREVER            INT64_MAX

static int64_t lesser(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static uint32_t last_before_valley(const struct pwm *p)
{
    return p->period == 0 ? 0 : p->period - 1;
}

/* Of a way from end to end: one clock at least. */
static int64_t half_period(const struct pwm *p)
{
    return p->period == 0 ? 1 : p->period;
}

static bool follows(const struct pwm *p)
{
    return p->leader && (p->control & FOLLOW);
}

static bool starts_at_once(const struct pwm *p)
{
    return (p->control & RUN) && !follows(p);
}

static bool wish_for(uint32_t compare, uint32_t count, bool rising)
{
    return rising ? count < compare : count <= compare;
}

static bool wish(const struct pwm *p, int k)
{
    return wish_for(p->compare[k].active, p->count, p->rising);
}

static bool legs_enabled(const struct pwm *p)
{
    return p->live && (p->running || (p->control & BRAKE));
}

static bool leg_wish(const struct pwm *p, int k)
{
    return p->running && !(p->control & BRAKE) && wish(p, k);
}

/* ---- for how long nothing is decided ---- */

/* Until step() moves the carrier to an end. */
static int64_t until_end(const struct pwm *p)
{
    if (p->rising) {
        return p->count >= last_before_valley(p) ? 0 : last_before_valley(p) - p->count;
    }
    return p->count <= 1 ? 0 : p->count - 1;
}

/* Until the carrier shows this count, on its way to the next end; FOREVER: not on this way. */
static int64_t until_count(const struct pwm *p, uint32_t count)
{
    int64_t way = p->rising ? (int64_t)count - p->count : (int64_t)p->count - count;
    return way < 0 ? FOREVER : way;
}

static int64_t until_trigger(const struct pwm *p)
{
    int64_t first = FOREVER;
    for (int n = 0; p->running && n < 2; n++) {
        if (p->trigger[n] & (p->rising ? AT_RISING : AT_FALLING)) {
            first = lesser(first, until_count(p, p->trigger[n] & COUNT_BITS));
        }
    }
    return first;
}

/* Until the wish of a phase is another than now. */
static int64_t until_wish(const struct pwm *p, int k)
{
    bool changes = p->running && !(p->control & BRAKE) && wish(p, k) == p->rising;
    return changes ? until_count(p, p->compare[k].active) : FOREVER;
}

static int64_t until_leg(const struct pwm *p, int k)
{
    const struct pwm_leg *leg = &p->leg[k];
    int64_t held = leg->left > 1 ? leg->left - 1 : 0;
    if (!leg->on || leg->side != leg_wish(p, k)) {
        return held;
    }
    int64_t changes = until_wish(p, k);
    return changes > held ? changes : held;
}

static int64_t until_carrier(const struct pwm *p)
{
    if (p->running) {
        return p->control & RUN ? until_end(p) : 0;
    }
    bool at_start = p->count == (p->phase & COUNT_BITS) && p->rising == ((p->phase & START_RISING) != 0);
    return at_start && !starts_at_once(p) ? FOREVER : 0;
}

/* Clocks from a place of the carrier to the next valley. */
static int64_t way_to_valley(const struct pwm *p, uint32_t count, bool rising)
{
    if (rising) {
        return count >= last_before_valley(p) ? 1 : (int64_t)last_before_valley(p) - count + 1;
    }
    return (count <= 1 ? 1 : count) + half_period(p);
}

/* The clock of the first valley after `clock`, by what is known of the carrier now, which is no further than that. */
static int64_t valley_after(const struct pwm *p, int64_t clock)
{
    int64_t valley;
    if (p->running && !(p->control & RUN)) { /* comes to rest, but not before a valley in the next clock */
        valley = p->rising && p->count >= last_before_valley(p) ? p->clock + 1 : FOREVER;
        return valley > clock ? valley : FOREVER;
    }
    if (p->running) {
        valley = p->clock + way_to_valley(p, p->count, p->rising);
    } else if (p->control & RUN) {
        valley = p->clock + 1 + way_to_valley(p, p->phase & COUNT_BITS, p->phase & START_RISING);
    } else {
        return FOREVER;
    }
    int64_t period = 2 * half_period(p), late = clock - valley;
    return late < 0 ? valley : valley + (late / period + 1) * period;
}

bool pwm_waits(const struct pwm *p)
{
    return !p->running && (p->control & RUN) && follows(p);
}

/* Asked each time: what the leader does may have changed. */
static int64_t next_clock(const struct pwm *p)
{
    return pwm_waits(p) ? lesser(p->next_clock, valley_after(p->leader, p->clock)) : p->next_clock;
}

static bool any_waits(const struct pwm *p)
{
    return p->compare[0].waiting || p->compare[1].waiting || p->compare[2].waiting;
}

static int64_t quiet(const struct pwm *p)
{
    if (p->fresh || (any_waits(p) && !p->running)) {
        return 0;
    }
    int64_t clocks = lesser(until_carrier(p), until_trigger(p));
    for (int k = 0; k < 3 && legs_enabled(p); k++) {
        clocks = lesser(clocks, until_leg(p, k));
    }
    return clocks;
}

void pwm_plan(struct pwm *p)
{
    int64_t clocks = quiet(p);
    p->next_clock = clocks == FOREVER ? FOREVER : p->clock + clocks + 1;
    p->next_triggers = until_trigger(p) == clocks && p->running;
}

/* ---- a clock ---- */

static void step_leg(const struct pwm *p, struct pwm_leg *leg, bool wished)
{
    if (!legs_enabled(p)) {
        *leg = (struct pwm_leg){wished, false, p->dead, false};
    } else if (leg->left > 1) {
        leg->left--;
    } else if (!leg->on) {
        leg->on = leg->active = true;
        leg->left = p->min_pulse;
    } else if (wished != leg->side) {
        *leg = (struct pwm_leg){wished, false, p->dead, true};
    }
}

static void step_compare(const struct pwm *p, struct pwm_compare *c, bool load)
{
    bool now = wish_for(c->active, p->count, p->rising), newly = wish_for(c->written, p->count, p->rising);
    bool ahead = now == p->rising && newly == p->rising, once = p->mode & MODE_ONCE;
    bool take = c->waiting && (!p->running || load || (once && p->fresh && ahead));
    if (take) {
        c->active = c->written;
        c->waiting = false;
    }
    if (p->fresh) {
        c->fell_back = once && !take;
    }
}

static void step_carrier(struct pwm *p, bool to_valley, bool to_peak)
{
    if (!p->running || !(p->control & RUN)) {
        bool was_running = p->running;
        p->running = starts_at_once(p) || (pwm_waits(p) && valley_after(p->leader, p->clock) == p->clock + 1);
        p->count = p->phase & COUNT_BITS;
        p->rising = p->phase & START_RISING;
        p->rested_at = was_running && !p->running ? p->clock + 1 : p->rested_at;
    } else if (to_valley) {
        p->count = p->period;
        p->rising = false;
    } else if (to_peak) {
        p->count = 0;
        p->rising = true;
    } else {
        p->count = (p->count + (p->rising ? 1u : COUNT_BITS)) & COUNT_BITS;
    }
}

static void drive(struct pwm *p)
{
    p->outputs = p->led = 0;
    for (int k = 0; k < 3 && legs_enabled(p); k++) {
        unsigned side = (p->leg[k].side ? 1u : 2u) << (2 * k);
        p->outputs |= p->leg[k].on ? side : 0u;
        p->led |= p->leg[k].active ? side : 0u;
    }
}

static void step(struct pwm *p)
{
    bool to_valley = p->running && p->rising && p->count >= last_before_valley(p);
    bool to_peak = p->running && !p->rising && p->count <= 1;
    bool load = to_valley || (to_peak && p->mode != MODE_VALLEY), started = !p->running;
    for (int k = 0; k < 3; k++) {
        step_leg(p, &p->leg[k], leg_wish(p, k));
    }
    for (int k = 0; k < 3; k++) {
        step_compare(p, &p->compare[k], load);
    }
    p->fresh = false;
    step_carrier(p, to_valley, to_peak);
    p->clock++;
    p->at_valley = to_valley;
    if (to_valley || (started && p->running)) {
        p->valley_at = p->clock * SIM_PS_PER_FABRIC_CLOCK;
    }
}

/* Clocks in which nothing is decided. A leg that is not enabled follows its wish a clock behind, and ends as it would have. */
static void glide(struct pwm *p, int64_t clocks)
{
    if (clocks <= 0) {
        return;
    }
    uint32_t way = p->running ? (uint32_t)clocks : 0;
    for (int k = 0; k < 3; k++) {
        struct pwm_leg *leg = &p->leg[k];
        if (legs_enabled(p)) {
            leg->left = leg->left > clocks ? leg->left - (uint32_t)clocks : (leg->left > 1 ? 1 : leg->left);
        } else {
            uint32_t before = p->rising ? p->count + way - 1 : p->count - way + 1;
            bool wished = wish_for(p->compare[k].active, before, p->rising);
            *leg = (struct pwm_leg){wished && p->running && !(p->control & BRAKE), false, p->dead, false};
        }
    }
    p->count = p->rising ? p->count + way : p->count - way;
    p->clock += clocks;
}

/* ---- from outside ---- */

void pwm_reset(struct pwm *p, sim_ps now)
{
    *p = (struct pwm){.leader = p->leader};
    p->period = p->phase = p->count = PERIOD_AFTER_RESET;
    p->dead = p->min_pulse = LONGEST;
    for (int k = 0; k < 3; k++) {
        p->leg[k].left = LONGEST;
    }
    p->clock = now / SIM_PS_PER_FABRIC_CLOCK;
    p->rested_at = p->clock - 1;
    p->valley_at = now;
    pwm_plan(p);
}

uint32_t pwm_read(const struct pwm *p, uint32_t offset)
{
    uint32_t status;
    switch (offset) {
    case CONTROL:
        return p->control;
    case STATUS:
        status = (p->running ? RUNNING : 0u) | (p->rising ? RISING : 0u) | (any_waits(p) ? WAITING : 0u);
        for (int k = 0; k < 3; k++) {
            status |= p->compare[k].fell_back ? (uint32_t)FELL_BACK_A << k : 0u;
        }
        return status;
    case PERIOD:
        return p->period;
    case DEAD:
        return p->dead;
    case MIN_PULSE:
        return p->min_pulse;
    case MODE:
        return p->mode;
    case PHASE:
        return p->phase;
    case TRIGGER_1:
    case TRIGGER_2:
        return p->trigger[offset == TRIGGER_2];
    case COUNT:
        return p->count;
    default:
        return offset >= COMPARE_A && offset <= COMPARE_C ? p->compare[(offset - COMPARE_A) / 4].written : 0;
    }
}

/* What the legs depend on holds still while they are in use. */
static void write_setting(struct pwm *p, uint32_t offset, uint32_t value)
{
    if ((p->control & (RUN | BRAKE)) || p->running || p->clock == p->rested_at) {
        return;
    }
    switch (offset) {
    case PERIOD:
        p->period = value & COUNT_BITS;
        break;
    case DEAD:
        p->dead = value & 0xFF;
        break;
    case MIN_PULSE:
        p->min_pulse = value & 0xFF;
        break;
    case MODE:
        p->mode = value & 3;
        break;
    case PHASE:
        p->phase = value & (START_RISING | COUNT_BITS);
        break;
    default:
        break;
    }
}

/* The one of phase C commits the set; the others withdraw one that still waits. */
static void write_compare(struct pwm *p, unsigned phase, uint32_t value)
{
    bool commits = phase == 2;
    p->compare[phase].written = value & COUNT_BITS;
    p->fresh = p->fresh || commits;
    for (int k = 0; k < 3; k++) {
        p->compare[k].waiting = commits;
    }
}

void pwm_write(struct pwm *p, uint32_t offset, uint32_t value)
{
    if (offset == CONTROL) {
        p->control = value & (RUN | BRAKE | FOLLOW);
        drive(p);
    } else if (offset == TRIGGER_1 || offset == TRIGGER_2) {
        p->trigger[offset == TRIGGER_2] = value & (AT_RISING | AT_FALLING | COUNT_BITS);
    } else if (offset >= COMPARE_A && offset <= COMPARE_C) {
        write_compare(p, (offset - COMPARE_A) / 4, value);
    } else {
        write_setting(p, offset, value);
    }
    pwm_plan(p);
}

void pwm_set_live(struct pwm *p, bool live)
{
    if (p->live != live) {
        p->live = live;
        drive(p);
        pwm_plan(p);
    }
}

void pwm_catch_up(struct pwm *p, sim_ps now)
{
    int64_t to = now / SIM_PS_PER_FABRIC_CLOCK;
    if (to > p->clock) {
        glide(p, to - p->clock);
    }
}

sim_ps pwm_next_event(const struct pwm *p)
{
    int64_t clock = next_clock(p);
    return clock == FOREVER ? SIM_NEVER : clock * SIM_PS_PER_FABRIC_CLOCK;
}

bool pwm_take_event(struct pwm *p)
{
    bool triggers = p->next_triggers;
    glide(p, next_clock(p) - 1 - p->clock);
    step(p);
    drive(p);
    pwm_plan(p);
    return triggers;
}

bool pwm_triggers_next(const struct pwm *p)
{
    return p->next_triggers;
}

/* The place of a count on its way from valley to valley. */
static int64_t place(const struct pwm *p, uint32_t count, bool rising)
{
    return rising ? (int64_t)p->period + count : (int64_t)p->period - count;
}

/* Clocks from a place of the carrier to that of the next trigger. */
static int64_t way_to_trigger(const struct pwm *p, uint32_t count, bool is_rising)
{
    int64_t first = FOREVER, length = 2 * half_period(p);
    for (int n = 0; n < 2; n++) {
        for (int rising = 0; rising < 2; rising++) {
            if (p->trigger[n] & (rising ? AT_RISING : AT_FALLING)) {
                int64_t way = place(p, p->trigger[n] & COUNT_BITS, rising) - place(p, count, is_rising);
                first = lesser(first, (way % length + length) % length);
            }
        }
    }
    return first;
}

sim_ps pwm_next_trigger(const struct pwm *p)
{
    int64_t from = p->running ? p->clock : FOREVER, way = FOREVER;
    if (p->running) {
        way = way_to_trigger(p, p->count, p->rising);
    } else if (pwm_waits(p)) {
        from = valley_after(p->leader, p->clock);
        way = way_to_trigger(p, p->phase & COUNT_BITS, p->phase & START_RISING);
    }
    return from == FOREVER || way == FOREVER ? SIM_NEVER : (from + way + 1) * SIM_PS_PER_FABRIC_CLOCK;
}
