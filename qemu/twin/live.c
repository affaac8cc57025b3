/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "live.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "events.h"
#include "qemu_api.h"
#include "scenario.h"

#define LOOK_NS 10000000 /* how often the pipe is looked at */

static int pipe_end;
static struct vm_timer *look_timer;
static char line[256];
static size_t length;

static void take_line(void)
{
    struct event e = {.t_s = (double)vm_now_ns() * 1e-9};
    const char *text = line;
    if (strncmp(line, "2 ", 2) == 0) { /* of axis 2 */
        e.axis = 1;
        text += 2;
    }
    const char *wrong = event_parse(text, &e);
    if (wrong) {
        fprintf(stderr, "mssfoc twin: live event '%s': %s\n", line, wrong);
    } else {
        scenario_play_now(&e);
    }
}

static void look(void *unused)
{
    (void)unused;
    char c;
    while (read(pipe_end, &c, 1) == 1) {
        if (c == '\n') {
            line[length] = '\0';
            if (length > 0) { /* an empty one follows each event: once it is read, the event has happened */
                take_line();
            }
            length = 0;
        } else if (length < sizeof line - 1) {
            line[length++] = c;
        }
    }
    vm_timer_at(look_timer, vm_now_ns() + LOOK_NS);
}

void live_start(const char *path)
{
    pipe_end = open(path, O_RDONLY | O_NONBLOCK);
    if (pipe_end < 0) {
        fprintf(stderr, "mssfoc twin: live %s: %s\n", path, strerror(errno));
        exit(1);
    }
    look_timer = vm_timer_new(look, NULL);
    look(NULL);
}
