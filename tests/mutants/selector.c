/* SPDX-License-Identifier: MIT */
/*
 * Linked into whatever is built with mutants beside the original: which one counts, by MUTANTS_NOW in the environment, and
 * which have been met, a byte each, in the file MUTANTS_MET if there is one, whichever process it was.
 */
#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#include "selector.h"

static unsigned char unseen[MUTANTS_MOST];
int mutant_now;
unsigned char *mutant_met = unseen;

__attribute__((visibility("default"), constructor)) void mutant_begin(void);

void mutant_begin(void)
{
    const char *const now = getenv("MUTANTS_NOW"), *const path = getenv("MUTANTS_MET");
    const int file = path != NULL ? open(path, O_RDWR) : -1;
    mutant_now = now != NULL ? atoi(now) : 0;
    mutant_met = unseen;
    if (file >= 0) {
        void *const shared = mmap(NULL, MUTANTS_MOST, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
        mutant_met = shared != MAP_FAILED ? shared : unseen;
        (void)close(file);
    }
}
