/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The two inputs of safe torque off, behind their filters, and whether they agree (docs/fabric.md). Times are the fabric's
 * clocks; of two changes of a pin within two clocks it sees none. */
#ifndef TWIN_STO_H
#define TWIN_STO_H

#include <stdbool.h>
#include <stdint.h>

enum { STO_ASKS_A = 1, STO_ASKS_B = 2, STO_ASKS_APART = 4 };

struct sto_input {
    bool pin; /* low: it asks */
    bool low; /* behind two flip-flops */
    bool asks;
    int64_t follows_at; /* when `low` is what the pin is; INT64_MAX: it is */
    int64_t count, at;  /* of the filter, as it is in that clock */
};

struct sto {
    int64_t longest, patience;
    struct sto_input input[2];
    bool apart;
    int64_t changed_at; /* what the two ask for */
};

/* The filters begin anew, with the pins as they are. */
void sto_reset(struct sto *s, int64_t clock);
void sto_pin(struct sto *s, int input, bool low, int64_t clock);
/* The next clock in which something changes; INT64_MAX: none. */
int64_t sto_due(const struct sto *s);
/* That clock has come. */
void sto_take(struct sto *s, int64_t clock);
/* STO_ASKS_* */
unsigned sto_asks(const struct sto *s);

#endif
