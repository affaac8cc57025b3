/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "cycles.h"

#define KEY(member, min, max, initial) \
    ((struct config_key){#member, offsetof(struct cycles_params, member), min, max, initial})

/* The nominal values of docs/silicon.md, where their ranges and sources are. */
const struct config_key cycles_keys[] = {
    KEY(apb_read, 0, 100, 3),     KEY(apb_write, 0, 100, 3), KEY(ppb, 0, 100, 0),
    KEY(esram, 0, 100, 1),        KEY(envm_wait, 0, 100, 5), KEY(cache, 0, 2, 2),
    KEY(cache_miss, 0, 1000, 23), KEY(exit, 0, 100, 10),     KEY(vector, 0, 100, 2),
    KEY(cold, 0, 1, 0),           CONFIG_KEYS_END,
};
