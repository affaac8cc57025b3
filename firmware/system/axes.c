/* SPDX-License-Identifier: MIT */
#include "firmware/system/axes.h"

#include "startup/startup.h"

_Alignas(AXES_ALIGNMENT) struct axis axes[AXIS_COUNT];
_Static_assert(AXES_ALIGNMENT > (ADC_STATUS_EOC | ADC_STATUS_OVERRUN | ADC_STATUS_TRIP),
               "an address would clear them, too");

struct scope scope;

struct thermal_memory axes_heat[AXIS_COUNT] STARTUP_NOINIT;

void current_loop_fault(void)
{
    drive_sample_fault(&axes[0]);
}
