/* SPDX-License-Identifier: MIT */
/* The three lines between those who speak and the drivers of tests/unit/host. */
#include <string.h>

#include "swarm.h"
#include "tests/unit/host/bus.h"
#include "tests/unit/host/can.h"

extern char host_heard[4096];
extern uint32_t host_said_bytes, host_heard_bytes, host_heard_taken;

struct can lines_can;
struct rs485 lines_rs485;

bool world_can_is_up(void)
{
    return world.powered && world.canopen.can->regs != NULL && host_can_state != CAN_OFF && world.cut == 0;
}

bool world_can(uint32_t id, const uint8_t *data, uint32_t count)
{
    if (!world_can_is_up() || host_can_saids == CAN_QUEUE) {
        return false;
    }
    struct can_frame *const f = &host_can_said[host_can_saids++];
    *f = (struct can_frame){.id = (uint16_t)id, .count = (uint8_t)count};
    memcpy(f->data, data, count);
    return true;
}

bool world_type(const char *text)
{
    const size_t length = strlen(text);
    if (!world.powered || host_heard_bytes + length + 1u >= sizeof host_heard) {
        return false;
    }
    memcpy(host_heard + host_heard_bytes, text, length);
    host_heard_bytes += (uint32_t)length;
    host_heard[host_heard_bytes++] = '\r';
    return true;
}

/* A request to a thread that does not come is late when it does: no answer. */
bool world_modbus(const uint8_t *bytes, uint32_t count)
{
    const bool hears = world.powered && world.hung_ms == 0;
    if (hears) {
        memcpy(host_bus_heard, bytes, count);
        host_bus_heard_bytes = count;
        host_bus_heard_taken = 0u;
        host_bus_marks = host_bus_silence_mark;
    }
    return hears;
}

/* A bus that is off stays so until it is whole again, and the driver tries. */
static void deliver_can(void)
{
    const bool open = world.canopen.can->regs != NULL, stays = host_can_state == CAN_OFF && host_can_recovers == 0u;
    host_can_state = open && (world.cut != 0 || stays) ? CAN_OFF : CAN_ACTIVE;
    host_can_cut = host_can_state == CAN_OFF;
    (void)can_pending(&lines_can); /* what waited goes out */
    for (uint32_t n = 0; n < host_can_heards; n++) {
        masters_hear_can(&host_can_heard[n]);
    }
    host_can_heards = 0u;
    if (host_can_taken == host_can_saids) {
        host_can_saids = host_can_taken = 0u;
    }
}

/* Behind the thread's turn. */
void lines_deliver(void)
{
    lines_rs485.driving = false;
    if (host_bus_sent_bytes != 0u) {
        masters_hear_modbus(host_bus_sent, host_bus_sent_bytes);
        host_bus_sent_bytes = 0u;
    }
    deliver_can();
}

void lines_reset(void)
{
    memset(&lines_can, 0, sizeof lines_can);
    host_can_heards = host_can_saids = host_can_taken = host_can_state = host_can_cut = 0u;
    host_bus_heard_bytes = host_bus_heard_taken = host_bus_sent_bytes = 0u;
    host_heard_bytes = host_heard_taken = host_said_bytes = 0u;
}
