/* SPDX-License-Identifier: MIT */
/* MMUART against its registers: rates, a loop-back, an overrun, a full buffer; the rest: tests/unit/test_mmuart.py. */
#include "drivers/board.h"
#include "drivers/cortex/nvic.h"
#include "drivers/mss/mmuart.h"
#include "drivers/mss/watchdog.h"
#include "startup/startup.h"
#include "tests/target/harness.h"
#include "tests/target/waiting.h"

static struct mmuart uart;
static volatile uint32_t uart_calls;

void UART0_IRQHandler(void)
{
    uart_calls++;
    mmuart_irq_handler(&uart);
}

static bool uart_goes_idle(void)
{
    const uint32_t start = mss_timer2_now();
    while (!mmuart_is_idle(&uart)) {
        if (mss_timer2_now() - start > 300000u * US_TICKS) {
            return false; /* 1024 characters take 89 ms */
        }
        watchdog_refresh();
    }
    wait_us(200u); /* the last one is still on its way through the receiver */
    return true;
}

/* What one run through the loop-back brought, kept until the console works again. */
struct loop_result {
    bool idle;
    uint32_t sent, received, wrong;
    uint32_t marked, first_marked; /* characters next to a loss, and the first of them */
    uint32_t ier_after, calls;
    struct mmuart_counters counters;
};

static char pattern(uint32_t i)
{
    return (char)(uint8_t)(i * 37u + 11u);
}

/* Sends `count` characters to itself and reads them; the console is deaf and dumb meanwhile. */
static struct loop_result loop_back(uint32_t count)
{
    struct loop_result result = {.sent = 0u};
    (void)mmuart_init(&uart, MMUART0, 115200u);
    MMUART0->MCR = MMUART_MCR_LOOP;
    uart_calls = 0u;
    nvic_enable(MSS_IRQ_UART0);
    for (uint32_t i = 0; i < count; i++) {
        result.sent += mmuart_put(&uart, pattern(i)) ? 1u : 0u;
    }
    result.idle = uart_goes_idle();
    nvic_disable(MSS_IRQ_UART0);
    char character;
    for (bool loss = false; mmuart_get(&uart, &character, &loss); loss = false) {
        result.first_marked = loss && result.marked == 0u ? result.received : result.first_marked;
        result.marked += loss ? 1u : 0u;
        result.wrong += character != pattern(result.received) ? 1u : 0u;
        result.received++;
    }
    result.ier_after = MMUART0->IER;
    result.calls = uart_calls;
    result.counters = mmuart_counters(&uart);
    MMUART0->MCR = 0u;
    return result;
}

static void check_loop_back(void)
{
    const struct loop_result one = loop_back(1u);
    harness_true("uart: one character leaves", one.idle);
    harness_equal("uart: and comes back", one.received - one.wrong, 1u);

    const struct loop_result hundred = loop_back(100u);
    harness_true("uart: 100 characters leave", hundred.idle);
    harness_equal("uart: and come back", hundred.received, 100u);
    harness_equal("uart: in order", hundred.wrong, 0u);
    harness_equal("uart: transmit interrupt is off when idle", hundred.ier_after, MMUART_IER_ERBFI | MMUART_IER_ELSI);
    harness_between("uart: interrupts for 100 characters", hundred.calls, 1u, 400u);
    harness_equal("uart: none dropped", hundred.counters.tx_dropped + hundred.counters.rx_dropped, 0u);
    harness_equal("uart: no overrun", hundred.counters.rx_overruns, 0u);
    harness_equal("uart: no error", hundred.counters.rx_errors, 0u);
    harness_equal("uart: none marked as next to a loss", hundred.marked, 0u);

    /* More than the receive buffer holds: the oldest stay, the rest is counted. */
    const struct loop_result many = loop_back(MMUART_RX_BYTES + 40u);
    harness_equal("uart: receive buffer holds its size", many.received, MMUART_RX_BYTES);
    harness_equal("uart: of the oldest", many.wrong, 0u);
    harness_equal("uart: rest dropped and counted", many.counters.rx_dropped, 40u);
    harness_equal("uart: what came before the loss is not marked", many.marked, 0u);
}

static void check_full_transmit_buffer(void)
{
    (void)mmuart_init(&uart, MMUART0, 115200u);
    MMUART0->MCR = MMUART_MCR_LOOP; /* with the interrupt off in the NVIC nothing leaves the buffer */
    uint32_t taken = 0;
    const uint32_t space = (uint32_t)mmuart_free_space(&uart);
    for (uint32_t i = 0; i < MMUART_TX_BYTES + 3u; i++) {
        taken += mmuart_put(&uart, 'x') ? 1u : 0u;
    }
    const uint32_t dropped = mmuart_counters(&uart).tx_dropped;
    const uint32_t left = (uint32_t)mmuart_free_space(&uart);
    (void)mmuart_init(&uart, MMUART0, 115200u);
    harness_equal("uart: free space at first", space, MMUART_TX_BYTES);
    harness_equal("uart: takes as many", taken, MMUART_TX_BYTES);
    harness_equal("uart: no space then", left, 0u);
    harness_equal("uart: three dropped and counted", dropped, 3u);
    harness_equal("uart: empty after init", (uint32_t)mmuart_free_space(&uart), MMUART_TX_BYTES);
}

