/* SPDX-License-Identifier: MIT */
#include "firmware/scope/scope.h"

#include "drivers/cortex/cpu.h"
#include "firmware/settings/config.h"

/* ==== a capture ==== */

void capture_begin(struct capture *c, int32_t last, bool fault)
{
    c->fire = false;
    c->cause = CAPTURE_BY_NOTHING;
    c->next = 0u;
    c->filled = 0u;
    c->left = 0u;
    c->had_before = 0u;
    c->last = last;
    c->had_fault = fault;
    c->state = CAPTURE_WAITING;
}

uint32_t capture_samples(const struct capture *c)
{
    return c->state == CAPTURE_DONE ? c->had_before + c->samples - c->before : 0u;
}

/* The newest is just before `next`. */
int32_t capture_word(const struct capture *c, uint32_t sample, uint32_t word)
{
    const uint32_t back = capture_samples(c) - sample;
    const uint32_t place = c->next >= back ? c->next - back : c->next + c->samples - back;
    return c->memory[place * c->words + word];
}

/* ==== the recorder ==== */

#define ATTEMPTS 3u

void recorder_restart(struct recorder *r)
{
    r->bank[r->writing].begun = r->count;
}

void recorder_reset(struct recorder *r, uint32_t fault)
{
    r->had_fault = fault;
    r->kept = 0u;
    recorder_restart(r);
}

/*
 * Repeats if the current loop's interrupt came in between, or is pending: the values of that sample are not written yet.
 */
static void copy_of_one_sample(const struct signal_source *sources, uint32_t count, const struct fabric *fabric,
                               int32_t *to)
{
    for (uint32_t attempt = 0; attempt < ATTEMPTS; attempt++) {
        const uint32_t sequence = adc_sequence(&fabric->adc);
        const bool taken = (adc_status(&fabric->adc) & ADC_STATUS_EOC) == 0u;
        signals_copy(sources, count, to);
        cpu_compiler_barrier();
        if (taken && adc_sequence(&fabric->adc) == sequence) {
            break;
        }
    }
}

static void freeze_bank(struct recorder *r, const struct signal_choice *choice, uint32_t fault)
{
    r->kept_end = r->count;
    r->kept_fault = fault;
    r->kept_of = *choice;
    r->writing ^= 1u;
    r->bank[r->writing].begun = r->count;
    r->kept++;
}

void recorder_step(struct recorder *r, const struct signal_choice *choice, const struct signal_source *sources,
                   const struct fabric *fabric, uint32_t fault)
{
    struct recorder_bank *const bank = &r->bank[r->writing];
    copy_of_one_sample(sources, choice->count, fabric, bank->values[(r->count - bank->begun) % RECORDER_SAMPLES]);
    r->count++;
    if (fault != FAULT_NONE && r->had_fault == FAULT_NONE) {
        freeze_bank(r, choice, fault);
    }
    r->had_fault = fault;
}

static uint32_t samples_in(const struct recorder_bank *bank, uint32_t end)
{
    const uint32_t count = end - bank->begun;
    return count < RECORDER_SAMPLES ? count : RECORDER_SAMPLES;
}

/* The slow loop may freeze the bank or overwrite the sample during the copy: checked afterwards. */
bool recorder_get(const struct recorder *r, uint32_t number, uint32_t words, int32_t *values)
{
    const uint32_t kept = r->kept;
    const uint32_t count = r->count;
    const struct recorder_bank *bank = &r->bank[r->writing];
    const bool old = number - bank->begun >= count - bank->begun;
    if (old) {
        bank = &r->bank[r->writing ^ 1u];
        if (kept == 0u || r->kept_end - number - 1u >= samples_in(bank, r->kept_end)) {
            return false;
        }
    } else if (count - number >= RECORDER_SAMPLES) {
        return false;
    }
    for (uint32_t i = 0; i < words; i++) {
        values[i] = bank->values[(number - bank->begun) % RECORDER_SAMPLES][i];
    }
    cpu_compiler_barrier();
    return r->kept == kept && (old || r->count - number <= RECORDER_SAMPLES);
}

uint32_t recorder_fault_samples(const struct recorder *r)
{
    return r->kept == 0u ? 0u : samples_in(&r->bank[r->writing ^ 1u], r->kept_end);
}

