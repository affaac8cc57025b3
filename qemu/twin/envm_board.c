/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "envm_board.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "qemu_api.h"

#define ENVM_CR     0x4003800Cu
#define WAIT_STATES (0xFFu << 5)
#define ALIAS_BYTES 0x20000000u /* of the code bus, at 0 */

bool envm_board_busy;

static struct envm envm;
static const char *file;
static void (*power_fails)(void);
static int64_t stalled_ns;

static sim_ps present(void)
{
    return vm_now_ns() * SIM_PS_PER_NS;
}

static void look(void)
{
    envm_board_busy = envm_is_busy(&envm);
}

static void page_changed(void *unused, const struct envm *e, uint32_t page)
{
    (void)unused;
    vm_write_rom(ENVM_ARRAY_BASE + page * ENVM_PAGE, e->array + (size_t)page * ENVM_PAGE, ENVM_PAGE);
}

static uint32_t read_register(void *unused, uint32_t offset)
{
    (void)unused;
    uint32_t value = envm_read(&envm, offset, present());
    look();
    return value;
}

static void write_register(void *unused, uint32_t offset, uint32_t value)
{
    uint32_t word;
    (void)unused;
    vm_read_memory(ENVM_CR, &word, sizeof word);
    envm.wait_states = (word & WAIT_STATES) == WAIT_STATES;
    bool cut = envm_write(&envm, offset, value, present());
    look();
    if (cut) {
        envm_board_keep();
        power_fails();
    }
}

void envm_board_map(const struct envm_params *p, uint64_t seed, void (*cut)(void))
{
    static const struct vm_region controller = {
        "mssfoc-envm", ENVM_CONTROLLER_BASE, ENVM_CONTROLLER_BYTES, 4, read_register, write_register, NULL};
    envm_init(&envm, p, seed);
    power_fails = cut;
    vm_map(&controller);
}

/* What the loader has put into the array belongs to the image; the file's pages lie elsewhere. */
void envm_board_start(const char *path)
{
    vm_read_memory(ENVM_ARRAY_BASE, envm.array, ENVM_ARRAY_BYTES);
    file = path;
    if (file && !envm_recall(&envm, file)) {
        fprintf(stderr, "mssfoc twin: envm %s: %s\n", file, strerror(errno));
        exit(1);
    }
    for (uint32_t page = 0; page < ENVM_PAGES; page++) {
        if (envm.writes[page] > 0) {
            page_changed(NULL, &envm, page);
        }
    }
    envm.changed = page_changed;
}

static void waited(int64_t for_ns)
{
    stalled_ns += for_ns;
    envm_settle(&envm, present());
    look();
}

void envm_board_waits(uint32_t address)
{
    if (address < ALIAS_BYTES || address - ENVM_ARRAY_BASE < ENVM_ARRAY_BYTES) {
        vm_stall(sim_to_ns_up(envm.until), waited);
    }
}

void envm_board_power_cut(void)
{
    envm_power_cut(&envm, present());
    look();
    envm_board_keep();
    power_fails();
}

void envm_board_reset(void)
{
    envm_reset(&envm, present());
    look();
}

void envm_board_keep(void)
{
    if (file && !envm_store(&envm, file)) {
        fprintf(stderr, "mssfoc twin: envm %s: %s\n", file, strerror(errno));
    }
    if (stalled_ns > 0) {
        fprintf(stderr, "mssfoc twin: the core has waited %.6f s for the eNVM\n", (double)stalled_ns * 1e-9);
    }
}