static void check_overrun(void)
{
    (void)mmuart_init(&uart, MMUART0, 115200u);
    MMUART0->MCR = MMUART_MCR_LOOP;
    for (uint32_t i = 0; i < MMUART_FIFO_BYTES + 4u; i++) {
        MMUART0->THR = (uint8_t)pattern(i);
        wait_us(100u); /* one character is 87 us */
    }
    nvic_enable(MSS_IRQ_UART0);
    const bool idle = uart_goes_idle();
    nvic_disable(MSS_IRQ_UART0);
    const uint32_t overruns = mmuart_counters(&uart).rx_overruns;
    uint32_t received = 0;
    uint32_t wrong = 0;
    uint32_t marked = 0;
    char character;
    for (bool loss = false; mmuart_get(&uart, &character, &loss); loss = false) {
        marked += loss ? 1u : 0u;
        wrong += received < MMUART_FIFO_BYTES && character != pattern(received) ? 1u : 0u;
        received++;
    }
    MMUART0->MCR = 0u;
    harness_true("uart: idle after an overrun", idle);
    harness_between("uart: overrun counted", overruns, 1u, 4u);
    harness_between("uart: the FIFO's characters survive it", received, MMUART_FIFO_BYTES, MMUART_FIFO_BYTES + 1u);
    harness_equal("uart: intact", wrong, 0u);
    harness_equal("uart: and all marked, because the gap may be anywhere behind the first", marked, received);
}

static void check_emergency_write(void)
{
    static const char text[] = "help";
    (void)mmuart_init(&uart, MMUART0, 115200u);
    MMUART0->MCR = MMUART_MCR_LOOP;
    const bool written = mmuart_emergency_write(MMUART0, text);
    wait_us(600u);
    uint32_t right = 0;
    for (uint32_t i = 0; i < sizeof(text) - 1u && (MMUART0->LSR & MMUART_LSR_DR) != 0u; i++) {
        right += (char)MMUART0->RBR == text[i] ? 1u : 0u;
    }
    const uint32_t ier = MMUART0->IER;
    (void)mmuart_init(&uart, MMUART0, 115200u);
    harness_true("uart: emergency write", written);
    harness_equal("uart: went out", right, sizeof(text) - 1u);
    harness_equal("uart: and left the interrupts off", ier, 0u);
}

/* Divisor in 64ths, as the block has it. */
static uint32_t divisor_64ths(void)
{
    MMUART0->LCR = MMUART_LCR_8N1 | MMUART_LCR_DLAB;
    const uint32_t divisor = (MMUART0->DMR << 8) | MMUART0->DLR;
    MMUART0->LCR = MMUART_LCR_8N1;
    return (divisor << 6) | MMUART0->DFR;
}

static void test_uart(void)
{
    harness_true("uart: refuses 0 baud", !mmuart_init(&uart, MMUART0, 0u));
    harness_true("uart: refuses more than PCLK/32", !mmuart_init(&uart, MMUART0, BOARD_APB0_HZ / 32u + 1u));
    harness_true("uart: refuses a divisor over 16 bits", !mmuart_init(&uart, MMUART0, BOARD_APB0_HZ / (1u << 20)));
    harness_true("uart: takes the largest", mmuart_init(&uart, MMUART0, BOARD_APB0_HZ / (1u << 20) + 1u));
    harness_true("uart: PCLK/32", mmuart_init(&uart, MMUART0, BOARD_APB0_HZ / 32u));
    harness_equal("uart: divisor 2", divisor_64ths(), 2u << 6);
    harness_true("uart: 115200 baud", mmuart_init(&uart, MMUART0, 115200u));
    harness_equal("uart: divisor 54 + 16/64", divisor_64ths(), (54u << 6) + 16u);
    harness_equal("uart: fraction in use", MMUART0->MM0, MMUART_MM0_EFBR);
    harness_true("uart: 9600 baud", mmuart_init(&uart, MMUART0, 9600u));
    harness_equal("uart: divisor 651 + 3/64", divisor_64ths(), (651u << 6) + 3u);
    harness_true("uart: 56000 baud", mmuart_init(&uart, MMUART0, 56000u));
    harness_equal("uart: divisor 111 + 39/64", divisor_64ths(), (111u << 6) + 39u);
    (void)mmuart_init(&uart, MMUART0, 115200u);

    check_full_transmit_buffer();
    check_loop_back();
    check_overrun();
    check_emergency_write();
}

int main(void)
{
    (void)harness_begin();
    waiting_begin();
    test_uart();
    harness_end();
}
