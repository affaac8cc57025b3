/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The bus as a process of its own (can_hub.h): it outlives the twin that it began with, and ends with the last one. Who has
 * connected and not said yet whether he is one, a twin that waits for a debugger, say, keeps it, too.
 *
 *     canbus FD    a socket that listens; standard input ends when whoever has started this does */
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "can_hub.h"

#define LOOK_MS 20 /* how often time alone may change something */

enum { LAUNCHER, LISTENER, FIRST_END };

static struct can_hub hub;
static struct pollfd polled[FIRST_END + CAN_HUB_ENDS]; /* an end has the place of its number; -1: not there */
static bool abandoned;                                 /* nobody will start a first twin any more */

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000LL + now.tv_nsec / 1000000;
}

static void leave(int end)
{
    close(polled[FIRST_END + end].fd);
    polled[FIRST_END + end].fd = -1;
    can_hub_leave(&hub, end);
}

static void admit(void)
{
    const int at_once = 1;
    int fd = accept(polled[LISTENER].fd, NULL, NULL);
    int end = fd < 0 ? -1 : can_hub_join(&hub, now_ms());
    if (end >= 0) {
        (void)setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof at_once);
        polled[FIRST_END + end].fd = fd;
    } else if (fd >= 0) {
        (void)send(fd, CAN_HUB_FULL, strlen(CAN_HUB_FULL), MSG_DONTWAIT | MSG_NOSIGNAL);
        close(fd);
    }
}

static void hear(int end)
{
    char bytes[4096];
    ssize_t count = recv(polled[FIRST_END + end].fd, bytes, sizeof bytes, MSG_DONTWAIT);
    if (count > 0) {
        can_hub_hear(&hub, end, bytes, (size_t)count, now_ms());
    } else if (count == 0 || (errno != EAGAIN && errno != EINTR)) {
        leave(end);
    }
}

static void write_out(int end)
{
    const struct can_end *e = &hub.ends[end];
    ssize_t count = send(polled[FIRST_END + end].fd, e->out, e->waiting, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (count > 0) {
        can_hub_written(&hub, end, (size_t)count, now_ms());
    } else if (errno != EAGAIN && errno != EINTR) {
        leave(end);
    }
}

static void write_all(void)
{
    for (int end = 0; end < CAN_HUB_ENDS; end++) {
        if (polled[FIRST_END + end].fd >= 0 && hub.ends[end].waiting > 0) {
            write_out(end);
        }
    }
}

/* Whether somebody is kept from speaking: that ends by itself, too. */
static bool choose(void)
{
    bool held = false;
    for (int end = 0; end < CAN_HUB_ENDS; end++) {
        bool may = can_hub_may_speak(&hub, end, now_ms());
        short wanted = hub.ends[end].waiting > 0 ? POLLOUT : 0;
        polled[FIRST_END + end].events = (short)(wanted | (may ? POLLIN : 0));
        held = held || (polled[FIRST_END + end].fd >= 0 && !may);
    }
    return held;
}

static void turn(void)
{
    bool held = choose();
    if (poll(polled, FIRST_END + CAN_HUB_ENDS, held || can_hub_waits(&hub) ? LOOK_MS : -1) < 0) {
        return;
    }
    if (polled[LAUNCHER].revents) {
        char unread[64];
        abandoned = read(STDIN_FILENO, unread, sizeof unread) <= 0;
        polled[LAUNCHER].fd = abandoned ? -1 : STDIN_FILENO;
    }
    for (int end = 0; end < CAN_HUB_ENDS; end++) {
        short happened = polled[FIRST_END + end].revents;
        if (polled[FIRST_END + end].fd >= 0 && (happened & ~POLLOUT)) {
            hear(end);
        }
    }
    if (polled[LISTENER].revents) {
        admit();
    }
    can_hub_settle(&hub, now_ms());
    write_all();
}

int main(int argc, char **argv)
{
    if (argc != 2) {
        fprintf(stderr, "mssfoc: canbus FD: for CAN=tcp:PORT, which starts it\n");
        return 1;
    }
    for (int end = 0; end < CAN_HUB_ENDS; end++) {
        polled[FIRST_END + end].fd = -1;
    }
    polled[LAUNCHER] = (struct pollfd){.fd = STDIN_FILENO, .events = POLLIN};
    polled[LISTENER] = (struct pollfd){.fd = atoi(argv[1]), .events = POLLIN};
    (void)fcntl(polled[LISTENER].fd, F_SETFL, O_NONBLOCK); /* who wanted in may have gone again */
    while (can_hub_is_needed(&hub) || !(hub.had_twin || abandoned)) {
        turn();
    }
    return 0;
}
