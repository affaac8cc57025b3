/* SPDX-License-Identifier: MIT */
/*
 * MMUART_0 behind two ring buffers.
 *
 * The transmitter's interrupt is the delicate part. In a 16550 it is raised when the FIFO runs empty and when ETBEI is
 * switched on while it is empty, and it is dropped by reading IIR or writing THR. So it must not be relied on as an
 * edge: the handler looks at LSR.THRE on every entry, whatever the cause, and ETBEI is on exactly as long as there is
 * something to send. Switching it on with an empty FIFO is what starts a transmission.
 *
 * IER is written with constants, never modified: the thread only ever sets ETBEI, after it has stored the character,
 * and the handler clears it only when it has found the buffer empty. Whichever comes last, no character stays behind.
 */
#include "drivers/mss/mmuart.h"

#include "drivers/cortex/cpu.h"
#include "drivers/mss/sysreg.h"

#define IER_RECEIVE (MMUART_IER_ERBFI | MMUART_IER_ELSI)
#define IER_BOTH    (IER_RECEIVE | MMUART_IER_ETBEI)

/* Sixteen characters of ten bits at 9600 baud last 1.7 million clocks; a poll is at least four. */
#define EMERGENCY_POLLS 420000u

_Static_assert((MMUART0_TX_BYTES & (MMUART0_TX_BYTES - 1u)) == 0u, "a power of two: indices run free and are masked");
_Static_assert((MMUART0_RX_BYTES & (MMUART0_RX_BYTES - 1u)) == 0u, "a power of two: indices run free and are masked");

/* head: characters ever written, tail: characters ever read; each has one writer. */
static struct {
    volatile uint32_t head;
    volatile uint32_t tail;
    volatile char data[MMUART0_TX_BYTES];
} tx;

static struct {
    volatile uint32_t head;
    volatile uint32_t tail;
    volatile char data[MMUART0_RX_BYTES];
} rx;

static volatile struct mmuart_counters counters;

bool mmuart0_init(uint32_t baud)
{
    if (baud == 0u || baud > BOARD_APB0_HZ / 32u) {
        return false;
    }
    /* 64ths of the divisor: 64 PCLK / (16 baud), rounded. */
    const uint32_t divisor_64ths = (4u * BOARD_APB0_HZ + baud / 2u) / baud;
    const uint32_t divisor = divisor_64ths >> 6;
    if (divisor > 0xFFFFu) {
        return false;
    }

    sysreg_release_reset(SYSREG_RESET_MMUART0);
    MMUART0->IER = 0u;
    MMUART0->IEM = 0u;
    MMUART0->MM1 = 0u;
    MMUART0->MM2 = 0u;
    MMUART0->GFR = 0u;
    MMUART0->TTG = 0u;
    MMUART0->RTO = 0u;
    MMUART0->MCR = 0u;

    MMUART0->LCR = MMUART_LCR_DLAB;
    MMUART0->DMR = divisor >> 8;
    MMUART0->DLR = divisor & 0xFFu;
    MMUART0->LCR = MMUART_LCR_8N1;
    MMUART0->DFR = divisor_64ths & 63u;
    MMUART0->MM0 = MMUART_MM0_EFBR;

    /* Receive trigger 1 (bits 7:6 = 0): no character waits for a time-out. */
    MMUART0->FCR = MMUART_FCR_FIFO_ENABLE | MMUART_FCR_CLEAR_RX | MMUART_FCR_CLEAR_TX;

    tx.head = tx.tail = 0u;
    rx.head = rx.tail = 0u;
    counters.tx_dropped = 0u;
    counters.rx_dropped = 0u;
    counters.rx_overruns = 0u;
    counters.rx_errors = 0u;
    MMUART0->IER = IER_RECEIVE;
    return true;
}

size_t mmuart0_free_space(void)
{
    return MMUART0_TX_BYTES - (tx.head - tx.tail);
}

bool mmuart0_put(char character)
{
    if (mmuart0_free_space() == 0u) {
        counters.tx_dropped++;
        return false;
    }
    const uint32_t head = tx.head;
    tx.data[head % MMUART0_TX_BYTES] = character;
    tx.head = head + 1u;
    MMUART0->IER = IER_BOTH;
    return true;
}

bool mmuart0_is_idle(void)
{
    return tx.head == tx.tail && (MMUART0->LSR & MMUART_LSR_TEMT) != 0u;
}

bool mmuart0_get(char *character)
{
    const uint32_t tail = rx.tail;
    if (rx.head == tail) {
        return false;
    }
    *character = rx.data[tail % MMUART0_RX_BYTES];
    rx.tail = tail + 1u;
    return true;
}

/* Stores a received character, with the LSR that was read before it: reading LSR clears the error bits. */
static void receive(uint32_t lsr, char character)
{
    if ((lsr & MMUART_LSR_OE) != 0u) {
        counters.rx_overruns++; /* a later character was lost; this one is good */
    }
    if ((lsr & (MMUART_LSR_PE | MMUART_LSR_FE | MMUART_LSR_BI)) != 0u) {
        counters.rx_errors++;
    } else if (rx.head - rx.tail == MMUART0_RX_BYTES) {
        counters.rx_dropped++;
    } else {
        const uint32_t head = rx.head;
        rx.data[head % MMUART0_RX_BYTES] = character;
        rx.head = head + 1u;
    }
}

/* The FIFO is empty: fill it, or say that there is nothing more to send. */
static void transmit(void)
{
    uint32_t tail = tx.tail;
    for (uint32_t room = MMUART_FIFO_BYTES; room > 0u && tail != tx.head; room--) {
        MMUART0->THR = (uint8_t)tx.data[tail % MMUART0_TX_BYTES];
        tail++;
        tx.tail = tail;
    }
    if (tail == tx.head) {
        MMUART0->IER = IER_RECEIVE;
    }
}

void mmuart0_irq_handler(void)
{
    (void)MMUART0->IIR; /* drops the transmitter's interrupt */
    uint32_t lsr = MMUART0->LSR;
    for (uint32_t room = MMUART_FIFO_BYTES; room > 0u && (lsr & MMUART_LSR_DR) != 0u; room--) {
        receive(lsr, (char)MMUART0->RBR);
        lsr = MMUART0->LSR;
    }
    if ((lsr & MMUART_LSR_THRE) != 0u) {
        transmit();
    }
}

struct mmuart_counters mmuart0_counters(void)
{
    return (struct mmuart_counters){
        .tx_dropped = counters.tx_dropped,
        .rx_dropped = counters.rx_dropped,
        .rx_overruns = counters.rx_overruns,
        .rx_errors = counters.rx_errors,
    };
}

bool mmuart0_emergency_write(const char *text)
{
    MMUART0->IER = 0u;
    for (; *text != '\0'; text++) {
        uint32_t polls = EMERGENCY_POLLS;
        while ((MMUART0->LSR & MMUART_LSR_THRE) == 0u) {
            if (--polls == 0u) {
                return false;
            }
        }
        MMUART0->THR = (uint8_t)*text;
    }
    return true;
}
