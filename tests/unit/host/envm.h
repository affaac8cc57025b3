/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The eNVM's controller as the twin has it, on a bus whose every write is counted, and behind any of them the power fails. */
#ifndef TESTS_UNIT_HOST_ENVM_H
#define TESTS_UNIT_HOST_ENVM_H

#include "firmware/axis/axis.h"
#include "firmware/settings/slots.h"
#include "qemu/twin/envm.h"

struct host_bench {
    struct envm envm;
    struct axis *axis;  /* whose clock goes on while the thread sleeps */
    sim_ps now, served; /* when the watchdog was */
    uint32_t envm_cr;
    uint32_t watchdog_ticks; /* its load */
    bool watchdog_stands;
    uint64_t writes;             /* to any register, so far */
    uint64_t cut_at;             /* the power fails behind this one; 0: behind none */
    double cut_share;            /* of the command that it gave, */
    bool cut_in_command;         /* if it gave one */
    uint64_t open;               /* accesses with interrupts not masked while a command was under way */
    uint64_t refreshes, late_ms; /* of the watchdog; the longest time between two of them */
    uint64_t commands, programs; /* given */
    uint64_t lit;                /* commands given with the bridge on */
};

/* A device that has never stored anything. */
void host_envm_new(struct axis *a, double program_s, uint64_t seed);

/* Where settings stand in its array. */
struct slots host_slots(void);

#endif
