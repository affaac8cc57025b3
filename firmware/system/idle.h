/* SPDX-License-Identifier: MIT */
/* What the thread does while it has nothing to do: serves the watchdog as long as the interrupts live, and sleeps. */
#ifndef FIRMWARE_SYSTEM_IDLE_H
#define FIRMWARE_SYSTEM_IDLE_H

/* Sleeps until the next interrupt has been served. Thread only. */
void idle(void);

#endif
