/* SPDX-License-Identifier: MIT */
/*
 * The object dictionary, and its SDO server (CiA 301, 7.2.4): expedited and segmented, both directions; block transfer is
 * refused.
 */
#include "firmware/operate/canopen.h"
#include "firmware/settings/config.h"

#include "data_sheet_text.h"

/* ==== the electronic data sheet ==== */

#define FREQUENT_BITS  4u
#define CHARACTER_BITS 7u
#define DISTANCE_BITS  10u
#define COUNT_BITS     6u
#define COPY_MIN       3u

static uint32_t take_bits(struct data_sheet *s, uint32_t count)
{
    uint32_t value = 0;
    for (uint32_t n = 0; n < count; n++) {
        value = value << 1 | (packed[s->bit / 8u] >> (7u - s->bit % 8u) & 1u);
        s->bit++;
    }
    return value;
}

/* Restarts at the first character. */
static void data_sheet_begin(struct data_sheet *s)
{
    s->bit = 0u;
    s->left = 0u; /* `place` may be anywhere: copies refer to characters since then */
}

static uint8_t spelled_character(struct data_sheet *s)
{
    return take_bits(s, 1u) == 0u ? frequent[take_bits(s, FREQUENT_BITS)] : (uint8_t)take_bits(s, CHARACTER_BITS);
}

/* The next character; of no more than TEXT_BYTES. */
static uint8_t data_sheet_next(struct data_sheet *s)
{
    uint8_t character;
    if (s->left == 0u && take_bits(s, 1u) == 0u) {
        character = spelled_character(s);
    } else {
        if (s->left == 0u) {
            s->distance = take_bits(s, DISTANCE_BITS);
            s->left = take_bits(s, COUNT_BITS) + COPY_MIN;
        }
        character = s->recent[(s->place - s->distance - 1u) % DATA_SHEET_WINDOW];
        s->left--;
    }
    s->recent[s->place++ % DATA_SHEET_WINDOW] = character;
    return character;
}

/* ==== the dictionary ==== */

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

/* No such object: or only the subindex is missing. */
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
    return is_action(place) ? 1u : canopen_value(&view, place, index); /* 1: stores, restores on command */
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

