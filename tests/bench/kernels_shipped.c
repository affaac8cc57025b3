/* SPDX-License-Identifier: MIT */
/* The kernels as the firmware uses them. */
#define KERNEL(name) shipped_##name

#include "tests/bench/kernels_body.h"
