/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The eNVM's controller against UG0331 as docs/settings.md has it: commands, busy time, refusals, wear, what a cut leaves. */
#include "envm.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "check.h"

#define MS      1000000000
#define PAGE    100u
#define STATUS  0x120u
#define CMD     0x148u
#define CLRHINT 0x158u
#define ACCESS  0x1FCu
#define PROGRAM (0x08000000u | PAGE * ENVM_PAGE)
#define VERIFY  (0x10000000u | PAGE * ENVM_PAGE)
#define UNLOCK  (0x13000000u | PAGE * ENVM_PAGE)
#define LOCK    0x140u
#define DENIED  (1u << 18)
#define BUSY    (1u << 19)

static const struct envm_params params = {.program_s = 8e-3, .verify_s = 1e-3, .endurance = 3};
static struct envm envm;
static unsigned told;

static void changed(void *unused, const struct envm *e, uint32_t page)
{
    (void)unused;
    (void)e;
    told += page == PAGE;
}

static struct envm *fresh(uint64_t seed)
{
    envm_init(&envm, &params, seed);
    envm.changed = changed;
    envm.wait_states = true;
    told = 0;
    (void)envm_write(&envm, ACCESS, 1, 0);
    return &envm;
}

static void fill(struct envm *e, uint32_t word)
{
    for (uint32_t at = 0x80; at < 0x100; at += 4) {
        (void)envm_write(e, at, word + at, 0);
    }
}

static bool page_is(const struct envm *e, uint32_t word)
{
    for (uint32_t n = 0; n < 32; n++) {
        uint32_t there;
        memcpy(&there, e->array + PAGE * ENVM_PAGE + 4 * n, 4);
        if (there != word + 0x80 + 4 * n) {
            return false;
        }
    }
    return true;
}

static void commands(void)
{
    struct envm *e = fresh(1);
    fill(e, 0x1000);
    (void)envm_write(e, CMD, PROGRAM, 0);
    check_true("busy", envm_is_busy(e));
    check_hex("one look may be deceived", envm_read(e, STATUS, 1), 1);
    check_hex("not ready", envm_read(e, STATUS, 8 * (int64_t)MS - 1), 0);
    check_equal("nothing has changed yet", told, 0);
    (void)envm_write(e, CMD, VERIFY, 4 * (int64_t)MS);
    check_hex("a command while busy", envm_read(e, STATUS, 8 * (int64_t)MS), 1u | BUSY);
    check_true("the first went on", page_is(e, 0x1000) && told == 1 && !envm_is_busy(e));
    (void)envm_write(e, CLRHINT, 2, 9 * (int64_t)MS);
    (void)envm_write(e, CMD, VERIFY, 9 * (int64_t)MS);
    check_hex("no command is taken after that", envm_read(e, STATUS, 9 * (int64_t)MS), 1u | BUSY);
    (void)envm_write(e, CLRHINT, 4, 9 * (int64_t)MS);
    (void)envm_write(e, CMD, VERIFY, 9 * (int64_t)MS);
    check_hex("until it is cleared: verified", envm_read(e, STATUS, 10 * (int64_t)MS), 1);
    e->array[PAGE * ENVM_PAGE + 5] ^= 1;
    (void)envm_write(e, CMD, VERIFY, 11 * (int64_t)MS);
    check_hex("another content is noticed", envm_read(e, STATUS, 12 * (int64_t)MS), 1u | 1u << 1);
}

static void refusals(void)
{
    struct envm *e = fresh(1);
    check_equal("access is granted", envm_read(e, ACCESS, 0), 5);
    (void)envm_write(e, CMD, 0x08000000u | (ENVM_PAGES - 16) * ENVM_PAGE, 0);
    check_hex("a reserved page", envm_read(e, STATUS, 0), 1u | DENIED);
    (void)envm_write(e, CMD, PROGRAM, 0);
    check_hex("no command is taken, and the denial stays", envm_read(e, STATUS, 0), 1u | DENIED);
    (void)envm_write(e, CLRHINT, 2, 0);
    check_hex("until it is cleared", envm_read(e, STATUS, 0), 1);
    (void)envm_write(e, CMD, PROGRAM + 4, 0);
    check_hex("not a page's beginning", envm_read(e, STATUS, 0), 1u | DENIED);
    (void)envm_write(e, CLRHINT, 2, 0);
    (void)envm_write(e, LOCK, 1, 0);
    (void)envm_write(e, CMD, PROGRAM, 0);
    check_true("programmed, and locked by it", (envm_settle(e, 8 * (int64_t)MS), e->locked[PAGE]));
    (void)envm_write(e, CMD, PROGRAM, 9 * (int64_t)MS);
    check_hex("a locked page", envm_read(e, STATUS, 9 * (int64_t)MS), 1u | 1u << 4);
    (void)envm_write(e, CMD, UNLOCK, 9 * (int64_t)MS);
    (void)envm_write(e, CMD, PROGRAM, 9 * (int64_t)MS);
    check_true("unlocked", envm_is_busy(e));
    e = fresh(1);
    (void)envm_write(e, ACCESS, 0, 0);
    fill(e, 7);
    (void)envm_write(e, CMD, PROGRAM, 0);
    check_true("without access nothing is written", !envm_is_busy(e) && envm_read(e, 0x80, 0) == 0);
    check_hex("and the status reads 0", envm_read(e, STATUS, 0), 0);
    e->held = true;
    (void)envm_write(e, ACCESS, 1, 0);
    check_true("while somebody else has it", envm_read(e, ACCESS, 0) != 5);
    e = fresh(1);
    e->wait_states = false;
    fill(e, 9);
    (void)envm_write(e, CMD, PROGRAM, 0);
    check_hex("without wait states", envm_read(e, STATUS, 9 * (int64_t)MS), 1u | 1u << 3);
    check_true("it is not what was meant", !page_is(e, 9));
}

