/* SPDX-License-Identifier: MIT */
#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"
#include "firmware/settings/config.h"

/* The Makefile knows (.ci/commit): always as long, so that nothing behind it moves. */
#ifndef CONFIG_COMMIT
#define CONFIG_COMMIT "unknown"
#endif

/* The answer already uses the mode of the next line. */
static void run_machine(struct session *s, const struct arguments *a)
{
    s->machine = a->value[1] == 0;
    answer(s, OUTCOME_OK);
}

/* clang-format off */
const struct command commands_machine[] = {
    {"machine", " on|off", "no echo, no prompt; a line with '.' behind each answer, for programs",
     {ARGUMENT_CHOICE}, .run = run_machine},
};
/* clang-format on */

/* A line: what it is, and what of it was chosen when it was built. */
static void run_version(struct session *s, const struct arguments *a)
{
    (void)a;
    text_put(&s->out, "mssfoc " CONFIG_VERSION ", commit " CONFIG_COMMIT);
    text_print(&s->out, ", PWM %u Hz, dead time %u ns", (uint32_t)CONFIG_PWM_HZ, (uint32_t)CONFIG_DEAD_TIME_NS);
    const char *before = ", without ";
    for (uint32_t n = 0; n < FEATURE_COUNT; n++) {
        if (!FEATURE_IS_IN(n)) {
            text_print(&s->out, "%s%s", before, message_of_feature((enum feature)n));
            before = ", ";
        }
    }
    text_put(&s->out, FEATURES_LEFT_OUT == 0u ? ", all features\n" : "\n");
}

/* clang-format off */
const struct command commands_version[] = {
    {"version", "", "of this firmware: its commit, and what was chosen when it was built", .run = run_version},
};
/* clang-format on */
