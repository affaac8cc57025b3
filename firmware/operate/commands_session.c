/* SPDX-License-Identifier: MIT */
#include "firmware/operate/commands.h"
#include "firmware/settings/config.h"

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

static void run_version(struct session *s, const struct arguments *a)
{
    (void)a;
    text_put(&s->out, "mssfoc " CONFIG_VERSION "\n");
}

/* clang-format off */
const struct command commands_version[] = {
    {"version", "", "of this firmware", .run = run_version},
};
/* clang-format on */
