/* SPDX-License-Identifier: MIT */
#include "firmware/drive/nvm.h"
#include "firmware/drive/reaction.h"
#include "firmware/operate/modbus_functions.h"
#include "firmware/operate/modbus_objects.h"
#include "firmware/operate/quantities.h"
#include "firmware/settings/config.h"
#include "firmware/settings/features.h"
#include "lib/q15.h"

#define DEVICE_TYPE 0x00020192u
#define PRODUCT     0x6D666F63u
#define DRIVE_MODES (0x30Cu | (FEATURE_IN(POSITION) ? 0xA1u : 0u)) /* pv, tq, csv, cst; pp, hm, csp */
#define NO_SOURCE   UINT32_MAX

/* One value, wherever it comes from. */
struct place {
    enum { NOWHERE, OBJECT, REACTION, PARAM } kind;
    uint32_t number; /* enum modbus_object_id, enum fault, or row of param_table */
    uint32_t words;
    bool writable;
};

/* The objects that may be written. */
struct writable {
    struct cia402_setpoints setpoints;
    uint32_t source; /* of the angle */
    uint32_t store, restore;
};

/* What a request sees: values of one instant. */
struct view {
    const struct axis *axis;
    const struct cia402 *cia402;
    struct drive_status now;
    struct writable writable;
};

/* The drive's values after a write; adopted only once all of it has been checked. */
struct change {
    struct params params;
    uint8_t choice[FAULT_COUNT];
    uint32_t params_changed, choices_changed;
    struct outcome absent; /* what one of them needs and the build does not have */
    struct writable writable;
    uint32_t setpoints; /* a bit for each that is among them, by enum modbus_object_id */
};

/* ---- places ---- */

enum { RO, RW };

/* clang-format off */
#define OBJECT_ROW(at, index, type, access, name, unit, what, value) {at, MODBUS_##type, access == RW},
const struct modbus_object modbus_objects[OBJECT_COUNT] = {
    MODBUS_OBJECTS(OBJECT_ROW)
};
/* clang-format on */

static struct place object_at(uint32_t at)
{
    for (uint32_t n = 0; n < OBJECT_COUNT; n++) {
        const struct modbus_object *const o = &modbus_objects[n];
        if (o->at == at) {
            return (struct place){OBJECT, n, o->type >= MODBUS_U32 ? 2u : 1u, o->writable};
        }
    }
    return (struct place){.kind = NOWHERE};
}

/* The value that begins at a register; NOWHERE in the middle of one, or where there is none. */
static struct place place_at(uint32_t at)
{
    const uint32_t param = (at - MODBUS_PARAMS) / 2u;
    const uint32_t fault = at - MODBUS_REACTIONS;
    if (at >= MODBUS_PARAMS && param < param_count && at % 2u == 0u) {
        return (struct place){PARAM, param, 2, true};
    }
    if (at >= MODBUS_REACTIONS && fault < FAULT_COUNT) {
        return (struct place){REACTION, fault, 1, true};
    }
    return object_at(at);
}

/* ---- reading ---- */

static int32_t per_mille_of_rated(const struct axis *a, int32_t q15)
{
    const int64_t per_mille = (int64_t)quantity_milliamp(a, q15) * 1000 / a->params.i_rated_ma;
    return (int32_t)q15_clamp((int32_t)(per_mille > INT16_MAX ? INT16_MAX : per_mille), INT16_MIN, INT16_MAX);
}

/* "1.2.3" as 0x00010203. */
static uint32_t revision(void)
{
    uint32_t number = 0;
    uint32_t part = 0;
    for (const char *c = CONFIG_VERSION; *c != '\0'; c++) {
        if (*c == '.') {
            number = (number | part) << 8;
            part = 0;
        } else {
            part = part * 10u + (uint32_t)(*c - '0');
        }
    }
    return number | part;
}

/* In the unit of the table; 32 bits of it. */
static uint32_t get_object(const struct view *v, uint32_t object)
{
    const struct axis *const axis = v->axis;
    const struct cia402 *const cia402 = v->cia402;
    const struct drive_status *const now = &v->now;
    const struct fault_snapshot *const past = &axis->faults.snapshot;
    const struct writable *const w = &v->writable;
    /* clang-format off */
    switch ((enum modbus_object_id)object) {
#define OBJECT_VALUE(at, index, type, access, name, unit, what, value) \
    case OBJECT_##name: \
        return (uint32_t)(value);
        MODBUS_OBJECTS(OBJECT_VALUE)
    default:
        return 0;
    }
    /* clang-format on */
}

