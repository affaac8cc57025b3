/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The bus behind the CAN controller, with the time that bits take: one frame at a time, the lowest identifier first,
 * acknowledged by whoever else is there. Everybody but other twins uses the rate that the controller is set to. What others
 * send while nobody hears them is lost: they do not try again.
 *
 * Others are programs and twins at a character device (can_device.h), and events of a scenario. These are there from its first
 * frame on, and with this twin alone.
 *
 * The log has a line for each frame: nanoseconds at its end, what, identifier, data in hexadecimal.
 *   rx BYTES  heard by the drive         lost     likewise, but it was not there
 *   tx BYTES  by the drive, acknowledged  unheard  not so; only the first of its tries
 *   broken    by the drive, destroyed     off, on  the drive has left the bus because of errors, and is back
 *   noise     somebody's, destroyed */
#ifndef TWIN_CAN_BUS_H
#define TWIN_CAN_BUS_H

#include <stdbool.h>

/* Maps the controller. Before the first instruction. */
void can_bus_map(void);

/* Either may be NULL: a character device of QEMU where others are, and where the log goes. Ends the process with one line if
 * there is no such device, or the file cannot be written. Timers must be allowed. */
void can_bus_open(const char *chardev_id, bool slcan, const char *log_path);

/* Somebody sends "ID#DATA", hexadecimal; "ID#R" asks for it. */
void can_bus_send(const char *text);
/* So many frames of the drive are destroyed on their way. */
void can_bus_break(unsigned frames);
/* The drive alone at its end of a cable. */
void can_bus_cut(bool is_cut);

/* Of the device; or of the block, by the bit of SOFT_RESET_CR. */
void can_bus_reset(void);
void can_bus_note_reset(void);
void can_bus_flush(void);

#endif