static void wear(void)
{
    struct envm *e = fresh(1);
    for (int n = 1; n <= 4; n++) {
        (void)envm_write(e, CMD, PROGRAM, n * 10 * (int64_t)MS);
        uint32_t status = envm_read(e, STATUS, n * 10 * (int64_t)MS + 9 * (int64_t)MS);
        check_hex(n <= 3 ? "within its endurance" : "beyond it", status, n <= 3 ? 1 : 1u | 1u << 5);
    }
    check_equal("counted", e->writes[PAGE], 4);
    check_equal("the next page has none", e->writes[PAGE + 1], 0);
}

/* How many bits are the old ones, erased ones or the new, where these three differ. */
static void torn(double share, int *old, int *erased, int *new, uint64_t seed)
{
    struct envm *e = fresh(seed);
    memset(e->array + PAGE * ENVM_PAGE, 0x0F, ENVM_PAGE);
    for (uint32_t at = 0x80; at < 0x100; at += 4) {
        (void)envm_write(e, at, 0x33333333u, 0);
    }
    (void)envm_write(e, CMD, PROGRAM, 0);
    envm_power_cut(e, (sim_ps)(share * 8 * (double)MS));
    *old = *erased = *new = 0;
    for (uint32_t n = 0; n < ENVM_PAGE; n++) {
        uint8_t b = e->array[PAGE * ENVM_PAGE + n];
        *old += __builtin_popcount(~b & 0x30);   /* old 0, erased 1, new 1 */
        *erased += __builtin_popcount(b & 0xC0); /* old 0, erased 1, new 0 */
        *new += __builtin_popcount(~b & 0x0C);   /* old 1, erased 1, new 0 */
    }
    check_true("the controller starts anew", !envm_is_busy(e) && !e->granted && e->status == 1);
}

static void cuts(void)
{
    int old, erased, new, again[3];
    torn(0.25, &old, &erased, &new, 1);
    check_between("a quarter: half is erased", erased, 90, 166);
    check_true("the rest is as it was, nothing is new", old > 90 && new == 0);
    torn(0.5, &old, &erased, &new, 1);
    check_true("at half all is erased", old == 0 && erased == 256 && new == 0);
    torn(0.75, &old, &erased, &new, 1);
    check_true("then nothing old is left", old == 0);
    check_between("and half is new", new, 90, 166);
    torn(0.75, &again[0], &again[1], &again[2], 1);
    check_true("the same seed leaves the same", again[1] == erased && again[2] == new);
    torn(0, &old, &erased, &new, 1);
    check_true("at once: all is old", old == 256 && erased == 0);
    struct envm *e = fresh(1);
    fill(e, 1);
    (void)envm_write(e, CMD, PROGRAM, 0);
    envm_power_cut(e, 8 * (int64_t)MS);
    check_true("at the end: all is new", page_is(e, 1));
    struct envm_params cutting = params;
    cutting.cut_write = 3;
    envm_init(&envm, &cutting, 1);
    check_true("behind a write that is told", !envm_write(&envm, ACCESS, 1, 0) && !envm_write(&envm, 0x80, 1, 0) &&
                                                  envm_write(&envm, 0x84, 1, 0) && !envm.granted);
}

static void files(void)
{
    char path[] = "envm_XXXXXX";
    int descriptor = mkstemp(path);
    check_true("a file", descriptor >= 0);
    struct envm *e = fresh(1);
    fill(e, 0x7000);
    (void)envm_write(e, CMD, PROGRAM, 0);
    envm_settle(e, 8 * (int64_t)MS);
    e->locked[PAGE] = true;
    check_true("written", envm_store(e, path));
    e = fresh(1);
    check_true("read", envm_recall(e, path) && page_is(e, 0x7000) && e->writes[PAGE] == 1 && e->locked[PAGE]);
    check_true("no other page", e->writes[PAGE - 1] == 0 && e->array[PAGE * ENVM_PAGE - 1] == 0);
    FILE *file = fopen(path, "wb");
    check_true("another file is none",
               file && fputs("mssenvm0 and more", file) > 0 && fclose(file) == 0 && !envm_recall(e, path));
    check_true("a device that is new", remove(path) == 0 && envm_recall(e, path));
    close(descriptor);
}

int main(void)
{
    commands();
    refusals();
    wear();
    cuts();
    files();
    return check_end();
}
