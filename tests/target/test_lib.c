/* SPDX-License-Identifier: MIT */
/*
 * Lib.h on the target: the assembly, with each special LIB_TRIG_FRAC, against its portable definition, bit for bit, and with
 * input and output in the same memory at every distance; the kernels' inline assembly against the C beside it.
 */
#include "drivers/mss/watchdog.h"
#include "tests/target/harness.h"
#include "tests/target/lib_cases.h"
#include "tests/target/lib_inline.h"

#define VECTORS_PER_REFRESH 1024u
#define OVERLAPPED          4096u /* vectors from the first random one on */
#define INPUT               6u    /* index of the input's first word, with room for the output before and behind it */
#define WORDS               16u
#define NEAREST             2u /* words by which the output begins before the input at first */
#define DISTANCES           7u

struct build {
    uint32_t frac;
    lib_function functions[CASE_COUNT];
};

#define DECLARE(bits) \
    void frac##bits##_Clarke_Lib_Do(const void *in, void *out); \
    void frac##bits##_InvClarke_Lib_Do(const void *in, void *out); \
    void frac##bits##_Park_Lib_Do(const void *in, void *out); \
    void frac##bits##_InvPark_Lib_Do(const void *in, void *out);

DECLARE(1)
DECLARE(16)
DECLARE(30)
DECLARE(31)

static const struct build builds[] = {{LIB_TRIG_FRAC, LIB_FUNCTIONS()},
                                      {1, LIB_FUNCTIONS(frac1_)},
                                      {16, LIB_FUNCTIONS(frac16_)},
                                      {30, LIB_FUNCTIONS(frac30_)},
                                      {31, LIB_FUNCTIONS(frac31_)}};

static bool equal(const struct lib_result *x, const struct lib_result *y)
{
    return x->out[0] == y->out[0] && x->out[1] == y->out[1] && x->out[2] == y->out[2];
}

/* Whether a result is wrong, or a word outside the output has changed. */
static bool wrong_in_place(const struct build *b, enum lib_case which, const struct lib_vector *v,
                           const struct lib_result *expected, uint32_t output)
{
    int32_t memory[WORDS] = {0};
    bool wrong = false;

    for (uint32_t k = 0; k < 4u; k++) {
        memory[INPUT + k] = v->in[k];
    }
    b->functions[which](&memory[INPUT], &memory[output]);
    for (uint32_t k = 0; k < WORDS; k++) {
        const int32_t before = INPUT <= k && k < INPUT + 4u ? v->in[k - INPUT] : 0;
        const bool is_output = output <= k && k < output + lib_case_results(which);

        wrong = wrong || memory[k] != (is_output ? expected->out[k - output] : before);
    }
    return wrong;
}

static uint32_t wrong_results(const struct build *b, enum lib_case which)
{
    uint32_t state = 1u + which, wrong = 0u;

    for (uint32_t index = 0; index < LIB_CASE_VECTORS; index++) {
        const struct lib_vector vector = lib_case_vector(index, &state);
        const struct lib_result expected = lib_case_expected(which, &vector, b->frac);
        struct lib_result got = {{0, 0, 0}};

        b->functions[which](vector.in, got.out);
        wrong += equal(&got, &expected) ? 0u : 1u;
        for (uint32_t n = 0; n < DISTANCES && index - LIB_CASE_CORNERS < OVERLAPPED; n++) {
            wrong += wrong_in_place(b, which, &vector, &expected, INPUT - NEAREST + n) ? 1u : 0u;
        }
        if (index % VECTORS_PER_REFRESH == 0u) {
            watchdog_refresh();
        }
    }
    return wrong;
}

static uint32_t wrong_inline(void)
{
    uint32_t state = 1u, wrong = 0u;

    for (uint32_t index = 0; index < LIB_CASE_VECTORS; index++) {
        const struct lib_vector vector = lib_case_vector(index, &state);

        for (uint32_t which = 0; which < LIB_INLINE_COUNT; which++) {
            const struct lib_result got = lib_inline(which, vector.in), expected = lib_portable(which, vector.in);
            wrong += equal(&got, &expected) ? 0u : 1u;
        }
        if (index % VECTORS_PER_REFRESH == 0u) {
            watchdog_refresh();
        }
    }
    return wrong;
}

int main(void)
{
    static const char *const names[CASE_COUNT] = {"Clarke", "InvClarke", "Park", "InvPark"};

    (void)harness_begin();
    for (uint32_t n = 0; n < sizeof builds / sizeof builds[0]; n++) {
        harness_note("fraction bits", builds[n].frac);
        for (uint32_t which = 0; which < CASE_COUNT; which++) {
            (void)harness_equal(names[which], wrong_results(&builds[n], (enum lib_case)which), 0u);
        }
    }
    (void)harness_equal("kernels' inline assembly", wrong_inline(), 0u);
    harness_end();
}
