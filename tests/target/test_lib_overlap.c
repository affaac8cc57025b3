/* SPDX-License-Identifier: MIT */
/* The functions of Lib.h with input and output in the same memory, at every distance, against the same apart. */
#include "drivers/mss/watchdog.h"
#include "tests/target/harness.h"
#include "tests/target/lib_cases.h"

#define INPUT       6u /* index of the input's first word, with room for the output before and behind it */
#define WORDS       16u
#define NEAREST     2u /* words by which the output begins before the input at first */
#define DISTANCES   7u
#define PER_REFRESH 64u
#define VECTORS     4096u

typedef void (*lib_function)(const void *in, void *out);

struct function {
    const char *name;
    lib_function call;
    uint32_t results;
};

#define FUNCTION(name, results) ((struct function){#name " in place", (lib_function)name, results})

static const struct function functions[] = {
    FUNCTION(Clarke_Lib_Do, 2),
    FUNCTION(InvClarke_Lib_Do, 3),
    FUNCTION(Park_Lib_Do, 2),
    FUNCTION(InvPark_Lib_Do, 2),
};

/* Whether a result differs from that of separate memory, or a word outside the output has changed. */
static bool differs(const struct function *f, const struct lib_vector *v, uint32_t output)
{
    int32_t apart[3];
    int32_t memory[WORDS] = {0};
    bool different = false;

    f->call(v->in, apart);
    for (uint32_t k = 0; k < 4u; k++) {
        memory[INPUT + k] = v->in[k];
    }
    f->call(&memory[INPUT], &memory[output]);
    for (uint32_t k = 0; k < WORDS; k++) {
        const int32_t before = INPUT <= k && k < INPUT + 4u ? v->in[k - INPUT] : 0;
        const int32_t expected = output <= k && k < output + f->results ? apart[k - output] : before;

        different = different || memory[k] != expected;
    }
    return different;
}

int main(void)
{
    (void)harness_begin();
    for (uint32_t which = 0; which < sizeof functions / sizeof functions[0]; which++) {
        uint32_t state = 1u + which;
        uint32_t wrong = 0u;

        for (uint32_t n = 0; n < VECTORS; n++) {
            const struct lib_vector vector = lib_case_vector(LIB_CASE_CORNERS, &state);

            for (uint32_t distance = 0; distance < DISTANCES; distance++) {
                wrong += differs(&functions[which], &vector, INPUT - NEAREST + distance) ? 1u : 0u;
            }
            if (n % PER_REFRESH == 0u) {
                watchdog_refresh();
            }
        }
        harness_equal(functions[which].name, wrong, 0u);
    }
    harness_end();
}
