/* SPDX-License-Identifier: GPL-2.0-or-later */
/* How a model names its parameters to the configuration file: each model owns its table. */
#ifndef TWIN_KEYS_H
#define TWIN_KEYS_H

#include <math.h>
#include <stddef.h>

/* One double in a parameter struct. Outside min..max is refused; a NaN default means the key must be given. */
struct config_key {
    const char *name;
    size_t offset;
    double min, max;
    double initial;
};

#define CONFIG_REQUIRED NAN
#define CONFIG_KEYS_END ((struct config_key){NULL, 0, 0, 0, 0})

#endif
