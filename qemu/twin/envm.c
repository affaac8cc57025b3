/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "envm.h"

#include <stddef.h>
#include <string.h>

enum {
    WD = 0x080,
    WD_END = 0x100,
    STATUS = 0x120,
    PAGE_LOCK = 0x140,
    CMD = 0x148,
    CLRHINT = 0x158,
    REQ_ACCESS = 0x1FC,
};

enum {
    READY = 1u << 0,
    REFUSED = 1u << 4,
    WORN = 1u << 5,
    DENIED = 1u << 18,
    BUSY_ERROR = 1u << 19,
    KEPT = DENIED | BUSY_ERROR, /* until cleared; no command is taken meanwhile */
};

#define COMMAND_MASK   0xFF000000u
#define COMMAND_WRITE  0x08000000u
#define COMMAND_VERIFY 0x10000000u
#define COMMAND_UNLOCK 0x13000000u

#define ACCESS_GRANTED 5u
#define ACCESS_OTHER   6u
#define ERASED         0xFFu

#define KEY(field, low, high, initial) \
    ((struct config_key){#field, offsetof(struct envm_params, field), low, high, initial})
const struct config_key envm_keys[] = {
    KEY(program_s, 1e-6, 1, 8e-3),
    KEY(verify_s, 1e-6, 1, 20e-6),
    KEY(endurance, 1, 1e9, 1000),
    KEY(fails, 0, 14, 0),
    KEY(cut_write, 0, 1e9, 0),
    KEY(cut_share, 0, 1, 0.5),
    CONFIG_KEYS_END,
};

void envm_init(struct envm *e, const struct envm_params *p, uint64_t seed)
{
    memset(e, 0, sizeof *e);
    e->p = *p;
    e->status = READY;
    e->fails = (uint32_t)p->fails;
    e->until = SIM_NEVER;
    random_seed_stream(&e->noise, seed, STREAM_ENVM);
}

bool envm_is_busy(const struct envm *e)
{
    return e->until != SIM_NEVER;
}

static uint8_t *page_at(struct envm *e, uint32_t page)
{
    return e->array + (size_t)page * ENVM_PAGE;
}

static void tell(struct envm *e, uint32_t page)
{
    if (e->changed) {
        e->changed(e->context, e, page);
    }
}

/* Each bit that is set in about so many cases. */
static uint8_t some_bits(struct envm *e, double share)
{
    uint8_t bits = 0;
    for (unsigned n = 0; n < 8; n++) {
        bits |= (uint8_t)(((double)(random_u64(&e->noise) >> 11) * 0x1p-53 < share) << n);
    }
    return bits;
}

/* The page as it is when a part of the time is over. */
static void fill_page(struct envm *e, double share)
{
    uint8_t *now = page_at(e, e->page);
    const uint8_t *data = (const uint8_t *)e->data;
    for (uint32_t n = 0; n < ENVM_PAGE; n++) {
        if (share >= 1) {
            now[n] = data[n];
            continue;
        }
        uint8_t from = share < 0.5 ? now[n] : ERASED, to = share < 0.5 ? ERASED : data[n];
        uint8_t changed = some_bits(e, share < 0.5 ? 2 * share : 2 * share - 1);
        now[n] = (uint8_t)((from & ~changed) | (to & changed));
    }
    e->locked[e->page] = share >= 1 ? (e->page_lock & 1) != 0 : e->locked[e->page];
    tell(e, e->page);
}

static void end_programming(struct envm *e)
{
    fill_page(e, 1);
    if (!e->wait_states || (e->fails & (ENVM_FAIL_ERASE | ENVM_FAIL_WRITE))) {
        page_at(e, e->page)[random_u64(&e->noise) % ENVM_PAGE] ^= (uint8_t)(1u << random_u64(&e->noise) % 8);
        e->status |= e->wait_states ? e->fails & ~(uint32_t)ENVM_FAIL_VERIFY : (uint32_t)ENVM_FAIL_WRITE;
        tell(e, e->page);
    }
    e->status |= e->writes[e->page] > e->p.endurance ? WORN : 0;
    e->programmed++;
}

static void end_verifying(struct envm *e)
{
    bool same = memcmp(page_at(e, e->page), e->data, ENVM_PAGE) == 0;
    e->status |= same && !(e->fails & ENVM_FAIL_VERIFY) ? 0 : (uint32_t)ENVM_FAIL_VERIFY;
}

static void end_command(struct envm *e)
{
    if (e->programming) {
        end_programming(e);
        e->fails &= ENVM_FAIL_VERIFY;
    } else if (e->verifying) {
        end_verifying(e);
        e->fails &= ~(uint32_t)ENVM_FAIL_VERIFY;
    }
    e->programming = e->verifying = false;
    e->status |= READY;
    e->until = SIM_NEVER;
}

void envm_settle(struct envm *e, sim_ps now)
{
    if (now >= e->until) {
        end_command(e);
    }
}

static void begin(struct envm *e, double takes_s, sim_ps now)
{
    e->status &= ~(uint32_t)READY;
    e->glitch = true;
    e->began = now;
    e->until = now + sim_from_s(takes_s);
}

static void take_command(struct envm *e, uint32_t value, sim_ps now)
{
    uint32_t page = (value & ~COMMAND_MASK) / ENVM_PAGE;
    if (envm_is_busy(e)) {
        e->status |= BUSY_ERROR;
        return;
    }
    if (e->status & KEPT) {
        return;
    }
    e->status &= READY;
    if ((value & ~COMMAND_MASK) % ENVM_PAGE != 0 || page >= ENVM_PAGES - ENVM_PAGES_RESERVED) {
        e->status |= DENIED;
        return;
    }
    e->page = page;
    switch (value & COMMAND_MASK) {
    case COMMAND_WRITE:
        if (e->locked[page]) {
            e->status |= REFUSED;
            return;
        }
        e->programming = true;
        e->writes[page]++;
        begin(e, e->p.program_s, now);
        return;
    case COMMAND_VERIFY:
        e->verifying = true;
        begin(e, e->p.verify_s, now);
        return;
    case COMMAND_UNLOCK:
        e->locked[page] = false;
        return;
    default:
        return;
    }
}

uint32_t envm_read(struct envm *e, uint32_t offset, sim_ps now)
{
    envm_settle(e, now);
    if (offset >= WD && offset < WD_END) {
        return e->data[(offset - WD) / 4];
    }
    switch (offset) {
    case STATUS: {
        if (!e->granted) {
            return 0;
        }
        uint32_t glitch = envm_is_busy(e) && e->glitch ? READY : 0;
        e->glitch = false;
        return e->status | glitch;
    }
    case PAGE_LOCK:
        return e->page_lock;
    case REQ_ACCESS:
        return e->held ? ACCESS_OTHER : e->granted ? ACCESS_GRANTED : 0;
    default:
        return e->other[offset / 4];
    }
}

static void write_register(struct envm *e, uint32_t offset, uint32_t value, sim_ps now)
{
    if (offset == REQ_ACCESS) {
        e->granted = (value & 1) != 0 && !e->held;
    } else if (!e->granted) {
        return;
    } else if (offset >= WD && offset < WD_END) {
        e->data[(offset - WD) / 4] = value;
    } else if (offset == PAGE_LOCK) {
        e->page_lock = value & 1;
    } else if (offset == CMD) {
        take_command(e, value, now);
    } else if (offset == CLRHINT) {
        e->status &= ~(((value & 2) != 0 ? DENIED : 0u) | ((value & 4) != 0 ? BUSY_ERROR : 0u));
    } else if (offset != STATUS) {
        e->other[offset / 4] = value;
    }
}

bool envm_write(struct envm *e, uint32_t offset, uint32_t value, sim_ps now)
{
    envm_settle(e, now);
    write_register(e, offset, value, now);
    e->bus_writes++;
    if ((double)e->bus_writes != e->p.cut_write) {
        return false;
    }
    if (envm_is_busy(e)) {
        now += (sim_ps)((double)(e->until - now) * e->p.cut_share);
    }
    envm_power_cut(e, now);
    return true;
}

void envm_power_cut(struct envm *e, sim_ps now)
{
    envm_settle(e, now);
    if (e->programming) {
        fill_page(e, (double)(now - e->began) / (double)(e->until - e->began));
    }
    e->programming = e->verifying = e->granted = false;
    e->page_lock = 0;
    e->status = READY;
    e->until = SIM_NEVER;
    memset(e->data, 0, sizeof e->data);
    memset(e->other, 0, sizeof e->other);
}

void envm_reset(struct envm *e, sim_ps now)
{
    envm_power_cut(e, now);
}
