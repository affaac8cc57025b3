/* SPDX-License-Identifier: MIT */
/*
 * Modbus functions 3, 4, 6, 16, 22, 23 and 43/14 (MODBUS Application Protocol V1.1b3): a request without address and check sum
 * in, its reply out. After an exception nothing has changed. Thread.
 */
#ifndef FIRMWARE_OPERATE_MODBUS_FUNCTIONS_H
#define FIRMWARE_OPERATE_MODBUS_FUNCTIONS_H

#include <stddef.h>

#include "firmware/operate/modbus_registers.h"

#define MODBUS_PDU_BYTES 253u

/*
 * Carries out `request`, of `count` bytes, and writes the reply of at most MODBUS_PDU_BYTES; returns its length.
 * `writes_only`: a broadcast; reads do nothing, and the reply is not sent.
 */
size_t modbus_function(struct modbus_drive *d, const uint8_t *request, size_t count, bool writes_only, uint8_t *reply);

/* 43/14: who this is. As above. */
enum modbus_exception modbus_identify(const uint8_t *request, uint8_t *reply, size_t *count);

#endif