int32_t recorder_fault_word(const struct recorder *r, uint32_t sample, uint32_t word)
{
    const struct recorder_bank *const bank = &r->bank[r->writing ^ 1u];
    const uint32_t number = r->kept_end - recorder_fault_samples(r) + sample;
    return bank->values[(number - bank->begun) % RECORDER_SAMPLES][word];
}

/* ==== the scope ==== */

#if UINTPTR_MAX == UINT32_MAX
_Static_assert(offsetof(struct scope, entry) == 0 && offsetof(struct scope_entry, pend_bit) == 0 &&
                   offsetof(struct scope_entry, pend) == 4 && offsetof(struct scope_entry, handler) == 8 &&
                   offsetof(struct scope_entry, ticks) == 12,
               "system/scoped_tick.S loads the four words at once");
#endif

static void take_sources(struct scope *s)
{
    for (uint32_t i = 0; i < s->choice.count; i++) {
        s->sources[i] = signal_source(s->choice.which[i], s->axis, &s->zero);
    }
}

void scope_init(struct scope *s, struct axis *a, void (*enter)(void), volatile uint32_t *pend, uint32_t pend_bit)
{
    s->entry.pend_bit = pend_bit;
    s->entry.pend = pend;
    s->enter = enter;
    s->axis = a;
    s->sweep.axis = a;
    s->every = 1u;
    s->choice = signal_default();
    s->capture.memory = s->memory;
    s->capture.before = scope_capacity(s) / 2u;
    s->trigger_on = s->choice.which[0];
    take_sources(s);
}

/* ---- settings ---- */

static bool is_under_way(const struct scope *s)
{
    return s->capture.state == CAPTURE_WAITING || s->capture.state == CAPTURE_TRIGGERED;
}

static enum error drop_capture(struct scope *s)
{
    if (is_under_way(s)) {
        return ERROR_SCOPE_ARMED;
    }
    if (sweep_runs(&s->sweep)) {
        return ERROR_SWEEPING;
    }
    s->capture.state = CAPTURE_OFF;
    return ERROR_NONE;
}

enum error scope_choose(struct scope *s, const struct signal_choice *choice)
{
    const enum error error = drop_capture(s);
    if (error == ERROR_NONE) {
        const uint32_t mask = cpu_mask_below(CONFIG_PRIORITY_SLOW_LOOP); /* the recorder's signals, too */
        s->choice = *choice;
        take_sources(s);
        recorder_restart(&s->recorder);
        (void)cpu_mask_below(mask);
    }
    return error;
}

enum error scope_attach(struct scope *s, struct axis *axis)
{
    const enum error error = s->axis == axis ? ERROR_NONE : drop_capture(s);
    if (error == ERROR_NONE && s->axis != axis) {
        scope_off(s); /* the vector may hold the entry until the slow loop's next step */
        const uint32_t mask = cpu_mask_below(CONFIG_PRIORITY_SLOW_LOOP);
        s->axis = axis;
        s->sweep = (struct sweep){.axis = axis};
        take_sources(s);
        recorder_reset(&s->recorder, axis->faults.cause);
        (void)cpu_mask_below(mask);
    }
    return error;
}

enum error scope_set_every(struct scope *s, uint32_t ticks)
{
    const enum error error = drop_capture(s);
    s->every = error == ERROR_NONE ? ticks : s->every;
    return error;
}

enum error scope_set_before(struct scope *s, uint32_t samples)
{
    const enum error error = drop_capture(s);
    s->capture.before = error == ERROR_NONE ? samples : s->capture.before;
    return error;
}

enum error scope_set_trigger(struct scope *s, uint32_t signal, enum capture_when when, int32_t level)
{
    const enum error error = drop_capture(s);
    if (error == ERROR_NONE) {
        s->trigger_on = signal;
        s->capture.when = when;
        s->capture.level = level;
    }
    return error;
}

/* ---- a capture ---- */

