/* SPDX-License-Identifier: MIT */
/*
 * A Modbus RTU slave (MODBUS over Serial Line V1.02) on an RS-485 line: splits received bytes into frames (modbus_frame.h),
 * carries out requests to this drive (modbus_functions.h) and answers: the first axis under modbus_address, a second under the
 * next address. Parameters modbus_address, modbus_baud and modbus_parity of the first take effect as soon as the line is idle.
 * Thread.
 */
#ifndef FIRMWARE_OPERATE_MODBUS_H
#define FIRMWARE_OPERATE_MODBUS_H

#include "drivers/mss/rs485.h"
#include "firmware/operate/modbus_frame.h"
#include "firmware/operate/modbus_functions.h"

struct modbus {
    struct rs485 *line;
    struct bus_drive drives[AXIS_COUNT];
    struct modbus_frame frame;
    int32_t address, baud, parity; /* as they are in effect */
    uint32_t silence_ms;           /* certainly longer than 3.5 characters */
    uint32_t heard_ms;             /* when the last character came */
    uint8_t reply[MODBUS_FRAME_BYTES];
};

/* Opens the line. Once, when the axes have been initialised: AXIS_COUNT of them, and of places to store. */
void modbus_start(struct modbus *m, struct rs485 *line, struct axis *axes, const struct slots *slots);

/* Serves the line; call it whenever there is time. Takes as long as `on` if requested to enable operation. */
void modbus_poll(struct modbus *m);

#endif
