/* SPDX-License-Identifier: MIT */
/*
 *     explore [all|sample|SETUP [STATES]]
 *     explore SETUP play EVENT...
 *
 * Explores all setups of the drive, those for `make test`, or one, and interrupts it in what it found. Ends with 1 if anything
 * is violated.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "adapter.h"
#include "engine.h"

#define SAMPLE_STRIDE 97 /* blocks */

static int number_of(const char *name)
{
    for (int n = 0; n < explore_setup_count; n++) {
        if (strcmp(explore_setups[n].name, name) == 0) {
            return n;
        }
    }
    return -1;
}

int main(int argc, char **argv)
{
    const char *const which = argc > 1 ? argv[1] : "all";
    const bool all = strcmp(which, "all") == 0, sample = strcmp(which, "sample") == 0;
    static struct examples examples;
    struct totals totals = {0};
    if (!all && !sample && number_of(which) < 0) {
        fprintf(stderr, "explore: no setup '%s'; there are all, sample", which);
        for (int n = 0; n < explore_setup_count; n++) {
            fprintf(stderr, ", '%s'", explore_setups[n].name);
        }
        fprintf(stderr, "\n");
        return 2;
    }
    if (argc > 2 && strcmp(argv[2], "play") == 0 && number_of(which) >= 0) {
        return engine_play(number_of(which), &argv[3]) ? 0 : 2;
    }
    for (int n = 0; n < explore_setup_count; n++) {
        if (all || (sample && explore_setups[n].sample) || n == number_of(which)) {
            engine_explore(n, argc > 2 ? strtoull(argv[2], NULL, 10) : 0u, &totals, &examples);
            interleave(n, &examples, sample ? SAMPLE_STRIDE : 1u, &totals);
        }
    }
    printf("in all %llu states, %llu transitions, %llu violations\n", (unsigned long long)totals.states,
           (unsigned long long)totals.transitions, (unsigned long long)totals.violations);
    return totals.violations != 0u;
}
