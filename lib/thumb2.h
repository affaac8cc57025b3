/* SPDX-License-Identifier: MIT */
/*
 * Which build of the functions of Lib.h there is: LIB_THUMB2 is defined where Lib_thumb2.S takes the place of the portable C
 * in Lib.c. LIB_PORTABLE switches the assembly off, and must then be given to both files. Included by C and by assembly.
 */
#ifndef LIB_THUMB2_H
#define LIB_THUMB2_H

#if (defined(__ARM_ARCH_7M__) || defined(__ARM_ARCH_7EM__)) && !defined(LIB_PORTABLE)
#define LIB_THUMB2
#endif

#endif
