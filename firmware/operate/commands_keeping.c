/* SPDX-License-Identifier: MIT */
#include "firmware/drive/keeping.h"
#include "firmware/operate/answers.h"
#include "firmware/operate/commands_parts.h"
#include "firmware/operate/keeping_text.h"

void run_save(struct session *s, char *const *words)
{
    (void)words;
    struct saved report;
    const struct outcome outcome = drive_save(s->axis, s->slots, &report);
    answer(s, outcome);
    if (outcome.error == ERROR_NONE) {
        keeping_text_saved(&s->out, &report);
    }
}

void run_load(struct session *s, char *const *words)
{
    (void)words;
    struct kept kept;
    const struct outcome outcome = drive_load(s->axis, s->slots, &kept);
    if (kept.state == KEPT_NONE) {
        answer(s, outcome);
        keeping_text_damage(&s->out, &kept.view);
    } else {
        keeping_text_loaded(&s->out, &kept);
    }
}

void run_defaults(struct session *s, char *const *words)
{
    (void)words;
    answer(s, drive_defaults(s->axis));
}
