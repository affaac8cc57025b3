/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the plant in RTL (drivers/fabric/rtl/plant) has to be told to be a motor of the configuration file: its words in per
 * unit and its registers. Of the C plant's effects it knows those that microcode.py has operations for; plant_words_lack()
 * says which of those asked for it has not. */
#ifndef TWIN_PLANT_WORDS_H
#define TWIN_PLANT_WORDS_H

#include <stdbool.h>
#include <stdint.h>

#include "plant.h"
#include "plant_addresses.h"

/* What 1 stands for. */
struct plant_bases {
    double v, a, vs, nm, rad_s, step_s;
};

struct plant_words {
    struct plant_bases base;
    int64_t word[PLANT_WORDS];
    bool set[PLANT_WORDS]; /* the others are the program's own */
    uint32_t control, delay, index, reach, hall;
};

void plant_words_make(struct plant_words *w, const struct plant_params *p);
/* NULL, or an effect that is asked for and not there. */
const char *plant_words_lack(const struct plant_params *p);

/* A number of per unit as a word, and as a coefficient. */
int64_t plant_word(double per_unit);
int64_t plant_coefficient(double factor);
/* -1...1 turns as a word that wraps. */
int64_t plant_angle(double turns);
/* The words that a load torque or a shaft that is held or let go change. */
void plant_words_shaft(struct plant_words *w, const struct motor *m);

#endif
