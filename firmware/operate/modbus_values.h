/* SPDX-License-Identifier: MIT */
/* The values of the objects in modbus_objects.h. Thread. */
#ifndef FIRMWARE_OPERATE_MODBUS_VALUES_H
#define FIRMWARE_OPERATE_MODBUS_VALUES_H

#include "firmware/operate/modbus_objects.h"
#include "firmware/operate/modbus_registers.h"

/* What a request sees: values of one instant. */
struct modbus_view {
    const struct axis *axis;
    const struct cia402 *cia402;
    struct drive_status now;
};

/* In the unit of the table; 32 bits of it. */
uint32_t modbus_value(const struct modbus_view *v, enum modbus_object_id object);

#endif
