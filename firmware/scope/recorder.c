/* SPDX-License-Identifier: MIT */
#include "firmware/scope/recorder.h"

#include "drivers/cortex/cpu.h"

#define ATTEMPTS 3u

void recorder_begin(struct recorder *r)
{
    r->bank[r->writing].begun = r->count;
}

void recorder_forget(struct recorder *r, uint32_t fault)
{
    r->had_fault = fault;
    r->kept = 0u;
    recorder_begin(r);
}

/*
 * The current loop's interrupt may come in between. A conversion that it has not taken yet counts as one in between: the values
 * of that sample are still to come.
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

/* The slow loop may keep a fault, or overwrite the sample, while it is copied: then the number no longer fits. */
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
