/* SPDX-License-Identifier: MIT */
#include "firmware/operate/modbus_functions.h"

/* ---- places ---- */

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

/* ---- reading ---- */

static void put_words(uint8_t *bytes, uint32_t value, uint32_t words)
{
    for (uint32_t n = 2u * words; n > 0u; n--) {
        bytes[n - 1u] = (uint8_t)value;
        value >>= 8;
    }
}

enum modbus_exception modbus_read(const struct bus_drive *d, uint32_t at, uint32_t count, uint8_t *bytes)
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
    return MODBUS_FINE;
}

/* ---- writing ---- */

/* Two's complement, of 16 bits what the type says. */
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
    return refusal == OBJECT_FINE        ? MODBUS_FINE
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
        if (wrong != OBJECT_FINE) {
            return exception_of(wrong);
        }
        done += words_of(&p);
    }
    return MODBUS_FINE;
}

enum modbus_exception modbus_write(struct bus_drive *d, uint32_t at, uint32_t count, const uint8_t *bytes)
{
    struct object_change change;
    object_begin(&change, d);
    enum modbus_exception wrong = gather_change(&change, at, count, bytes);
    if (wrong == MODBUS_FINE) {
        wrong = exception_of(object_commit(&change, d));
    }
    if (wrong != MODBUS_FINE && wrong != MODBUS_ILLEGAL_ADDRESS) {
        object_stop(&change, d);
    }
    return wrong;
}
