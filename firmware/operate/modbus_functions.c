/* SPDX-License-Identifier: MIT */
#include "firmware/operate/modbus.h"

#include "firmware/settings/config.h"

#define READ_MAX       125u
#define WRITE_MAX      123u
#define READ_WRITE_MAX 121u /* written by function 23 */
#define EXCEPTION      0x80

/*
 * ---- registers ----
 *
 * Functions 3 and 4 read the same registers. A 32-bit value takes two, the high one first, and is read and written as a whole:
 * a request for half of one gets MODBUS_ILLEGAL_ADDRESS.
 */

static struct object_place object_at(uint32_t at)
{
    for (uint32_t n = 0; n < OBJECT_COUNT; n++) {
        if (objects[n].at == at) {
            return (struct object_place){PLACE_OBJECT, n};
        }
    }
    return (struct object_place){.kind = PLACE_NONE};
}

/* The value that begins at a register; none in the middle of one, or where there is none. */
static struct object_place place_at(uint32_t at)
{
    const uint32_t param = (at - MODBUS_PARAMS) / 2u;
    const uint32_t fault = at - MODBUS_REACTIONS;
    if (at >= MODBUS_PARAMS && param < param_count && at % 2u == 0u) {
        return (struct object_place){PLACE_PARAM, param};
    }
    if (at >= MODBUS_REACTIONS && fault < FAULT_COUNT) {
        return (struct object_place){PLACE_REACTION, fault};
    }
    return object_at(at);
}

static uint32_t words_of(const struct object_place *p)
{
    return object_type(p) >= OBJECT_TYPE_U32 ? 2u : 1u;
}

static void put_words(uint8_t *bytes, uint32_t value, uint32_t words)
{
    for (uint32_t n = 2u * words; n > 0u; n--) {
        bytes[n - 1u] = (uint8_t)value;
        value >>= 8;
    }
}

/* `count` registers from `at` on, as bytes of the line; all of one instant. Range: 1...125. */
static enum modbus_exception modbus_read(const struct bus_drive *d, uint32_t at, uint32_t count, uint8_t *bytes)
{
    const struct object_view view = object_view(d);
    for (uint32_t done = 0; done < count;) {
        const struct object_place p = place_at(at + done);
        if (p.kind == PLACE_NONE || done + words_of(&p) > count) {
            return MODBUS_ILLEGAL_ADDRESS;
        }
        put_words(&bytes[2u * done], object_get(&view, &p), words_of(&p));
        done += words_of(&p);
    }
    return MODBUS_OK;
}

/* Sign-extended by its type. */
static int32_t get_value(const uint8_t *bytes, enum object_type type)
{
    const uint32_t high = ((uint32_t)bytes[0] << 8) | bytes[1];
    if (type >= OBJECT_TYPE_U32) {
        return (int32_t)((high << 16) | ((uint32_t)bytes[2] << 8) | bytes[3]);
    }
    return type == OBJECT_TYPE_U16 ? (int32_t)high : (int16_t)high;
}

static enum modbus_exception exception_of(enum object_refusal refusal)
{
    return refusal == OBJECT_OK          ? MODBUS_OK
           : refusal == OBJECT_BAD_STATE ? MODBUS_DEVICE_FAILURE
           : refusal == OBJECT_COMMANDED ? MODBUS_DEVICE_BUSY
                                         : MODBUS_ILLEGAL_VALUE;
}

static enum modbus_exception gather_change(struct object_change *c, uint32_t at, uint32_t count, const uint8_t *bytes)
{
    for (uint32_t done = 0; done < count;) {
        const struct object_place p = place_at(at + done);
        if (p.kind == PLACE_NONE || !object_is_writable(&p) || done + words_of(&p) > count) {
            return MODBUS_ILLEGAL_ADDRESS;
        }
        const enum object_refusal wrong = object_change(c, &p, get_value(&bytes[2u * done], object_type(&p)));
        if (wrong != OBJECT_OK) {
            return exception_of(wrong);
        }
        done += words_of(&p);
    }
    return MODBUS_OK;
}

/*
 * Checks the values and writes all or none. Each value is checked against its range; several parameters also for consistency,
 * as switching on does. Range: 1...123.
 */
static enum modbus_exception modbus_write(struct bus_drive *d, uint32_t at, uint32_t count, const uint8_t *bytes)
{
    struct object_change change;
    object_begin(&change, d);
    enum modbus_exception wrong = gather_change(&change, at, count, bytes);
    if (wrong == MODBUS_OK) {
        wrong = exception_of(object_commit(&change, d));
    }
    if (wrong != MODBUS_OK && wrong != MODBUS_ILLEGAL_ADDRESS) {
        object_stop(&change, d);
    }
    return wrong;
}

/* ---- the functions ---- */

/* A request and its reply. */
struct call {
    struct bus_drive *drive;
    const uint8_t *request;
    size_t count;
    uint8_t *reply;
    size_t replied; /* bytes of the reply */
};

static uint32_t word(const struct call *c, size_t at)
{
    return ((uint32_t)c->request[at] << 8) | c->request[at + 1u];
}

static void echo_request(struct call *c, size_t count)
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
    if (count == 0u || count > READ_MAX) {
        return MODBUS_ILLEGAL_VALUE;
    }
    return read_into(c, word(c, 1), count);
}

static enum modbus_exception write_one(struct call *c)
{
    echo_request(c, 5);
    return modbus_write(c->drive, word(c, 1), 1, &c->request[3]);
}

