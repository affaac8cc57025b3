/* SPDX-License-Identifier: MIT */
#include "firmware/drive/nvm.h"

#include <stddef.h>

#include "drivers/cortex/cpu.h"
#include "firmware/drive/drive.h"
#include "firmware/drive/requests.h"
#include "firmware/drive/retune.h"
#include "firmware/monitor/device.h"
#include "firmware/settings/features.h"
#include "firmware/source/rotor.h"
#include "lib/q15.h"
#include "lib/trig.h"

#define FAULT_STORED(number, name, code, allowed, initial, retry, stored, ...) [FAULT_##name] = (stored),

const char *nvm_name_of_fault(enum fault cause)
{
    static const char *const names[FAULT_COUNT] = {FAULTS(FAULT_STORED)};
    return cause < FAULT_COUNT ? names[cause] : NULL;
}

struct outcome drive_defaults(struct axis *a)
{
    if (!drive_is_off(a)) {
        return outcome_of(ERROR_DRIVE_IS_ON);
    }
    params_init(&a->params);
    a->nvm_from_defaults = true;
    fault_default_reactions(a->reactions.choice);
    return OUTCOME_OK;
}

/* a cos k(x + f) + b sin k(x + f) as a function of x: a rotation of (a, b) by k f. */
static void nvm_rotate_cogging(struct cogging_map *m, uint32_t from_q32)
{
    for (int32_t n = 0; n < m->count; n++) {
        struct cogging_harmonic *const h = &m->harmonics[n];
        const cossin_t turn = cossin_q15(h->order * from_q32);
        const int64_t a = h->cos_q23;
        const int64_t b = h->sin_q23;
        h->cos_q23 = (int32_t)((a * turn.cos + b * turn.sin + (1 << 14)) >> 15);
        h->sin_q23 = (int32_t)((b * turn.cos - a * turn.sin + (1 << 14)) >> 15);
    }
}

void drive_restore_cogging(struct axis *a)
{
    struct nvm_cogging *const k = &a->nvm_cogging;
    if (!k->pending || !rotor_has_encoder(a) ||
        (encoder_status(&a->fabric->encoder) & ENCODER_STATUS_INDEX_SEEN) == 0u) {
        return;
    }
    const uint32_t held = request_hold();
    nvm_rotate_cogging(&k->map, 0u - encoder_index(&a->fabric->encoder) * a->tuning.turn_scale_q32);
    cogging_set_fade(&k->map, a->params.speed_bw_hz);
    a->motion.cogging = k->map;
    k->pending = false;
    request_release(held);
}

/* ==== loading ==== */

/* From a slot to an axis: first into a separate set, which is checked, then into the axis. */

#define PARAMETERS_MAX 128u
#define HARMONIC_BYTES 12u

struct candidate {
    struct params params;
    struct tuning tuning;
    uint32_t seen[PARAMETERS_MAX / 32u]; /* a bit for each row of the table */
    uint8_t choice[FAULT_COUNT];
    bool index_known;
    uint32_t index_offset_q32;
    struct cogging_map cogging;
};

static void copy_name(char *to, const char *from)
{
    uint32_t n = 0;
    for (; from[n] != '\0'; n++) {
        to[n] = from[n];
    }
    to[n] = '\0';
}

static void pass_over(struct nvm_report *k, const struct record *r)
{
    if (k->unknown == 0u) {
        copy_name(k->first_unknown, r->name);
    }
    k->unknown++;
}

static enum error take_parameter(struct candidate *c, const struct record *r)
{
    if (r->value_bytes != 4u) {
        return ERROR_STORED_FORMAT;
    }
    const struct param_info *const info = param_find(r->name);
    const int32_t value = record_word(r, 0);
    if (value < info->min || value > info->max) {
        return ERROR_STORED_RANGE;
    }
    param_set(&c->params, info, value);
    const uint32_t row = (uint32_t)(info - param_table);
    c->seen[row / 32u] |= 1u << (row % 32u);
    return ERROR_NONE;
}

static enum fault fault_named(const char *name)
{
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        const char *const its = nvm_name_of_fault((enum fault)cause);
        if (its != NULL && text_equal(its, name)) {
            return (enum fault)cause;
        }
    }
    return FAULT_COUNT;
}

static enum error take_reaction(struct candidate *c, const struct record *r)
{
    const enum fault cause = fault_named(r->name);
    if (r->value_bytes != 1u) {
        return ERROR_STORED_FORMAT;
    }
    if (r->value[0] >= REACTION_COUNT || ((fault_class(cause)->allowed >> r->value[0]) & 1u) == 0u) {
        return ERROR_REACTION_NOT_ALLOWED;
    }
    c->choice[cause] = r->value[0];
    return ERROR_NONE;
}

