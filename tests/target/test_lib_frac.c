/* SPDX-License-Identifier: MIT */
/* Park and inverse Park with other LIB_TRIG_FRAC than the image's: the assembly against its portable definition. */
#include "drivers/mss/watchdog.h"
#include "lib/transform_s32.h"
#include "tests/target/harness.h"
#include "tests/target/lib_cases.h"

#define VECTORS_PER_REFRESH 4096u

#define DECLARE(frac) \
    void lib_frac##frac##_Park(const parkinput_type *in, parkoutput_type *out); \
    void lib_frac##frac##_InvPark(const invparkinput_type *in, invparkoutput_type *out);

DECLARE(1)
DECLARE(16)
DECLARE(30)
DECLARE(31)

struct build {
    uint32_t frac;
    void (*park)(const parkinput_type *in, parkoutput_type *out);
    void (*invpark)(const invparkinput_type *in, invparkoutput_type *out);
    const char *park_name, *invpark_name;
};

#define BUILD(frac) \
    ((struct build){frac, lib_frac##frac##_Park, lib_frac##frac##_InvPark, "Park, " #frac " fraction bits", \
                    "InvPark, " #frac " fraction bits"})

static const struct build builds[] = {BUILD(1), BUILD(16), BUILD(30), BUILD(31)};

static bool park_differs(const struct build *build, const struct lib_vector *v)
{
    const parkinput_type in = {v->in[0], v->in[1], v->in[2], v->in[3]};
    const s32_pair_t expected = s32_park(in.ialpha, in.ibeta, in.cos, in.sin, build->frac);
    parkoutput_type out;

    build->park(&in, &out);
    return out.id != expected.x || out.iq != expected.y;
}

static bool invpark_differs(const struct build *build, const struct lib_vector *v)
{
    const invparkinput_type in = {v->in[0], v->in[1], v->in[2], v->in[3]};
    const s32_pair_t expected = s32_invpark(in.vd, in.vq, in.cos, in.sin, build->frac);
    invparkoutput_type out;

    build->invpark(&in, &out);
    return out.valpha != expected.x || out.vbeta != expected.y;
}

int main(void)
{
    (void)harness_begin();
    for (uint32_t which = 0; which < sizeof builds / sizeof builds[0]; which++) {
        const struct build *const build = &builds[which];
        uint32_t state = 1u + which;
        uint32_t park_wrong = 0u;
        uint32_t invpark_wrong = 0u;

        for (uint32_t index = 0; index < LIB_CASE_VECTORS; index++) {
            const struct lib_vector vector = lib_case_vector(index, &state);

            park_wrong += park_differs(build, &vector) ? 1u : 0u;
            invpark_wrong += invpark_differs(build, &vector) ? 1u : 0u;
            if (index % VECTORS_PER_REFRESH == 0u) {
                watchdog_refresh();
            }
        }
        harness_equal(build->park_name, park_wrong, 0u);
        harness_equal(build->invpark_name, invpark_wrong, 0u);
    }
    harness_end();
}