static uint32_t get_place(const struct view *v, const struct place *p)
{
    if (p->kind == PARAM) {
        return (uint32_t)param_get(&v->axis->params, &param_table[p->number]);
    }
    return p->kind == REACTION ? v->axis->reactions.choice[p->number] : get_object(v, p->number);
}

static void put_words(uint8_t *bytes, uint32_t value, uint32_t words)
{
    for (uint32_t n = 2u * words; n > 0u; n--) {
        bytes[n - 1u] = (uint8_t)value;
        value >>= 8;
    }
}

enum modbus_exception modbus_read(const struct modbus_drive *d, uint32_t at, uint32_t count, uint8_t *bytes)
{
    const struct view view = {d->axis,
                              &d->cia402,
                              drive_status(d->axis),
                              {.setpoints = d->cia402.setpoints, .source = d->axis->tuning.angle_source}};
    for (uint32_t done = 0; done < count;) {
        const struct place p = place_at(at + done);
        if (p.kind == NOWHERE || done + p.words > count) {
            return MODBUS_ILLEGAL_ADDRESS;
        }
        put_words(&bytes[2u * done], get_place(&view, &p), p.words);
        done += p.words;
    }
    return MODBUS_FINE;
}

/* ---- writing ---- */

/* Two's complement, of 16 bits what the type says. */
static int32_t get_value(const uint8_t *bytes, const struct place *p)
{
    const uint32_t high = ((uint32_t)bytes[0] << 8) | bytes[1];
    if (p->words == 2u) {
        return (int32_t)((high << 16) | ((uint32_t)bytes[2] << 8) | bytes[3]);
    }
    return p->kind == OBJECT && modbus_objects[p->number].type == MODBUS_I16 ? (int16_t)high : (int32_t)high;
}

static enum modbus_exception change_param(struct change *c, uint32_t number, int32_t value)
{
    const struct param_info *const info = &param_table[number];
    if (value < info->min || value > info->max) {
        return MODBUS_ILLEGAL_VALUE;
    }
    c->absent = c->absent.error != ERROR_NONE ? c->absent : features_allow(info, value);
    param_set(&c->params, info, value);
    c->params_changed++;
    return MODBUS_FINE;
}

static enum modbus_exception change_choice(struct change *c, uint32_t fault, int32_t choice)
{
    if (fault_choice_is_absent((enum fault)fault, (enum reaction)choice)) {
        c->absent = feature_absent(FEATURE_SENSORLESS);
        return MODBUS_FINE; /* refused as a whole, with that reason */
    }
    if (choice >= REACTION_COUNT || ((fault_class((enum fault)fault)->allowed >> choice) & 1u) == 0u) {
        return MODBUS_ILLEGAL_VALUE;
    }
    c->choice[fault] = (uint8_t)choice;
    c->choices_changed++;
    return MODBUS_FINE;
}

static void set_object(struct writable *w, uint32_t object, int32_t value)
{
    /* clang-format off */
    switch ((enum modbus_object_id)object) {
#define WRITE_RO(name, place)
#define WRITE_RW(name, place) \
    case OBJECT_##name: \
        place = (__typeof__(place))value; \
        break;
#define OBJECT_WRITE(at, index, type, access, name, unit, what, value) WRITE_##access(name, value)
        MODBUS_OBJECTS(OBJECT_WRITE)
    default:
        break;
    }
    /* clang-format on */
}

/* Actions that must not happen by accident need a code word. */
static enum modbus_exception change_object(struct change *c, uint32_t object, int32_t value)
{
    const struct writable *const w = &c->writable;
    set_object(&c->writable, object, value);
    if (object <= OBJECT_homing_method) {
        c->setpoints |= 1u << object;
    }
    const bool illegal = (object == OBJECT_store && w->store != MODBUS_SAVE) ||
                         (object == OBJECT_restore && w->restore != MODBUS_LOAD) ||
                         (object == OBJECT_angle_source && w->source > PARAM_ANGLE_HALL);
    return illegal ? MODBUS_ILLEGAL_VALUE : MODBUS_FINE;
}

