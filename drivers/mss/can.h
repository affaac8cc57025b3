/* SPDX-License-Identifier: MIT */
/*
 * The MSS's CAN controller (docs/silicon.md, CAN) behind two queues: frames with 11-bit identifiers, both ways.
 *
 * Frames leave one after the other, in the order of the queue, through one mailbox: what is queued first is sent first,
 * whatever its identifier. Received ones come through linked mailboxes, the lowest free one first; the interrupt takes them
 * in that order, which is that of the bus as long as it comes within a frame's time (47 us at 1 Mbit/s). So its priority is
 * above the slow loop's.
 */
#ifndef DRIVERS_MSS_CAN_H
#define DRIVERS_MSS_CAN_H

#include "drivers/reg.h"

#define CAN_MAILBOXES 32u

struct can_regs {
    volatile uint32_t INT_STATUS; /* write 1 clears */
    volatile uint32_t INT_ENABLE;
    const volatile uint32_t RX_BUF_STATUS;
    const volatile uint32_t TX_BUF_STATUS;
    const volatile uint32_t ERROR_STATUS;
    volatile uint32_t COMMAND;
    volatile uint32_t CONFIG;
    volatile uint32_t ECR;
    struct {
        volatile uint32_t CTRL, ID, DATA_HIGH, DATA_LOW;
    } TX[CAN_MAILBOXES];
    struct {
        volatile uint32_t CTRL, ID, DATA_HIGH, DATA_LOW, AMR, ACR, AMR_DATA, ACR_DATA;
    } RX[CAN_MAILBOXES];
};

REG_AT_OFFSET(struct can_regs, ERROR_STATUS, 0x010);
REG_AT_OFFSET(struct can_regs, COMMAND, 0x014);
REG_AT_OFFSET(struct can_regs, CONFIG, 0x018);
REG_AT_OFFSET(struct can_regs, TX, 0x020);
REG_AT_OFFSET(struct can_regs, RX, 0x220);
_Static_assert(sizeof(struct can_regs) == 0x620, "the block's size");

#define CAN REG_BLOCK(struct can_regs, 0x40015000u)

/* docs/silicon.md says what each is */
#define CAN_INT_GLOBAL          (1u << 0)
#define CAN_INT_BUS_OFF         (1u << 9)
#define CAN_INT_RX_LOST         (1u << 10)
#define CAN_INT_TX_DONE         (1u << 11)
#define CAN_INT_RX_STORED       (1u << 12)
#define CAN_STATE_AT            16u
#define CAN_COMMAND_RUN         (1u << 0)
#define CAN_CONFIG_SJW_AT       2u
#define CAN_CONFIG_AUTO_RESTART (1u << 4)
#define CAN_CONFIG_TSEG2_AT     5u
#define CAN_CONFIG_TSEG1_AT     8u
#define CAN_CONFIG_FIXED_ORDER  (1u << 12)
#define CAN_CONFIG_SWAP_ENDIAN  (1u << 13)
#define CAN_CONFIG_PRESCALER_AT 16u
#define CAN_TX_REQUEST          (1u << 0)
#define CAN_TX_INTERRUPT        (1u << 2)
#define CAN_TX_CHANGE_LOW       (1u << 3)
#define CAN_CHANGE_HIGH         (1u << 23)
#define CAN_RX_ACKNOWLEDGE      (1u << 0)
#define CAN_RX_ENABLE           (1u << 3)
#define CAN_RX_INTERRUPT        (1u << 5)
#define CAN_RX_LINK             (1u << 6)
#define CAN_RX_CHANGE_LOW       (1u << 7)
#define CAN_IS_REMOTE           (1u << 21)
#define CAN_COUNT_AT            16u
#define CAN_STANDARD_AT         21u
#define CAN_MASK_EXTENDED       (1u << 2)

#define CAN_QUEUE 32u /* frames each way; a power of two */

#define CAN_REMOTE 0x8000u /* beside the identifier: the frame asks for one, and has no data */

struct can_frame {
    uint16_t id;
    uint8_t count; /* of data, 0...8 */
    uint8_t data[8];
};

enum can_state { CAN_ACTIVE, CAN_PASSIVE, CAN_OFF };

struct can {
    struct can_regs *regs; /* NULL: not open */
    struct can_frame rx[CAN_QUEUE], tx[CAN_QUEUE];
    volatile uint32_t rx_head, rx_tail; /* run free; the interrupt fills rx and empties tx */
    volatile uint32_t tx_head, tx_tail;
    volatile uint32_t rx_lost, offs; /* frames that found no room; times the bus was left because of errors */
    uint32_t tx_dropped;
};

/* True if `kbit_s` can be had of the clock: 20, 50, 125, 250, 500, 800, 1000. Any context. */
bool can_rate_is_known(uint32_t kbit_s);

/*
 * Resets the controller and joins the bus; the queues are empty. `recovers`: it comes back by itself from bus-off, after
 * 128 times 11 recessive bits; otherwise can_open() does it. The caller enables the interrupt, of CONFIG_PRIORITY_CAN.
 * False, and nothing is done, if the rate cannot be had. Thread.
 */
bool can_open(struct can *c, struct can_regs *regs, uint32_t kbit_s, bool recovers);

/* Leaves the bus, and holds the controller in reset. Thread. */
void can_close(struct can *c);

/* Queues a frame; false, and it is dropped, if there is no room. Thread. */
bool can_send(struct can *c, const struct can_frame *f);

/* Frames that have not left yet, the one under way included. Thread. */
uint32_t can_pending(const struct can *c);

/* Those that wait behind the one under way shall not leave any more. Thread. */
void can_forget(struct can *c);

/* Takes a received frame; false if there is none. Thread. */
bool can_take(struct can *c, struct can_frame *f);

/* Thread. */
enum can_state can_state(const struct can *c);

/* Interrupt. */
void can_irq_handler(struct can *c);

#endif
