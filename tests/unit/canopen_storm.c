/* SPDX-License-Identifier: MIT */
/*
 * A million frames on the CAN bus of a drive that operates half of the time: noise, others' traffic, mutated requests, and
 * those that are right. Who judges knows by the standard which frame is meant for this node: any other changes nothing, and
 * nothing is sent for it; a request by SDO has one answer, and what is refused has changed nothing; process data changes
 * set-points alone.
 *
 *     canopen_storm FRAMES SEED       prints the counts by name; what must not be is counted, too
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "can.h"
#include "envm.h"
#include "firmware/operate/canopen.h"
#include "storm_random.h"

enum {
    NODE = 5,
    SDO_IN = 0x600 + NODE,
    SDO_OUT = 0x580 + NODE,
    EMERGENCY = 0x80 + NODE,
    MASTER = 0x77F,
    LAYER_SETTING = 0x7E5
};

struct counts {
    long frames, meant, answered, aborted, written, noise, process;
    long changed_by_nothing, answered_nothing, not_one_answer, refused_but_changed, process_changed_more;
};

static struct fabric fabric;
static struct axis axis;
static struct can can;
static struct canopen node;
static struct counts counts;

/* All that a frame may write, and what follows from it at once. */
struct state {
    struct params params;
    uint8_t choice[FAULT_COUNT];
    uint32_t mode, request, state, nmt, heartbeat, consumer, sync_id, emergency_id;
    int32_t target, torque;
    uint32_t pdo_ids[2 * CANOPEN_PDOS_EACH], mapped[2 * CANOPEN_PDOS_EACH];
    struct cia402_setpoints setpoints;
};

static void look(struct state *s)
{
    memset(s, 0, sizeof *s);
    s->params = axis.params;
    memcpy(s->choice, axis.reactions.choice, sizeof s->choice);
    s->mode = axis.mode;
    s->request = axis.request;
    s->state = axis.state;
    s->nmt = (uint32_t)node.state;
    s->heartbeat = node.heartbeat_ms;
    s->consumer = node.consumer;
    s->sync_id = node.sync_id;
    s->emergency_id = node.emergency_id;
    s->target = axis.speed.target_rpm_q16;
    s->torque = axis.torque_command_q15;
    for (uint32_t n = 0; n < CANOPEN_PDOS_EACH; n++) {
        s->pdo_ids[n] = node.rpdo[n].id;
        s->pdo_ids[CANOPEN_PDOS_EACH + n] = node.tpdo[n].id;
        s->mapped[n] = node.rpdo[n].count;
        s->mapped[CANOPEN_PDOS_EACH + n] = node.tpdo[n].count;
    }
    s->setpoints = node.drives[0].cia402.setpoints;
}

/* ---- frames ---- */

static void fill(struct can_frame *f)
{
    for (int n = 0; n < 8; n++) {
        f->data[n] = any(2) != 0u ? (uint8_t)any(256) : 0u;
    }
}

static void noise(struct can_frame *f)
{
    do {
        f->id = (uint16_t)(any(2048) | (any(8) == 0u ? CAN_REMOTE : 0u));
    } while (f->id == LAYER_SETTING); /* has a storm of its own, in test_canopen_lss.py */
    f->count = (uint8_t)any(9);
    fill(f);
}

static uint32_t some_index(void)
{
    static const uint16_t indices[] = {0x1000, 0x1003, 0x1005, 0x1008, 0x1010, 0x1011, 0x1014, 0x1016, 0x1017,
                                       0x1018, 0x1021, 0x1400, 0x1403, 0x1600, 0x1603, 0x1800, 0x1802, 0x1A00,
                                       0x1A03, 0x2008, 0x2408, 0x3000, 0x3010, 0x3024, 0x6040, 0x6041, 0x6060,
                                       0x6064, 0x606C, 0x6071, 0x607A, 0x6098, 0x60FF};
    return any(8) == 0u ? any(65536) : indices[any(sizeof indices / sizeof indices[0])] + (any(4) == 0u ? any(4) : 0u);
}

static void sdo_request(struct can_frame *f)
{
    static const uint8_t commands[] = {0x40, 0x23, 0x27, 0x2B, 0x2F, 0x21, 0x20,
                                       0x22, 0x60, 0x70, 0x01, 0x11, 0x00, 0x80};
    const uint32_t index = some_index();
    f->id = SDO_IN;
    f->count = 8;
    fill(f);
    f->data[0] = commands[any(sizeof commands)];
    f->data[1] = (uint8_t)index;
    f->data[2] = (uint8_t)(index >> 8);
    f->data[3] = (uint8_t)(any(2) != 0u ? 0u : any(10));
}

static void some_frame(struct can_frame *f)
{
    static const uint16_t ids[] = {0x000, 0x080, 0x205, 0x305, 0x405, 0x505, 0x605, MASTER, 0x585, 0x705};
    switch (any(5)) {
    case 0:
        noise(f);
        break;
    case 1:
        noise(f);
        f->id = ids[any(sizeof ids / sizeof ids[0])];
        break;
    case 2:
        f->id = 0;
        f->count = 2;
        f->data[0] = (uint8_t)(any(3) == 0u ? any(256) : 1u);
        f->data[1] = (uint8_t)(any(2) != 0u ? NODE : any(3));
        break;
    case 3:
        fill(f);
        f->id = (uint16_t)(0x105u + 0x100u * (1u + any(4)));
        f->count = (uint8_t)(2u + any(7));
        f->data[0] = (uint8_t)any(32);
        f->data[1] = 0;
        break;
    default:
        sdo_request(f);
        break;
    }
}

