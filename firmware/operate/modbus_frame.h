/* SPDX-License-Identifier: MIT */
/*
 * Modbus RTU: where frames begin and end in what is heard on the line.
 *
 * The standard ends a frame by a silence of 3.5 characters, which a USB adapter tears open and closes as it likes. So a frame
 * ends here where its function code says, if the check sum fits there; nobody waits for a silence. Requests to other slaves
 * and their replies look alike up to their length: both lengths are tried. While a frame is on its way, silence means
 * nothing, until it has lasted for MODBUS_PATIENCE_MS; or a request to this drive broke off there, and a whole one stands
 * behind it.
 *
 * Where no length fits, or the function is unknown, what follows cannot be told from what was. Then, and only then, a silence
 * counts: reading goes on behind the first one that was heard. Never does it begin elsewhere, so that what another slave
 * sends is not taken for a request, whatever it contains. A frame found so is for nobody if something has followed it: it is
 * too late.
 *
 * Pure: bytes and silences in, frames out. Thread.
 */
#ifndef FIRMWARE_OPERATE_MODBUS_FRAME_H
#define FIRMWARE_OPERATE_MODBUS_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define MODBUS_FRAME_BYTES  256u
#define MODBUS_PATIENCE_MS  50u /* in the midst of a frame: USB adapters hold characters back for 16 ms */
#define MODBUS_BROADCAST    0u
#define MODBUS_ADDRESS_MOST 247u

struct modbus_frame {
    uint8_t bytes[MODBUS_FRAME_BYTES];
    size_t count;
    size_t silence; /* where the first one that was heard in `bytes` is; 0: there was none */
    size_t tried;   /* so many bytes have been looked at: no frame from bytes[0], or from the silence, ends in them */
    bool lost;      /* no frame begins at bytes[0] */
    bool open;      /* a request of a function that nobody knows may begin there: a silence ends it */
    bool resumed;   /* bytes[0] came behind a silence and not behind a frame */
};

/* Forgets what has been heard. */
void modbus_frame_forget(struct modbus_frame *f);

/* A silence of 3.5 characters or more. */
void modbus_frame_silence(struct modbus_frame *f);

/* A byte. */
void modbus_frame_hear(struct modbus_frame *f, uint8_t byte);

/*
 * The length of a frame at the beginning of `bytes` that is complete, with its check sum, and 0 if there is none. `address`:
 * whose requests are looked for, which decides what lengths a frame may have. The caller takes it by modbus_frame_drop().
 */
size_t modbus_frame_find(struct modbus_frame *f, uint8_t address);

/* At a silence, before it is told: the length of the request of an unknown function that it ends, or 0. */
size_t modbus_frame_find_open(const struct modbus_frame *f);

/* Whether a frame of this length is too old to be carried out. */
bool modbus_frame_is_late(const struct modbus_frame *f, size_t length);

/* Takes so many bytes from the beginning. */
void modbus_frame_drop(struct modbus_frame *f, size_t length);

#endif