/* A record of another image is kept as long as its parameter here has its initial value. */
static bool parameter_is_foreign(const struct record *r, const struct params *own)
{
    const struct param_info *const info = param_find(r->name);
    if (info == NULL || r->value_bytes != 4u) {
        return info == NULL;
    }
    const int32_t value = record_word(r, 0);
    const bool chosen = own != NULL && param_get(own, info) != info->initial;
    return !chosen && value >= info->min && value <= info->max && features_allow(info, value).error != ERROR_NONE;
}

static bool reaction_is_foreign(const struct record *r, const struct reactions *own)
{
    const enum fault cause = fault_named(r->name);
    if (cause == FAULT_COUNT || r->value_bytes != 1u) {
        return cause == FAULT_COUNT;
    }
    const bool chosen = own != NULL && own->choice[cause] != fault_class(cause)->initial;
    return !chosen && fault_reaction_is_absent(cause, (enum reaction)r->value[0]);
}

/*
 * True if this image does not use a stored record; with `own`, whether a save of that axis copies it: not if a different value
 * has been set here. Thread.
 */
static bool nvm_is_foreign(const struct record *r, const struct axis *own)
{
    switch (r->kind) {
    case RECORD_PARAMETER:
        return parameter_is_foreign(r, own != NULL ? &own->params : NULL);
    case RECORD_REACTION:
        return reaction_is_foreign(r, own != NULL ? &own->reactions : NULL);
    case RECORD_INDEX:
    case RECORD_COGGING:
        return own != NULL && !FEATURE_IN(ENCODER);
    default:
        return true;
    }
}

static enum error take_cogging(struct candidate *c, const struct record *r)
{
    const uint32_t count = r->value_bytes / HARMONIC_BYTES;
    if (r->value_bytes != count * HARMONIC_BYTES || count > COGGING_HARMONICS) {
        return ERROR_STORED_FORMAT;
    }
    c->cogging.count = (int32_t)count;
    for (uint32_t n = 0; n < count; n++) {
        c->cogging.harmonics[n] = (struct cogging_harmonic){(uint32_t)record_word(r, 3u * n),
                                                            record_word(r, 3u * n + 1u), record_word(r, 3u * n + 2u)};
    }
    return ERROR_NONE;
}

static enum error stored_take(struct candidate *c, struct nvm_report *k, const struct record *r)
{
    if (nvm_is_foreign(r, NULL)) {
        pass_over(k, r);
        return ERROR_NONE;
    }
    switch (r->kind) {
    case RECORD_PARAMETER:
        return take_parameter(c, r);
    case RECORD_REACTION:
        return take_reaction(c, r);
    case RECORD_COGGING:
        return take_cogging(c, r);
    case RECORD_INDEX:
        c->index_known = r->value_bytes == 4u;
        c->index_offset_q32 = c->index_known ? (uint32_t)record_word(r, 0) : 0u;
        return c->index_known ? ERROR_NONE : ERROR_STORED_FORMAT;
    default:
        return ERROR_NONE;
    }
}

static void set_initial(struct candidate *c)
{
    *c = (struct candidate){.index_known = false};
    params_init(&c->params);
    fault_default_reactions(c->choice);
}

static uint32_t count_missing(const struct candidate *c)
{
    uint32_t missing = 0;
    for (uint32_t row = 0; row < param_count; row++) {
        missing += (c->seen[row / 32u] >> (row % 32u)) & 1u ? 0u : 1u;
    }
    return missing;
}

static enum error read_records(struct candidate *c, const struct slots *s, struct nvm_report *k)
{
    struct record_reader reader = records_read(slots_records(s, k->view.newest), k->view.records_bytes[k->view.newest]);
    struct record r;
    while (record_next(&reader, &r)) {
        const enum error problem = stored_take(c, k, &r);
        if (problem != ERROR_NONE) {
            copy_name(k->about, r.name);
            return problem;
        }
    }
    k->missing = count_missing(c);
    return reader.broken ? ERROR_STORED_FORMAT : ERROR_NONE;
}

/* Checks a set for consistency as `on` does; `t` is then its tuning. Thread. */
static struct outcome nvm_check(const struct params *p, struct tuning *t)
{
    const struct outcome problem = tuning_compute(p, t);
    return problem.error == ERROR_NONE ? tuning_check_motor(p) : problem;
}

/* The index is in the encoder scale in effect, so the set's scale comes first. Slow loop masked. */
static void stored_take_over(struct axis *a, const struct candidate *c)
{
    a->params = c->params;
    a->nvm_from_defaults = false;
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        a->reactions.choice[cause] = c->choice[cause];
    }
    if (axis_fabric_is_untrusted(a) || !source_has((uint32_t)c->params.angle_source, SOURCE_COUNTS)) {
        return;
    }
    if (c->index_known || c->cogging.count > 0) {
        apply_tuning(a, &c->tuning);
    }
    if (c->index_known && !a->start.aligned) { /* the offset found in this run is newer */
        a->start.index_offset_q32 = c->index_offset_q32;
        a->start.index_known = true;
    }
    a->nvm_cogging = (struct nvm_cogging){c->cogging, c->cogging.count > 0};
}

