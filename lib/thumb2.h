/* SPDX-License-Identifier: MIT */
/*
 * Selects the build of Lib.h's functions: LIB_THUMB2 is defined if Lib_thumb2.S replaces the portable C in Lib.c. LIB_PORTABLE
 * disables the assembly and must be defined for both files. Included by C and by assembly.
 */
#ifndef LIB_THUMB2_H
#define LIB_THUMB2_H

#if (defined(__ARM_ARCH_7M__) || defined(__ARM_ARCH_7EM__)) && !defined(LIB_PORTABLE)
#define LIB_THUMB2
#endif

#endif
