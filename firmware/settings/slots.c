/* SPDX-License-Identifier: MIT */
#include "firmware/settings/slots.h"

#include "firmware/settings/crc.h"
#include "firmware/settings/params.h"

/* The header, in words; the rest of its page is zero. Its own CRC starts at the second word. */
enum header {
    HEADER_CRC, /* of the records' pages, then of the header after this word */
    HEADER_MARK,
    HEADER_NUMBER,
    HEADER_RECORDS_BYTES,
};

#define MARK 0x3153464Du /* "MFS1" */

static const uint32_t *header_of(const struct slots *s, uint32_t slot)
{
    return (const uint32_t *)(const void *)(s->memory + slot * s->slot_bytes);
}

static uint32_t crc_of_header(uint32_t crc, const uint32_t *header)
{
    return crc32_end(crc32_add(crc, header + HEADER_MARK, ENVM_PAGE_BYTES - sizeof *header));
}

static bool is_valid(const struct slots *s, uint32_t slot)
{
    const uint32_t *const header = header_of(s, slot);
    const uint32_t bytes = header[HEADER_RECORDS_BYTES];
    if (header[HEADER_MARK] != MARK || bytes % ENVM_PAGE_BYTES != 0u || bytes > s->slot_bytes - ENVM_PAGE_BYTES) {
        return false;
    }
    return crc_of_header(crc32_add(CRC32_START, slots_records(s, slot), bytes), header) == header[HEADER_CRC];
}

static bool is_empty(const struct slots *s, uint32_t slot)
{
    const uint32_t *const header = header_of(s, slot);
    for (uint32_t n = 0; n < s->slot_bytes / sizeof *header; n++) {
        if (header[n] != header[0] || (header[n] != 0u && header[n] != UINT32_MAX)) {
            return false;
        }
    }
    return true;
}

/* The number wraps at 2^32, and the slots are one save apart. */
static bool is_later(uint32_t number, uint32_t than)
{
    return (int32_t)(number - than) > 0;
}

struct slots_view slots_check(const struct slots *s)
{
    struct slots_view view = {.any = false};
    for (uint32_t slot = 0; slot < SLOTS; slot++) {
        if (!is_valid(s, slot)) {
            view.state[slot] = is_empty(s, slot) ? SLOT_EMPTY : SLOT_DAMAGED;
            continue;
        }
        view.state[slot] = SLOT_VALID;
        view.number[slot] = header_of(s, slot)[HEADER_NUMBER];
        view.records_bytes[slot] = header_of(s, slot)[HEADER_RECORDS_BYTES];
        if (!view.any || is_later(view.number[slot], view.number[view.newest])) {
            view.newest = slot;
        }
        view.any = true;
    }
    return view;
}

void slot_begin(struct slot_writer *w, const struct slots *s, const struct slots_view *view)
{
    const uint32_t slot = view->any ? 1u - view->newest : 0u;
    *w = (struct slot_writer){
        .slot = slot,
        .header_offset = s->offset_bytes + slot * s->slot_bytes,
        .page_offset = s->offset_bytes + slot * s->slot_bytes + ENVM_PAGE_BYTES,
        .end_offset = s->offset_bytes + (slot + 1u) * s->slot_bytes,
        .number = view->any ? view->number[view->newest] + 1u : 1u,
        .crc = CRC32_START,
    };
}

bool slot_has_room(const struct slot_writer *w, uint32_t bytes)
{
    return w->page_offset + w->fill + bytes <= w->end_offset;
}

bool slot_put(struct slot_writer *w, uint8_t byte)
{
    uint8_t *const bytes = (uint8_t *)w->page;
    bytes[w->fill] = byte;
    w->fill++;
    return w->fill == ENVM_PAGE_BYTES;
}

void slot_next(struct slot_writer *w)
{
    w->crc = crc32_add(w->crc, w->page, ENVM_PAGE_BYTES);
    w->records_bytes += ENVM_PAGE_BYTES;
    w->page_offset += ENVM_PAGE_BYTES;
    w->fill = 0;
}

bool slot_pad(struct slot_writer *w)
{
    if (w->fill == 0u) {
        return false;
    }
    while (!slot_put(w, 0u)) {
    }
    return true;
}

void slot_header(struct slot_writer *w)
{
    for (uint32_t n = 0; n < ENVM_PAGE_WORDS; n++) {
        w->page[n] = 0;
    }
    w->page[HEADER_MARK] = MARK;
    w->page[HEADER_NUMBER] = w->number;
    w->page[HEADER_RECORDS_BYTES] = w->records_bytes;
    w->page[HEADER_CRC] = crc_of_header(w->crc, w->page);
    w->page_offset = w->header_offset;
}

/* ==== records ==== */

bool record_next(struct record_reader *r, struct record *found)
{
    const uint32_t left = (uint32_t)(r->end - r->at);
    if (left < RECORD_HEADER_BYTES || r->at[0] == RECORD_END) {
        return false;
    }
    const uint32_t name_bytes = r->at[1];
    const uint32_t value_bytes = r->at[2] | (uint32_t)r->at[3] << 8;
    if (name_bytes > RECORD_NAME_MAX || RECORD_HEADER_BYTES + name_bytes + value_bytes > left) {
        r->broken = true;
        return false;
    }
    *found = (struct record){.kind = r->at[0], .value_bytes = value_bytes};
    for (uint32_t n = 0; n < name_bytes; n++) {
        found->name[n] = (char)r->at[RECORD_HEADER_BYTES + n];
    }
    found->value = r->at + RECORD_HEADER_BYTES + name_bytes;
    r->at = found->value + value_bytes;
    return true;
}

int32_t record_word(const struct record *r, uint32_t place)
{
    const uint8_t *const b = r->value + 4u * place;
    return (int32_t)(b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24);
}

void record_header(uint8_t header[RECORD_HEADER_BYTES], uint32_t kind, const char *name, uint32_t value_bytes)
{
    header[0] = (uint8_t)kind;
    header[1] = (uint8_t)text_length(name);
    header[2] = (uint8_t)value_bytes;
    header[3] = (uint8_t)(value_bytes >> 8);
}
