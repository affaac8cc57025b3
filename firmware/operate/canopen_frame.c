/* SPDX-License-Identifier: MIT */
#include "firmware/operate/canopen.h"
#include "firmware/operate/objects.h"

#define TX_STALL_MS 100u    /* longer than a frame waits on a fully loaded bus */
#define TX_BACKLOG  8u      /* frames: two cycles of four PDOs */
#define OLDEST_MS   100000u /* above any time of the bus, 65 535 ms; ten times this fits into 32 bits */

void canopen_open(struct canopen *c, int32_t kbit_s)
{
    uint32_t rate = (uint32_t)kbit_s;
    while (!can_rate_is_known(rate)) {
        rate--;
    }
    (void)can_open(c->can, CAN, rate, c->line.recover != 0);
    canopen_note_progress(c); /* another line: a stall of the former one does not count */
}

struct canopen_line canopen_line(const struct params *p)
{
    return (struct canopen_line){p->can_node, p->can_kbit, p->can_recover};
}

bool canopen_line_differs(const struct canopen_line *one, const struct canopen_line *other)
{
    return one->node != other->node || one->kbit != other->kbit || one->recover != other->recover;
}

void canopen_set_line(struct params *p, const struct canopen_line *line)
{
    p->can_node = line->node;
    p->can_kbit = line->kbit;
    p->can_recover = line->recover;
}

bool canopen_has_backlog(const struct canopen *c)
{
    return can_pending(c->can) >= TX_BACKLOG;
}

void canopen_note_progress(struct canopen *c)
{
    c->tx_count = c->can->tx_tail;
    c->tx_progress_ms = canopen_now_ms(c);
    c->tx_stalled = false;
}

void canopen_watch_tx(struct canopen *c)
{
    if (can_pending(c->can) == 0u || (c->can->tx_tail != c->tx_count && !c->tx_stalled)) {
        canopen_note_progress(c);
    } else if (canopen_now_ms(c) - c->tx_progress_ms > TX_STALL_MS) {
        c->tx_stalled = true;
        can_forget(c->can);
    }
}

bool canopen_send(struct canopen *c, uint32_t id, const uint8_t *data, uint32_t count)
{
    if (canopen_is_silent(c) || c->tx_stalled) {
        return false;
    }
    struct can_frame f = {.id = (uint16_t)(id & CANOPEN_ID), .count = (uint8_t)count};
    for (uint32_t n = 0; n < count; n++) {
        f.data[n] = data[n];
    }
    return can_send(c->can, &f); /* the driver counts frames that do not fit */
}

void canopen_put(uint8_t *bytes, uint32_t value, uint32_t count)
{
    for (uint32_t n = 0; n < count; n++) {
        bytes[n] = (uint8_t)(value >> (8u * n));
    }
}

uint32_t canopen_get(const uint8_t *bytes, uint32_t count)
{
    uint32_t value = 0;
    for (uint32_t n = 0; n < count; n++) {
        value |= (uint32_t)bytes[n] << (8u * n);
    }
    return value;
}

uint32_t canopen_now_ms(const struct canopen *c)
{
    return c->drives[0].axis->time_ms;
}

uint32_t canopen_elapsed_ms(const struct canopen *c, uint32_t *then_ms)
{
    const uint32_t since_ms = canopen_now_ms(c) - *then_ms;
    if (since_ms <= OLDEST_MS) {
        return since_ms;
    }
    *then_ms += since_ms - OLDEST_MS;
    return OLDEST_MS;
}

uint32_t canopen_bytes(enum object_type type)
{
    return type <= OBJECT_TYPE_U8 ? 1u : type <= OBJECT_TYPE_I16 ? 2u : 4u;
}

int32_t canopen_signed(uint32_t value, enum object_type type)
{
    return type == OBJECT_TYPE_I8 ? (int8_t)value : type == OBJECT_TYPE_I16 ? (int16_t)value : (int32_t)value;
}

void canopen_note_activity(struct canopen *c)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        owner_message(c->drives[n].axis, OWNER_CAN);
    }
}

struct object_place canopen_place(uint32_t index, uint32_t subindex)
{
    index -= canopen_axis(index) * CANOPEN_AXIS;
    if (AXIS_COUNT > 1u && index == CANOPEN_TYPE && subindex == 0u) {
        return (struct object_place){PLACE_OBJECT, OBJECT_device_type};
    }
    if (index - CANOPEN_PARAMS < param_count && subindex == 0u) {
        return (struct object_place){PLACE_PARAM, index - CANOPEN_PARAMS};
    }
    if (index > CANOPEN_REACTIONS && index - CANOPEN_REACTIONS < FAULT_COUNT && subindex == 0u) {
        return (struct object_place){PLACE_REACTION, index - CANOPEN_REACTIONS};
    }
    for (uint32_t n = 0; n < OBJECT_COUNT; n++) {
        if (objects[n].index == index && objects[n].subindex == subindex) {
            return (struct object_place){PLACE_OBJECT, n};
        }
    }
    for (uint32_t n = 0; n < profile_object_count; n++) {
        if (profile_objects[n].index == index && profile_objects[n].subindex == subindex) {
            return (struct object_place){PLACE_PROFILE, n};
        }
    }
    return (struct object_place){.kind = PLACE_NONE};
}
