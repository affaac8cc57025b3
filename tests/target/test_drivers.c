/* SPDX-License-Identifier: MIT */
/*
 * Drivers of the core and of the MSS against their registers: reset cause and clocks, MSS timer, UART, watchdog, NVIC.
 */
#include "drivers/board.h"
#include "drivers/cortex/dwt.h"
#include "drivers/cortex/nvic.h"
#include "drivers/cortex/scb.h"
#include "drivers/cortex/systick.h"
#include "drivers/mss/gpio.h"
#include "drivers/mss/mmuart.h"
#include "drivers/mss/sysreg.h"
#include "drivers/mss/timer.h"
#include "drivers/mss/watchdog.h"
#include "startup/startup.h"
#include "tests/target/harness.h"

enum stage { POWER_ON, AFTER_WATCHDOG };

#define US_TICKS (BOARD_MSS_TIMER_HZ / 1000000u)

/* Waits by timer 2, which the test of the timers has checked before it is used. */
static void wait_us(uint32_t us)
{
    const uint32_t start = mss_timer2_now();
    while (mss_timer2_now() - start < us * US_TICKS) {
        /* time passes */
    }
}

/* ---- SYSREG ---- */

static void test_sysreg(void)
{
    harness_equal("sysreg: cause is power-on", harness_reset_cause(), SYSREG_CAUSE_POWER_ON);
    harness_equal("sysreg: the cause is cleared by reading it", sysreg_reset_cause(), 0u);

    const struct sysreg_clocks clocks = sysreg_clock_ratios();
    harness_equal("sysreg: M3 ratio", clocks.m3, 1u);
    harness_equal("sysreg: APB0 ratio", clocks.apb0, 1u);
    harness_equal("sysreg: APB1 ratio", clocks.apb1, 1u);
    harness_equal("sysreg: FIC_0 ratio", clocks.fic0, 1u);
    harness_true("sysreg: clocks from the PLL", clocks.from_pll);
    harness_true("sysreg: clocks are the board's", sysreg_clocks_match_board());
    harness_true("sysreg: both PLLs are locked", sysreg_plls_locked());

    const uint32_t facc1 = SYSREG->MSSDDR_FACC1_CR;
    SYSREG->MSSDDR_FACC1_CR = facc1 | SYSREG_FACC1_GLMUX_SEL;
    harness_true("sysreg: the standby clock is not the board's", !sysreg_clocks_match_board());
    SYSREG->MSSDDR_FACC1_CR = facc1 | (1u << 2);
    harness_equal("sysreg: APB0 ratio of code 1", sysreg_clock_ratios().apb0, 2u);
    harness_true("sysreg: APB0 at half rate is not the board's", !sysreg_clocks_match_board());
    SYSREG->MSSDDR_FACC1_CR = facc1 | (4u << 13);
    harness_equal("sysreg: FIC_0 ratio of code 4", sysreg_clock_ratios().fic0, 8u);
    SYSREG->MSSDDR_FACC1_CR = facc1 | (3u << 9);
    harness_equal("sysreg: code 3 is no ratio", sysreg_clock_ratios().m3, 0u);
    harness_true("sysreg: and not the board's", !sysreg_clocks_match_board());
    SYSREG->MSSDDR_FACC1_CR = facc1;

    const uint32_t resets = SYSREG->SOFT_RESET_CR;
    const uint32_t held = SYSREG_RESET_TIMER | SYSREG_RESET_GPIO | SYSREG_RESET_GPOUT;
    SYSREG->SOFT_RESET_CR = resets | held;
    sysreg_enable_cache();
    harness_equal("sysreg: cache on", SYSREG->CC_CR & SYSREG_CC_CR_ENABLE, SYSREG_CC_CR_ENABLE);
    harness_equal("sysreg: for the code at 0", SYSREG->CC_REGION_CR & 0xFu, SYSREG_CC_REGION_CODE_0);
    gpio_init();
    harness_equal("sysreg: gpio_init releases its own resets only", SYSREG->SOFT_RESET_CR & held, SYSREG_RESET_TIMER);
    sysreg_release_reset(SYSREG_RESET_TIMER);
    harness_equal("sysreg: all released", SYSREG->SOFT_RESET_CR & held, 0u);
    SYSREG->SOFT_RESET_CR = resets;
}

/* ---- MSS timer ---- */

#define PERIOD_TICKS 20000u
#define PERIODS      8u

