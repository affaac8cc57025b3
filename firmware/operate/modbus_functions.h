/* SPDX-License-Identifier: MIT */
/*
 * Modbus functions 3, 4, 6, 16, 22, 23 and 43/14 (MODBUS Application Protocol V1.1b3) and the registers that they work on.
 * After an exception nothing has changed, but that a word which stops is obeyed. Thread.
 */
#ifndef FIRMWARE_OPERATE_MODBUS_FUNCTIONS_H
#define FIRMWARE_OPERATE_MODBUS_FUNCTIONS_H

#include <stddef.h>
#include <stdint.h>

#include "firmware/operate/object_values.h"

#define MODBUS_PDU_BYTES 253u

/* MODBUS Application Protocol V1.1b3, chapter 7 */
enum modbus_exception {
    MODBUS_FINE,
    MODBUS_ILLEGAL_FUNCTION,
    MODBUS_ILLEGAL_ADDRESS,
    MODBUS_ILLEGAL_VALUE,
    MODBUS_DEVICE_FAILURE,  /* the drive's state does not allow it */
    MODBUS_DEVICE_BUSY = 6, /* another line commands it */
};

/* Where reactions to faults begin, by fault number; and parameters in the order of param_table, two registers each. */
#define MODBUS_REACTIONS 0x0400u
#define MODBUS_PARAMS    0x1000u

/*
 * Carries out `request`, of `count` bytes without address and check sum, and writes the reply of at most MODBUS_PDU_BYTES;
 * returns its length. `writes_only`: a broadcast; reads do nothing, and the reply is not sent.
 */
size_t modbus_function(struct bus_drive *d, const uint8_t *request, size_t count, bool writes_only, uint8_t *reply);

#endif
