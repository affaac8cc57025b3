/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "dump.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "qemu_api.h"

static FILE *opened(const struct dump *d)
{
    FILE *file = fopen(d->path, "wb");
    if (!file) {
        fprintf(stderr, "mssfoc twin: dump %s: %s\n", d->path, strerror(errno));
        exit(1);
    }
    return file;
}

void dump_open(const struct dump *dumps, size_t count)
{
    for (size_t n = 0; n < count; n++) {
        fclose(opened(&dumps[n]));
    }
}

/* A file that stays short tells its reader that it failed. */
void dump_write(const struct dump *dumps, size_t count)
{
    for (size_t n = 0; n < count; n++) {
        unsigned char *bytes = malloc(dumps[n].bytes);
        FILE *file = bytes ? fopen(dumps[n].path, "wb") : NULL;
        if (file) {
            vm_read_memory(dumps[n].address, bytes, dumps[n].bytes);
            fwrite(bytes, 1, dumps[n].bytes, file);
            fclose(file);
        }
        free(bytes);
    }
}
