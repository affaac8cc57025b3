/* SPDX-License-Identifier: MIT */
/*
 * Modbus RTU framing: finds where frames begin and end on the line.
 *
 * The standard ends a frame by a silence of 3.5 characters, but a USB adapter inserts and removes silences at will. So here a
 * frame ends where its function code says, if the check sum matches there; nothing waits for a silence. Requests to other
 * slaves and their replies differ only in length: both lengths are tried. Within a frame a silence means nothing, until it has
 * lasted for MODBUS_PATIENCE_MS; or if a request to this drive broke off there and a complete one follows.
 *
 * If no length fits, or the function is unknown, the frame's end cannot be told. Then, and only then, a silence counts: reading
 * resumes after the first one heard. It never resumes elsewhere, so data from another slave is never taken for a request,
 * whatever it contains. A frame found this way is dropped if something has followed it: it is too late.
 *
 * Pure: bytes and silences in, frames out. Thread.
 */
#ifndef FIRMWARE_OPERATE_MODBUS_FRAME_H
#define FIRMWARE_OPERATE_MODBUS_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define MODBUS_FRAME_BYTES  256u
#define MODBUS_PATIENCE_MS  50u /* within a frame: USB adapters hold characters back for 16 ms */
#define MODBUS_BROADCAST    0u
#define MODBUS_ADDRESS_MOST 247u

struct modbus_frame {
    uint8_t bytes[MODBUS_FRAME_BYTES];
    size_t count;
    size_t silence; /* where the first one heard in `bytes` is; 0: none */
    size_t tried;   /* bytes examined so far: no frame from bytes[0], or from the silence, ends in them */
    bool lost;      /* no frame begins at bytes[0] */
    bool open;      /* a request of an unknown function may begin there: a silence ends it */
    bool resumed;   /* bytes[0] came after a silence, not after a frame */
};

/* Forgets what has been heard. */
void modbus_frame_forget(struct modbus_frame *f);

/* A silence of 3.5 characters or more. */
void modbus_frame_silence(struct modbus_frame *f);

/* A byte. */
void modbus_frame_hear(struct modbus_frame *f, uint8_t byte);

/*
 * The length of a complete frame at the beginning of `bytes`, check sum included; 0 if there is none. `address`: the first of
 * AXIS_COUNT whose requests are searched for, which decides the possible lengths. The caller removes it by modbus_frame_drop().
 */
size_t modbus_frame_find(struct modbus_frame *f, uint8_t address);

/* At a silence, before modbus_frame_silence(): the length of the unknown function's request that it ends, or 0. */
size_t modbus_frame_find_open(const struct modbus_frame *f);

/* True if a frame of this length is too old to be carried out. */
bool modbus_frame_is_late(const struct modbus_frame *f, size_t length);

/* Removes `length` bytes from the beginning. */
void modbus_frame_drop(struct modbus_frame *f, size_t length);

#endif
