/* SPDX-License-Identifier: MIT */
#include "firmware/settings/slots.h"

#include "firmware/settings/crc.h"
#include "firmware/settings/params.h"

/* The head, in words; the rest of its page is zero. Its CRC starts at the second word. */
enum head {
    HEAD_CRC, /* of the records' pages, then of the head after this word */
    HEAD_MARK,
    HEAD_NUMBER,
    HEAD_RECORDS_BYTES,
};

#define MARK 0x3153464Du /* "MFS1" */

static const uint32_t *head_of(const struct slots *s, uint32_t slot)
{
    return (const uint32_t *)(const void *)(s->memory + slot * s->slot_bytes);
}

static uint32_t crc_of_head(uint32_t crc, const uint32_t *head)
{
    return crc32_end(crc32_add(crc, head + HEAD_MARK, ENVM_PAGE_BYTES - sizeof *head));
}

static bool is_whole(const struct slots *s, uint32_t slot)
{
    const uint32_t *const head = head_of(s, slot);
    const uint32_t bytes = head[HEAD_RECORDS_BYTES];
    if (head[HEAD_MARK] != MARK || bytes % ENVM_PAGE_BYTES != 0u || bytes > s->slot_bytes - ENVM_PAGE_BYTES) {
        return false;
    }
    return crc_of_head(crc32_add(CRC32_START, slots_records(s, slot), bytes), head) == head[HEAD_CRC];
}

static bool is_empty(const struct slots *s, uint32_t slot)
{
    const uint32_t *const head = head_of(s, slot);
    for (uint32_t n = 0; n < s->slot_bytes / sizeof *head; n++) {
        if (head[n] != head[0] || (head[n] != 0u && head[n] != UINT32_MAX)) {
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

struct slots_view slots_look(const struct slots *s)
{
    struct slots_view view = {.any = false};
    for (uint32_t slot = 0; slot < SLOTS; slot++) {
        if (!is_whole(s, slot)) {
            view.state[slot] = is_empty(s, slot) ? SLOT_EMPTY : SLOT_DAMAGED;
            continue;
        }
        view.state[slot] = SLOT_WHOLE;
        view.number[slot] = head_of(s, slot)[HEAD_NUMBER];
        view.records_bytes[slot] = head_of(s, slot)[HEAD_RECORDS_BYTES];
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
        .head_offset = s->offset_bytes + slot * s->slot_bytes,
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

void slot_head(struct slot_writer *w)
{
    for (uint32_t n = 0; n < ENVM_PAGE_WORDS; n++) {
        w->page[n] = 0;
    }
    w->page[HEAD_MARK] = MARK;
    w->page[HEAD_NUMBER] = w->number;
    w->page[HEAD_RECORDS_BYTES] = w->records_bytes;
    w->page[HEAD_CRC] = crc_of_head(w->crc, w->page);
    w->page_offset = w->head_offset;
}

/* ==== records ==== */

bool record_next(struct record_reader *r, struct record *found)
{
    const uint32_t left = (uint32_t)(r->end - r->at);
    if (left < RECORD_HEAD_BYTES || r->at[0] == RECORD_END) {
        return false;
    }
    const uint32_t name_bytes = r->at[1];
    const uint32_t value_bytes = r->at[2] | (uint32_t)r->at[3] << 8;
    if (name_bytes > RECORD_NAME_MOST || RECORD_HEAD_BYTES + name_bytes + value_bytes > left) {
        r->broken = true;
        return false;
    }
    *found = (struct record){.kind = r->at[0], .value_bytes = value_bytes};
    for (uint32_t n = 0; n < name_bytes; n++) {
        found->name[n] = (char)r->at[RECORD_HEAD_BYTES + n];
    }
    found->value = r->at + RECORD_HEAD_BYTES + name_bytes;
    r->at = found->value + value_bytes;
    return true;
}

int32_t record_word(const struct record *r, uint32_t place)
{
    const uint8_t *const b = r->value + 4u * place;
    return (int32_t)(b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24);
}

void record_head(uint8_t head[RECORD_HEAD_BYTES], uint32_t kind, const char *name, uint32_t value_bytes)
{
    head[0] = (uint8_t)kind;
    head[1] = (uint8_t)text_length(name);
    head[2] = (uint8_t)value_bytes;
    head[3] = (uint8_t)(value_bytes >> 8);
}
