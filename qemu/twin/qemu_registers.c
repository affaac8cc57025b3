/* SPDX-License-Identifier: GPL-2.0-or-later */
#define _GNU_SOURCE
#include "qemu_registers.h"

#include <link.h>
#include <stdint.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

/* The helper that calls a plugin back before an instruction, and its row in 7.2 (tcg/tcg.c: TCGHelperInfo). */
#define HELPER "plugin_vcpu_udata_cb"
struct helper_row {
    void *function;
    const char *name;
    unsigned flags, types;
};
enum { NO_READ_GLOBALS = 1, NO_WRITE_GLOBALS = 2, OF_PLUGIN = 16 /* not in every 7.2 */ };

struct range {
    uintptr_t from, to;
};

static bool lies_in(const struct dl_phdr_info *program, uintptr_t address, size_t bytes)
{
    for (int n = 0; n < program->dlpi_phnum; n++) {
        const ElfW(Phdr) *part = &program->dlpi_phdr[n];
        uintptr_t start = program->dlpi_addr + part->p_vaddr;
        if (part->p_type == PT_LOAD && address >= start && address + bytes <= start + part->p_filesz) {
            return true;
        }
    }
    return false;
}

static struct helper_row *find_row(const struct dl_phdr_info *program, struct range range)
{
    for (uintptr_t at = range.from; at + sizeof(struct helper_row) <= range.to; at += sizeof(void *)) {
        struct helper_row *row = (struct helper_row *)at;
        if ((row->flags & ~(unsigned)OF_PLUGIN) == NO_READ_GLOBALS &&
            lies_in(program, (uintptr_t)row->name, sizeof HELPER) && memcmp(row->name, HELPER, sizeof HELPER) == 0 &&
            lies_in(program, (uintptr_t)row->function, 1)) {
            return row;
        }
    }
    return NULL;
}

static bool correct(struct helper_row *row)
{
    uintptr_t page = (uintptr_t)sysconf(_SC_PAGESIZE), start = (uintptr_t)row & ~(page - 1);
    size_t bytes = (uintptr_t)(row + 1) - start;
    if (mprotect((void *)start, bytes, PROT_READ | PROT_WRITE) != 0) {
        return false;
    }
    row->flags ^= NO_READ_GLOBALS | NO_WRITE_GLOBALS;
    return mprotect((void *)start, bytes, PROT_READ) == 0;
}

/* The table is constant, but has pointers in it: it is in the part that is made read-only after relocation. */
static int visit(struct dl_phdr_info *program, size_t size, void *corrected)
{
    (void)size;
    for (int n = 0; n < program->dlpi_phnum; n++) {
        const ElfW(Phdr) *part = &program->dlpi_phdr[n];
        if (part->p_type == PT_GNU_RELRO) {
            uintptr_t start = program->dlpi_addr + part->p_vaddr;
            struct helper_row *row = find_row(program, (struct range){start, start + part->p_filesz});
            *(bool *)corrected = row && correct(row);
        }
    }
    return 1; /* the program comes first; its libraries do not matter */
}

bool vm_make_callbacks_read_registers(void)
{
    bool corrected = false;
    dl_iterate_phdr(visit, &corrected);
    return corrected;
}