/* ---- who it is meant for ---- */

static bool is_process(const struct can_frame *f)
{
    for (uint32_t n = 0; n < CANOPEN_PDOS_EACH; n++) {
        const struct canopen_pdo *const p = &node.rpdo[n];
        if (p->id >> 31 == 0u && p->count > 0u && f->id == (p->id & 0x7FFu)) {
            return true;
        }
    }
    return f->id == node.sync_id;
}

static bool is_command(const struct can_frame *f)
{
    static const uint8_t known[] = {1, 2, 128, 129, 130};
    return f->id == 0u && f->count == 2u && (f->data[1] == 0u || f->data[1] == NODE) &&
           memchr(known, f->data[0], sizeof known) != NULL;
}

static bool is_request(const struct can_frame *f)
{
    return f->id == SDO_IN && f->count == 8u && node.state != NMT_STOPPED;
}

/* ---- judging ---- */

static uint32_t sent_as(uint32_t id)
{
    uint32_t count = 0;
    for (uint32_t n = 0; n < host_can_heards; n++) {
        count += host_can_heard[n].id == id;
    }
    return count;
}

static bool was_aborted(void)
{
    for (uint32_t n = 0; n < host_can_heards; n++) {
        if (host_can_heard[n].id == SDO_OUT && host_can_heard[n].data[0] == 0x80) {
            return true;
        }
    }
    return false;
}

static void judge_request(const struct can_frame *f, bool changed)
{
    const bool aborts = f->data[0] >> 5 == 4; /* the client's own abort has no answer */
    counts.answered += sent_as(SDO_OUT) == 1u;
    counts.aborted += was_aborted();
    counts.written += changed;
    counts.not_one_answer += sent_as(SDO_OUT) != (aborts ? 0u : 1u);
    counts.refused_but_changed += changed && (aborts || was_aborted());
}

static void judge_process(const struct state *before, struct state *after)
{
    counts.process++;
    after->setpoints = before->setpoints; /* these it may, and what the drive then does */
    after->mode = before->mode;
    after->request = before->request;
    after->target = before->target;
    after->torque = before->torque;
    counts.process_changed_more += memcmp(before, after, sizeof *after) != 0;
}

static void one_frame(void)
{
    struct can_frame f = {0};
    struct state before, after;
    some_frame(&f);
    const bool request = is_request(&f), process = node.state == NMT_OPERATIONAL && is_process(&f);
    const bool meant = request || process || is_command(&f);
    look(&before);
    host_can_heards = 0;
    host_can_said[0] = f;
    host_can_saids = 1;
    host_can_taken = 0;
    canopen_poll(&node);
    look(&after);
    const bool changed = memcmp(&before, &after, sizeof after) != 0;
    counts.frames++;
    counts.meant += meant;
    if (request) {
        judge_request(&f, changed);
    } else if (process) {
        judge_process(&before, &after);
    } else if (!meant) {
        counts.noise++;
        counts.changed_by_nothing += changed;
        counts.answered_nothing += host_can_heards > 0u;
    }
}

/* Puts the drive back to where frames find something to do. */
static void restore(bool on)
{
    node.drives[0].cia402.stage = CIA402_DISABLED;
    axis.request = AXIS_REQUEST_NONE;
    axis.faults.cause = FAULT_NONE;
    axis.state = on ? AXIS_OPERATION_ENABLED : AXIS_SWITCH_ON_DISABLED;
    axis.params.can_node = NODE;
    host_can_saids = host_can_taken = 0;
    for (int n = 0; n < 3; n++) { /* and what it then has to tell has been told */
        axis.time_ms += 200;
        canopen_poll(&node);
        while (drive_prepare(&axis)) {
        }
    }
}

int main(int argc, char **argv)
{
    const long frames = argc > 1 ? atol(argv[1]) : 1000000;
    seed = argc > 2 ? (uint32_t)atol(argv[2]) : 12345u;
    drive_init(&axis, &fabric);
    axis.fabric_doubt = 0;
    axis.params.can_node = NODE;
    axis.loop.vbus_q15 = axis.tuning.v_min_q15 + 100;
    host_envm_new(&axis, 8e-3, 1u);
    const struct slots slots = host_slots();
    canopen_start(&node, &can, &axis, &slots);
    for (long n = 0; n < frames; n++) {
        if (n % 8 == 0) {
            restore(n % 16 == 0);
        }
        one_frame();
        while (drive_prepare(&axis)) {
        }
        host_can_saids = host_can_taken = 0;
        canopen_poll(&node); /* what a frame leads to in the drive is over before the next one */
    }
    printf("frames %ld\nmeant %ld\nanswered %ld\naborted %ld\nwritten %ld\nnoise %ld\nprocess %ld\n", counts.frames,
           counts.meant, counts.answered, counts.aborted, counts.written, counts.noise, counts.process);
    printf("changed_by_nothing %ld\nanswered_nothing %ld\nnot_one_answer %ld\nrefused_but_changed "
           "%ld\nprocess_changed_more %ld\n",
           counts.changed_by_nothing, counts.answered_nothing, counts.not_one_answer, counts.refused_but_changed,
           counts.process_changed_more);
    return 0;
}
