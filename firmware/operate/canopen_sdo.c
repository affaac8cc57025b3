/* SPDX-License-Identifier: MIT */
/* The SDO server (CiA 301, 7.2.4): expedited and segmented, both ways; block transfer is refused. */
#include "firmware/operate/canopen_parts.h"

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

static void download(struct canopen *c, const uint8_t *said, uint32_t index, uint32_t subindex)
{
    enum object_type type;
    const uint8_t command = said[0];
    uint32_t wrong = canopen_writable(c, index, subindex, &type);
    if (wrong == 0u && (command & SIZED) != 0u) {
        const uint32_t given =
            (command & EXPEDITED) != 0u ? VALUE_BYTES - (command >> 2 & 3u) : canopen_get(&said[4], VALUE_BYTES);
        wrong = length_abort(given, canopen_bytes(type));
    }
    if (wrong != 0u) {
        refuse(c, index, subindex, wrong);
    } else if ((command & EXPEDITED) == 0u) {
        begin_download(c, index, subindex);
    } else {
        uint8_t answer[8] = {0, said[1], said[2], said[3]};
        write_value(c, index, subindex, canopen_get(&said[4], canopen_bytes(type)), DOWNLOADED, answer);
    }
}

static void download_segment(struct canopen *c, const uint8_t *said)
{
    struct canopen_sdo *const s = &c->sdo;
    const uint32_t count = SEGMENT_BYTES - (said[0] >> 1 & 7u);
    enum object_type type;
    if (((said[0] & TOGGLED) != 0u) != s->toggle) {
        refuse(c, s->index, s->subindex, SDO_TOGGLE);
        return;
    }
    for (uint32_t n = 0; n < count && s->done + n < VALUE_BYTES; n++) {
        s->data[s->done + n] = said[1u + n];
    }
    s->done += count;
    uint8_t answer[8] = {(uint8_t)(SEGMENT_TAKEN | (said[0] & TOGGLED))};
    s->toggle = !s->toggle;
    if (s->done > VALUE_BYTES) {
        refuse(c, s->index, s->subindex, SDO_TOO_LONG);
    } else if ((said[0] & LAST) == 0u) {
        reply(c, answer);
    } else {
        const uint32_t wrong = canopen_writable(c, s->index, s->subindex, &type);
        const uint32_t length = wrong != 0u ? wrong : length_abort(s->done, canopen_bytes(type));
        if (length != 0u) {
            refuse(c, s->index, s->subindex, length);
        } else {
            write_value(c, s->index, s->subindex, canopen_get(s->data, s->done), answer[0], answer);
        }
    }
}

/* ---- upload: the client reads ---- */

static uint32_t text_bytes(const char *text)
{
    uint32_t length = 0;
    while (text[length] != '\0') {
        length++;
    }
    return length;
}

static void upload(struct canopen *c, uint32_t index, uint32_t subindex)
{
    struct canopen_value v = {.text = NULL};
    const uint32_t wrong = canopen_read(c, index, subindex, &v);
    if (wrong != 0u) {
        refuse(c, index, subindex, wrong);
    } else if (v.kind != VALUE_NUMBER) {
        const uint32_t length = v.kind == VALUE_TEXT ? text_bytes(v.text) : data_sheet_length();
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

static void upload_segment(struct canopen *c, const uint8_t *said)
{
    struct canopen_sdo *const s = &c->sdo;
    uint8_t answer[8] = {0};
    if (((said[0] & TOGGLED) != 0u) != s->toggle) {
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
    answer[0] = (uint8_t)((said[0] & TOGGLED) | (SEGMENT_BYTES - count) << 1 | (s->left == 0u ? (uint32_t)LAST : 0u));
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
        return; /* no SDO has another length */
    }
    canopen_hear(c);
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
