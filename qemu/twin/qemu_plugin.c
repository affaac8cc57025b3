/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What QEMU calls: attachment, translated and executed instructions, the end. */
#include "qemu_api.h"
#include "qemu_registers.h"
#include "qemu_sleep.h"
#include "qemu_symbols.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define READS_REGISTERS  1      /* QEMU_PLUGIN_CB_R_REGS */
#define READS_AND_WRITES 3      /* QEMU_PLUGIN_MEM_RW */
#define WFI_T1           0xBF30 /* encoding T1 in the ARMv7-M Architecture Reference Manual; it ends a translated block */

static void (*attach_hook)(void);
static void (*start_hook)(void);
static const struct vm_instructions *instruction_hooks;
static void (*exit_hook)(void);

static void state_changed(void *unused, bool running, int state)
{
    (void)unused;
    (void)state;
    if (running && start_hook) {
        void (*start)(void) = start_hook;
        start_hook = NULL;
        vm_take_over_resets();
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

static void accessed(unsigned cpu, uint32_t info, uint64_t address, void *next)
{
    (void)cpu;
    (void)info;
    instruction_hooks->access((uint32_t)address, next);
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

/* Instructions of a block that are told of as one. */
struct piece {
    opaque *first, *last; /* NULL: there is none */
    struct vm_instruction known, known_of_last;
};

static struct piece piece_at(const opaque *block, size_t n)
{
    opaque *instruction = vm.qemu_plugin_tb_get_insn(block, n);
    struct vm_instruction known = instruction_hooks->translate((uint32_t)vm.qemu_plugin_insn_vaddr(instruction));
    return (struct piece){instruction, instruction, known, known};
}

/* Each call from a block costs: where the piece before ends with an access, that tells of this one, too. */
static void listen(const struct piece *before, const struct piece *p)
{
    bool told = p->first && before->last && before->known_of_last.accesses_once && !p->known.wants_registers;
    void *context = (void *)(uintptr_t)p->known.context;
    if (before->last && before->known_of_last.wants_address) {
        vm.qemu_plugin_register_vcpu_mem_cb(before->last, accessed, 0, READS_AND_WRITES, told ? context : NULL);
    }
    if (p->first && !told) {
        int flags = p->known.wants_registers ? READS_REGISTERS : 0;
        vm.qemu_plugin_register_vcpu_insn_exec_cb(p->first, executed, flags, context);
    }
}

/* A block is executed from its first instruction to its last: where it has to end earlier, it is translated anew. */
static void translated(uint64_t id, opaque *block)
{
    (void)id;
    static const struct piece none;
    size_t count = vm.qemu_plugin_tb_n_insns(block);
    struct piece before = none, now = piece_at(block, 0);
    for (size_t n = 1; n < count; n++) {
        struct piece next = piece_at(block, n);
        const void *joined = instruction_hooks->join(now.known.context, next.known.context);
        if (joined) {
            now.known.context = joined;
            now.last = next.last;
            now.known_of_last = next.known_of_last;
        } else {
            listen(&before, &now);
            before = now;
            now = next;
        }
    }
    listen(&before, &now);
    listen(&now, &none);
    if (is_wfi(now.last)) {
        vm.qemu_plugin_register_vcpu_insn_exec_cb(now.last, about_to_sleep, 0, NULL);
    }
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
        current = vm_find("current_cpu"); /* thread-local: of the one thread that executes instructions */
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
