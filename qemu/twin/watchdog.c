/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A down counter on the 50 MHz RC oscillator: firmware cannot change its load or its window. Switched off it stands, and
 * goes on from there. In interrupt mode the twin's does nothing. UG0331, watchdog chapter. */
#include "watchdog.h"

#include "sysreg.h"

enum {
    VALUE = 0x00,
    LOAD = 0x04,
    MVRP = 0x08,
    REFRESH = 0x0C,
    ENABLE = 0x10,
    CONTROL = 0x14,
    STATUS = 0x18,
};

#define NO_FORBIDDEN_WINDOW 0xFFFFFFFFu
#define REFRESH_KEY         0xAC15DE42u
#define TICK_PS             20000
#define CONTROL_BITS        3u        /* that firmware can change */
#define CONTROL_INTERRUPTS  (1u << 2) /* WDOGMODE of WDOG_CR */
#define WDOG_CR_ENABLE      (1u << 0)
#define WDOG_CR_INTERRUPTS  (1u << 1)

/* Six ones are appended to what the design sets. */
static uint32_t load_ticks(void)
{
    return sysreg_value(SYSREG_WDOGLOAD) << 6 | 0x3Fu;
}

static bool is_set(uint32_t bit)
{
    return (sysreg_value(SYSREG_WDOG_CR) & bit) != 0;
}

void watchdog_init(struct watchdog *w, void (*reset)(void))
{
    w->reset = reset;
    w->control = 0;
    watchdog_reload(w, 0);
}

static sim_ps left(const struct watchdog *w, sim_ps now)
{
    return w->expires_at == SIM_NEVER ? w->left : w->expires_at > now ? w->expires_at - now : 0;
}

static void count_down(struct watchdog *w, sim_ps from, sim_ps now)
{
    w->left = from;
    w->expires_at = is_set(WDOG_CR_ENABLE) && !is_set(WDOG_CR_INTERRUPTS) ? now + from : SIM_NEVER;
}

void watchdog_reload(struct watchdog *w, sim_ps now)
{
    count_down(w, (sim_ps)load_ticks() * TICK_PS, now);
}

void watchdog_switched(struct watchdog *w, sim_ps now)
{
    count_down(w, left(w, now), now);
}

uint32_t watchdog_read(const struct watchdog *w, uint32_t offset, sim_ps now)
{
    switch (offset) {
    case VALUE:
        return (uint32_t)(left(w, now) / TICK_PS);
    case LOAD:
        return load_ticks();
    case MVRP:
        return NO_FORBIDDEN_WINDOW;
    case ENABLE:
        return is_set(WDOG_CR_ENABLE);
    case CONTROL:
        return w->control | (is_set(WDOG_CR_INTERRUPTS) ? CONTROL_INTERRUPTS : 0);
    case STATUS:
        return 1; /* refresh permitted, always */
    default:
        return 0;
    }
}

void watchdog_write(struct watchdog *w, uint32_t offset, uint32_t value, sim_ps now)
{
    if (offset == REFRESH && value == REFRESH_KEY) {
        watchdog_reload(w, now);
    } else if (offset == CONTROL) {
        w->control = value & CONTROL_BITS;
    }
}
