/* SPDX-License-Identifier: MIT */
#include "firmware/operate/modbus_registers.h"

#include "firmware/drive/keeping.h"
#include "firmware/drive/reaction.h"
#include "firmware/operate/modbus_objects.h"
#include "firmware/operate/modbus_values.h"

/* One value, wherever it comes from. */
struct place {
    enum { NOWHERE, OBJECT, REACTION, PARAM } kind;
    uint32_t number; /* enum modbus_object_id, enum fault, or row of param_table */
    uint32_t words;
    bool writable;
};

/* The drive's values after a write; adopted only once all of it has been checked. */
struct change {
    struct params params;
    struct cia402_wishes wishes;
    uint8_t choice[FAULT_COUNT];
    uint32_t params_changed, choices_changed;
    bool wished; /* an object is among them, and so: */
    bool word, target;
    bool stores, restores;
    bool hands_over; /* to another source of the angle: */
    uint32_t source;
};

/* ---- places ---- */

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

static uint32_t value_of(const struct modbus_view *v, const struct place *p)
{
    if (p->kind == PARAM) {
        return (uint32_t)param_get(&v->axis->params, &param_table[p->number]);
    }
    return p->kind == REACTION ? v->axis->reactions.choice[p->number]
                               : modbus_value(v, (enum modbus_object_id)p->number);
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
    const struct modbus_view view = {d->axis, &d->cia402, drive_status(d->axis)};
    for (uint32_t done = 0; done < count;) {
        const struct place p = place_at(at + done);
        if (p.kind == NOWHERE || done + p.words > count) {
            return MODBUS_ILLEGAL_ADDRESS;
        }
        put_words(&bytes[2u * done], value_of(&view, &p), p.words);
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
    param_set(&c->params, info, value);
    c->params_changed++;
    return MODBUS_FINE;
}

static enum modbus_exception change_choice(struct change *c, uint32_t fault, int32_t choice)
{
    if (choice >= REACTION_COUNT || ((fault_class((enum fault)fault)->allowed >> choice) & 1u) == 0u) {
        return MODBUS_ILLEGAL_VALUE;
    }
    c->choice[fault] = (uint8_t)choice;
    c->choices_changed++;
    return MODBUS_FINE;
}

/* Actions that must not happen by accident need a code word. */
static enum modbus_exception ask(bool *asked, int32_t value, uint32_t signature)
{
    *asked = (uint32_t)value == signature;
    return *asked ? MODBUS_FINE : MODBUS_ILLEGAL_VALUE;
}

static enum modbus_exception change_source(struct change *c, int32_t value)
{
    c->hands_over = true;
    c->source = (uint32_t)value;
    return c->source <= PARAM_ANGLE_HALL ? MODBUS_FINE : MODBUS_ILLEGAL_VALUE;
}

static enum modbus_exception change_object(struct change *c, uint32_t object, int32_t value)
{
    struct cia402_wishes *const w = &c->wishes;
    if (object == OBJECT_store) {
        return ask(&c->stores, value, MODBUS_SAVE);
    }
    if (object == OBJECT_restore) {
        return ask(&c->restores, value, MODBUS_LOAD);
    }
    if (object == OBJECT_angle_source) {
        return change_source(c, value);
    }
    c->wished = true;
    c->word = c->word || object == OBJECT_control_word;
    c->target = c->target || (object != OBJECT_control_word && object != OBJECT_homing_method);
    if (object == OBJECT_control_word) {
        w->control_word = (uint32_t)value;
    } else if (object == OBJECT_mode) {
        w->mode = value;
    } else if (object == OBJECT_target_velocity) {
        w->target_rpm = value;
    } else if (object == OBJECT_target_position) {
        w->target_counts = value;
    } else if (object == OBJECT_target_torque) {
        w->target_torque_pm = value;
    } else {
        w->homing_method = value; /* no other is writable */
    }
    return MODBUS_FINE;
}

static enum modbus_exception change_value(struct change *c, const struct place *p, int32_t value)
{
    if (p->kind == PARAM) {
        return change_param(c, p->number, value);
    }
    return p->kind == REACTION ? change_choice(c, p->number, value) : change_object(c, p->number, value);
}

static enum modbus_exception gather(struct change *c, uint32_t at, uint32_t count, const uint8_t *bytes)
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

/* Checks several parameters as switching on would; a single one, as on the console, only against its range. */
static bool go_together(const struct change *c, const struct axis *a)
{
    if (c->params_changed < 2u) {
        return true;
    }
    struct tuning unused = a->tuning;
    return tuning_compute(&c->params, &unused).error == ERROR_NONE && tuning_check_emf(&c->params).error == ERROR_NONE;
}

static enum modbus_exception judge(const struct change *c, const struct axis *a)
{
    if (c->wished && !cia402_may_wish(&c->wishes, &c->params)) {
        return MODBUS_ILLEGAL_VALUE;
    }
    if (c->params_changed + c->choices_changed > 0u && !drive_is_off(a)) {
        return MODBUS_DEVICE_FAILURE;
    }
    return go_together(c, a) ? MODBUS_FINE : MODBUS_ILLEGAL_VALUE;
}

/* Both change nothing if refused; no request combines them with parameters. */
static enum modbus_exception keep(const struct modbus_drive *d, const struct change *c)
{
    struct saved unused;
    if ((c->restores && drive_defaults(d->axis).error != ERROR_NONE) ||
        (c->stores && drive_save(d->axis, d->slots, &unused).error != ERROR_NONE)) {
        return MODBUS_DEVICE_FAILURE;
    }
    return MODBUS_FINE;
}

/* The drive's `refusal` tells why not, also for what takes time. */
static enum modbus_exception hand_over(struct modbus_drive *d, const struct change *c)
{
    if (!c->hands_over) {
        return MODBUS_FINE;
    }
    return cia402_hand_over(&d->cia402, d->axis, c->source) ? MODBUS_FINE : MODBUS_DEVICE_FAILURE;
}

static void commit(struct modbus_drive *d, const struct change *c)
{
    if (c->params_changed > 0u) {
        d->axis->params = c->params;
    }
    for (uint32_t fault = 0; c->choices_changed > 0u && fault < FAULT_COUNT; fault++) {
        d->axis->reactions.choice[fault] = c->choice[fault];
    }
    cia402_wish(&d->cia402, &c->wishes, c->word, c->target);
}

enum modbus_exception modbus_write(struct modbus_drive *d, uint32_t at, uint32_t count, const uint8_t *bytes)
{
    struct change change = {.params = d->axis->params, .wishes = d->cia402.wishes};
    for (uint32_t fault = 0; fault < FAULT_COUNT; fault++) {
        change.choice[fault] = d->axis->reactions.choice[fault];
    }
    enum modbus_exception wrong = gather(&change, at, count, bytes);
    if (wrong == MODBUS_FINE) {
        wrong = judge(&change, d->axis);
    }
    if (wrong == MODBUS_FINE) {
        wrong = keep(d, &change);
    }
    if (wrong == MODBUS_FINE) {
        wrong = hand_over(d, &change);
    }
    if (wrong == MODBUS_FINE) {
        commit(d, &change);
    }
    return wrong;
}
