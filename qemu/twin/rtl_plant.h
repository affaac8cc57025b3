/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The verilated plant: clocks, pins and its registers. */
#ifndef TWIN_RTL_PLANT_H
#define TWIN_RTL_PLANT_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define RTL_PLANT_WORDS 128

/* From the axis to the plant, and back; bits C B A, of sdata bus voltage C B A. */
struct rtl_plant_in {
    uint8_t gate_high, gate_low;
    bool chops, cs_n, sclk, temp_cs_n, temp_sclk;
};

struct rtl_plant_out {
    uint8_t sdata, hall;
    bool temp_sdata, a, b, index, lost;
};

struct rtl_plant;

struct rtl_plant *rtl_plant_new(void);
/* A clock with the pins as they are. */
void rtl_plant_clock(struct rtl_plant *p, const struct rtl_plant_in *in, struct rtl_plant_out *out);
/* The same with half of a write to a register; true: that was the second half. */
bool rtl_plant_transfer(struct rtl_plant *p, const struct rtl_plant_in *in, struct rtl_plant_out *out, uint32_t offset,
                        uint32_t value);
/* The same many times, for pins that rest; looks at nothing. */
void rtl_plant_clocks(struct rtl_plant *p, const struct rtl_plant_in *in, uint64_t clocks);
/* Registers, each in two clocks in which the gates rest. */
void rtl_plant_write(struct rtl_plant *p, uint32_t offset, uint32_t value);
uint32_t rtl_plant_read(struct rtl_plant *p, uint32_t offset);
/* A word at once, without a clock, as a debugger of the RTL would. */
void rtl_plant_put(struct rtl_plant *p, int place, int64_t word);
int64_t rtl_plant_get(const struct rtl_plant *p, int place);
/* What is written in the present clock: its place, or -1. */
int rtl_plant_writes(const struct rtl_plant *p, int64_t *word);
/* The clock of the step. */
int rtl_plant_phase(const struct rtl_plant *p);
/* Clocks, one at least, in which no pin of encoder and Hall switches changes; those of converters follow CS and SCLK alone. */
uint64_t rtl_plant_rests(const struct rtl_plant *p);
void rtl_plant_look(const struct rtl_plant *p, struct rtl_plant_out *out);

#ifdef __cplusplus
}
#endif

#endif
