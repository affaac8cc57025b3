/* SPDX-License-Identifier: MIT */
/* Layer setting services (CiA 305): a master assigns node number and bit rate. Only `store` changes parameters. */
#include "firmware/operate/canopen.h"
#include "firmware/settings/features.h"

#define ANSWER        0x7E4u
#define STORE         0x1010u
#define IDENTITY      0x1018u
#define PARTS         4u /* vendor, product, revision, serial number: 128 bits that name a device */
#define FASTSCAN_BITS 32u
#define FASTSCAN_ALL  128u /* instead of a bit number: any unconfigured node answers */

enum {
    SWITCH_ALL = 0x04,
    SET_NODE = 0x11,
    SET_RATE = 0x13,
    ACTIVATE_RATE = 0x15,
    STORE_BOTH = 0x17,
    SWITCH_ONE = 0x40, /* by vendor, and the three other parts after it */
    SWITCHED_ONE = 0x44,
    IS_THERE = 0x4F,
    FASTSCAN = 0x51,
    ASK_IDENTITY = 0x5A, /* as SWITCH_ONE */
    ASK_NODE = 0x5E
};
enum {
    DONE = 0,
    OUT_OF_RANGE = 1,
    NOT_SUPPORTED = 1,
    NOT_STORED = 2,
    OWN_REASON = 255 /* manufacturer's: the refusal's number follows */
};

static void lss_answer(struct canopen *c, uint32_t command, uint32_t value)
{
    struct can_frame f = {.id = ANSWER, .count = 8, .data = {(uint8_t)command}};
    canopen_put(&f.data[1], value, 4);
    (void)can_send(c->can, &f);
}

static uint32_t identity(struct canopen *c, uint32_t part)
{
    struct canopen_value v;
    (void)canopen_read(c, IDENTITY, part + 1u, &v);
    return v.value;
}

static void switch_to(struct canopen *c, bool configures)
{
    c->lss.configures = configures;
    c->lss.matched = c->lss.part = 0u;
}

/* ---- the state ---- */

/* A node that had no number and got one now boots with it. */
static void switch_all(struct canopen *c, uint32_t state)
{
    if (state > 1u) {
        return;
    }
    const bool leaves = c->lss.configures && state == 0u;
    switch_to(c, state == 1u);
    if (leaves && c->node == CANOPEN_NO_NUMBER && c->lss.node != CANOPEN_NO_NUMBER) {
        canopen_nmt_reset(c);
    }
}

/* Selective: the four parts come one by one, in order. */
static void switch_one(struct canopen *c, uint32_t part, uint32_t value)
{
    const bool next = part == 0u || part == c->lss.matched;
    c->lss.matched = (uint8_t)(next && value == identity(c, part) ? part + 1u : 0u);
    if (c->lss.matched == PARTS) {
        switch_to(c, true);
        lss_answer(c, SWITCHED_ONE, 0u);
    }
}

/* Fastscan: bit by bit a master finds the identity of an unconfigured node; the last bit of the last part selects it. */
static void scan(struct canopen *c, uint32_t value, const uint8_t *where)
{
    const uint32_t bit = where[0], part = where[1], next = where[2];
    if (c->node != CANOPEN_NO_NUMBER) {
        return;
    }
    if (bit == FASTSCAN_ALL) {
        c->lss.part = 0u;
        lss_answer(c, IS_THERE, 0u);
    } else if (bit < FASTSCAN_BITS && part < PARTS && next < PARTS && part == c->lss.part &&
               (value ^ identity(c, part)) >> bit == 0u) {
        c->lss.part = (uint8_t)next;
        if (bit == 0u && next < part) {
            switch_to(c, true);
        }
        lss_answer(c, IS_THERE, 0u);
    }
}

/* ---- configuration ---- */

static uint32_t set_node(struct canopen *c, uint32_t node)
{
    if (node == 0u || (node > CANOPEN_NODES && node != CANOPEN_NO_NUMBER)) {
        return OUT_OF_RANGE;
    }
    c->lss.node = (uint8_t)node;
    return DONE;
}

/* Only CiA's standard table, number 0. */
static uint32_t set_rate(struct canopen *c, uint32_t table, uint32_t row)
{
    static const uint16_t kbit_s[] = {1000, 800, 500, 250, 125, 100, 50, 20, 10};
    if (table != 0u || row >= sizeof kbit_s / sizeof kbit_s[0] || !can_rate_is_known(kbit_s[row])) {
        return NOT_SUPPORTED;
    }
    c->lss.kbit = kbit_s[row];
    return DONE;
}

