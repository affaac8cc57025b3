/* SPDX-License-Identifier: MIT */
/*
 * A Modbus RTU server (MODBUS over Serial Line V1.02) on an RS-485 line: splits received bytes into frames, carries out
 * requests to this drive and answers: the first axis under modbus_address, a second under the next address. Parameters
 * modbus_address, modbus_baud and modbus_parity of the first take effect as soon as the line is idle. Thread.
 */
#ifndef FIRMWARE_OPERATE_MODBUS_H
#define FIRMWARE_OPERATE_MODBUS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "drivers/mss/rs485.h"
#include "firmware/operate/objects.h"

/* ==== frames ==== */

/*
 * Modbus RTU framing: finds where frames begin and end on the line.
 *
 * The standard ends a frame by a silence of 3.5 characters, but USB adapters add and remove silences. So a frame ends where its
 * function code says, if the check sum matches there, without waiting for a silence. Requests to other servers and their
 * replies differ only in length: both lengths are tried. A silence within a frame is ignored, unless it lasts for
 * MODBUS_FRAME_TIMEOUT_MS, or a request to this drive broke off there and a complete one follows.
 *
 * If no length fits, or the function is unknown, the frame's end is unknown. Only then a silence counts: parsing resumes after
 * the first one received. It never resumes elsewhere, so data of another server is never taken for a request. A frame found
 * this way is dropped if more bytes have followed it: it is too late.
 *
 * No I/O: bytes and silences in, frames out. Thread.
 */
#define MODBUS_FRAME_BYTES      256u
#define MODBUS_FRAME_TIMEOUT_MS 50u /* within a frame: USB adapters delay characters by 16 ms */
#define MODBUS_BROADCAST        0u
#define MODBUS_ADDRESS_MAX      247u

struct modbus_frame {
    uint8_t bytes[MODBUS_FRAME_BYTES];
    size_t count;
    size_t silence; /* position of the first one in `bytes`; 0: none */
    size_t tried;   /* bytes examined so far: no frame from bytes[0] or from the silence ends in them */
    bool lost;      /* no frame begins at bytes[0] */
    bool open;      /* a request of an unknown function may begin there: a silence ends it */
    bool resumed;   /* bytes[0] came after a silence, not after a frame */
};

/* Drops what has been received. Thread. */
void modbus_frame_forget(struct modbus_frame *f);

/* ==== functions ==== */

/*
 * Modbus functions 3, 4, 6, 16, 22, 23 and 43/14 (MODBUS Application Protocol V1.1b3) and the registers that they work on.
 * After an exception nothing has changed, except that a control word that stops is obeyed. Thread.
 */
#define MODBUS_PDU_BYTES 253u

/* MODBUS Application Protocol V1.1b3, chapter 7 */
enum modbus_exception {
    MODBUS_OK,
    MODBUS_ILLEGAL_FUNCTION,
    MODBUS_ILLEGAL_ADDRESS,
    MODBUS_ILLEGAL_VALUE,
    MODBUS_DEVICE_FAILURE,  /* the drive's state does not allow it */
    MODBUS_DEVICE_BUSY = 6, /* another line commands the drive */
};

/* Where reactions to faults begin, by fault number; and parameters in the order of param_table, two registers each. */
#define MODBUS_REACTIONS 0x0400u
#define MODBUS_PARAMS    0x1000u

/*
 * Carries out `request`, of `count` bytes without address and check sum, and writes the reply of at most MODBUS_PDU_BYTES;
 * returns its length. `writes_only`: a broadcast; reads do nothing, and the reply is not sent.
 */
size_t modbus_function(struct bus_drive *d, const uint8_t *request, size_t count, bool writes_only, uint8_t *reply);

/* ==== the line ==== */

struct modbus {
    struct rs485 *line;
    struct bus_drive drives[AXIS_COUNT];
    struct modbus_frame frame;
    int32_t address, baud, parity; /* in effect */
    uint32_t silence_ms;           /* longer than 3.5 characters in any case */
    uint32_t received_ms;          /* when the last character was received */
    uint8_t reply[MODBUS_FRAME_BYTES];
};

/* Opens the line. Once, when the axes have been initialised: `axes` and `slots` have AXIS_COUNT elements. */
void modbus_start(struct modbus *m, struct rs485 *line, struct axis *axes, const struct slots *slots);

/* Serves the line; call it repeatedly. Takes as long as `on` if requested to enable operation. */
void modbus_poll(struct modbus *m);

#endif
