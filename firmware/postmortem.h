/* SPDX-License-Identifier: MIT */
/*
 * What is left after a processor fault: the cause, the registers and the fault addresses, in RAM that a reset does not
 * clear, printed after the next boot.
 */
#ifndef FIRMWARE_POSTMORTEM_H
#define FIRMWARE_POSTMORTEM_H

#include <stdbool.h>

/* Whether the last reset followed a processor fault. Takes the record over; call once, early. Thread. */
bool postmortem_collect(void);

/* Prints the record that was collected, if there is one. Thread. */
void postmortem_print(void);

#endif
