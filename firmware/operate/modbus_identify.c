/* SPDX-License-Identifier: MIT */
#include "firmware/operate/modbus_functions.h"
#include "firmware/settings/config.h"

#define OF_IDENTIFICATION 0x0Eu
#define CONFORMITY        0x82u /* regular identification, as a stream and one by one */

enum { BASIC = 1, REGULAR = 2, EXTENDED = 3, SINGLE = 4 };

static const char *const objects[] = {
    "mssfoc",                               /* vendor's name */
    "mssfoc",                               /* product code */
    CONFIG_VERSION,                         /* revision */
    "",                                     /* vendor's address in the web */
    "mssfoc motor drive",                   /* product name */
    "SmartFusion2, field-oriented control", /* model */
    "",                                     /* the user's name for it */
};

#define BASIC_OBJECTS   3u
#define REGULAR_OBJECTS (sizeof objects / sizeof objects[0])

static void put(uint8_t *reply, size_t *count, uint32_t object)
{
    const size_t head = *count;
    size_t end = head + 2u;
    for (const char *c = objects[object]; *c != '\0'; c++) {
        reply[end++] = (uint8_t)*c;
    }
    reply[head] = (uint8_t)object;
    reply[head + 1u] = (uint8_t)(end - head - 2u);
    *count = end;
}

/* All fit into one reply: some 90 letters. A stream from a missing object starts at the beginning. */
enum modbus_exception modbus_identify(const uint8_t *request, uint8_t *reply, size_t *count)
{
    const uint32_t what = request[2];
    uint32_t first = request[3];
    if (request[1] != OF_IDENTIFICATION) {
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
    const uint8_t head[] = {request[0], OF_IDENTIFICATION, (uint8_t)what, CONFORMITY, 0, 0, (uint8_t)(end - first)};
    for (size_t n = 0; n < sizeof head; n++) {
        reply[n] = head[n];
    }
    *count = sizeof head;
    for (uint32_t object = first; object < end; object++) {
        put(reply, count, object);
    }
    return MODBUS_FINE;
}
