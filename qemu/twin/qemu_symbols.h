/* SPDX-License-Identifier: GPL-2.0-or-later */
/* QEMU's internal functions, reached by name in the running program: Debian's builds export them because they load modules.
 * MemoryRegion, QEMUTimer and the rest stay opaque; they get zeroed room that is larger than any version's. Only the files that
 * implement qemu_api.h include this. */
#ifndef TWIN_QEMU_SYMBOLS_H
#define TWIN_QEMU_SYMBOLS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define OPAQUE_BYTES 4096 /* generous: a later version may have grown */

typedef void opaque;

/* GLib's public GByteArray. */
struct byte_array {
    uint8_t *data;
    unsigned length;
};

/* Layout of MemoryRegionOps, equal in 7.2 and 10. */
struct region_ops {
    uint64_t (*read)(void *opaque_context, uint64_t offset, unsigned size);
    void (*write)(void *opaque_context, uint64_t offset, uint64_t value, unsigned size);
    void *read_with_attrs, *write_with_attrs;
    int endianness;
    struct {
        unsigned min, max;
        bool unaligned;
        void *accepts;
    } valid;
    struct {
        unsigned min, max;
        bool unaligned;
    } impl;
};

#define FUNCTIONS(X) \
    X(void, qemu_plugin_register_vcpu_init_cb, (uint64_t, void (*)(uint64_t, unsigned))) \
    X(void, qemu_plugin_register_vcpu_tb_trans_cb, (uint64_t, void (*)(uint64_t, opaque *))) \
    X(void, qemu_plugin_register_atexit_cb, (uint64_t, void (*)(uint64_t, void *), void *)) \
    X(size_t, qemu_plugin_tb_n_insns, (const opaque *)) \
    X(opaque *, qemu_plugin_tb_get_insn, (const opaque *, size_t)) \
    X(void, qemu_plugin_register_vcpu_insn_exec_cb, (opaque *, void (*)(unsigned, void *), int, void *)) \
    X(void, qemu_plugin_register_vcpu_mem_cb, \
      (opaque *, void (*)(unsigned, uint32_t, uint64_t, void *), int, int, void *)) \
    X(uint64_t, qemu_plugin_insn_vaddr, (const opaque *)) \
    X(opaque *, qemu_get_cpu, (int)) \
    X(int, arm_cpu_gdb_read_register, (opaque *, struct byte_array *, int)) \
    X(struct byte_array *, g_byte_array_new, (void)) \
    X(void, icount_update, (opaque *)) \
    X(opaque *, get_system_memory, (void)) \
    X(void, memory_region_init_io, (opaque *, opaque *, const struct region_ops *, void *, const char *, uint64_t)) \
    X(void, memory_region_add_subregion_overlap, (opaque *, uint64_t, opaque *, int)) \
    X(opaque *, object_resolve_path_type, (const char *, const char *, bool *)) \
    X(opaque *, object_resolve_path_component, (opaque *, const char *)) \
    X(opaque *, qdev_get_gpio_in, (opaque *, int)) \
    X(void, qemu_set_irq, (opaque *, int)) \
    X(int64_t, qemu_clock_get_ns, (int)) \
    X(void, timer_init_full, (opaque *, opaque *, int, int, int, void (*)(void *), void *)) \
    X(void, timer_mod_ns, (opaque *, int64_t)) \
    X(void, timer_del, (opaque *)) \
    X(void, qemu_register_reset, (void (*)(void *), void *)) \
    X(bool, runstate_is_running, (void)) \
    X(opaque *, qemu_add_vm_change_state_handler, (void (*)(void *, bool, int), void *)) \
    X(void, qemu_system_reset, (int)) \
    X(void, async_run_on_cpu, (opaque *, void (*)(opaque *, uint64_t), uint64_t)) \
    X(opaque *, qemu_allocate_irq, (void (*)(void *, int, int), void *, int)) \
    X(void, qdev_connect_gpio_out_named, (opaque *, const char *, int, opaque *)) \
    X(void, cpu_physical_memory_rw, (uint64_t, void *, uint64_t, bool)) \
    X(void *, cpu_physical_memory_map, (uint64_t, uint64_t *, bool)) \
    X(int, cpu_memory_rw_debug, (opaque *, uint64_t, void *, size_t, bool)) \
    X(int, address_space_write_rom, (opaque *, uint64_t, uint64_t attributes, const void *, uint64_t)) \
    X(opaque *, qemu_chr_find, (const char *)) \
    X(int, qemu_chr_be_can_write, (opaque *)) \
    X(void, qemu_chr_be_write, (opaque *, const uint8_t *, int)) \
    X(bool, qemu_chr_fe_init, (opaque *, opaque *, opaque **)) \
    X(void, qemu_chr_fe_set_handlers, \
      (opaque *, int (*)(void *), void (*)(void *, const uint8_t *, int), void (*)(void *, int), int (*)(void *), \
       void *, opaque *, bool)) \
    X(int, qemu_chr_fe_write, (opaque *, const uint8_t *, int))

#define MEMBER(result, name, parameters) result(*name) parameters;
struct vm_symbols {
    FUNCTIONS(MEMBER)
    opaque *address_space_memory;
};
#undef MEMBER

extern struct vm_symbols vm;

/* QEMU reads it, and it says what QEMU is. */
__attribute__((visibility("default"))) extern int qemu_plugin_version;

/* Ends the process with one line on stderr where QEMU does not export it. */
void *vm_find(const char *name);

/* Zeroed room for what stays opaque; never given back. */
opaque *vm_room(size_t bytes);

/* The machine's core with its interrupt controller. */
opaque *vm_core(void);

/* A reset that the guest asks for goes vm_request_reset()'s way; before the first instruction. */
void vm_take_over_resets(void);

#endif
