/* SPDX-License-Identifier: MIT */
#include "firmware/operate/canopen_parts.h"

#define PDO_BITS 64u

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

uint32_t canopen_pdo_type(const struct canopen_pdo *p, uint32_t type, bool receives)
{
    (void)p;
    (void)receives;
    return type <= 240u || type >= 254u ? 0u : SDO_VALUE;
}

/* What a master may send is what acts at once: control word, mode, targets. */
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
