/* SPDX-License-Identifier: MIT */
/*
 * The registers: their contents, and all-or-nothing writes of several. Function codes 3 and 4 see the same.
 *
 * A 32-bit value takes two registers, the high one first, and is read and written as a whole: a request for half of one gets
 * MODBUS_ILLEGAL_ADDRESS. Thread.
 */
#ifndef FIRMWARE_OPERATE_MODBUS_REGISTERS_H
#define FIRMWARE_OPERATE_MODBUS_REGISTERS_H

#include <stdint.h>

#include "firmware/drive/drive.h"
#include "firmware/operate/cia402.h"
#include "firmware/settings/slots.h"

/* MODBUS Application Protocol V1.1b3, chapter 7 */
enum modbus_exception {
    MODBUS_FINE,
    MODBUS_ILLEGAL_FUNCTION,
    MODBUS_ILLEGAL_ADDRESS,
    MODBUS_ILLEGAL_VALUE,
    MODBUS_DEVICE_FAILURE, /* the drive's state does not allow it */
};

struct modbus_drive {
    struct axis *axis;
    const struct slots *slots; /* where settings are stored */
    struct cia402 cia402;
};

/* `count` registers from `at` on, as bytes of the line; all of one instant. Range: 1...125. */
enum modbus_exception modbus_read(const struct modbus_drive *d, uint32_t at, uint32_t count, uint8_t *bytes);

/*
 * Checks the values and writes them. Nothing has changed unless it returns MODBUS_FINE. Each value is checked against its
 * range; several parameters also together, as switching on would. Range: 1...123.
 */
enum modbus_exception modbus_write(struct modbus_drive *d, uint32_t at, uint32_t count, const uint8_t *bytes);

#endif
