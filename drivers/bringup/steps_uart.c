/* SPDX-License-Identifier: MIT */
/* MMUART_1 in its local loop, so that nothing leaves the device: B15. The line status as found is the console's. */
#include "drivers/bringup/bringup.h"
#include "drivers/cortex/dwt.h"

#define LOOP_BAUD       115200u
#define LOOP_CHARACTERS 10u
#define PATIENCE_CYCLES (2u * LOOP_CHARACTERS * 10u * (BOARD_M3_HZ / LOOP_BAUD))

static uint32_t loop_cycles(struct mmuart_regs *uart)
{
    const uint32_t start = dwt_cycles();
    uint32_t heard = 0;
    for (uint32_t n = 0; n < LOOP_CHARACTERS; n++) {
        uart->THR = n;
    }
    while (heard < LOOP_CHARACTERS && dwt_cycles() - start < PATIENCE_CYCLES) {
        if ((uart->LSR & MMUART_LSR_DR) != 0u) {
            heard += uart->RBR == heard ? 1u : LOOP_CHARACTERS + 1u;
        }
    }
    return heard == LOOP_CHARACTERS ? dwt_cycles() - start : 0u;
}

void step_uart(struct bringup *b)
{
    struct mmuart looped = {0};
    volatile uint8_t *const scratch = (volatile uint8_t *)&MMUART1->SR;
    report(b, FACT_LSR, b->found.lsr);
    (void)mmuart_init(&looped, MMUART1, LOOP_BAUD);
    MMUART1->IER = 0u;
    MMUART1->MCR = MMUART_MCR_LOOP;
    report(b, FACT_UART_TIME, loop_cycles(MMUART1));
    MMUART1->MCR = 0u;
    MMUART1->SR = 0x5Au;
    report(b, FACT_UART_BY_BYTE, *scratch);
    *scratch = 0xA5u;
    report(b, FACT_UART_BY_WORD, MMUART1->SR);
}