/* Whether it can be written, and of which type it is: 0, or the abort code. */
static uint32_t check_writable(uint32_t index, uint32_t subindex, enum object_type *type)
{
    const struct row *const r = row_of(index, subindex);
    const struct object_place place = canopen_place(index, subindex);
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

/* The line stays as it is: by CiA 301 restored values take effect only after the next reset. */
static void keep_node(struct canopen *c)
{
    canopen_set_line(&c->drives[0].axis->params, &c->line);
}

static enum object_refusal write_axis(struct bus_drive *d, const struct object_place *place, uint32_t value)
{
    struct object_change change;
    object_begin(&change, d);
    const enum object_refusal wrong = object_change(&change, place, canopen_signed(value, object_type(place)));
    return wrong == OBJECT_OK ? object_commit(&change, d) : wrong;
}

/* All axes store and restore together: none if one of them is on; after one that fails the rest do not. */
static enum object_refusal act_on_all(struct canopen *c, const struct object_place *place, uint32_t value)
{
    enum object_refusal wrong = OBJECT_OK;
    for (uint32_t n = 1; n < AXIS_COUNT; n++) { /* the first checks itself */
        wrong = drive_is_off(c->drives[n].axis) ? wrong : OBJECT_BAD_STATE;
    }
    for (uint32_t n = 0; wrong == OBJECT_OK && n < AXIS_COUNT; n++) {
        wrong = write_axis(&c->drives[n], place, value);
    }
    return wrong;
}

static uint32_t write_drive(struct canopen *c, const struct object_place *place, uint32_t index, uint32_t value)
{
    static const uint32_t aborts[] = {
        [OBJECT_OK] = 0u,
        [OBJECT_TOO_LOW] = SDO_VALUE_TOO_LOW,
        [OBJECT_TOO_HIGH] = SDO_VALUE_TOO_HIGH,
        [OBJECT_BAD_VALUE] = SDO_VALUE,
        [OBJECT_NO_CODE_WORD] = SDO_NOT_STORED,
        [OBJECT_BAD_STATE] = SDO_DEVICE_STATE,
        [OBJECT_COMMANDED] = SDO_LOCAL_CONTROL,
    };
    const enum object_refusal wrong =
        is_action(place) ? act_on_all(c, place, value) : write_axis(&c->drives[canopen_axis(index)], place, value);
    if (wrong == OBJECT_OK && place->kind == PLACE_OBJECT && place->number == OBJECT_restore) {
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
    return subindex == 1u ? canopen_pdo_id(p, value) : subindex == 2u ? canopen_pdo_type(value) : 0u;
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
    case 0x1003: /* 0 only: clears them */
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
        canopen_clear_history(c);
    } else if (index == 0x1016u) {
        c->master_alive = false; /* supervised from the next one on */
        canopen_clear_error(c, COMM_ERROR_HEARTBEAT);
    }
    return 0u;
}

/* ==== the server ==== */

enum { DOWNLOAD_SEGMENT = 0, DOWNLOAD = 1, UPLOAD = 2, UPLOAD_SEGMENT = 3, ABORT = 4 }; /* bits 5 to 7 of a command */
enum { SIZED = 1u << 0, EXPEDITED = 1u << 1, TOGGLED = 1u << 4, LAST = 1u << 0 };
enum { DOWNLOADED = 0x60, UPLOADED = 0x40, SEGMENT_TAKEN = 0x20, ABORTED = 0x80 };
#define SEGMENT_BYTES 7u
#define VALUE_BYTES   4u

static void reply(struct canopen *c, uint8_t *data)
{
    canopen_send(c, c->sdo_out, data, 8);
}

static void reply_about(struct canopen *c, uint8_t command, uint32_t index, uint32_t subindex, uint32_t value)
{
    uint8_t data[8] = {command};
    canopen_put(&data[1], index, 2);
    data[3] = (uint8_t)subindex;
    canopen_put(&data[4], value, 4);
    reply(c, data);
}

static void refuse(struct canopen *c, uint32_t index, uint32_t subindex, uint32_t why)
{
    c->sdo.under_way = SDO_IDLE;
    reply_about(c, ABORTED, index, subindex, why);
}

/* ---- download: the client writes ---- */

static void write_value(struct canopen *c, uint32_t index, uint32_t subindex, uint32_t value, uint8_t done,
                        uint8_t *data)
{
    const uint32_t wrong = canopen_write(c, index, subindex, value);
    if (wrong != 0u) {
        refuse(c, index, subindex, wrong);
        return;
    }
    c->sdo.under_way = SDO_IDLE;
    data[0] = done;
    reply(c, data);
}

static uint32_t length_abort(uint32_t given, uint32_t wanted)
{
    return given == wanted ? 0u : given > wanted ? SDO_TOO_LONG : SDO_TOO_SHORT;
}

static void begin_download(struct canopen *c, uint32_t index, uint32_t subindex)
{
    c->sdo = (struct canopen_sdo){.under_way = SDO_DOWNLOAD, .index = (uint16_t)index, .subindex = (uint8_t)subindex};
    reply_about(c, DOWNLOADED, index, subindex, 0u);
}

static void download(struct canopen *c, const uint8_t *data, uint32_t index, uint32_t subindex)
{
    enum object_type type;
    const uint8_t command = data[0];
    uint32_t wrong = check_writable(index, subindex, &type);
    if (wrong == 0u && (command & SIZED) != 0u) {
        const uint32_t given =
            (command & EXPEDITED) != 0u ? VALUE_BYTES - (command >> 2 & 3u) : canopen_get(&data[4], VALUE_BYTES);
        wrong = length_abort(given, canopen_bytes(type));
    }
    if (wrong != 0u) {
        refuse(c, index, subindex, wrong);
    } else if ((command & EXPEDITED) == 0u) {
        begin_download(c, index, subindex);
    } else {
        uint8_t answer[8] = {0, data[1], data[2], data[3]};
        write_value(c, index, subindex, canopen_get(&data[4], canopen_bytes(type)), DOWNLOADED, answer);
    }
}

static void download_segment(struct canopen *c, const uint8_t *data)
{
    struct canopen_sdo *const s = &c->sdo;
    const uint32_t count = SEGMENT_BYTES - (data[0] >> 1 & 7u);
    enum object_type type;
    if (((data[0] & TOGGLED) != 0u) != s->toggle) {
        refuse(c, s->index, s->subindex, SDO_TOGGLE);
        return;
    }
    for (uint32_t n = 0; n < count && s->done + n < VALUE_BYTES; n++) {
        s->data[s->done + n] = data[1u + n];
    }
    s->done += count;
    uint8_t answer[8] = {(uint8_t)(SEGMENT_TAKEN | (data[0] & TOGGLED))};
    s->toggle = !s->toggle;
    if (s->done > VALUE_BYTES) {
        refuse(c, s->index, s->subindex, SDO_TOO_LONG);
    } else if ((data[0] & LAST) == 0u) {
        reply(c, answer);
    } else {
        const uint32_t wrong = check_writable(s->index, s->subindex, &type);
        const uint32_t length = wrong != 0u ? wrong : length_abort(s->done, canopen_bytes(type));
        if (length != 0u) {
            refuse(c, s->index, s->subindex, length);
        } else {
            write_value(c, s->index, s->subindex, canopen_get(s->data, s->done), answer[0], answer);
        }
    }
}

/* ---- upload: the client reads ---- */

static void upload(struct canopen *c, uint32_t index, uint32_t subindex)
{
    struct canopen_value v = {.text = NULL};
    const uint32_t wrong = canopen_read(c, index, subindex, &v);
    if (wrong != 0u) {
        refuse(c, index, subindex, wrong);
    } else if (v.kind != VALUE_NUMBER) {
        const uint32_t length = v.kind == VALUE_TEXT ? (uint32_t)text_length(v.text) : TEXT_BYTES;
        c->sdo = (struct canopen_sdo){.under_way = SDO_UPLOAD, .text = v.text, .left = length};
        c->sdo.index = (uint16_t)index;
        data_sheet_begin(&c->sheet);
        reply_about(c, UPLOADED | SIZED, index, subindex, length);
    } else {
        const uint32_t bytes = canopen_bytes(v.type);
        const uint32_t value = bytes == 4u ? v.value : v.value & ((1u << (8u * bytes)) - 1u);
        c->sdo.under_way = SDO_IDLE;
        reply_about(c, (uint8_t)(UPLOADED | SIZED | EXPEDITED | (VALUE_BYTES - bytes) << 2), index, subindex, value);
    }
}

static void upload_segment(struct canopen *c, const uint8_t *data)
{
    struct canopen_sdo *const s = &c->sdo;
    uint8_t answer[8] = {0};
    if (((data[0] & TOGGLED) != 0u) != s->toggle) {
        refuse(c, s->index, s->subindex, SDO_TOGGLE);
        return;
    }
    const uint32_t count = s->left < SEGMENT_BYTES ? s->left : SEGMENT_BYTES;
    for (uint32_t n = 0; n < count; n++) {
        answer[1u + n] = s->text != NULL ? (uint8_t)s->text[s->done + n] : data_sheet_next(&c->sheet);
    }
    s->left -= count;
    s->done += count;
    s->toggle = !s->toggle;
    answer[0] = (uint8_t)((data[0] & TOGGLED) | (SEGMENT_BYTES - count) << 1 | (s->left == 0u ? (uint32_t)LAST : 0u));
    if (s->left == 0u) {
        s->under_way = SDO_IDLE;
    }
    reply(c, answer);
}

void canopen_sdo_take(struct canopen *c, const struct can_frame *f)
{
    const uint32_t index = canopen_get(&f->data[1], 2), subindex = f->data[3];
    const uint32_t kind = f->data[0] >> 5;
    if (f->count != 8u) {
        return; /* every SDO has 8 bytes */
    }
    canopen_note_activity(c);
    if (kind == DOWNLOAD) {
        download(c, f->data, index, subindex);
    } else if (kind == UPLOAD) {
        upload(c, index, subindex);
    } else if (kind == DOWNLOAD_SEGMENT && c->sdo.under_way == SDO_DOWNLOAD) {
        download_segment(c, f->data);
    } else if (kind == UPLOAD_SEGMENT && c->sdo.under_way == SDO_UPLOAD) {
        upload_segment(c, f->data);
    } else if (kind == ABORT) {
        c->sdo.under_way = SDO_IDLE;
    } else {
        refuse(c, index, subindex, SDO_COMMAND);
    }
}
