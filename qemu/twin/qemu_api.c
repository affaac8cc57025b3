/* SPDX-License-Identifier: GPL-2.0-or-later */
/* QEMU's internal functions are reached by name in the running program: Debian's builds export them because they load
 * modules. MemoryRegion, QEMUTimer and the rest stay opaque; they get zeroed room that is larger than any version's.
 *
 * Two of QEMU's plugin API versions are served by one binary: the constructor below runs before QEMU reads
 * qemu_plugin_version. 7.2 and 8 accept version 1; 9 and 10 accept 2 and later; what is used here did not change. */
#define _GNU_SOURCE
#include "qemu_api.h"

#include "qemu_registers.h"
#include "qemu_sleep.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define OPAQUE_BYTES         4096
#define ABOVE_THE_MACHINE    10
#define CLOCK_VIRTUAL        1
#define SCALE_NS             1
#define LITTLE_ENDIAN_DEVICE 2
#define CAUSE_GUEST_RESET    7 /* SHUTDOWN_CAUSE_GUEST_RESET */
/* WFI, encoding T1 in the ARMv7-M Architecture Reference Manual; it ends a translated block */
#define READS_REGISTERS  1 /* QEMU_PLUGIN_CB_R_REGS */
#define READS_AND_WRITES 3 /* QEMU_PLUGIN_MEM_RW */
#define WFI_T1           0xBF30

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
static struct {
    FUNCTIONS(MEMBER)
    opaque *address_space_memory;
} vm;

__attribute__((visibility("default"))) extern int qemu_plugin_version;
int qemu_plugin_version = 1;

__attribute__((constructor)) static void choose_plugin_version(void)
{
    if (dlsym(RTLD_DEFAULT, "qemu_plugin_scoreboard_new")) {
        qemu_plugin_version = 2; /* scoreboards came with version 2, in QEMU 9.0 */
    }
}

static void *find(const char *name)
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
#define FIND(result, name, parameters) vm.name = (result(*) parameters)find(#name);
    FUNCTIONS(FIND)
    vm.address_space_memory = find("address_space_memory");
}

/* ---- plugin callbacks ---- */

static void (*attach_hook)(void);
static void (*start_hook)(void);
static const struct vm_instructions *instruction_hooks;
static void (*exit_hook)(void);
static void take_over_resets(void);

static void state_changed(void *unused, bool running, int state)
{
    (void)unused;
    (void)state;
    if (running && start_hook) {
        void (*start)(void) = start_hook;
        start_hook = NULL;
        take_over_resets();
        start();
    }
}

/* QEMU 7.2 gets here while the core is being built, when a timer would crash it; 10 when the machine already runs. */
static void attached(uint64_t id, unsigned cpu)
{
    (void)id;
    if (cpu != 0) {
        return;
    }
    attach_hook();
    if (vm.runstate_is_running()) {
        state_changed(NULL, true, 0);
    } else {
        vm.qemu_add_vm_change_state_handler(state_changed, NULL);
    }
}

void vm_on_attach(uint64_t plugin_id, void (*attach)(void), void (*start)(void))
{
    attach_hook = attach;
    start_hook = start;
    vm.qemu_plugin_register_vcpu_init_cb(plugin_id, attached);
}

static void executed(unsigned cpu, void *instruction)
{
    (void)cpu;
    instruction_hooks->execute(instruction);
}

static void accessed(unsigned cpu, uint32_t info, uint64_t address, void *unused)
{
    (void)cpu;
    (void)info;
    (void)unused;
    instruction_hooks->access((uint32_t)address);
}

/* QEMU's main loop moves the clock to the next timer as soon as the core is halted, and now and then it does so before
 * the core's thread has booked the instructions it executed last: the clock then stands too late by their time, and the
 * run is no longer the same as the one before. Booking them just before the core halts closes that gap. */
static void about_to_sleep(unsigned cpu, void *unused)
{
    (void)unused;
    opaque *core = vm.qemu_get_cpu((int)cpu);
    vm.icount_update(core);
    vm_sleep_ahead(core);
}

static bool is_wfi(const opaque *instruction)
{
    uint8_t bytes[2];
    vm_read_memory((uint32_t)vm.qemu_plugin_insn_vaddr(instruction), bytes, sizeof bytes);
    return (bytes[0] | bytes[1] << 8) == WFI_T1;
}

/* An instruction of a block, and what its `execute` stands for. */
struct piece {
    opaque *instruction;
    struct vm_instruction known;
};