static volatile uint32_t timer1_calls, timer1_first, timer1_last, timer1_ris_after;

void Timer1_IRQHandler(void)
{
    const uint32_t now = mss_timer2_now();
    mss_timer1_acknowledge();
    timer1_ris_after |= MSS_TIMER->TIM1_RIS | MSS_TIMER->TIM1_MIS;
    if (timer1_calls == 0u) {
        timer1_first = now;
    }
    timer1_last = now;
    timer1_calls++;
}

static void test_timer(void)
{
    mss_timer2_start_free_running();
    const uint32_t t0 = mss_timer2_now();
    harness_between("timer: timer 2 starts at 0", t0, 0u, 1000u);
    for (volatile uint32_t i = 0; i < 1000u; i++) {
        /* let it count */
    }
    harness_between("timer: timer 2 counts up", mss_timer2_now() - t0, 1000u, 1000000u);

    harness_true("timer: refuses a period of 0", !mss_timer1_start_periodic(0u));
    harness_equal("timer: and stays off", MSS_TIMER->TIM1_CTRL & MSS_TIMER_CTRL_ENABLE, 0u);

    nvic_enable(MSS_IRQ_TIMER1);
    const uint32_t start = mss_timer2_now();
    harness_true("timer: starts", mss_timer1_start_periodic(PERIOD_TICKS));
    while (timer1_calls < PERIODS && mss_timer2_now() - start < 2u * PERIODS * PERIOD_TICKS) {
        /* bounded */
    }
    mss_timer1_stop();
    harness_equal("timer: interrupts", timer1_calls, PERIODS);
    harness_between("timer: first comes a period after the start", timer1_first - start, PERIOD_TICKS,
                    PERIOD_TICKS + 2000u);
    harness_between("timer: period", timer1_last - timer1_first, (PERIODS - 1u) * PERIOD_TICKS - 20u,
                    (PERIODS - 1u) * (PERIOD_TICKS + 1u) + 20u);
    harness_equal("timer: acknowledged", timer1_ris_after, 0u);

    const uint32_t calls = timer1_calls;
    wait_us(3u * PERIOD_TICKS / US_TICKS);
    harness_equal("timer: no interrupt after the stop", timer1_calls - calls, 0u);
    nvic_disable(MSS_IRQ_TIMER1);
}

/* ---- MMUART ---- */

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

/* The receiver's registers in RAM: the status stays as it is set, so a call of the handler receives sixteen times. */
static struct mmuart_regs fake;

static void fake_receive(uint32_t lsr)
{
    fake.IER = 0u;
    ((volatile uint32_t *)&fake)[offsetof(struct mmuart_regs, LSR) / 4u] = lsr;
    mmuart_irq_handler(&uart);
}

/* Takes out what was received and counts; the first character decides about `first`. */
static uint32_t fake_marked(uint32_t *received, bool *first)
{
    uint32_t marked = 0;
    char character;
    *received = 0;
    for (bool loss = false; mmuart_get(&uart, &character, &loss); loss = false) {
        *first = *received == 0u ? loss : *first;
        marked += loss ? 1u : 0u;
        *received += 1u;
    }
    return marked;
}

static void check_damaged(const char *name, uint32_t lsr)
{
    uint32_t received;
    bool first = false;
    (void)mmuart_init(&uart, &fake, 115200u);
    fake_receive(MMUART_LSR_DR | lsr);
    const uint32_t marked_alone = fake_marked(&received, &first);
    harness_equal(name, received + marked_alone, 0u);
    harness_equal("uart: and counted", mmuart_counters(&uart).rx_errors, MMUART_FIFO_BYTES);
    fake_receive(MMUART_LSR_DR);
    const uint32_t marked = fake_marked(&received, &first);
    harness_equal("uart: the next good one says so", marked, 1u);
    harness_true("uart: that is the first", first && received == MMUART_FIFO_BYTES);
}

