/* SPDX-License-Identifier: MIT */
#include "firmware/fault.h"

#include "drivers/cortex/cpu.h"
#include "drivers/fabric/adc.h"
#include "drivers/fabric/gate.h"
#include "firmware/current_loop.h"
#include "firmware/drive.h"
#include "firmware/speed_loop.h"

struct fault_snapshot fault_snapshot;

struct fault_text {
    const char *name;
    const char *hint;
};

static const struct fault_text fault_texts[FAULT_COUNT] = {
    [FAULT_NONE] = {"none", ""},
    [FAULT_OVERCURRENT_HARDWARE] = {"over-current (hardware)",
                                    "short circuit? motor cable, gains, comparator threshold"},
    [FAULT_GATE_DRIVER] = {"gate driver", "gate supply, driver temperature, bridge"},
    [FAULT_INTERLOCK] = {"interlock", "both sides of a phase were commanded on: dead time, PWM driver"},
    [FAULT_LOOP_OVERRUN] = {"loop overrun", "the current loop missed a sample: interrupt load, debugger halt"},
    [FAULT_ENCODER] = {"encoder", "encoder cable, supply, line receiver"},
    [FAULT_OVERCURRENT] = {"over-current", "current gains, i_trip_ma, load"},
    [FAULT_CURRENT_SUM] = {"current sum", "a current sensor, its gain, or a leak to earth"},
    [FAULT_OVERVOLTAGE] = {"over-voltage", "braking energy has nowhere to go: ramp_rpm_s, brake resistor, v_max_mv"},
    [FAULT_UNDERVOLTAGE] = {"under-voltage", "supply, its current limit, v_min_mv"},
    [FAULT_OVERSPEED] = {"over-speed", "overhauling load, encoder_counts, overspeed_rpm"},
    [FAULT_CURRENT_OFFSET] = {"current offset", "a current sensor's zero is out of range: amplifier, reference"},
    [FAULT_STALL] = {"stall", "the rotor is blocked, the load too heavy, or the encoder stands still"},
    [FAULT_LOOP_STOPPED] = {"loop stopped", "no end-of-conversion interrupts: fabric clock, CorePWM, ADC"},
    [FAULT_WATCHDOG] = {"watchdog reset", "the program hung or the refresh came late"},
    [FAULT_EXCEPTION] = {"processor exception", "'fault' shows the registers"},
    [FAULT_CLOCK] = {"clock", "clock ratios differ from drivers/board.h: Libero clock settings"},
    [FAULT_FABRIC] = {"fabric", "the FPGA does not carry the design of docs/fabric.md"},
};

static void take_snapshot(void)
{
    fault_snapshot.time_ms = drive.time_ms;
    fault_snapshot.state = drive.state;
    const struct adc_sample sample = adc_read();
    fault_snapshot.i_a_q15 = sample.ia_q15;
    fault_snapshot.i_b_q15 = sample.ib_q15;
    fault_snapshot.i_c_q15 = sample.ic_q15;
    fault_snapshot.i_d_q15 = current_loop.i_d_q15;
    fault_snapshot.i_q_q15 = current_loop.i_q_q15;
    fault_snapshot.vbus_q15 = sample.vbus_q15;
    fault_snapshot.speed_rpm_q4 = speed_loop.speed_rpm_q4;
    fault_snapshot.angle_u16 = current_loop_angle_u16();
    fault_snapshot.gate_status = gate_status();
}

void fault_raise(enum fault cause)
{
    gate_disable();
    const uint32_t mask = cpu_irq_save(); /* two callers must not both find it empty */
    if (drive.fault == FAULT_NONE) {
        drive.fault = cause;
        take_snapshot();
    }
    cpu_irq_restore(mask);
}

enum fault fault_from_gate(uint32_t gate_flags)
{
    if ((gate_flags & GATE_STATUS_OVERCURRENT) != 0u) {
        return FAULT_OVERCURRENT_HARDWARE;
    }
    if ((gate_flags & GATE_STATUS_DRIVER_FAULT) != 0u) {
        return FAULT_GATE_DRIVER;
    }
    if ((gate_flags & GATE_STATUS_INTERLOCK) != 0u) {
        return FAULT_INTERLOCK;
    }
    return (gate_flags & GATE_STATUS_LOOP_LOST) != 0u ? FAULT_LOOP_OVERRUN : FAULT_NONE;
}

void fault_forget(void)
{
    drive.fault = FAULT_NONE;
}

const char *fault_name(enum fault cause)
{
    return cause < FAULT_COUNT ? fault_texts[cause].name : "unknown";
}

const char *fault_hint(enum fault cause)
{
    return cause < FAULT_COUNT ? fault_texts[cause].hint : "";
}