static struct piece piece_at(const opaque *block, size_t n)
{
    opaque *instruction = vm.qemu_plugin_tb_get_insn(block, n);
    return (struct piece){instruction, instruction_hooks->translate((uint32_t)vm.qemu_plugin_insn_vaddr(instruction))};
}

static void listen_at_sleep(const struct piece *p)
{
    if (is_wfi(p->instruction)) {
        vm.qemu_plugin_register_vcpu_insn_exec_cb(p->instruction, about_to_sleep, 0, NULL);
    }
}

static void listen(const struct piece *p)
{
    vm.qemu_plugin_register_vcpu_insn_exec_cb(p->instruction, executed, p->known.wants_registers ? READS_REGISTERS : 0,
                                              (void *)(uintptr_t)p->known.context);
    if (p->known.wants_address) {
        vm.qemu_plugin_register_vcpu_mem_cb(p->instruction, accessed, 0, READS_AND_WRITES, NULL);
    }
    listen_at_sleep(p);
}

/* A block is executed from its first instruction to its last: where it has to end earlier, it is translated anew. */
static void translated(uint64_t id, opaque *block)
{
    (void)id;
    size_t count = vm.qemu_plugin_tb_n_insns(block);
    struct piece head = piece_at(block, 0);
    for (size_t n = 1; n < count; n++) {
        struct piece next = piece_at(block, n);
        const void *joined = instruction_hooks->join(head.known.context, next.known.context);
        if (joined) {
            head.known.context = joined;
            listen_at_sleep(&next);
        } else {
            listen(&head);
            head = next;
        }
    }
    listen(&head);
}

void vm_on_instructions(uint64_t plugin_id, const struct vm_instructions *hooks)
{
    instruction_hooks = hooks;
    bool true_registers = qemu_plugin_version >= 2 || vm_make_callbacks_read_registers();
    if (!true_registers) {
        fputs("mssfoc twin: this QEMU does not show a plugin the registers amid a block; use Debian's 7.2, or 9 and "
              "later\n",
              stderr);
        exit(1);
    }
    vm.qemu_plugin_register_vcpu_tb_trans_cb(plugin_id, translated);
}

uint32_t vm_register(int number)
{
    static struct byte_array *value;
    if (!value) {
        value = vm.g_byte_array_new();
    }
    value->length = 0;
    uint32_t word = 0;
    if (vm.arm_cpu_gdb_read_register(vm.qemu_get_cpu(0), value, number) == sizeof word) {
        memcpy(&word, value->data, sizeof word);
    }
    return word;
}

int64_t vm_executing_ns(void)
{
    /* QEMU refuses to tell the time to a core that is amid a block; it asks current_cpu whether that is so. */
    static opaque **current;
    if (!current) {
        current = find("current_cpu"); /* thread-local: of the one thread that executes instructions */
    }
    opaque *cpu = *current;
    vm.icount_update(cpu);
    *current = NULL;
    int64_t now_ns = vm_now_ns();
    *current = cpu;
    return now_ns;
}

static void leaving(uint64_t id, void *unused)
{
    (void)id;
    (void)unused;
    exit_hook();
}

void vm_on_exit(uint64_t plugin_id, void (*leave)(void))
{
    exit_hook = leave;
    vm.qemu_plugin_register_atexit_cb(plugin_id, leaving, NULL);
}

/* ---- memory map ---- */

static opaque *room(size_t bytes)
{
    opaque *storage = calloc(1, bytes);
    if (!storage) {
        fputs("mssfoc twin: out of memory\n", stderr);
        exit(1);
    }
    return storage;
}

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
    struct region_ops *ops = room(OPAQUE_BYTES); /* generous: a later version may have grown */
    ops->read = region_read;
    ops->write = region_write;
    ops->endianness = LITTLE_ENDIAN_DEVICE;
    ops->valid.min = region->min_access_bytes;
    ops->valid.max = 4;
    ops->impl.min = 1;
    ops->impl.max = 4;
    opaque *storage = room(OPAQUE_BYTES);
    vm.memory_region_init_io(storage, NULL, ops, (void *)(uintptr_t)region, region->name, region->size);
    vm.memory_region_add_subregion_overlap(container, region->base, storage, ABOVE_THE_MACHINE);
}

static opaque *core(void)
{
    bool ambiguous;
    opaque *found = vm.object_resolve_path_type("", "armv7m", &ambiguous);
    if (!found) {
        fputs("mssfoc twin: this machine has no Cortex-M; use -M emcraft-sf2\n", stderr);
        exit(1);
    }
    return found;
}

