/* SPDX-License-Identifier: MIT */
#include "firmware/operate/modbus_functions.h"

#define READ_MOST       125u
#define WRITE_MOST      123u
#define READ_WRITE_MOST 121u /* written by function 23 */

enum {
    READ_HOLDING = 0x03,
    READ_INPUT = 0x04,
    WRITE_ONE = 0x06,
    WRITE_SEVERAL = 0x10,
    WRITE_MASKED = 0x16,
    WRITE_AND_READ = 0x17,
    IDENTIFY = 0x2B,
    EXCEPTION = 0x80,
};

/* What a function works on. */
struct call {
    struct modbus_drive *drive;
    const uint8_t *request;
    size_t count;
    uint8_t *reply;
    size_t replied; /* bytes of the reply */
};

static uint32_t word(const struct call *c, size_t at)
{
    return ((uint32_t)c->request[at] << 8) | c->request[at + 1u];
}

static void echo(struct call *c, size_t count)
{
    for (size_t n = 0; n < count; n++) {
        c->reply[n] = c->request[n];
    }
    c->replied = count;
}

static enum modbus_exception read_into(struct call *c, uint32_t at, uint32_t count)
{
    c->reply[1] = (uint8_t)(2u * count);
    c->replied = 2u + 2u * count;
    return modbus_read(c->drive, at, count, &c->reply[2]);
}

static enum modbus_exception read_registers(struct call *c)
{
    const uint32_t count = word(c, 3);
    if (count == 0u || count > READ_MOST) {
        return MODBUS_ILLEGAL_VALUE;
    }
    return read_into(c, word(c, 1), count);
}

static enum modbus_exception write_one(struct call *c)
{
    echo(c, 5);
    return modbus_write(c->drive, word(c, 1), 1, &c->request[3]);
}

static enum modbus_exception write_several(struct call *c)
{
    const uint32_t count = word(c, 3);
    if (count == 0u || count > WRITE_MOST || c->request[5] != 2u * count || c->count != 6u + 2u * count) {
        return MODBUS_ILLEGAL_VALUE;
    }
    echo(c, 5);
    return modbus_write(c->drive, word(c, 1), count, &c->request[6]);
}

static enum modbus_exception write_masked(struct call *c)
{
    uint8_t now[2];
    const enum modbus_exception wrong = modbus_read(c->drive, word(c, 1), 1, now);
    if (wrong != MODBUS_FINE) {
        return wrong;
    }
    for (size_t n = 0; n < 2u; n++) {
        const uint8_t kept = c->request[3u + n];
        now[n] = (uint8_t)((now[n] & kept) | (c->request[5u + n] & (uint8_t)~kept));
    }
    echo(c, 7);
    return modbus_write(c->drive, word(c, 1), 1, now);
}

/* Checks first that it can be read: otherwise nothing is written. The read returns the values after the write. */
static enum modbus_exception write_and_read(struct call *c)
{
    const uint32_t reads = word(c, 3);
    const uint32_t writes = word(c, 7);
    if (reads == 0u || reads > READ_MOST || writes == 0u || writes > READ_WRITE_MOST || c->request[9] != 2u * writes ||
        c->count != 10u + 2u * writes) {
        return MODBUS_ILLEGAL_VALUE;
    }
    enum modbus_exception wrong = read_into(c, word(c, 1), reads);
    if (wrong == MODBUS_FINE) {
        wrong = modbus_write(c->drive, word(c, 5), writes, &c->request[10]);
    }
    return wrong == MODBUS_FINE ? read_into(c, word(c, 1), reads) : wrong;
}

static enum modbus_exception identify(struct call *c)
{
    return modbus_identify(c->request, c->reply, &c->replied);
}

struct function {
    uint8_t code;
    uint8_t least; /* bytes of its request */
    bool writes;
};

/* The row of a function that is known, or NULL. */
static const struct function *find(uint8_t code)
{
    static const struct function functions[] = {
        {READ_HOLDING, 5, false}, {READ_INPUT, 5, false},     {WRITE_ONE, 5, true}, {WRITE_SEVERAL, 6, true},
        {WRITE_MASKED, 7, true},  {WRITE_AND_READ, 10, true}, {IDENTIFY, 4, false},
    };
    for (size_t n = 0; n < sizeof functions / sizeof functions[0]; n++) {
        if (functions[n].code == code) {
            return &functions[n];
        }
    }
    return NULL;
}

static enum modbus_exception run(struct call *c)
{
    switch (c->request[0]) {
    case WRITE_ONE:
        return write_one(c);
    case WRITE_SEVERAL:
        return write_several(c);
    case WRITE_MASKED:
        return write_masked(c);
    case WRITE_AND_READ:
        return write_and_read(c);
    case IDENTIFY:
        return identify(c);
    default:
        return read_registers(c);
    }
}

static enum modbus_exception carry_out(struct call *c, bool writes_only)
{
    const struct function *const known = find(c->request[0]);
    if (known == NULL || (writes_only && !known->writes)) {
        return MODBUS_ILLEGAL_FUNCTION;
    }
    return c->count < known->least ? MODBUS_ILLEGAL_VALUE : run(c);
}

size_t modbus_function(struct modbus_drive *d, const uint8_t *request, size_t count, bool writes_only, uint8_t *reply)
{
    struct call call = {.drive = d, .request = request, .count = count, .reply = reply};
    const enum modbus_exception wrong = carry_out(&call, writes_only);
    reply[0] = request[0];
    if (wrong != MODBUS_FINE) {
        reply[0] = request[0] | EXCEPTION;
        reply[1] = (uint8_t)wrong;
        call.replied = 2;
    }
    return call.replied;
}
