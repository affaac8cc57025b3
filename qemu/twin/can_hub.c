/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "can_hub.h"

#include <stdio.h>
#include <string.h>

#define RESERVE_BYTES 4096u  /* of `out`, for what is no frame */
#define MUCH_BYTES    65536u /* for a twin to take */
#define PATIENCE_MS   1000   /* with a twin that takes nothing */

/* ---- what is to be written ---- */

static bool put(struct can_end *e, const char *text, size_t length, size_t reserve)
{
    if (e->waiting + length + reserve > sizeof e->out) {
        return false;
    }
    memcpy(e->out + e->waiting, text, length);
    e->waiting += length;
    return true;
}

static void say(struct can_end *e, const char *text)
{
    (void)put(e, text, strlen(text), 0);
}

void can_hub_written(struct can_hub *h, int end, size_t count, int64_t now_ms)
{
    struct can_end *e = &h->ends[end];
    e->waiting -= count;
    memmove(e->out, e->out + count, e->waiting);
    e->moved_ms = now_ms;
}

/* ---- who is on the bus ---- */

static bool node_of(const struct can_end *e)
{
    return e->used && e->twin && e->node.bit_ns > 0;
}

static bool differs(const struct can_end *one, const struct can_end *other)
{
    return node_of(one) && node_of(other) && one->node.bit_ns != other->node.bit_ns;
}

static struct can_others others_of(const struct can_hub *h, const struct can_end *e)
{
    struct can_others all = {false, false};
    for (const struct can_end *o = h->ends; o < h->ends + CAN_HUB_ENDS; o++) {
        if (o == e || !o->used) {
            continue;
        }
        all.hear = all.hear || o->listens || (node_of(o) && !differs(o, e));
        all.differ = all.differ || (differs(o, e) && !o->node.passive);
    }
    return all;
}

bool can_hub_waits(const struct can_hub *h)
{
    for (const struct can_end *e = h->ends; e < h->ends + CAN_HUB_ENDS; e++) {
        if (e->used && !e->twin && e->speaker.attached && !e->listens) {
            return true;
        }
    }
    return false;
}

void can_hub_settle(struct can_hub *h, int64_t now_ms)
{
    char text[CAN_TEXT_BYTES];
    for (struct can_end *e = h->ends; e < h->ends + CAN_HUB_ENDS; e++) {
        if (e->used && !e->twin && e->speaker.attached && now_ms - e->attached_ms > CAN_HUB_JOIN_MS) {
            e->listens = true;
        }
        e->moved_ms = e->waiting == 0 ? now_ms : e->moved_ms;
    }
    for (struct can_end *e = h->ends; e < h->ends + CAN_HUB_ENDS; e++) {
        if (!e->used || !e->twin) {
            continue;
        }
        struct can_others all = others_of(h, e);
        if ((all.hear != e->told.hear || all.differ != e->told.differ) && put(e, text, can_link_others(all, text), 0)) {
            e->told = all;
        }
    }
}

unsigned can_hub_twins(const struct can_hub *h)
{
    unsigned count = 0;
    for (const struct can_end *e = h->ends; e < h->ends + CAN_HUB_ENDS; e++) {
        count += e->used && e->twin;
    }
    return count;
}

bool can_hub_is_needed(const struct can_hub *h)
{
    for (const struct can_end *e = h->ends; e < h->ends + CAN_HUB_ENDS; e++) {
        if (e->used && (e->twin || !e->spoke)) {
            return true;
        }
    }
    return false;
}

bool can_hub_may_speak(const struct can_hub *h, int end, int64_t now_ms)
{
    for (const struct can_end *e = h->ends; e < h->ends + CAN_HUB_ENDS && !h->ends[end].twin; e++) {
        if (e->used && e->twin && e->waiting > MUCH_BYTES && now_ms - e->moved_ms < PATIENCE_MS) {
            return false;
        }
    }
    return true;
}

/* ---- frames ---- */

