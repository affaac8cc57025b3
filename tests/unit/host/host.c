/* SPDX-License-Identifier: MIT */
/* What the firmware's rooms lean on, for this machine: the core, the clocks, and a console whose two ends are buffers. */
#include "drivers/cortex/cpu.h"
#include "drivers/mss/mmuart.h"
#include "drivers/mss/sysreg.h"
#include "firmware/monitor/device.h"
#include "firmware/system/idle.h"

uint32_t host_primask, host_basepri, host_sleeps, host_watchdog_served;
void (*host_on_sleep)(void);
void (*host_on_mask)(uint32_t level);

uint32_t host_device_fault; /* enum fault that the device has now */

/* the console: what the firmware has said, what it is told */
char host_said[65536], host_heard[4096];
uint32_t host_baud;  /* of the console, as it was last set; 0: never */
bool host_line_busy; /* what the firmware has said is not out yet */
uint32_t host_said_bytes, host_heard_bytes, host_heard_taken;

bool device_guard_stack(void)
{
    return true;
}

enum fault device_fault(void)
{
    return (enum fault)host_device_fault;
}

size_t mmuart_free_space(const struct mmuart *u)
{
    (void)u;
    return sizeof host_said - host_said_bytes;
}

bool mmuart_get(struct mmuart *u, char *character, bool *loss)
{
    (void)u;
    (void)loss;
    if (host_heard_taken == host_heard_bytes) {
        return false;
    }
    *character = host_heard[host_heard_taken++];
    return true;
}

bool mmuart_put(struct mmuart *u, char character)
{
    (void)u;
    host_said[host_said_bytes++] = character;
    return true;
}

bool mmuart_is_idle(const struct mmuart *u)
{
    (void)u;
    return !host_line_busy;
}

bool mmuart_init(struct mmuart *u, struct mmuart_regs *regs, uint32_t baud)
{
    (void)u;
    (void)regs;
    host_baud = baud;
    return true;
}

uint32_t sysreg_edac_corrected(void)
{
    return 0u;
}

uint32_t device_watchdog_ms(void)
{
    return 32212u;
}

void idle_serve_watchdog(struct idle *i)
{
    (void)i;
    host_watchdog_served++;
}

void idle(struct idle *i)
{
    (void)i;
    cpu_wait_for_interrupt();
}

uint32_t measure_current_loop_cycles(const volatile uint32_t *time_ms)
{
    (void)time_ms;
    return 217u;
}
