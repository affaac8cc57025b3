/* SPDX-License-Identifier: MIT */
/*
 * An MMUART behind two ring buffers.
 *
 * The transmitter's interrupt is the delicate part. In a 16550 it is raised when the FIFO runs empty and when ETBEI is
 * switched on while it is empty, and it is dropped by reading IIR or writing THR. So it must not be relied on as an
 * edge: the handler looks at LSR.THRE on every entry, whatever the cause, and ETBEI is on exactly as long as there is
 * something to send. Switching it on with an empty FIFO is what starts a transmission.
 *
 * IER is written as a whole, never modified: the thread only ever sets all of it, after it has stored the character, and the
 * handler clears ETBEI only when it has found nothing to send, ERBFI only while nobody has room. Whichever comes last, no
 * character stays behind.
 */
#include "drivers/mss/mmuart.h"

#include "drivers/cortex/cpu.h"
#include "drivers/mss/sysreg.h"

#define LSR_ERRORS  (MMUART_LSR_OE | MMUART_LSR_PE | MMUART_LSR_FE | MMUART_LSR_BI)
#define IER_RECEIVE (MMUART_IER_ERBFI | MMUART_IER_ELSI)
#define IER_BOTH    (IER_RECEIVE | MMUART_IER_ETBEI)

/* Sixteen characters of ten bits at 9600 baud last 1.7 million clocks; a poll is at least four. */
#define EMERGENCY_POLLS 420000u

_Static_assert((MMUART_TX_BYTES & (MMUART_TX_BYTES - 1u)) == 0u, "a power of two: indices run free and are masked");
_Static_assert((MMUART_RX_BYTES & (MMUART_RX_BYTES - 1u)) == 0u, "a power of two: indices run free and are masked");

static uint32_t line_control(enum mmuart_format format)
{
    switch (format) {
    case MMUART_8N2:
        return MMUART_LCR_8N1 | MMUART_LCR_STB;
    case MMUART_8O1:
        return MMUART_LCR_8N1 | MMUART_LCR_PEN;
    case MMUART_8E1:
        return MMUART_LCR_8N1 | MMUART_LCR_PEN | MMUART_LCR_EPS;
    default:
        return MMUART_LCR_8N1;
    }
}

/* MMUART_1 hangs on the other bus. */
static uint32_t clock_hz(const struct mmuart_regs *regs)
{
    return regs == MMUART1 ? BOARD_APB1_HZ : BOARD_APB0_HZ;
}

bool mmuart_open(struct mmuart *u, struct mmuart_regs *regs, uint32_t baud, enum mmuart_format format)
{
    const uint32_t pclk_hz = clock_hz(regs);
    if (baud < pclk_hz / (1u << 20) + 1u || baud > pclk_hz / 32u) { /* the divisor has 16 bits and is at least 2 */
        return false;
    }
    /* 64ths of the divisor: 64 PCLK / (16 baud), rounded. */
    const uint32_t divisor_64ths = (4u * pclk_hz + baud / 2u) / baud;
    const uint32_t divisor = divisor_64ths >> 6;

    sysreg_release_reset(regs == MMUART1 ? SYSREG_RESET_MMUART1 : SYSREG_RESET_MMUART0);
    regs->IER = 0u;
    regs->IEM = 0u;
    regs->MM1 = 0u;
    regs->MM2 = 0u;
    regs->GFR = 0u;
    regs->TTG = 0u;
    regs->RTO = 0u;
    regs->MCR = 0u;

    regs->LCR = MMUART_LCR_DLAB;
    regs->DMR = divisor >> 8;
    regs->DLR = divisor & 0xFFu;
    regs->LCR = line_control(format);
    regs->DFR = divisor_64ths & 63u;
    regs->MM0 = MMUART_MM0_EFBR;

    /* Receive trigger 1 (bits 7:6 = 0): no character waits for a time-out. */
    regs->FCR = MMUART_FCR_FIFO_ENABLE | MMUART_FCR_CLEAR_RX | MMUART_FCR_CLEAR_TX;

    u->tx_head = u->tx_tail; /* empty, wherever that is */
    u->rx_head = u->rx_tail;
    u->rx_suspects = 0u;
    u->rx_silence = false;
    u->rx_muted = false;
    u->flow_control = u->holding = u->held = false;
    u->urgent = 0;
    u->rx_lsr = 0u;
    u->counters = (struct mmuart_counters){0};
    u->regs = regs;
    regs->IER = IER_RECEIVE;
    return true;
}

bool mmuart_init(struct mmuart *u, struct mmuart_regs *regs, uint32_t baud)
{
    return mmuart_open(u, regs, baud, MMUART_8N1);
}

void mmuart_use_flow_control(struct mmuart *u)
{
    u->flow_control = true;
}

size_t mmuart_free_space(const struct mmuart *u)
{
    return MMUART_TX_BYTES - (u->tx_head - u->tx_tail);
}

bool mmuart_put(struct mmuart *u, char character)
{
    if (mmuart_free_space(u) == 0u) {
        u->counters.tx_dropped++;
        return false;
    }
    const uint32_t head = u->tx_head;
    u->tx_data[head % MMUART_TX_BYTES] = character;
    u->tx_head = head + 1u;
    u->regs->IER = IER_BOTH;
    return true;
}

bool mmuart_is_idle(const struct mmuart *u)
{
    return u->tx_head == u->tx_tail && (u->regs->LSR & MMUART_LSR_TEMT) != 0u;
}