static enum modbus_exception write_several(struct call *c)
{
    const uint32_t count = word(c, 3);
    if (count == 0u || count > WRITE_MAX || c->request[5] != 2u * count || c->count != 6u + 2u * count) {
        return MODBUS_ILLEGAL_VALUE;
    }
    echo_request(c, 5);
    return modbus_write(c->drive, word(c, 1), count, &c->request[6]);
}

static enum modbus_exception write_masked(struct call *c)
{
    uint8_t now[2];
    const enum modbus_exception wrong = modbus_read(c->drive, word(c, 1), 1, now);
    if (wrong != MODBUS_OK) {
        return wrong;
    }
    for (size_t n = 0; n < 2u; n++) {
        const uint8_t kept = c->request[3u + n];
        now[n] = (uint8_t)((now[n] & kept) | (c->request[5u + n] & (uint8_t)~kept));
    }
    echo_request(c, 7);
    return modbus_write(c->drive, word(c, 1), 1, now);
}

/* Checks first that it can be read: otherwise nothing is written. The read returns the values after the write. */
static enum modbus_exception write_and_read(struct call *c)
{
    const uint32_t reads = word(c, 3);
    const uint32_t writes = word(c, 7);
    if (reads == 0u || reads > READ_MAX || writes == 0u || writes > READ_WRITE_MAX || c->request[9] != 2u * writes ||
        c->count != 10u + 2u * writes) {
        return MODBUS_ILLEGAL_VALUE;
    }
    enum modbus_exception wrong = read_into(c, word(c, 1), reads);
    if (wrong == MODBUS_OK) {
        wrong = modbus_write(c->drive, word(c, 5), writes, &c->request[10]);
    }
    return wrong == MODBUS_OK ? read_into(c, word(c, 1), reads) : wrong;
}

/* ---- 43/14: device identification ---- */

#define OF_IDENTIFICATION 0x0Eu
#define CONFORMITY        0x82u /* regular identification, stream and individual access */

enum { BASIC = 1, REGULAR = 2, EXTENDED = 3, SINGLE = 4 };

static const char *const identification[] = {
    "mssfoc",                               /* vendor's name */
    "mssfoc",                               /* product code */
    CONFIG_VERSION,                         /* revision */
    "",                                     /* vendor's address in the web */
    "mssfoc motor drive",                   /* product name */
    "SmartFusion2, field-oriented control", /* model */
    "",                                     /* the user's name for it */
};

#define BASIC_OBJECTS   3u
#define REGULAR_OBJECTS (sizeof identification / sizeof identification[0])

static void put_identification(struct call *c, uint32_t object)
{
    const size_t head = c->replied;
    size_t end = head + 2u;
    for (const char *letter = identification[object]; *letter != '\0'; letter++) {
        c->reply[end++] = (uint8_t)*letter;
    }
    c->reply[head] = (uint8_t)object;
    c->reply[head + 1u] = (uint8_t)(end - head - 2u);
    c->replied = end;
}

/* All fit into one reply: some 90 characters. A stream from a missing object starts at the first. */
static enum modbus_exception identify(struct call *c)
{
    const uint32_t what = c->request[2];
    uint32_t first = c->request[3];
    if (c->request[1] != OF_IDENTIFICATION) {
        return MODBUS_ILLEGAL_FUNCTION;
    }
    if (what < BASIC || what > SINGLE) {
        return MODBUS_ILLEGAL_VALUE;
    }
    uint32_t end = what == BASIC ? BASIC_OBJECTS : REGULAR_OBJECTS;
    if (what == SINGLE) {
        if (first >= REGULAR_OBJECTS) {
            return MODBUS_ILLEGAL_ADDRESS;
        }
        end = first + 1u;
    }
    first = first < end ? first : 0u;
    const uint8_t head[] = {c->request[0], OF_IDENTIFICATION, (uint8_t)what, CONFORMITY, 0, 0, (uint8_t)(end - first)};
    for (size_t n = 0; n < sizeof head; n++) {
        c->reply[n] = head[n];
    }
    c->replied = sizeof head;
    for (uint32_t object = first; object < end; object++) {
        put_identification(c, object);
    }
    return MODBUS_OK;
}

/* ---- dispatch ---- */

static const struct function {
    uint8_t code;
    uint8_t least; /* bytes of its request */
    bool writes;
    enum modbus_exception (*run)(struct call *c);
} modbus_functions[] = {
    {0x03, 5, false, read_registers}, {0x04, 5, false, read_registers}, {0x06, 5, true, write_one},
    {0x10, 6, true, write_several},   {0x16, 7, true, write_masked},    {0x17, 10, true, write_and_read},
    {0x2B, 4, false, identify},
};

static enum modbus_exception run_function(struct call *c, bool writes_only)
{
    for (size_t n = 0; n < sizeof modbus_functions / sizeof modbus_functions[0]; n++) {
        const struct function *const f = &modbus_functions[n];
        if (f->code == c->request[0] && (f->writes || !writes_only)) {
            return c->count < f->least ? MODBUS_ILLEGAL_VALUE : f->run(c);
        }
    }
    return MODBUS_ILLEGAL_FUNCTION;
}

size_t modbus_function(struct bus_drive *d, const uint8_t *request, size_t count, bool writes_only, uint8_t *reply)
{
    struct call call = {.drive = d, .request = request, .count = count, .reply = reply};
    const enum modbus_exception wrong = run_function(&call, writes_only);
    reply[0] = request[0];
    if (wrong != MODBUS_OK) {
        reply[0] = request[0] | EXCEPTION;
        reply[1] = (uint8_t)wrong;
        call.replied = 2;
    }
    return call.replied;
}
