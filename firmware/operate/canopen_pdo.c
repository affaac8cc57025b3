/* SPDX-License-Identifier: MIT */
#include "firmware/operate/canopen_parts.h"

#define SYNCHRONOUS_MOST 240u
#define EMERGENCY_LENGTH 0x8210u /* a PDO that is too short */

static bool exists(const struct canopen_pdo *p)
{
    return (p->id & CANOPEN_INVALID) == 0u && p->count > 0u;
}

static bool is_synchronous(const struct canopen_pdo *p)
{
    return p->type <= SYNCHRONOUS_MOST;
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

/* All of its values, or none. */
static void act_on(struct canopen *c, const struct canopen_pdo *p)
{
    struct object_change change;
    uint32_t at = 0;
    object_begin(&change, &c->drive);
    for (uint32_t n = 0; n < p->count; n++) {
        const struct object_place place = canopen_place(p->map[n] >> 16, p->map[n] >> 8 & 0xFFu);
        const enum object_type type = object_type(&place);
        const uint32_t bytes = canopen_bytes(type);
        if (object_change(&change, &place, canopen_signed(canopen_get(&p->data[at], bytes), type)) != OBJECT_FINE) {
            return;
        }
        at += bytes;
    }
    (void)object_commit(&change, &c->drive); /* what is refused has changed nothing, and nobody waits for an answer */
}

static void receive(struct canopen *c, struct canopen_pdo *p, const struct can_frame *f)
{
    const uint32_t length = length_of(p);
    if (f->count < length) {
        canopen_emergency(c, EMERGENCY_LENGTH, f->id);
        return;
    }
    for (uint32_t n = 0; n < length; n++) {
        p->data[n] = f->data[n];
    }
    drive_hear(c->drive.axis);
    if (is_synchronous(p)) {
        p->syncs = 1u;
    } else {
        act_on(c, p);
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

static void gather(const struct canopen *c, const struct canopen_pdo *p, uint8_t *data)
{
    const struct object_view view = object_view(&c->drive);
    uint32_t at = 0;
    for (uint32_t n = 0; n < p->count; n++) {
        const struct object_place place = canopen_place(p->map[n] >> 16, p->map[n] >> 8 & 0xFFu);
        const uint32_t bytes = canopen_bytes(object_type(&place));
        canopen_put(&data[at], object_get(&view, &place), bytes);
        at += bytes;
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

static void send_pdo(struct canopen *c, struct canopen_pdo *p, const uint8_t *data, uint32_t length)
{
    for (uint32_t n = 0; n < length; n++) {
        p->data[n] = data[n];
    }
    p->bytes = (uint8_t)length;
    p->syncs = 0u;
    p->sent_ms = canopen_now_ms(c);
    canopen_send(c, p->id, data, length);
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
            act_on(c, &c->rpdo[n]);
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
    const uint32_t now_ms = canopen_now_ms(c);
    for (uint32_t n = 0; n < CANOPEN_PDOS_EACH; n++) {
        struct canopen_pdo *const p = &c->tpdo[n];
        const uint32_t since_ms = now_ms - p->sent_ms;
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