static enum modbus_exception change_value(struct change *c, const struct place *p, int32_t value)
{
    if (p->kind == PARAM) {
        return change_param(c, p->number, value);
    }
    return p->kind == REACTION ? change_choice(c, p->number, value) : change_object(c, p->number, value);
}

static enum modbus_exception gather_change(struct change *c, uint32_t at, uint32_t count, const uint8_t *bytes)
{
    for (uint32_t done = 0; done < count;) {
        const struct place p = place_at(at + done);
        if (p.kind == NOWHERE || !p.writable || done + p.words > count) {
            return MODBUS_ILLEGAL_ADDRESS;
        }
        const enum modbus_exception wrong = change_value(c, &p, get_value(&bytes[2u * done], &p));
        if (wrong != MODBUS_FINE) {
            return wrong;
        }
        done += p.words;
    }
    return MODBUS_FINE;
}

/*
 * Checks several parameters as switching on would; a single one, as on the console, only against its range. Not inline: its
 * tuning would stand on the stack while settings are stored.
 */
static __attribute__((noinline)) bool go_together(const struct change *c, const struct axis *a)
{
    if (c->params_changed < 2u) {
        return true;
    }
    struct tuning unused = a->tuning;
    return tuning_compute(&c->params, &unused).error == ERROR_NONE && tuning_check_emf(&c->params).error == ERROR_NONE;
}

static enum modbus_exception judge_change(const struct change *c, const struct axis *a)
{
    if (c->setpoints != 0u && !cia402_allows(&c->writable.setpoints, &c->params)) {
        return MODBUS_ILLEGAL_VALUE;
    }
    if (c->params_changed + c->choices_changed > 0u && !drive_is_off(a)) {
        return MODBUS_DEVICE_FAILURE;
    }
    return go_together(c, a) ? MODBUS_FINE : MODBUS_ILLEGAL_VALUE;
}

static bool store(struct modbus_drive *d)
{
    struct saved unused;
    d->cia402.refusal =
        FEATURE_IN(SETTINGS) ? drive_save(d->axis, d->slots, &unused) : feature_absent(FEATURE_SETTINGS);
    return d->cia402.refusal.error == ERROR_NONE;
}

/* These change nothing if refused; no request combines them with parameters. The drive's `refusal` says why a source was. */
static enum modbus_exception carry_out_actions(struct modbus_drive *d, const struct writable *w)
{
    const bool refused = (w->restore != 0u && drive_defaults(d->axis).error != ERROR_NONE) ||
                         (w->store != 0u && !store(d)) ||
                         (w->source != NO_SOURCE && !cia402_change_source(&d->cia402, d->axis, w->source));
    return refused ? MODBUS_DEVICE_FAILURE : MODBUS_FINE;
}

static void commit_change(struct modbus_drive *d, const struct change *c)
{
    const uint32_t not_targets = 1u << OBJECT_control_word | 1u << OBJECT_homing_method;
    if (c->params_changed > 0u) {
        d->axis->params = c->params;
    }
    for (uint32_t fault = 0; c->choices_changed > 0u && fault < FAULT_COUNT; fault++) {
        d->axis->reactions.choice[fault] = c->choice[fault];
    }
    cia402_accept(&d->cia402, &c->writable.setpoints, (c->setpoints & 1u << OBJECT_control_word) != 0u,
                  (c->setpoints & ~not_targets) != 0u);
}

enum modbus_exception modbus_write(struct modbus_drive *d, uint32_t at, uint32_t count, const uint8_t *bytes)
{
    struct change change = {.params = d->axis->params,
                            .writable = {.setpoints = d->cia402.setpoints, .source = NO_SOURCE}};
    for (uint32_t fault = 0; fault < FAULT_COUNT; fault++) {
        change.choice[fault] = d->axis->reactions.choice[fault];
    }
    enum modbus_exception wrong = gather_change(&change, at, count, bytes);
    if (wrong == MODBUS_FINE && change.absent.error != ERROR_NONE) {
        d->cia402.refusal = change.absent;
        wrong = MODBUS_ILLEGAL_VALUE;
    }
    if (wrong == MODBUS_FINE) {
        wrong = judge_change(&change, d->axis);
    }
    if (wrong == MODBUS_FINE) {
        wrong = carry_out_actions(d, &change.writable);
    }
    if (wrong == MODBUS_FINE) {
        commit_change(d, &change);
    }
    return wrong;
}
