/* SPDX-License-Identifier: MIT */
/* The lowest layer as it is, but for what it reads of the core: a test says which exception is being served. */
#ifndef TESTS_UNIT_HOST_STARTUP_H
#define TESTS_UNIT_HOST_STARTUP_H

#define startup_exception_number startup_exception_number_of_the_core
#include_next "startup/startup.h"
#undef startup_exception_number

uint32_t startup_exception_number(void);

#endif
