/* SPDX-License-Identifier: MIT */
/* From an axis to a slot, page by page. */
#include <stddef.h>

#include "drivers/cortex/cpu.h"
#include "firmware/drive/drive.h"
#include "firmware/drive/nvm.h"
#include "firmware/monitor/device.h"
#include "firmware/source/rotor.h"
#include "lib/q15.h"

#define WAKES_MOST 1000u /* of the thread, within which the slow loop should have advanced its clock: at least 12 ms */

struct saving {
    struct axis *axis;
    struct slot_writer writer;
    enum error problem;
    bool worn;
};

static const enum error error_of_envm[ENVM_RESULTS] = {
    [ENVM_DONE] = ERROR_NONE,
    [ENVM_WORN] = ERROR_NONE,
    [ENVM_NOT_GRANTED] = ERROR_ENVM_NOT_GRANTED,
    [ENVM_TIMED_OUT] = ERROR_ENVM_TIMED_OUT,
    [ENVM_DENIED] = ERROR_ENVM_DENIED,
    [ENVM_BUSY] = ERROR_ENVM_BUSY,
    [ENVM_LOCKED] = ERROR_ENVM_LOCKED,
    [ENVM_ERASE_FAILED] = ERROR_ENVM_ERASE,
    [ENVM_WRITE_FAILED] = ERROR_ENVM_WRITE,
    [ENVM_VERIFY_FAILED] = ERROR_ENVM_VERIFY,
};

/* Programming a page serves the watchdog, so only while the slow loop runs. This also lets pending interrupts run. */
static bool slow_loop_lives(const struct axis *a)
{
    const uint32_t before_ms = a->time_ms;
    for (uint32_t wake = 0; wake < WAKES_MOST; wake++) {
        cpu_wait_for_interrupt();
        if (a->time_ms != before_ms) {
            return true;
        }
    }
    return false;
}

/* Conversions go unanswered while a page is programmed: the slow loop must not take that for a stopped current loop. */
static void excuse(struct axis *a)
{
    a->paced_ms = a->time_ms;
}

static void program(struct saving *x)
{
    if (x->problem != ERROR_NONE) {
        return;
    }
    if (!slow_loop_lives(x->axis)) {
        x->problem = ERROR_BUSY;
        return;
    }
    const uint32_t mask = cpu_irq_save();
    const enum envm_result result = envm_program_page(x->writer.page_offset, x->writer.page);
    excuse(x->axis);
    if (x->axis->beside != NULL) {
        excuse(x->axis->beside);
    }
    cpu_irq_restore(mask);
    x->problem = error_of_envm[result];
    x->worn = x->worn || result == ENVM_WORN;
}

static void storing_put(struct saving *x, const void *bytes, uint32_t count)
{
    const uint8_t *const b = bytes;
    for (uint32_t n = 0; n < count && x->problem == ERROR_NONE; n++) {
        if (slot_put(&x->writer, b[n])) {
            program(x);
            slot_next(&x->writer);
        }
    }
}

static void put_record(struct saving *x, uint32_t kind, const char *name, const void *value, uint32_t bytes)
{
    uint8_t head[RECORD_HEAD_BYTES];
    const uint32_t name_bytes = record_name_bytes(name);
    if (!slot_has_room(&x->writer, RECORD_HEAD_BYTES + name_bytes + bytes) && x->problem == ERROR_NONE) {
        x->problem = ERROR_SAVE_FULL;
    }
    record_head(head, kind, name, bytes);
    storing_put(x, head, sizeof head);
    storing_put(x, name, name_bytes);
    storing_put(x, value, bytes);
}

static void put_parameters(struct saving *x)
{
    for (size_t n = 0; n < param_count; n++) {
        const int32_t value = param_get(&x->axis->params, &param_table[n]);
        put_record(x, RECORD_PARAMETER, param_table[n].name, &value, sizeof value);
    }
}

static void put_reactions(struct saving *x)
{
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        const char *const name = nvm_name_of_fault((enum fault)cause);
        if (name != NULL) {
            put_record(x, RECORD_REACTION, name, &x->axis->reactions.choice[cause], 1u);
        }
    }
}

/* What the newest slot has of another image, which may come back. */
static void put_foreign(struct saving *x, const struct slots *s, const struct slots_view *view)
{
    if (!view->any || x->axis->nvm_afresh) {
        return;
    }
    struct record_reader reader = records_read(slots_records(s, view->newest), view->records_bytes[view->newest]);
    struct record r;
    while (record_next(&reader, &r)) {
        if (nvm_is_foreign(&r, x->axis)) {
            put_record(x, r.kind, r.name, r.value, r.value_bytes);
        }
    }
}

