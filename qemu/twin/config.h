/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The twin's configuration file: one item a line, `#` starts a comment line.
 *
 *   trace PATH | csv PATH                                                         (trace.h: the same as text)
 *   can CHARDEV_ID bus|slcan | can_log PATH                                     (can_bus.h)
 *   progress PATH | seed N | end T_S | console CHARDEV_ID
 *   irqlog PATH                                                                   (irqlog.h)
 *   irqpath EXCEPTION PATH                                                        (irqpath.h)
 *   dwt cycles|instructions                                                       (what DWT_CYCCNT counts)
 *   time instructions|cycles                        (what moves it on: 8 ns an instruction, or 10 ns a cycle of the model)
 *   design OFFSET WORD [FIXED_BITS]                 (flash bits of SYSREG, from power-on on; the event flash_bits: later;
 *                                                    and which bits the design keeps the firmware from changing)
 *   wfi core|main_loop                                            (who moves time on in WFI, qemu_sleep.h; same results)
 *   watchdog WDOGLOAD                                              (of the design, watchdog.h; 64 ticks of 20 ns each)
 *   chip m2s010|m2s025                                           (chip.h: what traffic on FIC_0 does on the smaller one)
 *   fabric_wired core_reset_p|m2f|held|no_clock                    (chip.h: how the design has its reset, or what it lacks)
 *   cycles.KEY VALUE                                                              (docs/timing.md)
 *   envm PATH | envm.KEY VALUE                                                    (docs/settings.md)
 *   motor.KEY VALUE | load.KEY VALUE | inverter.KEY VALUE | sensor.KEY VALUE      (SI units)
 *   dump ADDRESS BYTES PATH                                                       (memory as it is at the end of the run)
 *   probe NAME ADDRESS TYPE SCALE                                                 (TYPE: s32 u32 s16 u16 s8 u8)
 *   event T_S KIND ARGUMENTS...                                                   (events.c)
 *   after PROBE=VALUE,VALUE... T_S KIND ARGUMENTS...      (T_S after the probe, given before, has had these values in turn)
 *   axis 1|2                                                                      (whose the lines from here on are)
 *
 * Without a line `axis` there is one. With `axis 2` the fabric has two, each with a motor, load, inverter and sensors, a trace
 * and probes of its own; an event that concerns the motor, or what is between it and the fabric, concerns that axis'. The event
 * `end` ends the run once each axis has had its own. All other lines and events are of the device and may stand under either.
 */
#ifndef TWIN_CONFIG_H
#define TWIN_CONFIG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "chip.h"
#include "cycles.h"
#include "envm.h"
#include "events.h"
#include "plant.h"

#define LATE_VALUES_MAX 4
#define CONFIG_AXES_MAX 2

struct flash_word {
    uint32_t offset, word, fixed;
};

struct probe {
    char *name;
    uint32_t address;
    unsigned bytes;
    bool is_signed;
    double scale;
};

/* A range of the guest's memory, written to a file when the run ends. */
struct dump {
    char *path;
    uint32_t address, bytes;
};

/* An event whose time depends on what the target does. */
struct late_event {
    size_t probe; /* of the axis that the event is of */
    double values[LATE_VALUES_MAX];
    size_t count, seen; /* of the values */
    struct event event; /* its time is counted from when the last value is seen */
};

/* What each motor has of its own. */
struct axis_config {
    char *trace_path, *csv_path; /* NULL if not given */
    struct plant_params plant;
    struct probe *probes;
    size_t probe_count;
};

struct config {
    struct axis_config axis[CONFIG_AXES_MAX];
    unsigned axes;                                                 /* of them */
    uint64_t seed;                                                 /* of the device; the plants' are drawn from it */
    char *progress_path, *irqlog_path, *irqpath_path, *console_id; /* NULL if not given */
    char *envm_path;                                               /* what the device keeps; NULL: nothing */
    char *live_path;                                               /* events of the moment come by it; likewise */
    char *bus_id, *bus_log_path;                                   /* likewise */
    char *can_id, *can_log_path;                                   /* likewise */
    bool can_slcan;
    char *fabric_path; /* library of the verilated RTL; NULL: the C models */
    double end_s;      /* 0: runs until QEMU is ended */
    uint32_t watchdog_load;
    struct chip_params chip;
    bool main_loop_wakes;
    bool count_instructions; /* what DWT_CYCCNT counts */
    bool time_by_cycles;
    struct flash_word *design;
    size_t design_count;
    struct cycles_params cycles;
    struct envm_params envm;
    unsigned irqpath_exception;
    struct dump *dumps;
    size_t dump_count;
    struct event *events; /* in order of time, equal times in order of the file */
    size_t event_count;
    struct late_event *late;
    size_t late_count;
};

/* Anything wrong ends the process with one line on stderr and status 1. With motor_only, the keys of inverter and
 * sensor may be missing. */
void config_load(struct config *config, const char *path, bool motor_only);

#endif
