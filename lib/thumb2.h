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

/* In C, a function's second name, by which those of its users find it that have the same LIB_TRIG_FRAC (Lib.h). */
#if defined(__PRAGMA_REDEFINE_EXTNAME) && defined(__ELF__)
#define LIB_TEXT_OF(words) #words
#define LIB_TEXT(words)    LIB_TEXT_OF(words)
#define LIB_NAMED_BY_FRAC(function) \
    extern __typeof__(function) LIB_CALLED(function, LIB_TRIG_FRAC) __attribute__((alias(LIB_TEXT(function))));
#else
#define LIB_NAMED_BY_FRAC(function)
#endif

#endif
