/* SPDX-License-Identifier: MIT */
#include "firmware/operate/canopen.h"

#define SYNCHRONOUS_MAX 240u
#define PDO_BITS        64u

/* ---- what a master may set ---- */

bool canopen_is_restricted(uint32_t id)
{
    return id <= 0x07Fu || (id >= 0x101u && id <= 0x180u) || (id >= 0x581u && id <= 0x5FFu) ||
           (id >= 0x601u && id <= 0x67Fu) || id >= 0x6E0u;
}

uint32_t canopen_pdo_id(const struct canopen_pdo *p, uint32_t id)
{
    const bool invalid = (id & CANOPEN_INVALID) != 0u;
    const bool moved = ((id ^ p->id) & CANOPEN_ID) != 0u;
    if ((id & CANOPEN_EXTENDED) != 0u || (!invalid && canopen_is_restricted(id & CANOPEN_ID))) {
        return SDO_VALUE;
    }
    return !invalid && moved && (p->id & CANOPEN_INVALID) == 0u ? SDO_VALUE : 0u; /* only while it does not exist */
}

uint32_t canopen_pdo_type(uint32_t type)
{
    return type <= SYNCHRONOUS_MAX || type >= 254u ? 0u : SDO_VALUE;
}

/* RPDOs may carry what acts immediately: control word, mode, targets. */
static bool may_map(const struct object_place *p, bool receives)
{
    if (p->kind != PLACE_OBJECT) {
        return false;
    }
    return receives ? p->number <= OBJECT_homing_method : p->number < OBJECT_store;
}

uint32_t canopen_pdo_entry(const struct canopen_pdo *p, uint32_t entry, bool receives)
{
    if ((p->id & CANOPEN_INVALID) == 0u || p->count != 0u) {
        return SDO_ACCESS;
    }
    if (entry == 0u) {
        return 0u;
    }
    const struct object_place place = canopen_place(entry >> 16, entry >> 8 & 0xFFu);
    if (place.kind == PLACE_NONE) {
        return SDO_NO_OBJECT;
    }
    const bool fits = (entry & 0xFFu) == 8u * canopen_bytes(object_type(&place));
    return may_map(&place, receives) && fits ? 0u : SDO_NOT_MAPPABLE;
}

uint32_t canopen_pdo_count(const struct canopen_pdo *p, uint32_t count)
{
    uint32_t bits = 0;
    if ((p->id & CANOPEN_INVALID) == 0u) {
        return SDO_ACCESS;
    }
    if (count > CANOPEN_MAPPED) {
        return SDO_VALUE_TOO_HIGH;
    }
    for (uint32_t n = 0; n < count; n++) {
        if (p->map[n] == 0u) {
            return SDO_NO_OBJECT;
        }
        bits += p->map[n] & 0xFFu;
    }
    return bits <= PDO_BITS ? 0u : SDO_PDO_LENGTH;
}

void canopen_pdo_defaults(struct canopen *c)
{
#define PDO_DEFAULT(pdo, n, cob, bits, kind, every_ms, entries, first, second) \
    c->pdo[n] = (struct canopen_pdo){.id = (cob) + (uint32_t)c->node + ((uint32_t)(bits) << 30), \
                                     .map = {first, second}, \
                                     .event_ms = (every_ms), \
                                     .type = (kind), \
                                     .count = (entries)};
    CANOPEN_PDOS(PDO_DEFAULT);
}

/* ---- of one that is set ---- */

static bool exists(const struct canopen_pdo *p)
{
    return (p->id & CANOPEN_INVALID) == 0u && p->count > 0u;
}

static bool is_synchronous(const struct canopen_pdo *p)
{
    return p->type <= SYNCHRONOUS_MAX;
}

static uint32_t length_of(const struct canopen_pdo *p)
{
    uint32_t bits = 0;
    for (uint32_t n = 0; n < p->count; n++) {
        bits += p->map[n] & 0xFFu;
    }
    return bits / 8u;
}

/* ---- in ---- */

enum change { CHANGE_CHECK, CHANGE_APPLY, CHANGE_STOP };

/* The PDO's values for one axis: checked, or applied; or of a refused PDO a control word that stops, alone. */
static bool change_axis(struct canopen *c, const struct canopen_pdo *p, uint32_t axis, enum change how)
{
    struct bus_drive *const d = &c->drives[axis];
    struct object_change change;
    uint32_t at = 0;
    bool ok = true;
    object_begin(&change, d);
    for (uint32_t n = 0; n < p->count; n++) {
        const uint32_t index = p->map[n] >> 16;
        const struct object_place place = canopen_place(index, p->map[n] >> 8 & 0xFFu);
        const enum object_type type = object_type(&place);
        const uint32_t bytes = canopen_bytes(type);
        const int32_t value = canopen_signed(canopen_get(&p->data[at], bytes), type);
        if (canopen_axis(index) == axis) {
            ok = object_change(&change, &place, value) == OBJECT_OK && ok;
        }
        at += bytes;
    }
    if (how == CHANGE_STOP) {
        object_stop(&change, d);
        return true;
    }
    return ok && (how == CHANGE_APPLY ? object_commit(&change, d) : object_check(&change, d)) == OBJECT_OK;
}