struct outcome scope_arm(struct scope *s)
{
    const enum error busy = drop_capture(s);
    if (busy != ERROR_NONE) {
        return outcome_of(busy);
    }
    if (s->capture.before >= scope_capacity(s)) {
        return (struct outcome){ERROR_SCOPE_BEFORE, (int32_t)scope_capacity(s) - 1};
    }
    if (s->axis->loop.handlers == NULL) {
        return outcome_of(ERROR_FABRIC_DOUBTED);
    }
    scope_off(s);
    s->watched = signal_source(s->trigger_on, s->axis, &s->zero);
    s->capture.words = s->choice.count;
    s->capture.samples = scope_capacity(s);
    s->dropped = 0u;
    s->late = 0u;
    s->due = s->entry.ticks + 1u;
    s->rate_of = (uint32_t)s->axis->loop.loops_per_slow;
    capture_begin(&s->capture, *s->watched.word + *s->watched.added, s->axis->faults.cause != FAULT_NONE);
    current_loop_divert(&s->axis->loop, s->enter, &s->entry.handler);
    return OUTCOME_OK;
}

enum error scope_fire(struct scope *s)
{
    if (s->capture.state != CAPTURE_WAITING) {
        return ERROR_SCOPE_NOT_ARMED;
    }
    s->capture.fire = true;
    return ERROR_NONE;
}

struct outcome scope_sweep(struct scope *s, enum sweep_loop loop, int32_t milliamp)
{
    if (is_under_way(s) || sweep_runs(&s->sweep)) {
        return outcome_of(is_under_way(s) ? ERROR_SCOPE_ARMED : ERROR_SWEEPING);
    }
    const struct outcome outcome = sweep_begin(&s->sweep, loop, milliamp);
    if (outcome.error == ERROR_NONE && loop != SWEEP_SPEED) {
        s->swept = s->entry.ticks;
        current_loop_divert(&s->axis->loop, s->enter, &s->entry.handler);
    }
    return outcome;
}

void scope_off(struct scope *s)
{
    if (!sweep_runs(&s->sweep)) {
        current_loop_undivert(&s->axis->loop);
    }
    if (is_under_way(s)) {
        s->capture.state = CAPTURE_OFF;
    }
}

/* ---- reading ---- */

struct scope_extent scope_extent(const struct scope *s, enum scope_record record)
{
    if (record == SCOPE_FAULT) {
        const uint32_t kept = recorder_fault_samples(&s->recorder);
        return (struct scope_extent){kept, s->recorder.kept_of.count, kept - 1u, &s->recorder.kept_of};
    }
    return (struct scope_extent){capture_samples(&s->capture), s->choice.count, s->capture.had_before, &s->choice};
}

uint32_t scope_read(const struct scope *s, enum scope_record record, uint32_t from, int32_t *to, uint32_t most)
{
    const struct scope_extent extent = scope_extent(s, record);
    uint32_t count = 0;
    for (; count < most && extent.samples != 0u && (from + count) / extent.words < extent.samples; count++) {
        const uint32_t sample = (from + count) / extent.words;
        const uint32_t word = (from + count) % extent.words;
        to[count] = record == SCOPE_FAULT ? recorder_fault_word(&s->recorder, sample, word)
                                          : capture_word(&s->capture, sample, word);
    }
    return count;
}

/* ---- the interrupts' halves ---- */

void scope_sample(struct scope *s)
{
    struct capture *const c = &s->capture;
    const uint32_t tick = s->entry.ticks;
    const uint32_t overdue = tick - s->due;
    if (sweep_runs(&s->sweep)) {
        sweep_sample(&s->sweep, tick - s->swept);
        s->swept = tick;
        return;
    }
    if (overdue > UINT32_MAX / 2u || !is_under_way(s)) {
        return;
    }
    signals_copy(s->sources, c->words, capture_slot(c));
    const int32_t watched = (int32_t)((uint32_t)*s->watched.word + (uint32_t)*s->watched.added);
    const bool fault = s->axis->faults.cause != FAULT_NONE;
    cpu_compiler_barrier();
    if (s->entry.ticks != tick) {
        s->dropped++;
        return;
    }
    s->late += overdue != 0u ? 1u : 0u;
    s->due = tick + s->every;
    capture_commit(c, watched, fault);
}

void scope_step(struct scope *s)
{
    if (axis_fabric_is_untrusted(s->axis)) {
        return;
    }
    sweep_step(&s->sweep);
    if (scope_is_on(s) && !is_under_way(s) && !sweep_runs(&s->sweep)) {
        current_loop_undivert(&s->axis->loop);
    }
    recorder_step(&s->recorder, &s->choice, s->sources, s->axis->fabric, s->axis->faults.cause);
}
