/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The device's cache: what waits while it is off, what it holds, and what a lock keeps (docs/silicon.md). */
#include <stdio.h>
#include <sys/wait.h>
#include <unistd.h>

#include "check.h"
#include "cycles_cache.h"
#include "sysreg.h"

enum { CC_CR = 0x18, FLUSH_CR = 0x1A8, ENABLED = 1, LOCKED = 4 };
enum { LINE = 32, WAY = 2048, MISS = 35, WAIT = 8 };

static void write_register(uint32_t offset, uint32_t value)
{
    for (int n = 0; n < SYSREG_WORDS; n++) {
        if (sysreg_words[n].offset == offset) {
            sysreg_write(&sysreg_words[n], offset, value);
        }
    }
}

static void begin(uint32_t control)
{
    static const struct cycles_params device = {.envm_wait = WAIT, .cache = CYCLES_CACHE_DEVICE, .cache_miss = MISS};
    sysreg_reset(RESET_POWER_ON);
    cycles_cache_init(&device);
    cycles_cache_reset();
    write_register(CC_CR, control);
}

/* As drivers/mss/cache.c does it, but for `missing` of the last lines. */
static void fill_and_lock(uint32_t missing)
{
    begin(ENABLED);
    for (uint32_t address = 0; address < CYCLES_CACHE_BYTES - missing * LINE; address += LINE) {
        (void)cycles_cache_waits(address);
    }
    write_register(CC_CR, ENABLED | LOCKED);
}

static void check_off(void)
{
    begin(0);
    check_equal("off: a word waits", cycles_cache_waits(0x100), WAIT);
    check_equal("off: the second of the pair does not", cycles_cache_waits(0x104), 0);
    check_equal("off: the next pair does", cycles_cache_waits(0x108), WAIT);
    check_equal("off: a second word alone does", cycles_cache_waits(0x204), WAIT);
    check_equal("off: the same word again does", cycles_cache_waits(0x204), WAIT);
}

static void check_ways(void)
{
    begin(ENABLED);
    check_equal("on: empty at first", cycles_cache_waits(0), MISS);
    check_equal("on: a line is there at once", cycles_cache_waits(LINE - 4), 0);
    for (uint32_t way = 1; way < 4; way++) {
        check_equal("on: one of the other ways", cycles_cache_waits(way * WAY), MISS);
    }
    check_equal("on: four ways hold four", cycles_cache_waits(0), 0);
    check_equal("on: a fifth pushes one out", cycles_cache_waits(4 * WAY), MISS);
    check_equal("on: not the one used last", cycles_cache_waits(0), 0);
    check_equal("on: but the one used longest ago", cycles_cache_waits(WAY), MISS);
    check_equal("on: another set is not concerned", cycles_cache_waits(5 * WAY + LINE), MISS);
    write_register(FLUSH_CR, 1);
    check_equal("on: a flush empties it", cycles_cache_waits(0), MISS);
    cycles_cache_evict();
    check_equal("on: so does other code", cycles_cache_waits(0), MISS);
}

static void check_lock(void)
{
    bool all = true;
    fill_and_lock(0);
    for (uint32_t address = 0; address < CYCLES_CACHE_BYTES; address += 4) {
        all = all && cycles_cache_waits(address) == 0;
    }
    check_true("locked: no word of the first 8 KB waits", all);
    check_equal("locked: the next one does", cycles_cache_waits(CYCLES_CACHE_BYTES), WAIT);
    check_equal("locked: again", cycles_cache_waits(CYCLES_CACHE_BYTES), WAIT);
    cycles_cache_evict();
    check_equal("locked: other code leaves all there", cycles_cache_waits(CYCLES_CACHE_BYTES - 4), 0);
}

/* In a process of its own: the twin ends. */
static void check_lock_without_a_line(void)
{
    fflush(stdout);
    const pid_t child = fork();
    if (child == 0) {
        fill_and_lock(1);
        (void)cycles_cache_waits(CYCLES_CACHE_BYTES - 2 * LINE);
        (void)cycles_cache_waits(CYCLES_CACHE_BYTES - LINE);
        _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    check_true("locked without a line: an access there ends the run", WIFEXITED(status) && WEXITSTATUS(status) == 1);
}

int main(void)
{
    check_off();
    check_ways();
    check_lock();
    check_lock_without_a_line();
    return check_end();
}
