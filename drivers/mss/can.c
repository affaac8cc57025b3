/* SPDX-License-Identifier: MIT */
/*
 * The block's traps, each of which docs/silicon.md lists with its source: data bytes stand the wrong way round for this
 * core unless SWAP_ENDIAN is set; CTRL words change only where their write-protect bits are written as 1, and these do not
 * read back, so words are written whole, never modified; the mailboxes are RAM that holds anything at first, so each word
 * is written once before one is read; CONFIG is written only while the block is stopped, which COMMAND tells.
 */
#include "drivers/mss/can.h"

#include "drivers/board.h"
#include "drivers/cortex/cpu.h"
#include "drivers/cortex/nvic.h"
#include "drivers/mss/sysreg.h"

#define INT_ALL         0xFFFFFFFFu
#define WANTED          (CAN_INT_GLOBAL | CAN_INT_BUS_OFF | CAN_INT_RX_LOST | CAN_INT_TX_DONE | CAN_INT_RX_STORED)
#define ACCEPT_STANDARD (~CAN_MASK_EXTENDED) /* any other bit of a filter may be anything */

#define RX_LINKED 8u

/* 16 + 3 + 1 quanta a bit, of which it is sampled behind the 17th: 85 %. 800 kbit/s has 25, and no more before it: 68 %. */
struct can_timing {
    uint16_t kbit_s, prescaler;
    uint8_t before, behind; /* the sample, quanta */
};

/* An edge may move the sample by all that is behind it, 4 quanta at most: a clock 0.58 % wrong is followed (ISO 11898-1). */
static uint32_t jump_of(const struct can_timing *t)
{
    return t->behind < 4u ? t->behind : 4u;
}

static const struct can_timing timings[] = {
    {20, 250, 16, 3}, {50, 100, 16, 3}, {125, 40, 16, 3}, {250, 20, 16, 3},
    {500, 10, 16, 3}, {800, 5, 16, 8},  {1000, 5, 16, 3},
};

_Static_assert(20000u * 250u * 20u == BOARD_APB1_HZ, "20 kbit/s of APB1");
_Static_assert(50000u * 100u * 20u == BOARD_APB1_HZ, "50 kbit/s of APB1");
_Static_assert(125000u * 40u * 20u == BOARD_APB1_HZ, "125 kbit/s of APB1");
_Static_assert(250000u * 20u * 20u == BOARD_APB1_HZ, "250 kbit/s of APB1");
_Static_assert(500000u * 10u * 20u == BOARD_APB1_HZ, "500 kbit/s of APB1");
_Static_assert(800000u * 5u * 25u == BOARD_APB1_HZ, "800 kbit/s of APB1");
_Static_assert(1000000u * 5u * 20u == BOARD_APB1_HZ, "1000 kbit/s of APB1");

_Static_assert((CAN_QUEUE & (CAN_QUEUE - 1u)) == 0u, "a power of two: indices run free and are masked");

static const struct can_timing *timing_of(uint32_t kbit_s)
{
    for (size_t n = 0; n < sizeof timings / sizeof timings[0]; n++) {
        if (timings[n].kbit_s == kbit_s) {
            return &timings[n];
        }
    }
    return NULL;
}

bool can_rate_is_known(uint32_t kbit_s)
{
    return timing_of(kbit_s) != NULL;
}

static void stop(struct can_regs *r)
{
    r->COMMAND = 0u;
    r->INT_ENABLE = 0u;
}

static void clear_mailboxes(struct can_regs *r)
{
    for (uint32_t n = 0; n < CAN_MAILBOXES; n++) {
        r->TX[n].CTRL = CAN_TX_CHANGE_LOW | CAN_CHANGE_HIGH;
        r->TX[n].ID = 0u;
        r->TX[n].DATA_HIGH = 0u;
        r->TX[n].DATA_LOW = 0u;
        r->RX[n].CTRL = CAN_RX_ACKNOWLEDGE | CAN_RX_CHANGE_LOW | CAN_CHANGE_HIGH;
        r->RX[n].ID = 0u;
        r->RX[n].DATA_HIGH = 0u;
        r->RX[n].DATA_LOW = 0u;
        r->RX[n].AMR = 0u;
        r->RX[n].ACR = 0u;
        r->RX[n].AMR_DATA = UINT32_MAX;
        r->RX[n].ACR_DATA = 0u;
    }
}

/* Every frame with an 11-bit identifier, whatever that is. */
static void set_filters(struct can_regs *r)
{
    for (uint32_t n = 0; n < RX_LINKED; n++) {
        r->RX[n].AMR = ACCEPT_STANDARD;
        r->RX[n].ACR = 0u;
        r->RX[n].CTRL = CAN_RX_CHANGE_LOW | CAN_CHANGE_HIGH | CAN_RX_ENABLE | CAN_RX_INTERRUPT |
                        (n + 1u < RX_LINKED ? CAN_RX_LINK : 0u);
    }
}

