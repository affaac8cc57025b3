/* SPDX-License-Identifier: MIT */
/* What each of the scope's signals is, for people. */
#ifndef FIRMWARE_OPERATE_SIGNAL_TEXT_H
#define FIRMWARE_OPERATE_SIGNAL_TEXT_H

/* Of a name in signal_table; never NULL. Any context. */
const char *signal_text(const char *name);

#endif