static void activate_rate(struct canopen *c, uint32_t delay_ms)
{
    c->lss.change = LSS_WAITS;
    c->lss.delay_ms = (uint16_t)delay_ms;
    c->lss.since_ms = canopen_now_ms(c);
}

static uint32_t own_reason(enum error why)
{
    return OWN_REASON | (uint32_t)why << 8;
}

static uint32_t not_stored(enum error why)
{
    return why >= ERROR_ENVM_CLOCK && why <= ERROR_ENVM_VERIFY ? (uint32_t)NOT_STORED : own_reason(why);
}

/* All axes are asked before the first writes: else one would keep at the next start what the others refused. */
static enum error forbids_store(const struct canopen *c)
{
    enum error why = ERROR_NONE;
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        why = drive_is_off(c->drives[n].axis) ? why : ERROR_SAVE_WHILE_ON; /* any axis */
    }
    for (uint32_t n = 0; why == ERROR_NONE && n < AXIS_COUNT; n++) {
        why = drive_may_save(c->drives[n].axis).error;
    }
    return why;
}

/* Of the axis that failed nevertheless; those after it have not tried. */
static enum error refusal(const struct canopen *c)
{
    uint32_t n = 0;
    while (n + 1u < AXIS_COUNT && c->drives[n].cia402.refusal.error == ERROR_NONE) {
        n++;
    }
    return c->drives[n].cia402.refusal.error;
}

/* As 0x1010:1, with the pending number and rate; if it fails, the parameters stay as they were. */
static uint32_t store(struct canopen *c)
{
    struct params *const p = &c->drives[0].axis->params;
    const struct canopen_line before = canopen_line(p);
    if (!FEATURE_IN(SETTINGS)) {
        return NOT_SUPPORTED;
    }
    if (canopen_line_differs(&before, &c->line)) { /* a parameter was set and takes effect in the next poll */
        return own_reason(ERROR_BUSY);
    }
    const enum error forbidden = forbids_store(c);
    if (forbidden != ERROR_NONE) {
        return not_stored(forbidden);
    }
    p->can_node = c->lss.node;
    p->can_kbit = c->lss.kbit;
    if (canopen_write(c, STORE, 1u, OBJECTS_SAVE) != 0u) {
        canopen_set_line(p, &before);
        return not_stored(refusal(c));
    }
    c->line.node = p->can_node; /* kept, but not in effect */
    c->line.kbit = p->can_kbit;
    return DONE;
}

/* Not inline: a branch table that points backwards holds addresses, which linker/bounds does not follow. */
static __attribute__((noinline)) void configure(struct canopen *c, uint32_t command, const uint8_t *data)
{
    if (command == SET_NODE) {
        lss_answer(c, command, set_node(c, data[1]));
    } else if (command == SET_RATE) {
        lss_answer(c, command, set_rate(c, data[1], data[2]));
    } else if (command == ACTIVATE_RATE) {
        activate_rate(c, canopen_get(&data[1], 2));
    } else if (command == STORE_BOTH) {
        lss_answer(c, command, store(c));
    } else if (command == ASK_NODE) {
        lss_answer(c, command, c->node);
    } else if (command - ASK_IDENTITY < PARTS) {
        lss_answer(c, command, identity(c, command - ASK_IDENTITY));
    }
}

void canopen_lss_take(struct canopen *c, const struct can_frame *f)
{
    const uint32_t command = f->data[0], value = canopen_get(&f->data[1], 4);
    if (f->count != 8u) {
        return;
    }
    if (command == SWITCH_ALL) {
        switch_all(c, f->data[1]);
    } else if (c->lss.configures) {
        configure(c, command, f->data);
    } else if (command - SWITCH_ONE < PARTS) {
        switch_one(c, command - SWITCH_ONE, value);
    } else if (command == FASTSCAN) {
        scan(c, value, &f->data[5]);
    }
}

/* ---- the change of rate: silent for the delay before and after it ---- */

void canopen_lss_step(struct canopen *c)
{
    struct canopen_lss *const s = &c->lss;
    if (s->change == LSS_NO_CHANGE || canopen_now_ms(c) - s->since_ms <= s->delay_ms) {
        return; /* rounded up: the first millisecond was partly over */
    }
    s->since_ms = canopen_now_ms(c);
    if (s->change == LSS_WAITS) {
        canopen_open(c, s->kbit);
        s->change = LSS_SETTLES;
    } else {
        s->change = LSS_NO_CHANGE;
    }
}