void drive_load_at_boot(struct axis *a, const struct slots *s, struct nvm_report *k)
{
    *k = (struct nvm_report){.state = NVM_NOTHING, .problem = outcome_of(ERROR_NOTHING_STORED), .view = slots_check(s)};
    if (!k->view.any) {
        return;
    }
    struct candidate c;
    set_initial(&c);
    k->problem = outcome_of(read_records(&c, s, k));
    if (k->problem.error == ERROR_NONE) {
        c.tuning = a->tuning; /* padding included: no stale stack bytes in an axis */
        k->problem = nvm_check(&c.params, &c.tuning);
    }
    k->state = k->problem.error == ERROR_NONE ? NVM_LOADED : NVM_REFUSED;
    if (k->state == NVM_LOADED) {
        const uint32_t held = request_hold();
        stored_take_over(a, &c);
        request_release(held);
    }
}

struct outcome drive_load(struct axis *a, const struct slots *s, struct nvm_report *k)
{
    if (!drive_is_off(a)) {
        *k = (struct nvm_report){.state = NVM_NOTHING};
        return outcome_of(ERROR_DRIVE_IS_ON);
    }
    drive_load_at_boot(a, s, k);
    return k->problem;
}

/* ==== saving ==== */

/* From an axis to a slot, page by page. */

#define WAKES_MAX 1000u /* wake-ups of the thread in which the slow loop's clock must advance: at least 12 ms */

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
static bool slow_loop_is_running(const struct axis *a)
{
    const uint32_t before_ms = a->time_ms;
    for (uint32_t wake = 0; wake < WAKES_MAX; wake++) {
        cpu_wait_for_interrupt();
        if (a->time_ms != before_ms) {
            return true;
        }
    }
    return false;
}

/* No conversions are served while a page is programmed: the slow loop must not report a stopped current loop. */
static void restart_rate_check(struct axis *a)
{
    a->rate_chosen_ms = a->time_ms;
}

static void program(struct saving *x)
{
    if (x->problem != ERROR_NONE) {
        return;
    }
    if (!slow_loop_is_running(x->axis)) {
        x->problem = ERROR_BUSY;
        return;
    }
    const uint32_t mask = cpu_irq_save();
    const enum envm_result result = envm_program_page(x->writer.page_offset, x->writer.page);
    restart_rate_check(x->axis);
    if (x->axis->other_axis != NULL) {
        restart_rate_check(x->axis->other_axis);
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
    uint8_t head[RECORD_HEADER_BYTES];
    const uint32_t name_bytes = (uint32_t)text_length(name);
    if (!slot_has_room(&x->writer, RECORD_HEADER_BYTES + name_bytes + bytes) && x->problem == ERROR_NONE) {
        x->problem = ERROR_SAVE_FULL;
    }
    record_header(head, kind, name, bytes);
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

/* Copies records of another image, which may be flashed again. */
static void put_foreign(struct saving *x, const struct slots *s, const struct slots_view *view)
{
    if (!view->any || x->axis->nvm_from_defaults) {
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

/* Index angle and cogging map are in the encoder scale they were learned in: is that the set's scale? */
static bool of_this_encoder(const struct axis *a, const struct tuning *set)
{
    return rotor_has_encoder(a) && set->angle_source == a->tuning.angle_source && !axis_fabric_is_untrusted(a) &&
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

/* True if there is a map but no index to refer it to. */
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

/* Programming blocks all interrupts. */
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
    if (a->other_axis != NULL && !is_at_rest(a->other_axis)) {
        return outcome_of(ERROR_SAVE_BESIDE_ON);
    }
    return nvm_check(&a->params, set);
}

struct outcome drive_may_save(const struct axis *a)
{
    struct tuning unused = a->tuning;
    return state_forbids(a, &unused);
}

/* The header makes the slot valid, so it is written last. */
static void storing_finish(struct saving *x)
{
    if (slot_pad(&x->writer)) {
        program(x);
        slot_next(&x->writer);
    }
    slot_header(&x->writer);
    program(x);
}

/* Verifies the flash array itself. */
static bool is_stored(const struct slots *s, const struct slot_writer *w)
{
    const struct slots_view view = slots_check(s);
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
    const struct slots_view view = slots_check(s);
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
    a->nvm_from_defaults = a->nvm_from_defaults && x.problem != ERROR_NONE;
    return outcome_of(x.problem);
}
