/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Two of QEMU's plugin API versions are served by one binary: the constructor below runs before QEMU reads
 * qemu_plugin_version. 7.2 and 8 accept version 1; 9 and 10 accept 2 and later; what is used here did not change. */
#define _GNU_SOURCE
#include "qemu_symbols.h"

#include "qemu_api.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

struct vm_symbols vm;

int qemu_plugin_version = 1;

__attribute__((constructor)) static void choose_plugin_version(void)
{
    if (dlsym(RTLD_DEFAULT, "qemu_plugin_scoreboard_new")) {
        qemu_plugin_version = 2; /* scoreboards came with version 2, in QEMU 9.0 */
    }
}

void *vm_find(const char *name)
{
    void *symbol = dlsym(RTLD_DEFAULT, name);
    if (!symbol) {
        fprintf(stderr, "mssfoc twin: this QEMU does not export %s; use Debian's qemu-system-arm 7.2 or 10.x\n", name);
        exit(1);
    }
    return symbol;
}

void vm_resolve(void)
{
#define FIND(result, name, parameters) vm.name = (result(*) parameters)vm_find(#name);
    FUNCTIONS(FIND)
    vm.address_space_memory = vm_find("address_space_memory");
}

opaque *vm_room(size_t bytes)
{
    opaque *storage = calloc(1, bytes);
    if (!storage) {
        fputs("mssfoc twin: out of memory\n", stderr);
        exit(1);
    }
    return storage;
}

opaque *vm_core(void)
{
    bool ambiguous;
    opaque *found = vm.object_resolve_path_type("", "armv7m", &ambiguous);
    if (!found) {
        fputs("mssfoc twin: this machine has no Cortex-M; use -M emcraft-sf2\n", stderr);
        exit(1);
    }
    return found;
}