bool can_open(struct can *c, struct can_regs *regs, uint32_t kbit_s, bool recovers)
{
    const struct can_timing *const t = timing_of(kbit_s);
    if (t == NULL) {
        return false;
    }
    can_close(c);
    sysreg_release_reset(SYSREG_RESET_CAN);
    stop(regs);
    clear_mailboxes(regs);
    regs->CONFIG = (t->prescaler - 1u) << CAN_CONFIG_PRESCALER_AT | CAN_CONFIG_SWAP_ENDIAN | CAN_CONFIG_FIXED_ORDER |
                   (t->before - 1u) << CAN_CONFIG_TSEG1_AT | (t->behind - 1u) << CAN_CONFIG_TSEG2_AT |
                   (jump_of(t) - 1u) << CAN_CONFIG_SJW_AT | (recovers ? CAN_CONFIG_AUTO_RESTART : 0u);
    set_filters(regs);
    c->rx_head = c->rx_tail = c->tx_head = c->tx_tail = 0u;
    cpu_compiler_barrier();
    c->regs = regs;
    regs->INT_STATUS = INT_ALL;
    regs->COMMAND = CAN_COMMAND_RUN;
    regs->INT_ENABLE = WANTED;
    return true;
}

void can_close(struct can *c)
{
    struct can_regs *const regs = c->regs;
    c->regs = NULL; /* for the interrupt, which may be pending */
    cpu_compiler_barrier();
    if (regs != NULL) {
        stop(regs);
    }
    SYSREG->SOFT_RESET_CR |= SYSREG_RESET_CAN;
}

/* ---- out: one mailbox ---- */

static uint32_t word_of(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static void bytes_of(uint32_t word, uint8_t *bytes)
{
    for (uint32_t n = 0; n < 4u; n++) {
        bytes[n] = (uint8_t)(word >> (8u * n));
    }
}

/* Nothing of the mailbox may change while it is under way. Interrupt. */
static void send_next(struct can *c)
{
    struct can_regs *const r = c->regs;
    const uint32_t tail = c->tx_tail;
    if (tail == c->tx_head || (r->TX_BUF_STATUS & 1u) != 0u) {
        return;
    }
    const struct can_frame *const f = &c->tx[tail % CAN_QUEUE];
    r->TX[0].ID = (uint32_t)f->id << CAN_STANDARD_AT;
    r->TX[0].DATA_HIGH = word_of(f->data);
    r->TX[0].DATA_LOW = word_of(&f->data[4]);
    r->TX[0].CTRL =
        (uint32_t)f->count << CAN_COUNT_AT | CAN_TX_CHANGE_LOW | CAN_CHANGE_HIGH | CAN_TX_INTERRUPT | CAN_TX_REQUEST;
    c->tx_tail = tail + 1u;
}

bool can_send(struct can *c, const struct can_frame *f)
{
    const uint32_t head = c->tx_head;
    if (c->regs == NULL || head - c->tx_tail == CAN_QUEUE) {
        c->tx_dropped++;
        return false;
    }
    c->tx[head % CAN_QUEUE] = *f;
    cpu_compiler_barrier();
    c->tx_head = head + 1u;
    nvic_pend(MSS_IRQ_CAN);
    return true;
}

uint32_t can_pending(const struct can *c)
{
    return c->regs == NULL ? 0u : c->tx_head - c->tx_tail + (c->regs->TX_BUF_STATUS & 1u);
}

/* The interrupt moves the tail. */
void can_forget(struct can *c)
{
    const uint32_t mask = cpu_irq_save();
    c->tx_head = c->tx_tail;
    cpu_irq_restore(mask);
}

/* ---- in ---- */

static void take_mailbox(struct can *c, uint32_t n)
{
    struct can_regs *const r = c->regs;
    const uint32_t head = c->rx_head;
    const uint32_t control = r->RX[n].CTRL;
    if (head - c->rx_tail < CAN_QUEUE) {
        struct can_frame *const f = &c->rx[head % CAN_QUEUE];
        const uint32_t count = (control >> CAN_COUNT_AT) & 15u;
        f->id = (uint16_t)(r->RX[n].ID >> CAN_STANDARD_AT | ((control & CAN_IS_REMOTE) != 0u ? CAN_REMOTE : 0u));
        f->count = (uint8_t)(count > 8u ? 8u : count);
        bytes_of(r->RX[n].DATA_HIGH, f->data);
        bytes_of(r->RX[n].DATA_LOW, &f->data[4]);
        cpu_compiler_barrier();
        c->rx_head = head + 1u;
    } else {
        c->rx_lost++;
    }
    r->RX[n].CTRL = CAN_RX_ACKNOWLEDGE;
}

static void receive_all(struct can *c)
{
    uint32_t stored;
    while ((stored = c->regs->RX_BUF_STATUS) != 0u) {
        for (uint32_t n = 0; n < RX_LINKED; n++) {
            if ((stored >> n & 1u) != 0u) {
                take_mailbox(c, n);
            }
        }
    }
}

bool can_take(struct can *c, struct can_frame *f)
{
    const uint32_t tail = c->rx_tail;
    if (tail == c->rx_head) {
        return false;
    }
    *f = c->rx[tail % CAN_QUEUE];
    cpu_compiler_barrier();
    c->rx_tail = tail + 1u;
    return true;
}

enum can_state can_state(const struct can *c)
{
    const uint32_t state = c->regs == NULL ? 0u : c->regs->ERROR_STATUS >> CAN_STATE_AT & 3u;
    return state >= 2u ? CAN_OFF : (enum can_state)state;
}

void can_irq_handler(struct can *c)
{
    if (c->regs == NULL) {
        return;
    }
    const uint32_t status = c->regs->INT_STATUS;
    c->regs->INT_STATUS = status;
    c->rx_lost += (status & CAN_INT_RX_LOST) != 0u;
    c->offs += (status & CAN_INT_BUS_OFF) != 0u;
    receive_all(c);
    send_next(c);
}
