/* SPDX-License-Identifier: MIT */
/* Put before every source by the compiler's wrapper (tree.py): whether this mutant counts now. */
#ifndef MUTANTS_SELECTOR_H
#define MUTANTS_SELECTOR_H

#define MUTANTS_MOST 8192
#define MUTANT(n)    (mutant_met[n] = 1, mutant_now == (n))

extern __attribute__((visibility("default"))) int mutant_now;
extern __attribute__((visibility("default"))) unsigned char *mutant_met;

#endif
