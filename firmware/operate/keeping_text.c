/* SPDX-License-Identifier: MIT */
#include "firmware/operate/keeping_text.h"

#include "firmware/operate/messages.h"

static void put_slot(struct text *t, uint32_t slot)
{
    text_put_char(t, (char)('A' + slot));
}

static void put_number(struct text *t, uint32_t number)
{
    text_put(t, ", save ");
    text_put_long(t, (int64_t)number);
}

void keeping_text_damage(struct text *t, const struct slots_view *v)
{
    for (uint32_t slot = 0; slot < SLOTS; slot++) {
        if (v->state[slot] == SLOT_DAMAGED) {
            text_put(t, "warning: slot ");
            put_slot(t, slot);
            text_put_line(t, v->any ? " is damaged, or its save was cut short; these may be the settings before it"
                                    : " is damaged, or its save was cut short");
        }
    }
}

static void put_refusal(struct text *t, const struct kept *k)
{
    text_put(t, "error: settings refused, nothing has changed: ");
    if (k->about[0] != '\0') {
        text_put(t, k->about);
        text_put(t, ": ");
    }
    for (const char *text = message_of_error(k->problem.error); *text != '\0'; text++) {
        if (*text == '@') {
            text_put_int(t, k->problem.value);
        } else {
            text_put_char(t, *text);
        }
    }
    text_put_line(t, "");
}

static void put_differences(struct text *t, const struct kept *k)
{
    if (k->unknown > 0u) {
        text_put_int(t, (int32_t)k->unknown);
        text_put(t, " stored records are unknown to this firmware and were passed over, the first is ");
        text_put_line(t, k->first_unknown);
    }
    if (k->missing > 0u) {
        text_put_int(t, (int32_t)k->missing);
        text_put_line(t, " parameters are not stored and have their initial values");
    }
}

void keeping_text_loaded(struct text *t, const struct kept *k)
{
    if (k->state == KEPT_NONE) {
        text_put_line(t, "settings: none stored, initial values");
    } else {
        text_put(t, "settings: slot ");
        put_slot(t, k->view.newest);
        put_number(t, k->view.number[k->view.newest]);
        text_put_line(t, k->state == KEPT_LOADED ? ", loaded" : "");
    }
    keeping_text_damage(t, &k->view);
    if (k->state == KEPT_REFUSED) {
        put_refusal(t, k);
    } else if (k->state == KEPT_LOADED) {
        put_differences(t, k);
    }
}

/* Saves alternate between the slots: every second one has written each page of this slot. */
void keeping_text_saved(struct text *t, const struct saved *s)
{
    text_put(t, "slot ");
    put_slot(t, s->slot);
    put_number(t, s->number);
    text_put(t, "; writes of its pages so far: about ");
    text_put_long(t, ((int64_t)s->number + 1) / 2);
    text_put_line(t, "");
    if (s->worn) {
        text_put_line(t, "warning: eNVM: a page has been written more often than it is made for");
    }
    if (s->cogging_dropped) {
        text_put_line(
            t, "warning: the cogging map is not stored: the encoder's index, from which it counts, was not seen");
    }
}
