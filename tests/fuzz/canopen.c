/* SPDX-License-Identifier: MIT */
/*
 * Frames on the bus of a node. The first byte of the input says whether the drive is in operation; then come frames, of a kind
 * and a length, and times. By the standard it is known which frame is meant for this node: any other changes nothing, and
 * nothing is sent for it; a request by SDO has one answer, and what is refused changes nothing; process data changes set-points
 * alone; layer setting changes nothing of a drive that is on, and of another the line alone.
 */
#include "firmware/operate/canopen.h"
#include "drive.h"
#include "tests/unit/host/can.h"

#define NODE      5
#define REMOTE    (1u << 15)
#define OF_NODE   0x7Fu
#define LSS_SAYS  0x7E4u
#define HEARTBEAT 0x700u

enum kind { NETWORK, SYNC, PROCESS, REQUEST, LAYER, ANY, TIME, ANEW };

static struct canopen canopen;
static struct can can;

/* Set-points, that process data may change and all that follows at once; and the rest. */
struct all {
    struct told rest;
    uint32_t target_request, target_mode;
    bool waits;
    int32_t target_rpm_q16, torque_command_q15;
    struct cia402_setpoints setpoints;
    uint32_t nmt, heartbeat, consumer, sync, emergency;
    uint32_t pdo[2u * CANOPEN_PDOS_EACH][2];
};

static struct all all(void)
{
    struct all a;
    memset(&a, 0, sizeof a);
    a.rest = told();
    memcpy(&a.setpoints, &canopen.drives[0].cia402.setpoints, sizeof a.setpoints);
    a.nmt = canopen.state;
    a.heartbeat = canopen.heartbeat_ms;
    a.consumer = canopen.consumer;
    a.sync = canopen.sync_id;
    a.emergency = canopen.emergency_id;
    for (size_t n = 0; n < 2u * CANOPEN_PDOS_EACH; n++) {
        const struct canopen_pdo *const p =
            n < CANOPEN_PDOS_EACH ? &canopen.rpdo[n] : &canopen.tpdo[n - CANOPEN_PDOS_EACH];
        a.pdo[n][0] = p->id;
        a.pdo[n][1] = p->count;
    }
    return a;
}

/* Without what process data may change. */
static struct all but_targets(struct all a)
{
    memset(&a.setpoints, 0, sizeof a.setpoints);
    a.rest.mode = a.rest.request = 0;
    a.rest.waits = false;
    a.rest.target_rpm_q16 = a.rest.torque_command_q15 = 0;
    return a;
}

static bool differ(struct all a, struct all b)
{
    return memcmp(&a, &b, sizeof a) != 0;
}

/* Process data that this node takes; *whole: all that is mapped has come. */
static bool is_process(const struct can_frame *f, bool *whole)
{
    bool found = f->id == canopen.sync_id;
    *whole = true;
    for (size_t n = 0; n < CANOPEN_PDOS_EACH; n++) {
        const struct canopen_pdo *const p = &canopen.rpdo[n];
        uint32_t bits = 0;
        for (size_t entry = 0; entry < p->count; entry++) {
            bits += p->map[entry] & 0xFFu;
        }
        if (p->id >> 31 == 0u && bits > 0u && (p->id & CANOPEN_ID) == f->id) {
            *whole = *whole && 8u * f->count >= bits;
            found = true;
        }
    }
    return found && canopen.state == NMT_OPERATIONAL;
}

/* What a frame is to this node; ANY: nothing. */
static enum kind meant_as(const struct can_frame *f, bool *whole)
{
    const bool commands = f->data[0] == 1u || f->data[0] == 2u || (f->data[0] >= 128u && f->data[0] <= 130u);
    if (canopen.node == 0u || canopen.lss.change != LSS_NO_CHANGE) {
        return ANY;
    }
    if (f->id == LSS_COMMAND) {
        return LAYER;
    }
    if (canopen.node == CANOPEN_NO_NUMBER) {
        return ANY;
    }
    if (f->id == 0x600u + canopen.node && f->count == 8u && canopen.state != NMT_STOPPED) {
        return REQUEST;
    }
    if (f->id == 0u) {
        return f->count == 2u && commands && (f->data[1] == 0u || f->data[1] == canopen.node) ? NETWORK : ANY;
    }
    return is_process(f, whole) ? PROCESS : ANY;
}

/* Nothing is left to tell, and the drive has taken what it was asked. */
static void settle(void)
{
    for (int n = 0; n < 3; n++) {
        canopen_poll(&canopen);
        take_turn();
    }
    host_can_heards = 0;
}

static void judge_answer(const struct can_frame *f, bool changed)
{
    const struct can_frame *answer = NULL;
    uint32_t answers = 0;
    for (uint32_t n = 0; n < host_can_heards; n++) {
        if (host_can_heard[n].id == 0x580u + canopen.node) {
            answer = &host_can_heard[n];
            answers++;
        }
    }
    const uint32_t kind = f->data[0] >> 5;
    if (kind == 4u) {
        HOLDS(answers == 0u && !changed, "the client's abort has no answer");
        return;
    }
    HOLDS(answers == 1u && answer->count == 8u, "a request has one answer of 8 bytes");
    const bool refused = answer->data[0] == 0x80u, segment = kind == 0u || kind == 3u;
    see(refused ? "refused" : changed ? "written" : "answered");
    HOLDS(!refused || !changed, "what is refused changes nothing");
    HOLDS(refused || segment || memcmp(&answer->data[1], &f->data[1], 3) == 0, "the answer is about the same object");
    HOLDS(refused || answer->data[0] >> 5 == (kind == 0u   ? 1u
                                              : kind == 1u ? 3u
                                              : kind == 2u ? 2u
                                                           : 0u),
          "the answer is of the request's kind");
}

