/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Behaviour, from the core's RTL: the counter runs from 0 to PERIOD, one count every PRESCALE+1 clocks, from reset on.
 * PRESCALE, PERIOD and the enables written during a period act at its end; the edges do so only while SYNC_UPDATE is 1.
 * Reads return what is active. At count = POSEDGE an output rises, at count = NEGEDGE it falls, and if the two are
 * equal it toggles; an edge beyond PERIOD never comes and the output holds its level. A disabled output is low.
 *
 * Nothing that is active changes within a period, so its edges are sorted once, at its start. */
#include "corepwm.h"

#include <string.h>

enum {
    PRESCALE = 0x00,
    PERIOD = 0x04,
    ENABLE_0_7 = 0x08,
    FIRST_EDGE = 0x10,
    LAST_EDGE = FIRST_EDGE + 8 * COREPWM_CHANNELS - 4,
    SYNC_UPDATE = COREPWM_SYNC_UPDATE,
};

static sim_ps count_ps(const struct corepwm *c)
{
    return ((sim_ps)c->active.prescale + 1) * SIM_PS_PER_FABRIC_CLOCK;
}

/* A period of 2^32 counts with the largest prescaler does not fit 64 bits of picoseconds; it never ends either. */
static sim_ps count_at(const struct corepwm *c, uint64_t count)
{
    if (count > (uint64_t)(SIM_NEVER - c->period_start) / (uint64_t)count_ps(c)) {
        return SIM_NEVER;
    }
    return c->period_start + (sim_ps)count * count_ps(c);
}

static sim_ps period_end(const struct corepwm *c)
{
    return count_at(c, (uint64_t)c->active.period + 1);
}

static struct corepwm_edge *edge_at(struct corepwm *c, uint32_t count)
{
    int n = c->edge_count;
    for (int i = 0; i < c->edge_count; i++) {
        if (c->edges[i].count == count) {
            return &c->edges[i];
        }
        if (c->edges[i].count > count) {
            n = i;
            break;
        }
    }
    memmove(&c->edges[n + 1], &c->edges[n], (size_t)(c->edge_count - n) * sizeof c->edges[0]);
    c->edge_count++;
    c->edges[n] = (struct corepwm_edge){.count = count};
    return &c->edges[n];
}

static void sort_edges(struct corepwm *c)
{
    c->edge_count = 0;
    c->next_edge = 0;
    for (int n = 0; n < COREPWM_CHANNELS; n++) {
        unsigned mask = 1u << n;
        uint32_t pos = c->active.pos_edge[n], neg = c->active.neg_edge[n];
        if (!(c->active.enable & mask)) {
            continue;
        }
        if (pos == neg) {
            if (pos <= c->active.period) {
                edge_at(c, pos)->toggle |= mask;
            }
            continue;
        }
        if (pos <= c->active.period) {
            edge_at(c, pos)->rise |= mask;
        }
        if (neg <= c->active.period) {
            edge_at(c, neg)->fall |= mask;
        }
    }
}

void corepwm_reset(struct corepwm *c, sim_ps now)
{
    memset(c, 0, sizeof *c);
    c->pending.prescale = c->pending.period = 8;
    c->active = c->pending;
    c->period_start = now;
}

uint32_t corepwm_read(const struct corepwm *c, uint32_t offset)
{
    switch (offset) {
    case PRESCALE:
        return c->active.prescale;
    case PERIOD:
        return c->active.period;
    case ENABLE_0_7:
        return c->active.enable;
    default:
        break;
    }
    if (offset >= FIRST_EDGE && offset <= LAST_EDGE) {
        uint32_t n = (offset - FIRST_EDGE) / 8;
        return offset & 4 ? c->active.neg_edge[n] : c->active.pos_edge[n];
    }
    return 0; /* SYNC_UPDATE reads 0 as well */
}

void corepwm_write(struct corepwm *c, uint32_t offset, uint32_t value)
{
    switch (offset) {
    case PRESCALE:
        c->pending.prescale = value;
        return;
    case PERIOD:
        c->pending.period = value;
        return;
    case ENABLE_0_7:
        c->pending.enable = value & ((1u << COREPWM_CHANNELS) - 1);
        return;
    case SYNC_UPDATE:
        c->sync_update = value & 1;
        return;
    default:
        break;
    }
    if (offset >= FIRST_EDGE && offset <= LAST_EDGE) {
        uint32_t n = (offset - FIRST_EDGE) / 8;
        if (offset & 4) {
            c->pending.neg_edge[n] = value;
        } else {
            c->pending.pos_edge[n] = value;
        }
    }
}

static bool sleeps(const struct corepwm *c)
{
    return c->active.enable == 0 && c->pending.enable == 0;
}

static void start_period(struct corepwm *c, sim_ps at)
{
    c->period_start = at;
    c->active.prescale = c->pending.prescale;
    c->active.period = c->pending.period;
    c->active.enable = c->pending.enable;
    if (c->sync_update) {
        memcpy(c->active.pos_edge, c->pending.pos_edge, sizeof c->active.pos_edge);
        memcpy(c->active.neg_edge, c->pending.neg_edge, sizeof c->active.neg_edge);
    }
    c->outputs &= c->active.enable;
    sort_edges(c);
}

void corepwm_catch_up(struct corepwm *c, sim_ps now)
{
    while (sleeps(c) && period_end(c) <= now) {
        start_period(c, period_end(c));
        sim_ps length = period_end(c) - c->period_start;
        c->period_start += (now - c->period_start) / length * length;
    }
}

sim_ps corepwm_next_event(const struct corepwm *c)
{
    if (sleeps(c)) {
        return SIM_NEVER;
    }
    return c->next_edge < c->edge_count ? count_at(c, c->edges[c->next_edge].count) : period_end(c);
}

void corepwm_take_event(struct corepwm *c)
{
    if (c->next_edge >= c->edge_count) {
        start_period(c, period_end(c));
        if (c->edge_count == 0 || c->edges[0].count != 0) {
            return;
        }
    }
    const struct corepwm_edge *e = &c->edges[c->next_edge++];
    c->outputs = ((c->outputs | e->rise) & ~e->fall) ^ e->toggle;
}

bool corepwm_may_rise_next(const struct corepwm *c, int channel)
{
    if (c->next_edge >= c->edge_count) {
        return true; /* the start of a period, whose edges are not known yet */
    }
    return (c->edges[c->next_edge].rise | c->edges[c->next_edge].toggle) & (1u << channel);
}

sim_ps corepwm_next_rise(const struct corepwm *c, int channel)
{
    unsigned mask = 1u << channel;
    for (int n = c->next_edge; n < c->edge_count; n++) {
        if ((c->edges[n].rise | c->edges[n].toggle) & mask) {
            return count_at(c, c->edges[n].count);
        }
    }
    return (c->active.enable | c->pending.enable) & mask ? period_end(c) : SIM_NEVER;
}
