/* SPDX-License-Identifier: MIT */
#include "firmware/operate/canopen_parts.h"
#include "firmware/settings/config.h"

enum { RO, RW, CONST };

struct row {
    uint16_t index;
    uint8_t subindex, type, access;
    uint16_t at; /* of struct canopen; of a constant: the value */
};

/* clang-format off */
#define AT_RO(where)    offsetof(struct canopen, where)
#define AT_RW(where)    offsetof(struct canopen, where)
#define AT_CONST(value) (value)
#define ROW(index, subindex, type, access, name, initial, where) \
    {index, subindex, OBJECT_TYPE_##type, access, AT_##access(where)},

static const struct row rows[] = {
    CANOPEN_OBJECTS(ROW)
    CANOPEN_RPDO(ROW)
    CANOPEN_TPDO(ROW)
};

static const struct string {
    uint16_t index;
    const char *text;
} strings[] = {
#define STRING(index, name, text) {index, text},
    CANOPEN_STRINGS(STRING)
};
/* clang-format on */

static bool is_pdo(uint32_t index)
{
    return index >= 0x1400u && index < 0x1C00u && (index & 0x1FFu) < CANOPEN_PDOS_EACH;
}

/* PDOs: by the row of the first. */
static const struct row *row_of(uint32_t index, uint32_t subindex)
{
    const uint32_t first = is_pdo(index) ? index & ~0x1FFu : index;
    for (size_t n = 0; n < sizeof rows / sizeof rows[0]; n++) {
        if (rows[n].index == first && rows[n].subindex == subindex) {
            return &rows[n];
        }
    }
    return NULL;
}

static const struct string *string_at(uint32_t index)
{
    for (size_t n = 0; n < sizeof strings / sizeof strings[0]; n++) {
        if (strings[n].index == index) {
            return &strings[n];
        }
    }
    return NULL;
}

/* Neither one nor the other: whether it is the subindex alone that is not there. */
static uint32_t absent(uint32_t index)
{
    for (uint32_t subindex = 0; subindex < 5u; subindex++) {
        if (row_of(index, subindex) != NULL || canopen_place(index, subindex).kind != PLACE_NONE) {
            return SDO_NO_SUBINDEX;
        }
    }
    return string_at(index) != NULL ? SDO_NO_SUBINDEX : SDO_NO_OBJECT;
}

static uint8_t *bytes_of(struct canopen *c, const struct row *r, uint32_t index)
{
    return (uint8_t *)c + r->at + (is_pdo(index) ? (index & 3u) * sizeof(struct canopen_pdo) : 0u);
}

/* ---- reading ---- */

/* Members are of the row's type; this core has the least significant byte first, as the bus has. */
static uint32_t row_value(struct canopen *c, const struct row *r, uint32_t index)
{
    return r->access == CONST ? r->at : canopen_get(bytes_of(c, r, index), canopen_bytes((enum object_type)r->type));
}

static bool is_action(const struct object_place *place)
{
    return place->kind == PLACE_OBJECT && (place->number == OBJECT_store || place->number == OBJECT_restore);
}

static uint32_t drive_value(const struct canopen *c, const struct object_place *place, uint32_t index)
{
    const struct object_view view = object_view(&c->drives[canopen_axis(index)]);
    return is_action(place) ? 1u : canopen_value(&view, place, index); /* both are done on command */
}

uint32_t canopen_read(struct canopen *c, uint32_t index, uint32_t subindex, struct canopen_value *v)
{
    const struct row *const r = row_of(index, subindex);
    const struct object_place place = canopen_place(index, subindex);
    const struct string *const s = subindex == 0u ? string_at(index) : NULL;
    v->kind = VALUE_NUMBER;
    if (s != NULL) {
        v->kind = s->text != NULL ? VALUE_TEXT : VALUE_SHEET;
        v->text = s->text;
        return 0u;
    }
    if (r != NULL) {
        v->type = (enum object_type)r->type;
        v->value = row_value(c, r, index);
        return 0u;
    }
    if (place.kind == PLACE_NONE) {
        return absent(index);
    }
    v->type = object_type(&place);
    v->value = drive_value(c, &place, index);
    return 0u;
}

/* ---- writing ---- */

uint32_t canopen_writable(struct canopen *c, uint32_t index, uint32_t subindex, enum object_type *type)
{
    const struct row *const r = row_of(index, subindex);
    const struct object_place place = canopen_place(index, subindex);
    (void)c;
    if (r != NULL) {
        *type = (enum object_type)r->type;
        return r->access == RW ? 0u : SDO_READ_ONLY;
    }
    if (place.kind == PLACE_NONE) {
        return subindex == 0u && string_at(index) != NULL ? SDO_READ_ONLY : absent(index);
    }
    *type = object_type(&place);
    return object_is_writable(&place) ? 0u : SDO_READ_ONLY;
}

/* What keeps the node on the bus stays: CiA 301 has the initial values take effect only behind the next reset. */
static void keep_node(struct canopen *c)
{
    canopen_set_line(&c->drives[0].axis->params, &c->line);
}

static enum object_refusal write_axis(struct bus_drive *d, const struct object_place *place, uint32_t value)
{
    struct object_change change;
    object_begin(&change, d);
    const enum object_refusal wrong = object_change(&change, place, canopen_signed(value, object_type(place)));
    return wrong == OBJECT_FINE ? object_commit(&change, d) : wrong;
}

/* All axes store and restore at once: none if one of them is on, and those behind one that cannot do not. */
static enum object_refusal act_on_all(struct canopen *c, const struct object_place *place, uint32_t value)
{
    enum object_refusal wrong = OBJECT_FINE;
    for (uint32_t n = 1; n < AXIS_COUNT; n++) { /* the first looks itself */
        wrong = drive_is_off(c->drives[n].axis) ? wrong : OBJECT_BAD_STATE;
    }
    for (uint32_t n = 0; wrong == OBJECT_FINE && n < AXIS_COUNT; n++) {
        wrong = write_axis(&c->drives[n], place, value);
    }
    return wrong;
}

static uint32_t write_drive(struct canopen *c, const struct object_place *place, uint32_t index, uint32_t value)
{
    static const uint32_t aborts[] = {
        [OBJECT_FINE] = 0u,
        [OBJECT_TOO_LOW] = SDO_VALUE_TOO_LOW,
        [OBJECT_TOO_HIGH] = SDO_VALUE_TOO_HIGH,
        [OBJECT_BAD_VALUE] = SDO_VALUE,
        [OBJECT_NO_CODE_WORD] = SDO_NOT_STORED,
        [OBJECT_BAD_STATE] = SDO_DEVICE_STATE,
        [OBJECT_COMMANDED] = SDO_LOCAL_CONTROL,
    };
    const enum object_refusal wrong =
        is_action(place) ? act_on_all(c, place, value) : write_axis(&c->drives[canopen_axis(index)], place, value);
    if (wrong == OBJECT_FINE && place->kind == PLACE_OBJECT && place->number == OBJECT_restore) {
        keep_node(c);
    }
    return aborts[wrong];
}

static uint32_t check_pdo(struct canopen *c, uint32_t index, uint32_t subindex, uint32_t value)
{
    const bool receives = index < 0x1800u;
    const struct canopen_pdo *const p = receives ? &c->rpdo[index & 3u] : &c->tpdo[index & 3u];
    if ((index & 0x200u) != 0u) {
        return subindex == 0u ? canopen_pdo_count(p, value) : canopen_pdo_entry(p, value, receives);
    }
    return subindex == 1u ? canopen_pdo_id(p, value) : subindex == 2u ? canopen_pdo_type(p, value, receives) : 0u;
}

/* 11 bits, and of no other service. */
static bool is_free_id(uint32_t id)
{
    return (id & (CANOPEN_EXTENDED | CANOPEN_NO_RTR)) == 0u && !canopen_is_restricted(id & CANOPEN_ID);
}

static uint32_t check_row(struct canopen *c, uint32_t index, uint32_t subindex, uint32_t value)
{
    if (is_pdo(index)) {
        return check_pdo(c, index, subindex, value);
    }
    switch (index) {
    case 0x1003: /* 0 alone: forget them */
        return value == 0u ? 0u : SDO_VALUE;
    case 0x1005:
        return value < 0x800u && is_free_id(value) ? 0u : SDO_VALUE; /* it does not produce SYNC */
    case 0x1014:
        return is_free_id(value) ? 0u : SDO_VALUE;
    case 0x1016:
        return value >> 16 <= 127u ? 0u : SDO_VALUE;
    default:
        return 0u;
    }
}

uint32_t canopen_write(struct canopen *c, uint32_t index, uint32_t subindex, uint32_t value)
{
    const struct row *const r = row_of(index, subindex);
    const struct object_place place = canopen_place(index, subindex);
    if (r == NULL) {
        return write_drive(c, &place, index, value);
    }
    const uint32_t wrong = check_row(c, index, subindex, value);
    if (wrong != 0u) {
        return wrong;
    }
    canopen_put(bytes_of(c, r, index), value, canopen_bytes((enum object_type)r->type));
    if (index == 0x1003u) {
        canopen_forget_errors(c);
    } else if (index == 0x1016u) {
        c->beats = false; /* watched from the next one on */
        canopen_relief(c, TROUBLE_HEARTBEAT);
    }
    return 0u;
}
