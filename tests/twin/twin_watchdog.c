/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The watchdog and its system registers against docs/silicon.md: who may write what, and which reset changes it. */
#include "watchdog.h"

#include "check.h"
#include "sysreg.h"

#define MS          ((sim_ps)1000000000)
#define LOAD_TICKS  ((sim_ps)WATCHDOG_LOAD << 6 | 0x3F)
#define TICK_PS     20000
#define VALUE       0x00
#define REFRESH     0x0C
#define ENABLE      0x10
#define CONTROL     0x14
#define REFRESH_KEY 0xAC15DE42u

static struct watchdog dog;

static void expired(void)
{
}

static void write_control(uint32_t value, sim_ps now)
{
    for (int n = 0; n < SYSREG_WORDS; n++) {
        if (sysreg_words[n].offset == SYSREG_WDOG_CR) {
            sysreg_write(&sysreg_words[n], SYSREG_WDOG_CR, value);
        }
    }
    watchdog_switched(&dog, now);
}

static void power_on(uint32_t design)
{
    sysreg_design(SYSREG_WDOGLOAD, WATCHDOG_LOAD);
    sysreg_design(SYSREG_WDOG_CR, design);
    sysreg_reset(RESET_POWER_ON);
    watchdog_init(&dog, expired);
}

static void kept(void)
{
    static const enum reset_cause warm[] = {RESET_SOFT, RESET_LOCKUP, RESET_WATCHDOG, RESET_USER};
    for (uint32_t written = 0; written < 4; written++) {
        power_on(1);
        write_control(written | 0xFFFFFFF0u, 0);
        check_hex("WDOG_CR has two bits", sysreg_value(SYSREG_WDOG_CR), written);
        for (unsigned n = 0; n < sizeof warm / sizeof *warm; n++) {
            sysreg_reset(warm[n]);
            check_hex("WDOG_CR outlives a reset", sysreg_value(SYSREG_WDOG_CR), written);
        }
        sysreg_design(SYSREG_WDOG_CR, 0);
        sysreg_reset(RESET_WATCHDOG);
        check_hex("another design is in effect from power-on on", sysreg_value(SYSREG_WDOG_CR), written);
        sysreg_reset(RESET_POWER_ON);
        check_hex("which sets it as the design has it", sysreg_value(SYSREG_WDOG_CR), 0);
    }
    power_on(0);
    write_control(1, 0);
    sysreg_reset(RESET_SOFT);
    sysreg_put_back();
    check_hex("traffic puts back what power-on left", sysreg_value(SYSREG_WDOG_CR), 0);
}

static void count(void)
{
    power_on(1);
    check_true("on", watchdog_read(&dog, ENABLE, 0) == 1 && dog.expires_at == LOAD_TICKS * TICK_PS);
    write_control(0, 7 * MS);
    check_true("off it stands", watchdog_read(&dog, ENABLE, 7 * MS) == 0 && dog.expires_at == SIM_NEVER);
    check_equal("where it was", watchdog_read(&dog, VALUE, 99 * MS), (int64_t)(LOAD_TICKS - 7 * MS / TICK_PS));
    write_control(1, 100 * MS);
    check_true("and goes on from there", dog.expires_at == LOAD_TICKS * TICK_PS + 93 * MS);
    watchdog_write(&dog, REFRESH, REFRESH_KEY, 101 * MS);
    check_true("refreshed, it has its whole time", dog.expires_at == LOAD_TICKS * TICK_PS + 101 * MS);
    write_control(3, 102 * MS);
    check_true("it interrupts", watchdog_read(&dog, CONTROL, 102 * MS) == 4 && dog.expires_at == SIM_NEVER);
}

static void openocd(void)
{
    power_on(1);
    sysreg_reset(RESET_SOFT);
    sysreg_leave_as_openocd();
    check_hex("OpenOCD switches it off", sysreg_value(SYSREG_WDOG_CR) | sysreg_value(SYSREG_CC_CR), 0);
    sysreg_reset(RESET_SOFT);
    check_hex("and another reset does not help", sysreg_value(SYSREG_WDOG_CR), 0);
    power_on(0);
    sysreg_fix(SYSREG_WDOG_CR, 3);
    write_control(1, 0);
    check_hex("a design may lock it", sysreg_value(SYSREG_WDOG_CR), 0);
}

int main(void)
{
    kept();
    count();
    openocd();
    return check_end();
}
