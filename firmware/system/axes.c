/* SPDX-License-Identifier: MIT */
#include "firmware/system/handlers.h"

#include "startup/startup.h"

struct axis axes[AXIS_COUNT];

#ifdef __arm__
_Static_assert(AXIS_ALIGNMENT > (ADC_STATUS_EOC | ADC_STATUS_OVERRUN | ADC_STATUS_TRIP),
               "an address would clear them, too");
#endif

#if AXIS_COUNT == 2u && defined __arm__
/* For the assembler, which has no sizeof. */
__attribute__((used)) static void name_second_axis(void)
{
    __asm__(".global axes_second\n\t.set axes_second, axes + %c0" ::"i"(sizeof(struct axis)));
}
#endif

struct scope scope;

struct thermal_memory axes_heat[AXIS_COUNT] STARTUP_NOINIT;

void current_loop_fault(struct axis *axis)
{
    drive_sample_fault(AXIS_COUNT == 1u ? &axes[0] : axis); /* the assembly passes no axis if there is one */
}
