/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "reach.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define ESRAM_REGION 2u /* of 256 MiB each */

static uint8_t *bits;

void reach_open(void)
{
    const char *path = getenv("TWIN_REACH");
    if (!path || !*path) {
        return;
    }
    int file = open(path, O_RDWR | O_CREAT, 0644);
    if (file >= 0 && ftruncate(file, REACH_BYTES) == 0) {
        void *shared = mmap(NULL, REACH_BYTES, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
        bits = shared == MAP_FAILED ? NULL : shared;
    }
    if (!bits) {
        fprintf(stderr, "mssfoc twin: TWIN_REACH %s: %s\n", path, strerror(errno));
        exit(1);
    }
    close(file);
}

void reach_note(uint32_t address)
{
    if (bits) {
        uint32_t place = (address % REACH_SPAN + (address >> 28 == ESRAM_REGION ? REACH_SPAN : 0)) / 2;
        __atomic_fetch_or(&bits[place / 8], (uint8_t)(1u << place % 8), __ATOMIC_RELAXED);
    }
}
