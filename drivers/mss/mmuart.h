/* SPDX-License-Identifier: MIT */
/*
 * MMUART: 8 bits, interrupt-driven, with a ring buffer each way (UG0331, MMUART chapter; 16550 register model with
 * additions). Nothing here waits except mmuart_emergency_write(), and that is bounded.
 *
 * A struct mmuart has one writer and one reader, both in the thread, and one interrupt handler.
 */
#ifndef DRIVERS_MSS_MMUART_H
#define DRIVERS_MSS_MMUART_H

#include "drivers/board.h"
#include "drivers/reg.h"

struct mmuart_regs {
    union {
        const volatile uint32_t RBR; /* read */
        volatile uint32_t THR;       /* write */
        volatile uint32_t DLR;       /* LCR.DLAB */
    };
    union {
        volatile uint32_t IER;
        volatile uint32_t DMR; /* LCR.DLAB */
    };
    union {
        const volatile uint32_t IIR; /* read */
        volatile uint32_t FCR;       /* write */
    };
    volatile uint32_t LCR;
    volatile uint32_t MCR;
    const volatile uint32_t LSR;
    const volatile uint32_t MSR;
    volatile uint32_t SR;
    uint32_t reserved_20;
    volatile uint32_t IEM;
    volatile uint32_t IIM;
    uint32_t reserved_2c;
    volatile uint32_t MM0;
    volatile uint32_t MM1;
    volatile uint32_t MM2;
    volatile uint32_t DFR;
    uint32_t reserved_40;
    volatile uint32_t GFR;
    volatile uint32_t TTG;
    volatile uint32_t RTO;
    volatile uint32_t ADR;
};

REG_AT_OFFSET(struct mmuart_regs, RBR, 0x00);
REG_AT_OFFSET(struct mmuart_regs, THR, 0x00);
REG_AT_OFFSET(struct mmuart_regs, DLR, 0x00);
REG_AT_OFFSET(struct mmuart_regs, IER, 0x04);
REG_AT_OFFSET(struct mmuart_regs, DMR, 0x04);
REG_AT_OFFSET(struct mmuart_regs, IIR, 0x08);
REG_AT_OFFSET(struct mmuart_regs, FCR, 0x08);
REG_AT_OFFSET(struct mmuart_regs, LCR, 0x0C);
REG_AT_OFFSET(struct mmuart_regs, MCR, 0x10);
REG_AT_OFFSET(struct mmuart_regs, LSR, 0x14);
REG_AT_OFFSET(struct mmuart_regs, MSR, 0x18);
REG_AT_OFFSET(struct mmuart_regs, SR, 0x1C);
REG_AT_OFFSET(struct mmuart_regs, IEM, 0x24);
REG_AT_OFFSET(struct mmuart_regs, IIM, 0x28);
REG_AT_OFFSET(struct mmuart_regs, MM0, 0x30);
REG_AT_OFFSET(struct mmuart_regs, MM1, 0x34);
REG_AT_OFFSET(struct mmuart_regs, MM2, 0x38);
REG_AT_OFFSET(struct mmuart_regs, DFR, 0x3C);
REG_AT_OFFSET(struct mmuart_regs, GFR, 0x44);
REG_AT_OFFSET(struct mmuart_regs, TTG, 0x48);
REG_AT_OFFSET(struct mmuart_regs, RTO, 0x4C);
REG_AT_OFFSET(struct mmuart_regs, ADR, 0x50);

#define MMUART0 REG_BLOCK(struct mmuart_regs, 0x40000000u) /* on APB0 */
#define MMUART1 REG_BLOCK(struct mmuart_regs, 0x40010000u) /* on APB1 */

#define MMUART_IER_ERBFI       (1u << 0) /* received data */
#define MMUART_IER_ETBEI       (1u << 1) /* transmitter empty */
#define MMUART_IER_ELSI        (1u << 2) /* receive errors */
#define MMUART_FCR_FIFO_ENABLE (1u << 0)
#define MMUART_FCR_CLEAR_RX    (1u << 1)
#define MMUART_FCR_CLEAR_TX    (1u << 2)
#define MMUART_LCR_8N1         0x03u
#define MMUART_LCR_STB         (1u << 2) /* two stop bits */
#define MMUART_LCR_PEN         (1u << 3) /* parity */
#define MMUART_LCR_EPS         (1u << 4) /* even parity */
#define MMUART_LCR_DLAB        (1u << 7)
#define MMUART_MCR_LOOP        (1u << 4)
#define MMUART_LSR_DR          (1u << 0)
#define MMUART_LSR_OE          (1u << 1)
#define MMUART_LSR_PE          (1u << 2)
#define MMUART_LSR_FE          (1u << 3)
#define MMUART_LSR_BI          (1u << 4)
#define MMUART_LSR_THRE        (1u << 5)
#define MMUART_LSR_TEMT        (1u << 6)
#define MMUART_MM0_EFBR        (1u << 7)
#define MMUART_FIFO_BYTES      16u

