// SPDX-License-Identifier: GPL-2.0-or-later
#include "rtl_plant.h"

#include "Vplant.h"
#include "Vplant___024root.h"
#include "verilated.h"

#if VERILATOR_VERSION_INTEGER == 5006000
#define INNER_NAMES
void Vplant___024root___eval_nba(Vplant___024root *root);
#endif

struct rtl_plant {
    Vplant top;
};

namespace
{
constexpr int64_t HALF = 1 << 18;
constexpr int LOOK_FROM = 84, LOOK_TO = 5; /* angles are written, a step begins, pins follow */

/* As rtl_one_clock() of the axis: eval() would ask twice what the inputs have done and when the clock rises. */
void edge(Vplant &top)
{
#ifdef INNER_NAMES
    top.rootp->__VnbaTriggered.at(0) = 1;
    Vplant___024root___eval_nba(top.rootp);
    top.rootp->__VnbaTriggered.at(0) = 0;
#else
    top.clk = 1;
    top.eval();
    top.clk = 0;
    top.eval();
#endif
}

void drive(Vplant &top, const rtl_plant_in *in)
{
    bool same = top.gate_high == in->gate_high && top.gate_low == in->gate_low && top.chops == in->chops &&
                top.cs_n == in->cs_n && top.sclk == in->sclk && top.temp_cs_n == in->temp_cs_n &&
                top.temp_sclk == in->temp_sclk;
    if (same) {
        return;
    }
    top.gate_high = in->gate_high;
    top.gate_low = in->gate_low;
    top.chops = in->chops;
    top.cs_n = in->cs_n;
    top.sclk = in->sclk;
    top.temp_cs_n = in->temp_cs_n;
    top.temp_sclk = in->temp_sclk;
    top.eval();
}

void transfer(Vplant &top, bool writes, uint32_t offset, uint32_t value)
{
    top.psel = 1;
    top.penable = 0;
    top.pwrite = writes;
    top.paddr = (uint16_t)offset;
    top.pwdata = value;
    top.eval();
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
    p->top.eval();
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

bool rtl_plant_transfer(struct rtl_plant *p, const struct rtl_plant_in *in, struct rtl_plant_out *out, uint32_t offset,
                        uint32_t value)
{
    Vplant &top = p->top;
    bool second = top.psel;
    top.penable = second;
    top.psel = top.pwrite = 1;
    top.paddr = (uint16_t)offset;
    top.pwdata = value;
    top.eval();
    rtl_plant_clock(p, in, out);
    top.psel = !second;
    top.penable = 0;
    top.eval();
    return second;
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
    p->top.eval();
    edge(p->top);
    uint32_t value = p->top.prdata;
    p->top.penable = 1;
    p->top.eval();
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

uint64_t rtl_plant_rests(const struct rtl_plant *p)
{
    const Vplant___024root *r = p->top.rootp;
    int phase = r->plant__DOT__core__DOT__clock;
    if (phase < LOOK_TO || phase >= LOOK_FROM) {
        return 1;
    }
    uint32_t quarter = r->plant__DOT__shaft__DOT__way & 0x3FFFFFFF;
    int64_t increment = (int32_t)r->plant__DOT__shaft__DOT__increment;
    int64_t room = increment >= 0 ? 0x3FFFFFFF - (int64_t)quarter : (int64_t)quarter;
    int64_t left = increment == 0 ? LOOK_FROM : room / (increment < 0 ? -increment : increment) - 2,
            until = LOOK_FROM - phase;
    left = left < until ? left : until;
    return left < 1 ? 1 : (uint64_t)left;
}

void rtl_plant_look(const struct rtl_plant *p, struct rtl_plant_out *out)
{
    const Vplant &top = p->top;
    *out = {(uint8_t)top.sdata, (uint8_t)top.pin_hall, (bool)top.temp_sdata, (bool)top.pin_a,
            (bool)top.pin_b,    (bool)top.pin_index,   (bool)top.pin_lost};
}

int rtl_plant_phase(const struct rtl_plant *p)
{
    return p->top.rootp->plant__DOT__core__DOT__clock;
}