void vm_map(const struct vm_region *region)
{
    map_into(vm.get_system_memory(), region);
}

void vm_map_private(const struct vm_region *region)
{
    opaque *container = vm.object_resolve_path_component(core(), "armv7m-container[0]");
    if (!container) {
        fputs("mssfoc twin: the core of this QEMU has no armv7m-container; use 7.2 or 10.x\n", stderr);
        exit(1);
    }
    map_into(container, region);
}

void vm_read_memory(uint32_t address, void *bytes, size_t length)
{
    vm.cpu_physical_memory_rw(address, bytes, length, false);
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

/* ---- time, interrupts, reset ---- */

int64_t vm_now_ns(void)
{
    return vm.qemu_clock_get_ns(CLOCK_VIRTUAL);
}

struct vm_timer *vm_timer_new(void (*expired)(void *context), void *context)
{
    struct vm_timer *timer = room(OPAQUE_BYTES);
    vm.timer_init_full(timer, NULL, CLOCK_VIRTUAL, SCALE_NS, 0, expired, context);
    return timer;
}

void vm_timer_at(struct vm_timer *timer, int64_t when_ns)
{
    vm.timer_mod_ns(timer, when_ns);
}

void vm_timer_stop(struct vm_timer *timer)
{
    vm.timer_del(timer);
}

void vm_sleep_alone(void)
{
    if (!vm_sleep_prepare()) {
        fputs(
            "mssfoc twin: the clock of this QEMU is not where it was in 7.2 and 10: the run takes longer, its results "
            "are the same\n",
            stderr);
    }
}

void vm_set_interrupt(int number, bool level)
{
    static opaque *line[128];
    if (!line[number]) {
        line[number] = vm.qdev_get_gpio_in(core(), number);
    }
    vm.qemu_set_irq(line[number], level);
}

void vm_on_reset(void (*reset)(void *context), void *context)
{
    vm.qemu_register_reset(reset, context);
}

static bool reset_is_due;

void vm_stall(int64_t until_ns, void (*over)(int64_t for_ns))
{
    (void)vm_stall_core(vm.qemu_get_cpu(0), until_ns, &reset_is_due, over);
}

static void reset_now(opaque *cpu, uint64_t unused)
{
    (void)cpu;
    (void)unused;
    reset_is_due = false;
    vm.qemu_system_reset(CAUSE_GUEST_RESET);
}

/* QEMU leaves a reset to its main loop, and by then time may have gone on, by an amount that depends on how busy the host
 * is. As work for the core's thread it comes before the next instruction, and before the next timer. */
void vm_request_reset(void)
{
    if (!reset_is_due) {
        reset_is_due = true;
        vm.async_run_on_cpu(vm.qemu_get_cpu(0), reset_now, 0);
    }
}

static void reset_requested_by_guest(void *unused, int line, int level)
{
    (void)unused;
    (void)line;
    if (level) {
        vm_request_reset();
    }
}

static void take_over_resets(void)
{
    vm.qdev_connect_gpio_out_named(core(), "SYSRESETREQ", 0, vm.qemu_allocate_irq(reset_requested_by_guest, NULL, 0));
}

void vm_end(void)
{
    /* A shutdown request would let the guest run on until the main loop gets to it, and print a different number of
     * characters each time. */
    exit(0);
}

/* ---- typing ---- */

struct vm_chardev *vm_find_chardev(const char *id)
{
    return vm.qemu_chr_find(id);
}

bool vm_type(struct vm_chardev *chardev, uint8_t byte)
{
    if (vm.qemu_chr_be_can_write(chardev) < 1) {
        return false;
    }
    vm.qemu_chr_be_write(chardev, &byte, 1);
    return true;
}

/* ---- a device of the twin's own ---- */

struct vm_chardev *vm_chardev_open(const char *id, int (*may_hear)(void *), void (*hear)(void *, const uint8_t *, int))
{
    opaque *chardev = vm.qemu_chr_find(id);
    opaque *frontend = room(OPAQUE_BYTES);
    if (!chardev || !vm.qemu_chr_fe_init(frontend, chardev, NULL)) {
        return NULL;
    }
    vm.qemu_chr_fe_set_handlers(frontend, may_hear, hear, NULL, NULL, NULL, NULL, true);
    return frontend;
}

void vm_chardev_write(struct vm_chardev *opened, uint8_t byte)
{
    (void)vm.qemu_chr_fe_write(opened, &byte, 1);
}