/* Characters that the buffers hold. */
#define MMUART_TX_BYTES 1024u
#define MMUART_RX_BYTES 512u

/* What went wrong on the line since mmuart_init(). */
struct mmuart_counters {
    uint32_t tx_dropped;  /* mmuart_put() with the buffer full */
    uint32_t rx_dropped;  /* received with the buffer full */
    uint32_t rx_overruns; /* lost in the receiver because the handler came too late */
    uint32_t rx_errors;   /* characters thrown away: framing, parity, break */
};

/* Heads count characters ever written, tails characters ever read; each has one writer. */
struct mmuart {
    struct mmuart_regs *regs;
    volatile uint32_t tx_head, tx_tail;
    volatile uint32_t rx_head, rx_tail;
    volatile uint32_t rx_suspects; /* how many of the next characters will be marked as next to a loss */
    volatile bool rx_muted;        /* received characters are dropped: echo */
    volatile uint32_t rx_lsr;      /* of a character that stays in the receiver: there was no room */
    volatile bool flow_control;
    volatile bool holding;    /* the other side has been asked to wait */
    volatile bool held;       /* the other side has asked us to wait */
    volatile char urgent;     /* sent ahead of everything waiting: XON or XOFF, 0 for none */
    volatile bool rx_silence; /* the next one follows a silence: set in the interrupt that measures it */
    volatile struct mmuart_counters counters;
    volatile char tx_data[MMUART_TX_BYTES];
    volatile uint16_t rx_data[MMUART_RX_BYTES]; /* the character, and MMUART_RX_* */
};

/* What follows the eight bits of a character. */
enum mmuart_format {
    MMUART_8N1,
    MMUART_8N2,
    MMUART_8O1,
    MMUART_8E1,
};

/*
 * Releases the block's reset, sets format and rate and empties both buffers. The rate is PCLK / (16 (n + f/64)), PCLK that of
 * the block's bus, rounded to the nearest: at 115200 baud from 100 MHz it is 0.006 % off. The caller enables the block's
 * interrupt in the NVIC and lets its handler call mmuart_irq_handler().
 *
 * Returns false and leaves the block alone if the divisor does not fit: baud above PCLK/32 or below PCLK/2^20. Context: thread.
 */
bool mmuart_open(struct mmuart *u, struct mmuart_regs *regs, uint32_t baud, enum mmuart_format format);

/* The same in 8N1. Context: thread. */
bool mmuart_init(struct mmuart *u, struct mmuart_regs *regs, uint32_t baud);

/*
 * Uses XON and XOFF until the next mmuart_open(): asks the other side to wait while the receive buffer holds more than
 * MMUART_RX_HIGH, and to go on at MMUART_RX_LOW; obeys its requests and does not pass them to the reader. With the buffer full
 * the rest stays in the receiver. For lines that carry text in both directions. Context: thread, after mmuart_open().
 */
void mmuart_use_flow_control(struct mmuart *u);

#define MMUART_XON     0x11
#define MMUART_XOFF    0x13
#define MMUART_RX_HIGH 128u /* the rest is for what is still in flight when the sender notices */
#define MMUART_RX_LOW  32u

/*
 * Puts a character into the transmit buffer; never waits. Returns false and counts it in tx_dropped when there is no
 * room. Context: thread, one writer.
 */
bool mmuart_put(struct mmuart *u, char character);

/* Characters that mmuart_put() will take now without dropping any. Context: thread. */
size_t mmuart_free_space(const struct mmuart *u);

/* True when everything has left, including the last stop bit. Context: thread. */
bool mmuart_is_idle(const struct mmuart *u);

/*
 * Takes the oldest received character; returns false if there is none. Sets *loss, and never clears it, when characters near
 * this one are missing: dropped for lack of room, damaged on the line, or overrun in the receiver. The first character after a
 * gap always sets it; after an overrun up to 16 before it do, too, because the receiver does not tell where the gap is.
 * Context: thread, one reader.
 */
bool mmuart_get(struct mmuart *u, char *character, bool *loss);

/* Beside the character's eight bits. */
#define MMUART_RX_LOSS    (1u << 8) /* others are missing near it, see above */
#define MMUART_RX_SILENCE (1u << 9) /* rx_silence was set when it came */

/* The same, with all that is known of the character. Context: thread, one reader. */
bool mmuart_take(struct mmuart *u, uint32_t *received);

/* Serves receiver and transmitter; at most 16 characters each way a call. Context: the block's interrupt only. */
void mmuart_irq_handler(struct mmuart *u);

/* Context: thread. The values may be from different instants. */
struct mmuart_counters mmuart_counters(const struct mmuart *u);

/*
 * Writes a string by polling, bypassing the buffers, with the block's interrupts off from then on; for the fault path, where
 * nothing else can be relied on. Gives up at the first character that the transmitter does not take in the time of 16, so it
 * returns even from a dead line. Returns true if all reached the transmitter. Context: fault; works without mmuart_init() too,
 * at whatever rate is set.
 */
bool mmuart_emergency_write(struct mmuart_regs *regs, const char *text);

#endif
