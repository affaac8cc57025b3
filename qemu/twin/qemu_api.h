/* SPDX-License-Identifier: GPL-2.0-or-later */
/* All contact with QEMU. Nothing else in the twin knows a symbol of it.
 *
 * Call everything here with QEMU's big lock held: from an MMIO access, a timer, the reset hook or at attachment. */
#ifndef TWIN_QEMU_API_H
#define TWIN_QEMU_API_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Finds every symbol that is used; if one is missing, ends the process with one line on stderr. */
void vm_resolve(void);

/* ---- plugin callbacks ---- */
/* `attach` may map; `start` comes before the first instruction and may use timers. */
void vm_on_attach(uint64_t plugin_id, void (*attach)(void), void (*start)(void));

/* What somebody wants to know of one translated instruction, besides that it is about to execute. */
struct vm_instruction {
    const void *context;
    bool wants_registers; /* vm_register() tells this instruction's operands */
    bool wants_address;   /* `access` is to be called for it */
    bool accesses_once;   /* and will be, whatever happens, once */
};

struct vm_instructions {
    struct vm_instruction (*translate)(uint32_t address);
    /* What stands for the first as well as for the second, which follows it in a block; NULL: each for itself. */
    const void *(*join)(const void *context, const void *next);
    void (*execute)(const void *context); /* before what it stands for is executed */
    /* After each of its accesses to memory. `next`, if not NULL, is about to execute. */
    void (*access)(uint32_t address, const void *next);
};
void vm_on_instructions(uint64_t plugin_id, const struct vm_instructions *hooks);

/* From within `execute`: r0...r15, and the program status. */
#define VM_XPSR 25
uint32_t vm_register(int number);
/* From within `execute`: virtual time at the end of the block of instructions that is being executed. */
int64_t vm_executing_ns(void);

void vm_on_exit(uint64_t plugin_id, void (*leave)(void));

/* ---- memory map ---- */
struct vm_region {
    const char *name;
    uint32_t base, size;
    unsigned min_access_bytes; /* narrower accesses fault */
    uint32_t (*read)(void *context, uint32_t offset);
    void (*write)(void *context, uint32_t offset, uint32_t value);
    void *context;
};
/* Over whatever the machine has there. The struct must stay. */
void vm_map(const struct vm_region *region);
/* The same on the private peripheral bus of the core. */
void vm_map_private(const struct vm_region *region);

void vm_read_memory(uint32_t address, void *bytes, size_t length);
/* As the core sees it: its private peripherals, too. */
void vm_read_core(uint32_t address, void *bytes, size_t length);
void vm_write_memory(uint32_t address, const void *bytes, size_t length);
void vm_write_rom(uint32_t address, const void *bytes, size_t length);

/* ---- time, interrupts, reset ---- */
int64_t vm_now_ns(void);

struct vm_timer;
struct vm_timer *vm_timer_new(void (*expired)(void *context), void *context);
void vm_timer_at(struct vm_timer *timer, int64_t when_ns);
void vm_timer_stop(struct vm_timer *timer);

/* At attachment. From now on the thread that executes the guest sleeps through WFI by itself (qemu_sleep.h). */
void vm_sleep_alone(void);

/* From within `execute` or `access`: the core's next instructions wait until then, and `over` is told for how long. */
void vm_stall(int64_t until_ns, void (*over)(int64_t for_ns));

void vm_set_interrupt(int number, bool level);
void vm_on_reset(void (*reset)(void *context), void *context);
/* What a watchdog does. The reset follows at the same virtual time, once the current event is over; so does one that the
 * guest asks for by SYSRESETREQ. */
void vm_request_reset(void);
/* Ends QEMU now with exit status 0: the guest does not execute one more instruction. */
__attribute__((noreturn)) void vm_end(void);

/* ---- typing ---- */
struct vm_chardev;
struct vm_chardev *vm_find_chardev(const char *id);     /* NULL if there is none of that name */
bool vm_type(struct vm_chardev *chardev, uint8_t byte); /* false if there is no room now */

/* ---- a device of the twin's own behind a character device ---- */
/* NULL if there is none of that name. `room` says how many bytes `hear` takes now. */
struct vm_chardev *vm_chardev_open(const char *id, int (*room)(void *unused),
                                   void (*hear)(void *unused, const uint8_t *bytes, int count),
                                   void (*changes)(void *unused, int event)); /* may be NULL */
#define VM_CHARDEV_OPENED 1 /* the event: somebody has connected; any other: nobody is there any more */
/* At once, dropped if nobody listens. */
void vm_chardev_send(struct vm_chardev *opened, const void *bytes, size_t count);

#endif
