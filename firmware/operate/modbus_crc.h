/* SPDX-License-Identifier: MIT */
/* The check sum of Modbus RTU (MODBUS over Serial Line, V1.02, 6.2.2): polynomial 0xA001 reflected, start 0xFFFF. */
#ifndef FIRMWARE_OPERATE_MODBUS_CRC_H
#define FIRMWARE_OPERATE_MODBUS_CRC_H

#include <stddef.h>
#include <stdint.h>

#define MODBUS_CRC_BYTES 2u

/* Of so many bytes; the low byte goes first on the line. Of a frame with its check sum it is 0. Any context. */
uint16_t modbus_crc(const uint8_t *bytes, size_t count);

#endif
