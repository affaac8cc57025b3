/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The memory map: regions that the twin answers, and access to what QEMU has. */
#include "qemu_api.h"
#include "qemu_symbols.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ABOVE_THE_MACHINE    10
#define LITTLE_ENDIAN_DEVICE 2
#define ESRAM_BASE           0x20000000u
#define ESRAM_BYTES          0x10000u

static uint64_t region_read(void *context, uint64_t offset, unsigned size)
{
    const struct vm_region *region = context;
    uint32_t word = region->read(region->context, (uint32_t)offset & ~3u);
    (void)size;
    return word >> 8 * (offset & 3);
}

static void region_write(void *context, uint64_t offset, uint64_t value, unsigned size)
{
    const struct vm_region *region = context;
    (void)size;
    region->write(region->context, (uint32_t)offset & ~3u, (uint32_t)value);
}

static void map_into(opaque *container, const struct vm_region *region)
{
    struct region_ops *ops = vm_room(OPAQUE_BYTES);
    ops->read = region_read;
    ops->write = region_write;
    ops->endianness = LITTLE_ENDIAN_DEVICE;
    ops->valid.min = region->min_access_bytes;
    ops->valid.max = 4;
    ops->impl.min = 1;
    ops->impl.max = 4;
    opaque *storage = vm_room(OPAQUE_BYTES);
    vm.memory_region_init_io(storage, NULL, ops, (void *)(uintptr_t)region, region->name, region->size);
    vm.memory_region_add_subregion_overlap(container, region->base, storage, ABOVE_THE_MACHINE);
}

void vm_map(const struct vm_region *region)
{
    map_into(vm.get_system_memory(), region);
}

void vm_map_private(const struct vm_region *region)
{
    opaque *container = vm.object_resolve_path_component(vm_core(), "armv7m-container[0]");
    if (!container) {
        fputs("mssfoc twin: the core of this QEMU has no armv7m-container; use 7.2 or 10.x\n", stderr);
        exit(1);
    }
    map_into(container, region);
}

/* Where QEMU keeps it; NULL if not in one piece. */
static const uint8_t *esram(void)
{
    static const uint8_t *start;
    static bool asked;
    if (!asked) {
        uint64_t length = ESRAM_BYTES;
        const uint8_t *mapped = vm.cpu_physical_memory_map(ESRAM_BASE, &length, false);
        start = length == ESRAM_BYTES ? mapped : NULL;
        asked = true;
    }
    return start;
}

/* eSRAM, which is read some twenty times a period, without the way through QEMU's map. */
void vm_read_memory(uint32_t address, void *bytes, size_t length)
{
    uint32_t offset = address - ESRAM_BASE;
    if (offset < ESRAM_BYTES && length <= ESRAM_BYTES - offset && esram()) {
        memcpy(bytes, esram() + offset, length);
    } else {
        vm.cpu_physical_memory_rw(address, bytes, length, false);
    }
}

void vm_read_core(uint32_t address, void *bytes, size_t length)
{
    (void)vm.cpu_memory_rw_debug(vm.qemu_get_cpu(0), address, bytes, length, false);
}

void vm_write_memory(uint32_t address, const void *bytes, size_t length)
{
    vm.cpu_physical_memory_rw(address, (void *)(uintptr_t)bytes, length, true);
}

void vm_write_rom(uint32_t address, const void *bytes, size_t length)
{
    /* MemTxAttrs is 4 bytes in 7.2 and 8 in 10; both are passed in one register. */
    vm.address_space_write_rom(vm.address_space_memory, address, 0, bytes, length);
}
