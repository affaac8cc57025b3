/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What a device keeps while it is off: a file of the pages that have ever been programmed, each with its number, how often it
 * was written, and whether it is locked. */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "envm.h"

static const char mark[8] = "mssenvm1";

struct entry {
    uint32_t page, writes, locked;
    uint8_t bytes[ENVM_PAGE];
};

static bool closed(FILE *file, bool good)
{
    return fclose(file) == 0 && good;
}

bool envm_store(const struct envm *e, const char *path)
{
    FILE *file = fopen(path, "wb");
    if (!file) {
        return false;
    }
    bool good = fwrite(mark, sizeof mark, 1, file) == 1;
    for (uint32_t page = 0; page < ENVM_PAGES && good; page++) {
        if (e->writes[page] > 0) {
            struct entry entry = {page, e->writes[page], e->locked[page], {0}};
            memcpy(entry.bytes, e->array + (size_t)page * ENVM_PAGE, ENVM_PAGE);
            good = fwrite(&entry, sizeof entry, 1, file) == 1;
        }
    }
    return closed(file, good);
}

bool envm_recall(struct envm *e, const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file) {
        return errno == ENOENT; /* a new device */
    }
    char found[sizeof mark];
    struct entry entry;
    bool good = fread(found, sizeof found, 1, file) == 1 && memcmp(found, mark, sizeof mark) == 0;
    while (good && fread(&entry, sizeof entry, 1, file) == 1) {
        good = entry.page < ENVM_PAGES;
        if (good) {
            memcpy(e->array + (size_t)entry.page * ENVM_PAGE, entry.bytes, ENVM_PAGE);
            e->writes[entry.page] = entry.writes;
            e->locked[entry.page] = entry.locked != 0;
        }
    }
    if (!good) {
        errno = EINVAL;
    }
    return closed(file, good);
}
