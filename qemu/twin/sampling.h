/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Between the plant's legs and what measures them: every step of the inverter is shown to amplifiers and meter, and at
 * their times the converter's channels are sampled. */
#ifndef TWIN_SAMPLING_H
#define TWIN_SAMPLING_H

#include "plant.h"

/* For the inverter's on_step. */
void sampling_follow(void *plant, double dt_s, const double from_a[3], const double to_a[3]);

/* Starts a conversion: A and the bus are sampled now, B and C after their skew. */
void sampling_start(struct plant *p);
/* Samples the currents whose time has come. */
void sampling_take(struct plant *p);
void sampling_forget(struct plant *p);

#endif