/* All values or none, except a stop: all axes but the first are checked before any is changed. There is no answer. */
static void apply_pdo(struct canopen *c, const struct canopen_pdo *p)
{
    bool ok = true;
    for (uint32_t axis = 1; ok && axis < AXIS_COUNT; axis++) {
        ok = change_axis(c, p, axis, CHANGE_CHECK);
    }
    for (uint32_t axis = 0; ok && axis < AXIS_COUNT; axis++) {
        ok = change_axis(c, p, axis, CHANGE_APPLY);
    }
    for (uint32_t axis = 0; !ok && axis < AXIS_COUNT; axis++) {
        (void)change_axis(c, p, axis, CHANGE_STOP);
    }
}

static void receive(struct canopen *c, struct canopen_pdo *p, const struct can_frame *f)
{
    const uint32_t length = length_of(p);
    if (f->count < length) {
        canopen_set_error(c, COMM_ERROR_LENGTH, f->id);
        return;
    }
    for (uint32_t n = 0; n < length; n++) {
        p->data[n] = f->data[n];
    }
    canopen_note_activity(c);
    canopen_clear_error(c, COMM_ERROR_LENGTH);
    if (is_synchronous(p)) {
        p->syncs = 1u;
    } else {
        apply_pdo(c, p);
    }
}

bool canopen_pdo_take(struct canopen *c, const struct can_frame *f)
{
    for (uint32_t n = 0; n < CANOPEN_PDOS_EACH; n++) {
        struct canopen_pdo *const p = &c->rpdo[n];
        if (exists(p) && f->id == (p->id & CANOPEN_ID)) {
            receive(c, p, f);
            return true;
        }
    }
    return false;
}

/* ---- out ---- */

/* Values of one axis, all of one instant. */
static void gather_axis(const struct canopen *c, const struct canopen_pdo *p, uint32_t axis, uint8_t *data)
{
    const struct object_view view = object_view(&c->drives[axis]);
    uint32_t at = 0;
    for (uint32_t n = 0; n < p->count; n++) {
        const uint32_t index = p->map[n] >> 16;
        const struct object_place place = canopen_place(index, p->map[n] >> 8 & 0xFFu);
        const uint32_t bytes = canopen_bytes(object_type(&place));
        if (canopen_axis(index) == axis) {
            canopen_put(&data[at], canopen_value(&view, &place, index), bytes);
        }
        at += bytes;
    }
}

static void gather(const struct canopen *c, const struct canopen_pdo *p, uint8_t *data)
{
    for (uint32_t axis = 0; axis < AXIS_COUNT; axis++) {
        gather_axis(c, p, axis, data);
    }
}

static bool differs(const struct canopen_pdo *p, const uint8_t *data, uint32_t length)
{
    bool other = p->bytes != length;
    for (uint32_t n = 0; n < length; n++) {
        other = other || data[n] != p->data[n];
    }
    return other;
}

/* If the queue is full it counts as not sent, and is sent later with its values then. */
static void send_pdo(struct canopen *c, struct canopen_pdo *p, const uint8_t *data, uint32_t length)
{
    p->syncs = 0u;
    if (canopen_has_backlog(c) || !canopen_send(c, p->id, data, length)) {
        return;
    }
    for (uint32_t n = 0; n < length; n++) {
        p->data[n] = data[n];
    }
    p->bytes = (uint8_t)length;
    p->sent_ms = canopen_now_ms(c);
}

static void sync_one(struct canopen *c, struct canopen_pdo *p)
{
    uint8_t data[8];
    const uint32_t length = length_of(p);
    p->syncs++;
    if (p->type != 0u && p->syncs < p->type) {
        return;
    }
    gather(c, p, data);
    if (p->type != 0u || differs(p, data, length)) {
        send_pdo(c, p, data, length);
    }
}

void canopen_pdo_sync(struct canopen *c)
{
    for (uint32_t n = 0; n < CANOPEN_PDOS_EACH; n++) {
        if (exists(&c->rpdo[n]) && c->rpdo[n].syncs != 0u) {
            c->rpdo[n].syncs = 0u;
            apply_pdo(c, &c->rpdo[n]);
        }
    }
    for (uint32_t n = 0; n < CANOPEN_PDOS_EACH; n++) {
        if (exists(&c->tpdo[n]) && is_synchronous(&c->tpdo[n])) {
            sync_one(c, &c->tpdo[n]);
        }
    }
}

void canopen_pdo_step(struct canopen *c)
{
    for (uint32_t n = 0; n < CANOPEN_PDOS_EACH; n++) {
        struct canopen_pdo *const p = &c->tpdo[n];
        const uint32_t since_ms = canopen_elapsed_ms(c, &p->sent_ms);
        if (!exists(p) || is_synchronous(p) || since_ms * 10u < p->inhibit) {
            continue;
        }
        uint8_t data[8];
        const uint32_t length = length_of(p);
        gather(c, p, data);
        if (differs(p, data, length) || (p->event_ms != 0u && since_ms >= p->event_ms)) {
            send_pdo(c, p, data, length);
        }
    }
}

void canopen_pdo_begin(struct canopen *c)
{
    for (uint32_t n = 0; n < CANOPEN_PDOS_EACH; n++) {
        c->tpdo[n].bytes = 0u;
        c->tpdo[n].syncs = 0u;
        c->rpdo[n].syncs = 0u;
    }
}
