/* SPDX-License-Identifier: MIT */
#include "firmware/settings/records.h"

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

uint32_t record_name_bytes(const char *name)
{
    uint32_t bytes = 0;
    while (name[bytes] != '\0') {
        bytes++;
    }
    return bytes;
}

void record_head(uint8_t head[RECORD_HEAD_BYTES], uint32_t kind, const char *name, uint32_t value_bytes)
{
    head[0] = (uint8_t)kind;
    head[1] = (uint8_t)record_name_bytes(name);
    head[2] = (uint8_t)value_bytes;
    head[3] = (uint8_t)(value_bytes >> 8);
}

bool record_name_is(const char *a, const char *b)
{
    while (*a != '\0' && *a == *b) {
        a++;
        b++;
    }
    return *a == *b;
}