/* While it stores, the time of process data and of a heartbeat comes: whoever operates goes on. */
static void judge_layer(struct all before, struct all after, bool at_once)
{
    uint32_t answers = 0;
    for (uint32_t n = 0; n < host_can_heards; n++) {
        const struct can_frame *const f = &host_can_heard[n];
        answers += f->id == LSS_SAYS || (f->id == HEARTBEAT + canopen.node && f->count == 1u && f->data[0] == 0u);
    }
    HOLDS(answers <= 1u, "layer setting has one answer at most, or a node boots");
    HOLDS(!at_once || answers == host_can_heards, "it says nothing else");
    if (axis.state == AXIS_SWITCH_ON_DISABLED) {
        before.rest.params.can_node = after.rest.params.can_node;
        before.rest.params.can_kbit = after.rest.params.can_kbit;
    }
    HOLDS(memcmp(&before.rest, &after.rest, sizeof before.rest) == 0, "layer setting changes the line alone");
}

static void hear(const struct can_frame *f)
{
    bool whole = true;
    const enum kind meant = meant_as(f, &whole);
    const struct all before = all();
    const uint32_t before_ms = axis.time_ms;
    host_can_said[0] = *f;
    host_can_saids = 1;
    host_can_taken = host_can_heards = 0;
    canopen_poll(&canopen);
    const struct all after = all();
    if (meant == REQUEST) {
        judge_answer(f, differ(before, after));
    } else if (meant == LAYER) {
        see("layer");
        judge_layer(before, after, axis.time_ms == before_ms);
    } else if (meant == PROCESS) {
        see(whole ? "process" : "short");
        HOLDS(whole || !differ(before, after), "of less than is mapped nothing is taken");
        HOLDS(!differ(but_targets(before), but_targets(after)), "process data changes set-points alone");
    } else if (meant == ANY) {
        HOLDS(!differ(before, after) && host_can_heards == 0u, "what is for others changes and says nothing");
    }
    host_can_saids = host_can_taken = 0;
    settle();
    check_ranges();
}

/* Where frames find something to do. */
static void begin_anew(bool on)
{
    canopen.drives[0].cia402.stage = CIA402_DISABLED;
    axis.request = AXIS_REQUEST_NONE;
    axis.faults.cause = FAULT_NONE;
    axis.params.can_node = NODE;
    axis.state = on ? AXIS_OPERATION_ENABLED : AXIS_SWITCH_ON_DISABLED;
    axis.time_ms += 200;
    settle();
}

static void take_part(struct input *in)
{
    const uint8_t head = next_byte(in), kind = head & 7u;
    struct can_frame f = {.count = head >> 3 & 15u};
    if (kind == TIME) {
        for (uint32_t n = head >> 3; n > 0u; n--) {
            axis.time_ms += 25;
            settle();
        }
        return;
    }
    if (kind == ANEW) {
        begin_anew((head & 8u) != 0u);
        return;
    }
    const uint8_t node = canopen.node;
    const uint32_t ids[] = {0, 0x80, 0x200u + 0x100u * (head >> 7) + node, 0x600u + node, LSS_COMMAND};
    f.count = f.count > 8u ? 8u : f.count;
    f.id = (uint16_t)(kind < ANY ? ids[kind] : 0u);
    if (kind == ANY) {
        f.id = (uint16_t)(next_byte(in) | (next_byte(in) & 0x87u) << 8);
    }
    for (uint32_t n = 0; n < f.count; n++) {
        f.data[n] = next_byte(in);
    }
    hear(&f);
}

/* A drive that operates can be reached, or has lost its master. */
static void check_reached(void)
{
    static const uint8_t wanted[8] = {0x43, 0x00, 0x10, 0, 0x92, 0x01, 0x02, 0};
    canopen.lss.change = LSS_NO_CHANGE;
    settle();
    if (canopen.node == CANOPEN_NO_NUMBER || canopen.node == 0u) {
        HOLDS(canopen.node == 0u || canopen.drives[0].cia402.stage != CIA402_ENABLED ||
                  axis.master_lost == CANOPEN_LOST_NMT,
              "who has lost his number says so");
        return;
    }
    hear(&(struct can_frame){.id = 0, .count = 2, .data = {128, 0}});
    host_can_said[0] = (struct can_frame){.id = (uint16_t)(0x600u + canopen.node), .count = 8, .data = {0x40, 0, 0x10}};
    host_can_saids = 1;
    host_can_taken = host_can_heards = 0;
    canopen_poll(&canopen);
    HOLDS(host_can_heards == 1u && host_can_heard[0].id == 0x580u + canopen.node &&
              memcmp(host_can_heard[0].data, wanted, 8) == 0,
          "behind all of it a good request is answered");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t count)
{
    struct input in = {data, data + count};
    begin_drive(false);
    axis.loop.vbus_q15 = axis.tuning.v_min_q15 + 100;
    axis.params.can_node = NODE;
    axis.params.can_heartbeat_ms = 0;
    host_can_saids = host_can_taken = host_can_heards = host_can_state = 0;
    canopen_start(&canopen, &can, &axis, &slots);
    begin_anew((next_byte(&in) & 1u) != 0u);
    while (in.at < in.end) {
        take_part(&in);
    }
    check_reached();
    return 0;
}
