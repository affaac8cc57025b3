/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Events that somebody sends while the run goes on, a line each, as a scenario's but without a time: they happen at once. */
#ifndef TWIN_LIVE_H
#define TWIN_LIVE_H

/* From a named pipe that exists. Such a run cannot be repeated to the byte. Ends the program if the pipe cannot be opened. */
void live_start(const char *path);

#endif
