/* SPDX-License-Identifier: MIT */
/*
 * The bring-up image: what a device is, beside what docs/silicon.md says of it, on MMUART_0 at 115200 baud. One function for
 * each step of that page; main.c goes through them. It switches no gate on.
 *
 * Interrupts are never masked, so that a bus fault has its own handler; none is enabled but by the steps that are about them.
 *
 * A step that ends in a reset, on purpose or not, is gone on with: what is known so far is in .noinit.
 */
#ifndef DRIVERS_BRINGUP_BRINGUP_H
#define DRIVERS_BRINGUP_BRINGUP_H

#include "drivers/bringup/table.h"
#include "drivers/mss/irq.h"

/* Registers as main() found them, before anything had been written. */
struct found {
    uint32_t causes, resets;
    uint32_t edac_cr, edac_irq, edac_sr;
    uint32_t envm_status;
    uint32_t lsr, pin_config, pin_out;
    uint32_t dwt_ctrl;
    uint32_t uart, timer, fabric; /* of which B17 says whether they are so again */
    uint32_t uncached_cycles;     /* of measure_chase_from_esram() before the cache was on */
};

/* In .noinit. */
struct bringup {
    uint32_t magic;
    struct found found;  /* at the page's begin */
    struct found again;  /* after the newest reset */
    uint32_t next;       /* step under way */
    bool reset_expected; /* the step has asked for it */
    bool page_done;
    uint32_t mark;                       /* B17's */
    uint32_t differs[(FACTS + 31) / 32]; /* a bit a fact */
    uint32_t not_ended;                  /* a bit a step: it ended in a reset that nobody had asked for */
    uint32_t exception;                  /* that led to it, 0: none */
};

/* How often each interrupt has come since it was last set to 0. */
extern volatile uint32_t interrupts_came[MSS_IRQ_COUNT];

/* ---- report.c: the page, a line at a time ---- */
void report(struct bringup *b, enum fact fact, uint32_t value);
void report_text(const char *step, const char *text);
void report_not_ended(struct bringup *b, const char *step, uint32_t causes);
void report_title(void);
/* What a user sends, and whether all is as documented. */
void report_verdict(const struct bringup *b);

/* ---- steps ---- */
void step_core(struct bringup *b);         /* B01 */
void step_causes(struct bringup *b);       /* B02 */
void step_clocks(struct bringup *b);       /* B03 */
void step_memory(struct bringup *b);       /* B04 */
void step_watchdog(struct bringup *b);     /* B05 */
void step_esram(struct bringup *b);        /* B06 */
void step_envm_cycles(struct bringup *b);  /* B07 */
void step_fic(struct bringup *b);          /* B08 */
void step_exceptions(struct bringup *b);   /* B09 */
void step_timer(struct bringup *b);        /* B10 */
void step_interrupts(struct bringup *b);   /* B11 */
void step_sleep(struct bringup *b);        /* B12 */
void step_fabric(struct bringup *b);       /* B13 */
void step_envm(struct bringup *b);         /* B14 */
void step_uart(struct bringup *b);         /* B15 */
void step_pins(struct bringup *b);         /* B16 */
void step_soft_reset(struct bringup *b);   /* B17 */
void step_other_resets(struct bringup *b); /* B18 */
void step_by_hand(struct bringup *b);      /* B19 */
void step_can_bus(struct bringup *b);      /* B20 */

/* Two lines, for somebody with another clock; the watchdog waits longer. */
void ten_seconds(void);

/* Ends in a lock-up of the core. */
_Noreturn void lock_up(void);

/* The page began at a power-on, or the reset button; a probe's reset leaves it to the program to release the fabric. */
bool powered_on(const struct bringup *b);

/* The fabric answers, and is the one that the drivers know: then it may be written to. */
bool fabric_is_ours(void);

/* Until `ticks` of timer 2 have passed since `start`. */
void wait_until(uint32_t start, uint32_t ticks);

#endif
