/* SPDX-License-Identifier: MIT */
#include "firmware/operate/modbus_objects.h"

enum { RO, RW };

/* clang-format off */
#define OBJECT_ROW(at, index, type, access, name, unit, what) {at, MODBUS_##type, access == RW},
const struct modbus_object modbus_objects[OBJECT_COUNT] = {
    MODBUS_OBJECTS(OBJECT_ROW)
};
/* clang-format on */