static void check_losses(void)
{
    uint32_t received;
    bool first = false;
    check_damaged("uart: a framing error is no character", MMUART_LSR_FE);
    check_damaged("uart: a parity error is no character", MMUART_LSR_PE);
    check_damaged("uart: a break is no character", MMUART_LSR_BI);

    (void)mmuart_init(&uart, &fake, 115200u);
    for (uint32_t n = 0; n < MMUART_RX_BYTES / MMUART_FIFO_BYTES + 1u; n++) {
        fake_receive(MMUART_LSR_DR); /* once more than fits */
    }
    uint32_t marked = fake_marked(&received, &first);
    harness_equal("uart: what fits before a drop", received, MMUART_RX_BYTES);
    harness_equal("uart: is good", marked, 0u);
    fake_receive(MMUART_LSR_DR);
    marked = fake_marked(&received, &first);
    harness_true("uart: the first one behind a drop is marked", marked == 1u && first);
    (void)mmuart_init(&uart, MMUART0, 115200u);
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
    (void)mmuart_init(&uart, MMUART0, 115200u);

    check_full_transmit_buffer();
    check_loop_back();
    check_overrun();
    check_losses();
    check_emergency_write();
}

/* ---- NVIC and the core's own exceptions ---- */

static volatile uint32_t order[8], order_count, pendsv_calls, systick_calls;

static void note(uint32_t who)
{
    order[order_count % 8u] = who;
    order_count++;
}

/* Pends a more urgent one (GPIO1) and an equal one (GPIO2) while it runs. */
void GPIO0_IRQHandler(void)
{
    note(0x10u);
    nvic_pend(MSS_IRQ_GPIO(1u));
    nvic_pend(MSS_IRQ_GPIO(2u));
    note(nvic_is_active(MSS_IRQ_GPIO(0u)) && nvic_is_pending(MSS_IRQ_GPIO(2u)) ? 0x11u : 0xEEu);
}

void GPIO1_IRQHandler(void)
{
    note(0x20u);
}

void GPIO2_IRQHandler(void)
{
    note(0x30u);
}

void PendSV_Handler(void)
{
    pendsv_calls++;
}

void SysTick_Handler(void)
{
    systick_calls++;
}

static void test_priorities(void)
{
    nvic_priority(MSS_IRQ_GPIO(3u), 99u);
    harness_equal("nvic: priority is held to 15", NVIC->IPR[MSS_IRQ_GPIO(3u)], 0xF0u);
    nvic_priority(MSS_IRQ_GPIO(0u), 5u);
    nvic_priority(MSS_IRQ_GPIO(1u), 4u);
    nvic_priority(MSS_IRQ_GPIO(2u), 5u);
    harness_equal("nvic: priority in the upper nibble", NVIC->IPR[MSS_IRQ_GPIO(0u)], 0x50u);
    nvic_enable(MSS_IRQ_COUNT);
    harness_true("nvic: a number too large is no interrupt", !nvic_is_enabled(MSS_IRQ_COUNT));

    nvic_enable(MSS_IRQ_GPIO(0u));
    nvic_enable(MSS_IRQ_GPIO(1u));
    nvic_enable(MSS_IRQ_GPIO(2u));
    harness_true("nvic: enabled", nvic_is_enabled(MSS_IRQ_GPIO(1u)));

    const uint32_t primask = cpu_irq_save();
    nvic_pend(MSS_IRQ_GPIO(0u));
    harness_equal("nvic: held back by PRIMASK", order_count, 0u);
    harness_true("nvic: but pending", nvic_is_pending(MSS_IRQ_GPIO(0u)));
    nvic_clear_pending(MSS_IRQ_GPIO(0u));
    cpu_irq_restore(primask);
    cpu_isb();
    harness_equal("nvic: and forgotten", order_count, 0u);

    const uint32_t before = cpu_mask_below(5u);
    nvic_pend(MSS_IRQ_GPIO(2u));
    nvic_pend(MSS_IRQ_GPIO(1u));
    const uint32_t masked_count = order_count;
    const uint32_t masked_first = order[0];
    (void)cpu_mask_below(before);
    cpu_isb();
    harness_equal("nvic: the mask lets one through", masked_count, 1u);
    harness_equal("nvic: the more urgent one", masked_first, 0x20u);
    harness_equal("nvic: the other follows", order[1], 0x30u);

    order_count = 0u;
    nvic_pend(MSS_IRQ_GPIO(0u));
    harness_equal("nvic: four steps", order_count, 4u);
    harness_equal("nvic: first the one pended", order[0], 0x10u);
    harness_equal("nvic: preempted by the more urgent", order[1], 0x20u);
    harness_equal("nvic: not by the equal", order[2], 0x11u);
    harness_equal("nvic: which comes after it", order[3], 0x30u);
    nvic_disable(MSS_IRQ_GPIO(0u));
    nvic_pend(MSS_IRQ_GPIO(0u));
    harness_equal("nvic: disabled, it does not run", order_count, 4u);
    nvic_clear_pending(MSS_IRQ_GPIO(0u));
}

