/* SPDX-License-Identifier: MIT */
/*
 * The board: clock rates, addresses in the fabric and interrupt lines, all fixed by the Libero design (docs/fabric.md).
 * Rates cannot be read from the device (it knows its ratios, not its reference), so they are defined only here;
 * sysreg_clocks_match_board() checks what can be checked.
 */
#ifndef DRIVERS_BOARD_H
#define DRIVERS_BOARD_H

#include "drivers/mss/irq.h"

/* ---- clocks, Hz ---- */
#define BOARD_M3_HZ        100000000u
#define BOARD_APB0_HZ      100000000u /* MMUART_0, MSS timer */
#define BOARD_APB1_HZ      100000000u /* GPIO, MMUART_1, CAN */
#define BOARD_FIC0_HZ      100000000u
#define BOARD_FABRIC_HZ    100000000u    /* PWM counts */
#define BOARD_MSS_TIMER_HZ BOARD_APB0_HZ /* no prescaler */
#define BOARD_WATCHDOG_HZ  50000000u     /* internal RC oscillator, +-5 % */

/* ---- fabric: 256-byte slots behind FIC_0, so that one base register reaches every block ---- */
#define BOARD_FABRIC_BASE 0x50000000u

/* ---- interrupts ---- */
#define BOARD_IRQ_ADC      MSS_IRQ_FABRIC(0u) /* 34: end of conversion, level */
#define BOARD_IRQ_ADC_2    MSS_IRQ_FABRIC(1u) /* 35: of the second axis */
#define BOARD_IRQ_CONSOLE  MSS_IRQ_UART0
#define BOARD_IRQ_TICK     MSS_IRQ_TIMER1
#define BOARD_IRQ_SCOPE    MSS_IRQ_I2C1_SMBUS    /* raised by software only: the block behind it stays in reset */
#define BOARD_IRQ_PUT_BACK MSS_IRQ_I2C1_SMBALERT /* likewise: a block is in reset again */
#define BOARD_IRQ_BUS      MSS_IRQ_UART1
#define BOARD_IRQ_CAN      MSS_IRQ_CAN
#define BOARD_IRQ_RELEASE  MSS_IRQ_TIMER2 /* when the bus driver is due to be switched off */

/* ---- RS-485: MSS GPIO that switches the transceiver's driver on (DE, and /RE with it), high: on ---- */
#define BOARD_PIN_BUS_DRIVER 0u

/* ---- limits of the fabric blocks ---- */
#define BOARD_ADC_Q15_PER_CODE   16     /* of a current: 12 bit, 2048 codes are 1.0 */
#define BOARD_ADC_OFFSET_NOMINAL 32768u /* of a sensor whose zero is at mid-scale, after reset */
#define BOARD_ADC_OFFSET_MAX     65535

#endif
