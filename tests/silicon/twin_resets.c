/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the twin's registers hold after power-on, and after other resets that find the causes cleared. A line each:
 * which reset, block, offset, value. */
#include <stdio.h>

#include "dwt.h"
#include "envm.h"
#include "gpio.h"
#include "sysreg.h"
#include "watchdog.h"

static void say(const char *after, const char *block, uint32_t offset, uint32_t value)
{
    printf("%s %s 0x%X 0x%X\n", after, block, offset, value);
}

static void say_sysreg(const char *after)
{
    for (int n = 0; n < SYSREG_WORDS; n++) {
        struct sysreg_word *word = &sysreg_words[n];
        say(after, "SYSREG", word->offset, sysreg_read(word, word->offset));
    }
}

static void expired(void)
{
}

static void say_watchdog(const char *after)
{
    struct watchdog watchdog;
    watchdog_init(&watchdog, expired);
    for (uint32_t offset = 0; offset <= 0x20; offset += 4) {
        say(after, "WATCHDOG", offset, watchdog_read(&watchdog, offset, 0));
    }
}

static void say_gpio(const char *after)
{
    static const uint32_t offsets[] = {0x00, 0x80, 0x84, 0x88};
    struct gpio gpio;
    gpio_reset(&gpio, sysreg_value(SYSREG_GPIO_DEF));
    for (unsigned n = 0; n < sizeof offsets / sizeof *offsets; n++) {
        say(after, "GPIO", offsets[n], gpio_read(&gpio, offsets[n]));
    }
}

static void say_envm(const char *after)
{
    static struct envm envm;
    envm_init(&envm, &(struct envm_params){.program_s = 1, .verify_s = 1, .endurance = 1}, 1);
    envm_reset(&envm, 0);
    say(after, "ENVM", 0x120, envm_read(&envm, 0x120, 0));
    say(after, "ENVM", 0x1FC, envm_read(&envm, 0x1FC, 0));
}

static uint64_t no_cycles(void)
{
    return 0;
}

static void say_dwt(const char *after)
{
    struct dwt dwt;
    dwt_init(&dwt, no_cycles);
    say(after, "DWT", 0, dwt_read(&dwt, 0));
    say(after, "DWT", 4, dwt_read(&dwt, 4));
}

static void say_all(const char *after)
{
    say_sysreg(after);
    say_watchdog(after);
    say_gpio(after);
    say_envm(after);
    say_dwt(after);
}

static const struct {
    const char *name;
    enum reset_cause cause;
} warm[] = {
    {"watchdog", RESET_WATCHDOG}, {"lock-up", RESET_LOCKUP}, {"software", RESET_SOFT}, {"external", RESET_USER}};

/* What firmware changes, and the causes cleared; WDOG_CR keeps what it gets, which tests/twin/test_core_side.py looks at. */
static void disturb(void)
{
    for (int n = 0; n < SYSREG_WORDS; n++) {
        if (sysreg_words[n].offset == SYSREG_WDOG_CR) {
            continue;
        }
        sysreg_write(&sysreg_words[n], sysreg_words[n].offset, n == 0 ? 0 : 0xFFFFFFFFu);
    }
}

int main(void)
{
    sysreg_design(SYSREG_WDOGLOAD, WATCHDOG_LOAD);
    sysreg_reset(RESET_POWER_ON);
    say_all("power-on");
    for (unsigned n = 0; n < sizeof warm / sizeof *warm; n++) {
        disturb();
        sysreg_reset(warm[n].cause);
        say_all(warm[n].name);
    }
    return 0;
}
