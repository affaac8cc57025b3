/* SPDX-License-Identifier: MIT */
/* A start's knowledge of the encoder, and switching the bridge on. */
#include "firmware/axis/axis.h"
#include "firmware/drive/start.h"
#include "firmware/source/rotor.h"

void start_forget(struct axis *a)
{
    a->start.aligned = false;
    a->start.index_known = false;
    a->start.remembered = false;
    a->start.rescaled = true;
    a->start.wired = false;
}

static bool counts_lead(enum loop_source source)
{
    return source == LOOP_ENCODER || source == LOOP_FORCED;
}

void start_follow(struct axis *a, enum loop_source source)
{
    const enum loop_source before = a->loop.source;
    current_loop_off(&a->loop, a->fabric);
    if (current_loop_select(&a->loop, a->fabric, source)) {
        if (counts_lead(source) && !counts_lead(before)) { /* until now the PLL tracked another source */
            current_loop_place(&a->loop, encoder_latched(&a->fabric->encoder) * a->loop.encoder_scale_q32, 0);
        }
        current_loop_on(&a->loop, a->fabric, &a->tuning);
    } else {
        fault_raise(a, FAULT_FABRIC); /* the gate does not let go */
    }
}

void start_open_gates(struct axis *a)
{
    struct start *const s = &a->start;
    const bool known = s->aligned && !s->recheck_wiring;
    if (rotor_is_sensorless(a)) {
        start_follow(a, LOOP_OBSERVER);
    } else {
        start_follow(a, known ? LOOP_ENCODER : LOOP_FORCED);
    }
    wiring_start(&s->wiring, false);
    s->phase = !known ? START_WIRING : s->remembered ? START_CONFIRM : START_FOLLOW;
}
