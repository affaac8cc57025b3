/* SPDX-License-Identifier: MIT */
/* From a slot to an axis: first into a separate set, which is checked, then into the axis. */
#include <stddef.h>

#include "firmware/drive/adopt.h"
#include "firmware/drive/drive.h"
#include "firmware/drive/nvm.h"
#include "firmware/drive/requests.h"
#include "firmware/settings/features.h"

#define PARAMETERS_MOST 128u
#define HARMONIC_BYTES  12u

struct candidate {
    struct params params;
    struct tuning tuning;
    uint32_t seen[PARAMETERS_MOST / 32u]; /* a bit for each row of the table */
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

static bool same(const char *a, const char *b)
{
    while (*a != '\0' && *a == *b) {
        a++;
        b++;
    }
    return *a == *b;
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
        if (its != NULL && same(its, name)) {
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

/* What this image has instead is still what it begins with. */
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
    return !chosen && fault_choice_is_absent(cause, (enum reaction)r->value[0]);
}

bool nvm_is_foreign(const struct record *r, const struct axis *own)
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
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        c->choice[cause] = fault_class((enum fault)cause)->initial;
    }
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

struct outcome nvm_check(const struct params *p, struct tuning *t)
{
    const struct outcome problem = tuning_compute(p, t);
    return problem.error == ERROR_NONE ? tuning_check_motor(p) : problem;
}

/* The index counts in the encoder scale in effect: the set's scale comes first. Slow loop held. */
static void stored_take_over(struct axis *a, const struct candidate *c)
{
    a->params = c->params;
    a->nvm_afresh = false;
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        a->reactions.choice[cause] = c->choice[cause];
    }
    if (axis_fabric_doubted(a) || c->params.angle_source != PARAM_ANGLE_ENCODER) {
        return;
    }
    if (c->index_known || c->cogging.count > 0) {
        adopt_tuning(a, &c->tuning);
    }
    if (c->index_known && !a->start.aligned) { /* what was found in this run is newer */
        a->start.index_offset_q32 = c->index_offset_q32;
        a->start.index_known = true;
    }
    a->nvm_cogging = (struct nvm_cogging){c->cogging, c->cogging.count > 0};
}

void drive_load_at_boot(struct axis *a, const struct slots *s, struct nvm_report *k)
{
    *k = (struct nvm_report){.state = NVM_NOTHING, .problem = outcome_of(ERROR_NOTHING_STORED), .view = slots_look(s)};
    if (!k->view.any) {
        return;
    }
    struct candidate c;
    set_initial(&c);
    k->problem = outcome_of(read_records(&c, s, k));
    if (k->problem.error == ERROR_NONE) {
        c.tuning = a->tuning; /* padding included: an axis must hold no stack bytes */
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
