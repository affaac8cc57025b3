/* SPDX-License-Identifier: MIT */
/*
 * Programs the eNVM through its controller (UG0331, eNVM chapter). A page of 128 bytes is the smallest unit; programming
 * includes erasure.
 *
 * While the controller works, every access to the array stalls on the bus, fetches included. So the code that waits for it runs
 * from eSRAM, with all interrupts masked, since their handlers are in eNVM. Vector table and stack are in eSRAM anyway.
 */
#ifndef DRIVERS_MSS_ENVM_H
#define DRIVERS_MSS_ENVM_H

#include "drivers/reg.h"

#define ENVM_PAGE_WORDS 32u
#define ENVM_PAGE_BYTES 128u

struct envm_regs {
    const volatile uint32_t AB[ENVM_PAGE_WORDS];
    volatile uint32_t WD[ENVM_PAGE_WORDS];
    uint32_t reserved_100[8];
    const volatile uint32_t STATUS;
    uint32_t reserved_124;
    volatile uint32_t NV_PAGE_STATUS;
    volatile uint32_t NV_FREQRNG;
    volatile uint32_t NV_DPD;
    volatile uint32_t NV_CE;
    uint32_t reserved_138[2];
    volatile uint32_t PAGE_LOCK;
    volatile uint32_t DWSIZE;
    volatile uint32_t CMD;
    uint32_t reserved_14c[2];
    volatile uint32_t INTEN;
    volatile uint32_t CLRHINT;
    uint32_t reserved_15c[40];
    volatile uint32_t REQ_ACCESS;
};

REG_AT_OFFSET(struct envm_regs, WD, 0x080);
REG_AT_OFFSET(struct envm_regs, STATUS, 0x120);
REG_AT_OFFSET(struct envm_regs, NV_PAGE_STATUS, 0x128);
REG_AT_OFFSET(struct envm_regs, PAGE_LOCK, 0x140);
REG_AT_OFFSET(struct envm_regs, CMD, 0x148);
REG_AT_OFFSET(struct envm_regs, INTEN, 0x154);
REG_AT_OFFSET(struct envm_regs, CLRHINT, 0x158);
REG_AT_OFFSET(struct envm_regs, REQ_ACCESS, 0x1FC);

#define ENVM REG_BLOCK(struct envm_regs, 0x60080000u) /* of eNVM_0, which every device has */

/* The array's bus address; reads here bypass the cache of the code at 0. */
#define ENVM_ARRAY 0x60000000u

/* Of SYSREG's ENVM_CR, both blocks: wait states with which programming is right at any clock. */
#define ENVM_CR_FREQRNG (0xFFu << 5)

#define ENVM_CMD_PROGRAM 0x08000000u /* and the page's offset from the array's start */
#define ENVM_CMD_VERIFY  0x10000000u

#define ENVM_STATUS_READY         (1u << 0)
#define ENVM_STATUS_VERIFY_ERROR  (1u << 1)
#define ENVM_STATUS_ERASE_ERROR   (1u << 2)
#define ENVM_STATUS_WRITE_ERROR   (1u << 3)
#define ENVM_STATUS_REFUSED       (1u << 4)
#define ENVM_STATUS_WORN          (1u << 5)
#define ENVM_STATUS_ACCESS_DENIED (1u << 18)
#define ENVM_STATUS_BUSY_ERROR    (1u << 19)

/* STATUS keeps both errors, and no command is taken, until they are cleared here (UG0331, eNVM status register). */
#define ENVM_CLRHINT_ACCESS_DENIED (1u << 1)
#define ENVM_CLRHINT_BUSY_ERROR    (1u << 2)

#define ENVM_ACCESS_ASK     1u
#define ENVM_ACCESS_GRANTED 5u

/* The result. From ENVM_NOT_GRANTED on the page does not hold what it should. */
enum envm_result {
    ENVM_DONE,
    ENVM_WORN,         /* done; the page has exceeded its rated write cycles */
    ENVM_NOT_GRANTED,  /* somebody else has the controller: the system controller, the fabric */
    ENVM_TIMED_OUT,    /* it did not end in time */
    ENVM_DENIED,       /* the page is protected by the design, or reserved */
    ENVM_BUSY,         /* another command was under way */
    ENVM_LOCKED,       /* the page is locked */
    ENVM_ERASE_FAILED, /* the page cannot be erased: worn out, or the supply */
    ENVM_WRITE_FAILED,
    ENVM_VERIFY_FAILED, /* it does not read back */
    ENVM_RESULTS
};

/*
 * Programs the page `offset_bytes` from the array's start, a multiple of ENVM_PAGE_BYTES, and has the controller verify it.
 * Restores the registers it sets: ENVM_CR, access. Refreshes the watchdog first, and gives up after 66 ms, or two thirds of its
 * time-out if that is shorter; without a watchdog, after some 10^6 looks.
 * Context: thread. All interrupts wait until it is done, some milliseconds; the bridge must be off.
 */
enum envm_result envm_program_page(uint32_t offset_bytes, const uint32_t words[ENVM_PAGE_WORDS]);

#endif
