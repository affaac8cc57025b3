// SPDX-License-Identifier: GPL-2.0-or-later
#include "rtl_plant.h"

#include "Vplant.h"
#include "Vplant___024root.h"

struct rtl_plant {
    Vplant top;
};

namespace
{
constexpr int64_t HALF = 1 << 18;

void edge(Vplant &top)
{
    top.clk = 1;
    top.eval();
    top.clk = 0;
    top.eval();
}

void drive(Vplant &top, const rtl_plant_in *in)
{
    top.gate_high = in->gate_high;
    top.gate_low = in->gate_low;
    top.chops = in->chops;
    top.cs_n = in->cs_n;
    top.sclk = in->sclk;
    top.temp_cs_n = in->temp_cs_n;
    top.temp_sclk = in->temp_sclk;
}

void transfer(Vplant &top, bool writes, uint32_t offset, uint32_t value)
{
    top.psel = 1;
    top.penable = 0;
    top.pwrite = writes;
    top.paddr = (uint16_t)offset;
    top.pwdata = value;
    edge(top);
    top.penable = 1;
    top.eval();
    edge(top);
    top.psel = top.penable = 0;
    top.eval();
}
} // namespace

struct rtl_plant *rtl_plant_new(void)
{
    rtl_plant *p = new rtl_plant;
    p->top.cs_n = p->top.sclk = p->top.temp_cs_n = p->top.temp_sclk = 1;
    p->top.rst_n = 0;
    edge(p->top);
    edge(p->top);
    p->top.rst_n = 1;
    p->top.eval();
    return p;
}

void rtl_plant_clock(struct rtl_plant *p, const struct rtl_plant_in *in, struct rtl_plant_out *out)
{
    Vplant &top = p->top;
    drive(top, in);
    edge(top);
    *out = {(uint8_t)top.sdata, (uint8_t)top.pin_hall, (bool)top.temp_sdata, (bool)top.pin_a,
            (bool)top.pin_b,    (bool)top.pin_index,   (bool)top.pin_lost};
}

void rtl_plant_clocks(struct rtl_plant *p, const struct rtl_plant_in *in, uint64_t clocks)
{
    drive(p->top, in);
    for (uint64_t n = 0; n < clocks; n++) {
        edge(p->top);
    }
}

void rtl_plant_write(struct rtl_plant *p, uint32_t offset, uint32_t value)
{
    transfer(p->top, true, offset, value);
}

uint32_t rtl_plant_read(struct rtl_plant *p, uint32_t offset)
{
    p->top.psel = 1;
    p->top.penable = 0;
    p->top.pwrite = 0;
    p->top.paddr = (uint16_t)offset;
    edge(p->top);
    uint32_t value = p->top.prdata;
    p->top.penable = 1;
    edge(p->top);
    p->top.psel = p->top.penable = 0;
    p->top.eval();
    return value;
}

void rtl_plant_put(struct rtl_plant *p, int place, int64_t word)
{
    Vplant___024root *r = p->top.rootp;
    uint32_t high = (uint32_t)(word >> 18) & 0x3FFFF, low = (uint32_t)word & 0x3FFFF;
    r->plant__DOT__core__DOT__high_ab__DOT__word[place] = high;
    r->plant__DOT__core__DOT__high_c__DOT__word[place] = high;
    r->plant__DOT__core__DOT__low_bc__DOT__word[place] = low;
}

int64_t rtl_plant_get(const struct rtl_plant *p, int place)
{
    const Vplant___024root *r = p->top.rootp;
    int64_t high = r->plant__DOT__core__DOT__high_ab__DOT__word[place];
    return (high >= HALF / 2 ? high - HALF : high) * HALF + r->plant__DOT__core__DOT__low_bc__DOT__word[place];
}

int rtl_plant_writes(const struct rtl_plant *p, int64_t *word)
{
    const Vplant___024root *r = p->top.rootp;
    *word = (int64_t)(r->plant__DOT__word << 28) >> 28;
    return r->plant__DOT__valid ? r->plant__DOT__place : -1;
}

int rtl_plant_phase(const struct rtl_plant *p)
{
    return p->top.rootp->plant__DOT__core__DOT__clock;
}