static void test_core(void)
{
    scb_priority(SCB_EXCEPTION_PENDSV, 15u);
    harness_equal("scb: PendSV priority", SCB->SHPR[10], 0xF0u);
    scb_pend_pendsv();
    cpu_dsb();
    cpu_isb();
    harness_equal("scb: PendSV comes", pendsv_calls, 1u);

    harness_true("dwt: has a cycle counter", dwt_init());
    const uint32_t first = dwt_cycles();
    for (volatile uint32_t i = 0; i < 100u; i++) {
        /* let it count */
    }
    harness_between("dwt: counts up", dwt_cycles() - first, 300u, 5000u);

    harness_true("systick: refuses 1", !systick_start_periodic(1u));
    harness_true("systick: refuses more than 24 bits", !systick_start_periodic(SYSTICK_MAX_TICKS + 1u));
    harness_true("systick: starts", systick_start_periodic(10000u));
    const uint32_t start = mss_timer2_now();
    while (systick_calls < 3u && mss_timer2_now() - start < 1000u * US_TICKS) {
        /* bounded */
    }
    systick_stop();
    harness_equal("systick: ticks", systick_calls, 3u);

    harness_true("gpio: a pin over 31 reads low", !gpio_read(GPIO_PINS));
    gpio_configure_output(5u);
    gpio_configure_output(31u);
    gpio_configure_input(6u);
    gpio_write(5u, true);
    gpio_write(6u, true);
    harness_true("gpio: an output reads back high", gpio_read(5u));
    harness_true("gpio: another output stays low", !gpio_read(31u));
    harness_true("gpio: an input does not follow the output register", !gpio_read(6u));
    gpio_write(31u, true);
    gpio_write(5u, false);
    harness_true("gpio: low again, the other one high", !gpio_read(5u) && gpio_read(31u));
    gpio_write(GPIO_PINS, true);
    harness_equal("gpio: a pin over 31 writes nothing", GPIO->GPIO_OUT, (1u << 31) | (1u << 6));
}

/* ---- watchdog ---- */

static void test_watchdog(void)
{
    harness_true("watchdog: on", watchdog_is_enabled());
    harness_equal("watchdog: time-out of the board's design", watchdog_timeout_ticks(), BOARD_WATCHDOG_LOAD_TICKS);
    harness_true("watchdog: as designed", watchdog_is_as_designed());
    watchdog_refresh();
    wait_us(5u);
    const uint32_t early = watchdog_remaining_ticks();
    wait_us(1000u);
    const uint32_t late = watchdog_remaining_ticks();
    watchdog_refresh();
    wait_us(5u);
    const uint32_t refreshed = watchdog_remaining_ticks();
    const uint32_t us_ticks = BOARD_WATCHDOG_HZ / 1000000u;
    harness_between("watchdog: near its load after a refresh", early, BOARD_WATCHDOG_LOAD_TICKS - 20u * us_ticks,
                    BOARD_WATCHDOG_LOAD_TICKS);
    harness_between("watchdog: counts down at its rate", early - late, 950u * us_ticks, 1050u * us_ticks);
    harness_between("watchdog: and back up", refreshed, BOARD_WATCHDOG_LOAD_TICKS - 20u * us_ticks,
                    BOARD_WATCHDOG_LOAD_TICKS);

    /* Refreshed in time it stays quiet for longer than its time-out; then it is left alone. */
    for (uint32_t ms = 0; ms < 150u; ms++) {
        watchdog_refresh();
        wait_us(1000u);
    }
    harness_true("watchdog: quiet while refreshed", true);
    harness_next_stage(AFTER_WATCHDOG);
    watchdog_refresh();
    wait_us(110000u);
    harness_next_stage(POWER_ON);
    harness_true("watchdog: resets when it is not refreshed", false);
}

static void power_on(void)
{
    test_sysreg();
    test_timer();
    test_uart();
    test_priorities();
    test_core();
    test_watchdog();
}

int main(void)
{
    if (harness_begin() == POWER_ON) {
        power_on();
    } else {
        harness_equal("watchdog: reset, and the cause says so", harness_reset_cause(), SYSREG_CAUSE_WATCHDOG);
    }
    harness_end();
}
