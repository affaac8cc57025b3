/* SPDX-License-Identifier: MIT */
/*
 * Interrupt numbers of the SmartFusion2 MSS that drivers use (UG0331, interrupt table). The handlers' names are in
 * startup/startup.h.
 */
#ifndef DRIVERS_MSS_IRQ_H
#define DRIVERS_MSS_IRQ_H

#define MSS_IRQ_WDOG_WAKEUP          0u
#define MSS_IRQ_I2C1_SMBALERT        8u
#define MSS_IRQ_I2C1_SMBUS           9u
#define MSS_IRQ_UART0                10u
#define MSS_IRQ_UART1                11u
#define MSS_IRQ_TIMER1               14u
#define MSS_IRQ_TIMER2               15u
#define MSS_IRQ_CAN                  16u
#define MSS_IRQ_ENVM0                17u
#define MSS_IRQ_PLL_LOCK_LOST        23u
#define MSS_IRQ_ECC_ERROR            29u
#define MSS_IRQ_FABRIC_PLL_LOCK_LOST 32u
#define MSS_IRQ_FABRIC(n)            (34u + (n)) /* n = 0...15: MSS_INT_F2M[n] */
#define MSS_IRQ_GPIO(n)              (50u + (n)) /* n = 0...31 */
#define MSS_IRQ_COUNT                82u

/* The core has the upper four bits of a priority: 0 most urgent ... 15. */
#define MSS_IRQ_PRIORITY_SHIFT  4u
#define MSS_IRQ_PRIORITY_LOWEST 15u

#endif