/* Both are relative to the index, in the scale they were learned in: is that the set's scale? */
static bool of_this_encoder(const struct axis *a, const struct tuning *set)
{
    return rotor_has_encoder(a) && set->angle_source == PARAM_ANGLE_ENCODER && !axis_fabric_doubted(a) &&
           set->encoder_scale_q32 == a->tuning.encoder_scale_q32 && set->encoder_counts == a->tuning.encoder_counts &&
           !identify_in_rotor_frame(&a->identify);
}

static void put_index(struct saving *x)
{
    const struct start *const s = &x->axis->start;
    if (s->index_known) {
        put_record(x, RECORD_INDEX, "index", &s->index_offset_q32, sizeof s->index_offset_q32);
    }
}

/* True if there is a map but nothing to count it from. */
static bool put_cogging(struct saving *x)
{
    const struct axis *const a = x->axis;
    struct cogging_map map = a->nvm_cogging.pending ? a->nvm_cogging.map : a->motion.cogging;
    if (map.count == 0) {
        return false;
    }
    if (!a->nvm_cogging.pending) {
        if ((encoder_status(&a->fabric->encoder) & ENCODER_STATUS_INDEX_SEEN) == 0u) {
            return true;
        }
        nvm_rotate_cogging(&map, encoder_index(&a->fabric->encoder) * a->tuning.turn_scale_q32);
    }
    put_record(x, RECORD_COGGING, "cogging", map.harmonics, (uint32_t)map.count * sizeof map.harmonics[0]);
    return false;
}

/* Programming keeps the core from every interrupt. */
static bool is_at_rest(const struct axis *a)
{
    return drive_is_off(a) && q15_abs(a->speed.speed_rpm_q4) <= AXIS_STANDSTILL_RPM_Q4;
}

static struct outcome state_forbids(const struct axis *a, struct tuning *set)
{
    if (!drive_is_off(a)) {
        return outcome_of(ERROR_SAVE_WHILE_ON);
    }
    if (device_fault() == FAULT_CLOCK) {
        return outcome_of(ERROR_ENVM_CLOCK);
    }
    if (q15_abs(a->speed.speed_rpm_q4) > AXIS_STANDSTILL_RPM_Q4) {
        return outcome_of(ERROR_TURNING);
    }
    if (a->beside != NULL && !is_at_rest(a->beside)) {
        return outcome_of(ERROR_SAVE_BESIDE_ON);
    }
    return nvm_check(&a->params, set);
}

struct outcome drive_may_save(const struct axis *a)
{
    struct tuning unused = a->tuning;
    return state_forbids(a, &unused);
}

/* The head makes it a slot, so it comes last. */
static void storing_finish(struct saving *x)
{
    if (slot_pad(&x->writer)) {
        program(x);
        slot_next(&x->writer);
    }
    slot_head(&x->writer);
    program(x);
}

/* Checks the array itself, not what was sent to it. */
static bool is_stored(const struct slots *s, const struct slot_writer *w)
{
    const struct slots_view view = slots_look(s);
    return view.any && view.newest == w->slot && view.number[w->slot] == w->number;
}

struct outcome drive_save(struct axis *a, const struct slots *s, struct saved *report)
{
    struct tuning set = a->tuning;
    const struct outcome forbidden = state_forbids(a, &set);
    if (forbidden.error != ERROR_NONE) {
        return forbidden;
    }
    struct saving x = {.axis = a};
    const struct slots_view view = slots_look(s);
    slot_begin(&x.writer, s, &view);
    put_parameters(&x);
    put_reactions(&x);
    bool dropped = a->motion.cogging.count > 0;
    if (of_this_encoder(a, &set)) {
        put_index(&x);
        dropped = put_cogging(&x);
    }
    put_foreign(&x, s, &view);
    storing_finish(&x);
    *report = (struct saved){x.writer.slot, x.writer.number, x.worn, dropped};
    if (x.problem == ERROR_NONE && !is_stored(s, &x.writer)) {
        x.problem = ERROR_ENVM_VERIFY;
    }
    a->nvm_afresh = a->nvm_afresh && x.problem != ERROR_NONE;
    return outcome_of(x.problem);
}
