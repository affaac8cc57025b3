/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The motor in RTL behind FABRIC=rtl (PLANT=rtl): its words are made of the configuration's, what events do to the C plant is
 * handed on, and the C plant's state is made what the RTL's is, for whoever looks at it. */
#ifndef TWIN_RTL_MOTOR_H
#define TWIN_RTL_MOTOR_H

#include "plant.h"

/* Ends the run if the configuration asks for an effect that the RTL has not. */
void rtl_motor_open(struct fabric *f, const struct plant_params *params);

#endif