bool mmuart_take(struct mmuart *u, uint32_t *received)
{
    const uint32_t tail = u->rx_tail;
    if (u->rx_head == tail) {
        return false;
    }
    *received = u->rx_data[tail % MMUART_RX_BYTES];
    u->rx_tail = tail + 1u;
    if (u->holding && u->rx_head - u->rx_tail <= MMUART_RX_LOW) {
        u->holding = false; /* the interrupt sets it far above */
        u->urgent = MMUART_XON;
        u->regs->IER = IER_BOTH;
    }
    return true;
}

bool mmuart_get(struct mmuart *u, char *character, bool *loss)
{
    uint32_t received;
    if (!mmuart_take(u, &received)) {
        return false;
    }
    *character = (char)(uint8_t)received;
    *loss = *loss || (received & MMUART_RX_LOSS) != 0u;
    return true;
}

/* The next `count` characters will carry the mark of a loss. */
static void suspect(struct mmuart *u, uint32_t count)
{
    if (u->rx_suspects < count) {
        u->rx_suspects = count;
    }
}

static bool is_full(const struct mmuart *u)
{
    return u->rx_head - u->rx_tail == MMUART_RX_BYTES;
}

static void ask_to_wait(struct mmuart *u)
{
    if (u->flow_control && !u->holding && u->rx_head - u->rx_tail > MMUART_RX_HIGH) {
        u->holding = true;
        u->urgent = MMUART_XOFF;
    }
}

static void store(struct mmuart *u, char character)
{
    uint32_t received = (uint8_t)character;
    if (u->rx_suspects > 0u) {
        u->rx_suspects--;
        received |= MMUART_RX_LOSS;
    }
    if (u->rx_silence) {
        u->rx_silence = false;
        received |= MMUART_RX_SILENCE;
    }
    const uint32_t head = u->rx_head;
    u->rx_data[head % MMUART_RX_BYTES] = (uint16_t)received;
    u->rx_head = head + 1u;
}

/*
 * Takes a received character, with the LSR that was read before it: reading LSR clears the error bits. After an overrun this
 * character is good; the gap comes behind the ones that the FIFO holds, so everything up to the first one behind it is suspect.
 */
static void receive(struct mmuart *u, uint32_t lsr, char character)
{
    if (u->rx_muted) {
        return;
    }
    if ((lsr & MMUART_LSR_OE) != 0u) {
        u->counters.rx_overruns++;
        suspect(u, MMUART_FIFO_BYTES + 1u);
    }
    if ((lsr & (MMUART_LSR_PE | MMUART_LSR_FE | MMUART_LSR_BI)) != 0u) {
        u->counters.rx_errors++;
        suspect(u, 1u);
    } else if (u->flow_control && (character == MMUART_XON || character == MMUART_XOFF)) {
        u->held = character == MMUART_XOFF;
    } else if (is_full(u)) {
        u->counters.rx_dropped++;
        suspect(u, 1u);
    } else {
        store(u, character);
    }
}

/* The FIFO is empty: what is urgent, and what waits unless the other side does not want it. */
static void transmit(struct mmuart *u)
{
    uint32_t room = MMUART_FIFO_BYTES;
    uint32_t tail = u->tx_tail;
    if (u->urgent != 0) {
        u->regs->THR = (uint8_t)u->urgent;
        u->urgent = 0;
        room--;
    }
    if (u->held) {
        return;
    }
    for (; room > 0u && tail != u->tx_head; room--) {
        u->regs->THR = (uint8_t)u->tx_data[tail % MMUART_TX_BYTES];
        tail++;
        u->tx_tail = tail;
    }
}

/* What there is to wait for: room in the transmitter, and characters, unless they would find none in the buffer. */
static void set_interrupts(struct mmuart *u)
{
    const bool sends = u->urgent != 0 || (u->tx_head != u->tx_tail && !u->held);
    const bool takes = !(u->flow_control && is_full(u));
    u->regs->IER = MMUART_IER_ELSI | (takes ? MMUART_IER_ERBFI : 0u) | (sends ? MMUART_IER_ETBEI : 0u);
}

void mmuart_irq_handler(struct mmuart *u)
{
    (void)u->regs->IIR; /* drops the transmitter's interrupt */
    uint32_t lsr = u->regs->LSR | u->rx_lsr;
    for (uint32_t room = MMUART_FIFO_BYTES; room > 0u && (lsr & MMUART_LSR_DR) != 0u; room--) {
        if (u->flow_control && is_full(u)) {
            u->rx_lsr = lsr & LSR_ERRORS; /* it stays where it is, and reading has cleared what is wrong with it */
            break;
        }
        u->rx_lsr = 0u;
        receive(u, lsr, (char)u->regs->RBR);
        lsr = u->regs->LSR;
    }
    ask_to_wait(u);
    if ((lsr & MMUART_LSR_THRE) != 0u) {
        transmit(u);
    }
    set_interrupts(u);
}

struct mmuart_counters mmuart_counters(const struct mmuart *u)
{
    return (struct mmuart_counters){
        .tx_dropped = u->counters.tx_dropped,
        .rx_dropped = u->counters.rx_dropped,
        .rx_overruns = u->counters.rx_overruns,
        .rx_errors = u->counters.rx_errors,
    };
}

bool mmuart_emergency_write(struct mmuart_regs *regs, const char *text)
{
    regs->IER = 0u;
    for (; *text != '\0'; text++) {
        uint32_t polls = EMERGENCY_POLLS;
        while ((regs->LSR & MMUART_LSR_THRE) == 0u) {
            if (--polls == 0u) {
                return false;
            }
        }
        regs->THR = (uint8_t)*text;
    }
    return true;
}
