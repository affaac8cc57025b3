/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The controller of eNVM_0 and its array of pages: programming, verifying, locks, wear, and what a power cut leaves of a page.
 * UG0331, eNVM chapter; docs/settings.md says what is not known of it and assumed. Time is handed in; knows nothing of QEMU. */
#ifndef TWIN_ENVM_H
#define TWIN_ENVM_H

#include <stdbool.h>
#include <stdint.h>

#include "keys.h"
#include "random.h"
#include "simtime.h"

#define ENVM_CONTROLLER_BASE  0x60080000u
#define ENVM_CONTROLLER_BYTES 0x200u
#define ENVM_ARRAY_BASE       0x60000000u
#define ENVM_ARRAY_BYTES      0x40000u
#define ENVM_PAGE             128u
#define ENVM_PAGES            (ENVM_ARRAY_BYTES / ENVM_PAGE)
#define ENVM_PAGES_RESERVED   16u /* at the top */

/* Status bits that a test may have the next command end with. */
enum envm_failure {
    ENVM_FAIL_VERIFY = 1u << 1,
    ENVM_FAIL_ERASE = 1u << 2,
    ENVM_FAIL_WRITE = 1u << 3,
};

struct envm_params {
    double program_s, verify_s;
    double endurance; /* writes of a page, beyond which the controller warns */
    double fails;     /* status bits of enum envm_failure that the first command ends with */
    double cut_write; /* the power fails behind this write to a register, counted from 1; 0: behind none */
    double cut_share; /* and when so much of the command that it gave has been done */
};

extern const struct config_key envm_keys[];

struct envm {
    struct envm_params p;
    struct random noise;
    uint8_t array[ENVM_ARRAY_BYTES];
    uint32_t writes[ENVM_PAGES]; /* of each page, so far */
    bool locked[ENVM_PAGES];
    bool wait_states; /* ENVM_CR holds what programming takes */
    bool held;        /* somebody else has the controller */
    bool granted;
    uint32_t data[ENVM_PAGE / 4];
    uint32_t status, page_lock, other[ENVM_CONTROLLER_BYTES / 4];
    uint32_t fails; /* enum envm_failure, of the next command */
    bool programming, verifying;
    uint32_t page;
    bool glitch; /* the next look at the status sees ready, wrongly: the vendor's driver takes two in a row for one */
    sim_ps began, until; /* of the command under way; SIM_NEVER: none ends */
    uint64_t bus_writes, programmed;
    /* What happens to the array: the page is another one now. */
    void (*changed)(void *context, const struct envm *e, uint32_t page);
    void *context;
};

void envm_init(struct envm *e, const struct envm_params *p, uint64_t seed);

uint32_t envm_read(struct envm *e, uint32_t offset, sim_ps now);
/* True when the power fails behind this write (cut_write). */
bool envm_write(struct envm *e, uint32_t offset, uint32_t value, sim_ps now);

/* Whether an access to the array has to wait, and until when. */
bool envm_is_busy(const struct envm *e);
/* What was due until now has been done. */
void envm_settle(struct envm *e, sim_ps now);

/* The power fails. A page that is being programmed is left as far as it has come: in the first half of the time each bit is the
 * old one or an erased one, in the second an erased one or the new. The controller starts anew. */
void envm_power_cut(struct envm *e, sim_ps now);
/* Of the device: what the command has done so far stays, as by a power cut. */
void envm_reset(struct envm *e, sim_ps now);

/* The pages that were ever programmed, to a file and from it; false with errno. */
bool envm_store(const struct envm *e, const char *path);
bool envm_recall(struct envm *e, const char *path);

#endif
