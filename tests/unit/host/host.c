/* SPDX-License-Identifier: MIT */
/* What the firmware's rooms lean on, for this machine: the core, the clocks, and a console whose two ends are buffers. */
#include "drivers/cortex/cpu.h"
#include "drivers/mss/mmuart.h"
#include "drivers/mss/sysreg.h"
#include "firmware/system/idle.h"
#include "firmware/system/measure.h"
#include "firmware/system/postmortem.h"

uint32_t host_primask, host_basepri, host_sleeps;
void (*host_on_sleep)(void);

bool host_clocks_match = true;

/* the console: what the firmware has said, what it is told */
char host_said[65536], host_heard[4096];
uint32_t host_said_bytes, host_heard_bytes, host_heard_taken;

bool sysreg_clocks_match_board(void)
{
    return host_clocks_match;
}

size_t mmuart0_free_space(void)
{
    return sizeof host_said - host_said_bytes;
}

bool mmuart0_get(char *character)
{
    if (host_heard_taken == host_heard_bytes) {
        return false;
    }
    *character = host_heard[host_heard_taken++];
    return true;
}

bool mmuart0_put(char character)
{
    host_said[host_said_bytes++] = character;
    return true;
}

void idle(void)
{
    cpu_wait_for_interrupt();
}

uint32_t measure_current_loop_cycles(const volatile uint32_t *time_ms)
{
    (void)time_ms;
    return 217u;
}

const struct postmortem *postmortem_record(void)
{
    return NULL;
}
