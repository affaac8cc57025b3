/* SPDX-License-Identifier: MIT */
/*
 * Which functions have been entered, for tests/mutants: the compiler has each of them say so (-finstrument-functions). A test
 * takes what it has entered, as places in this library, 32 bits each; a program of its own leaves that in a file when it ends.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define SPAN      (1u << 22)
#define UNSEEN    __attribute__((no_instrument_function))
#define OF_OURS   __attribute__((no_instrument_function, visibility("hidden")))
#define PATH_MOST 4096

extern const char __ehdr_start[] __attribute__((visibility("hidden")));

static uint8_t seen[SPAN / 8u];

OF_OURS void __cyg_profile_func_enter(void *function, void *caller);
OF_OURS void __cyg_profile_func_exit(void *function, void *caller);
void host_reach_take(const char *path);

void __cyg_profile_func_enter(void *function, void *caller)
{
    const uintptr_t place = (uintptr_t)function - (uintptr_t)__ehdr_start;
    (void)caller;
    if (place < SPAN) {
        seen[place / 8u] |= (uint8_t)(1u << place % 8u);
    }
}

void __cyg_profile_func_exit(void *function, void *caller)
{
    (void)function;
    (void)caller;
}

static UNSEEN void write_places(FILE *out)
{
    for (uint32_t place = 0; place < SPAN; place++) {
        if (place % 8u == 0u && seen[place / 8u] == 0u) {
            place += 7u;
        } else if ((seen[place / 8u] >> place % 8u & 1u) != 0u) {
            (void)fwrite(&place, sizeof place, 1, out);
        }
    }
}

/* What has been entered since it was last taken; without a path it is forgotten. */
UNSEEN void host_reach_take(const char *path)
{
    FILE *const out = path != NULL ? fopen(path, "wb") : NULL;
    if (out != NULL) {
        write_places(out);
        (void)fclose(out);
    }
    memset(seen, 0, sizeof seen);
}

static UNSEEN __attribute__((destructor)) void leave(void)
{
    const char *const stem = getenv("UNIT_REACH");
    char path[PATH_MOST];
    if (stem != NULL && snprintf(path, sizeof path, "%s.%ld.firmware.places", stem, (long)getpid()) < PATH_MOST) {
        host_reach_take(path);
    }
}