static void noise(struct can_hub *h, const struct can_end *from)
{
    for (struct can_end *e = h->ends; e < h->ends + CAN_HUB_ENDS; e++) {
        if (e != from && node_of(e)) {
            (void)put(e, CAN_LINK_NOISE, strlen(CAN_LINK_NOISE), RESERVE_BYTES);
        }
    }
}

/* A node of the same rate gets the frame, another one noise. */
static void carry(struct can_hub *h, const struct can_end *from, const struct can_frame *f)
{
    char wire[CAN_TEXT_BYTES], text[CAN_TEXT_BYTES];
    size_t length = can_link_wire(f, h->stamp_ns, wire);
    for (struct can_end *e = h->ends; e < h->ends + CAN_HUB_ENDS; e++) {
        if (!e->used || e == from) {
            continue;
        }
        if (e->twin && differs(from, e)) {
            (void)put(e, CAN_LINK_NOISE, strlen(CAN_LINK_NOISE), RESERVE_BYTES);
        } else if (e->twin) {
            (void)put(e, wire, length, RESERVE_BYTES);
        } else if (e->listens) {
            (void)put(e, text, can_tell(&e->speaker, f, h->stamp_ns, text), RESERVE_BYTES);
        }
    }
}

/* Whatever the rate of a program is, one of two nodes that differ destroys its frame. */
static bool nodes_differ(const struct can_hub *h)
{
    for (const struct can_end *e = h->ends; e < h->ends + CAN_HUB_ENDS; e++) {
        if (node_of(e) && others_of(h, e).differ) {
            return true;
        }
    }
    return false;
}

static void program_says(struct can_hub *h, struct can_end *e, const char *command, int64_t now_ms)
{
    char text[CAN_TEXT_BYTES];
    if (strncmp(command, "twins", 5) == 0) {
        (void)sprintf(text, "< twins %u >", can_hub_twins(h));
        say(e, text);
        return;
    }
    bool was = e->speaker.attached;
    struct can_heard heard = can_obey(&e->speaker, command);
    e->attached_ms = e->speaker.attached && !was ? now_ms : e->attached_ms;
    e->listens = e->speaker.attached && (e->listens || heard.sends);
    if (heard.sends && nodes_differ(h)) {
        noise(h, e);
    } else if (heard.sends) {
        carry(h, e, &heard.frame);
    }
    if (heard.answer) {
        say(e, heard.answer);
    }
}

static void take(struct can_hub *h, struct can_end *e, const char *command, int64_t now_ms)
{
    struct can_said said = can_link_read(command);
    e->spoke = true;
    if (said.kind == CAN_SAYS_NODE) {
        e->twin = h->had_twin = true;
        e->listens = false;
        e->node = said.node;
    } else if (!e->twin) {
        program_says(h, e, command, now_ms);
    } else if (said.kind == CAN_SAYS_WIRE) {
        h->stamp_ns = said.ended_ns;
        carry(h, e, &said.frame);
    } else if (said.kind == CAN_SAYS_NOISE) {
        noise(h, e);
    }
}

/* ---- ends ---- */

int can_hub_join(struct can_hub *h, int64_t now_ms)
{
    for (int n = 0; n < CAN_HUB_ENDS; n++) {
        struct can_end *e = &h->ends[n];
        if (!e->used) {
            e->used = true;
            e->spoke = e->twin = e->listens = false;
            e->node = (struct can_node){0, false};
            e->told = (struct can_others){false, false};
            e->moved_ms = now_ms;
            e->waiting = 0;
            say(e, can_greet(&e->speaker));
            return n;
        }
    }
    return -1;
}

void can_hub_leave(struct can_hub *h, int end)
{
    h->ends[end].used = false;
}

void can_hub_hear(struct can_hub *h, int end, const char *bytes, size_t count, int64_t now_ms)
{
    for (size_t n = 0; n < count; n++) {
        const char *command = can_command(&h->ends[end].speaker, bytes[n]);
        if (command) {
            take(h, &h->ends[end], command, now_ms);
        }
    }
}
