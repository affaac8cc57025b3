/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "rtl_parts.h"

/* ---- what is at the pins ---- */

static unsigned next_bits(void *context, uint64_t clocks)
{
    struct fabric_rtl *r = context;
    double at_ps = (double)(r->clock + (int64_t)clocks) * SIM_PS_PER_FABRIC_CLOCK;
    if (bit_streams_forgot(&r->bits, at_ps)) {
        rtl_fail("FABRIC=rtl", "the physics is further ahead of the RTL than the modulators' inputs are kept");
    }
    return bit_streams_clock(&r->bits, at_ps);
}

void rtl_attach(struct fabric_rtl *r)
{
    r->calls->modulate(r->axis, next_bits, r);
}

/* Of a driver with an input and an enable: what it turns on behind its dead time. */
static unsigned gates_of(const struct fabric_rtl *r)
{
    unsigned high = r->out.pin_high, low = r->out.pin_low, gates = 0;
    if (r->calls->in_en) {
        high &= low;
        low &= ~high;
    }
    for (int k = 0; k < 3; k++) {
        gates |= ((high >> k) & 1u) << (2 * k) | ((low >> k) & 1u) << (2 * k + 1);
    }
    return gates;
}

static void follow_converters(struct fabric_rtl *r)
{
    unsigned data = 0;
    for (int k = 0; k < 4; k++) {
        r->converter[k].code = r->code[k];
        data |= converter_follow(&r->converter[k], AD7356_ZEROS, r->out.pin_cs_n, r->out.pin_sclk) ? 1u << k : 0u;
    }
    r->in.pin_sdata = (uint8_t)data;
    r->in.pin_temp_sdata = converter_follow(&r->thermometer, AD7476A_ZEROS, r->out.pin_temp_cs_n, r->out.pin_temp_sclk);
}

static void note(struct fabric_rtl *r, const struct rtl_change *c)
{
    if (r->count == RTL_EVENTS_ROOM) {
        rtl_fail("FABRIC=rtl", "more happens at the RTL's pins than the twin can follow");
    }
    r->event[(r->first + r->count++) % RTL_EVENTS_ROOM] = *c;
}

/* The newest wires that have been noted, or else those the plant knows. */
void rtl_look(struct fabric_rtl *r)
{
    const struct fabric *f = &r->fabric;
    const struct rtl_change *last = r->count ? &r->event[(r->first + r->count - 1) % RTL_EVENTS_ROOM] : NULL;
    struct rtl_change before =
        last ? *last : (struct rtl_change){0, f->gates, f->live, f->chops, f->interrupt, false, false};
    struct rtl_change now = {r->clock,   gates_of(r),    r->out.live,  r->out.pin_chopper,
                             r->out.irq, r->out.trigger, r->out.sample};
    r->finish = now.converted ? INT64_MAX : r->finish;
    if (r->out.trip != r->tripped || r->out.sto != r->sto) {
        r->tripped = r->out.trip;
        r->sto = r->out.sto;
        r->stops_until = r->clock + RTL_STOP_CLOCKS;
    }
    if (now.triggered || now.converted || now.gates != before.gates || now.live != before.live ||
        now.chops != before.chops || now.interrupt != before.interrupt) {
        note(r, &now);
    }
    follow_converters(r);
}

void rtl_settle(struct fabric_rtl *r)
{
    r->calls->settle(r->axis, &r->in, &r->out);
    follow_converters(r);
    r->calls->settle(r->axis, &r->in, &r->out);
    r->promised = false;
}

/* ---- clocks ---- */

static void take_lines(struct fabric_rtl *r)
{
    while (lines_next(&r->lines) <= r->clock) {
        struct line_state s = lines_take(&r->lines);
        r->in.pin_a = s.a;
        r->in.pin_b = s.b;
        r->in.pin_index = s.index;
        r->in.pin_lost = s.lost;
        r->in.pin_hall = s.hall;
    }
}

void rtl_clock_to(struct fabric_rtl *r, int64_t to)
{
    while (r->clock < to && r->count == 0) {
        take_lines(r);
        r->calls->settle(r->axis, &r->in, &r->out);
        int64_t until = rtl_lesser(to, lines_next(&r->lines));
        until = until > r->clock ? until : r->clock + 1;
        r->clock += (int64_t)r->calls->run(r->axis, (uint64_t)(until - r->clock), &r->out);
        rtl_look(r);
    }
}

/* One clock of the bus, whatever happens in it. */
static void bus_clock(struct fabric_rtl *r)
{
    take_lines(r);
    rtl_settle(r);
    r->clock += (int64_t)r->calls->run(r->axis, 1, &r->out);
    rtl_look(r);
}

void rtl_reset_clock(struct fabric_rtl *r)
{
    bus_clock(r);
}

uint32_t rtl_transfer(struct fabric_rtl *r, bool writes, uint32_t offset, uint32_t value)
{
    r->in.psel = true;
    r->in.penable = false;
    r->in.pwrite = writes;
    r->in.paddr = (uint16_t)offset;
    r->in.pwdata = value;
    bus_clock(r);
    r->in.penable = true;
    uint32_t read = r->out.prdata;
    bus_clock(r);
    r->in.psel = r->in.penable = false;
    rtl_settle(r);
    r->fabric.ahead = rtl_time_of(r->clock);
    return read;
}
