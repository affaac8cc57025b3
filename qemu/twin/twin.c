/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The plugin: puts a SmartFusion2 board's fabric, watchdog and cycle counter around QEMU's emcraft-sf2, and a motor
 * behind the fabric.
 *
 *   qemu-system-arm -M emcraft-sf2 -icount shift=3,sleep=off -plugin twin.so,config=FILE ...
 */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "axes.h"
#include "can_bus.h"
#include "chip.h"
#include "config.h"
#include "console.h"
#include "core.h"
#include "cycles.h"
#include "dump.h"
#include "dwt.h"
#include "envm_board.h"
#include "gpio.h"
#include "irqlog.h"
#include "live.h"
#include "mmuart.h"
#include "qemu_api.h"
#include "random.h"
#include "scenario.h"
#include "serial_bus.h"
#include "sysreg.h"
#include "watchdog.h"

#define FABRIC_BYTES 0x1000u
#define TIMER_BASE   0x40004000u
#define PROGRESS_NS  50000000
#define ESRAM_BASE   0x20000000u
#define ESRAM_BYTES  0x10000u

static struct config config;
static struct watchdog watchdog;
static struct dwt dwt;
static struct mmuart_extension mmuart;
static struct gpio gpio;
static FILE *progress;
static enum reset_cause reset_cause = RESET_SOFT; /* of the reset that comes next */
static bool openocd_at_reset;                     /* and whether OpenOCD asks for it */
static bool fabric_sealed, fabric_hung;
static uint32_t fabric_last_read = SEALED_AT_ONCE; /* of a sealed fabric, the one that is still answered */
static bool started;

static struct vm_timer *watchdog_timer, *progress_timer, *end_timer;

static sim_ps present(void)
{
    return vm_now_ns() * SIM_PS_PER_NS;
}

static void reset_by(enum reset_cause cause)
{
    reset_cause = cause;
    vm_request_reset();
}

static void watchdog_bite(void)
{
    reset_by(RESET_WATCHDOG);
}

/* The board is without power for no time: what the core finds in RAM it has to take for nothing. */
static void power_returns(void)
{
    reset_by(RESET_POWER_ON);
}

/* Its driver for the eNVM works in all of the eSRAM, and puts nothing back. */
static void openocd_leaves(void)
{
    struct random r;
    random_seed(&r, config.seed);
    for (uint32_t address = ESRAM_BASE; address < ESRAM_BASE + ESRAM_BYTES; address += sizeof(uint64_t)) {
        const uint64_t left = random_u64(&r);
        vm_write_memory(address, &left, sizeof left);
    }
    sysreg_leave_as_openocd();
}

static void openocd(void)
{
    openocd_at_reset = true;
    reset_by(RESET_SOFT);
}

static void seal_fabric(bool sealed, uint32_t last_read)
{
    fabric_sealed = sealed;
    fabric_last_read = last_read;
}

static void hang_fabric(bool hangs)
{
    fabric_hung = hangs;
}

/* The fabric held in reset is the fabric as a reset leaves it, and nobody can change that. */
static void note_fabric_reset(bool was_held)
{
    if (chip_holds_fabric() != was_held) {
        axes_sync();
        axes_reset_fabric();
        axes_changed();
    }
}

static void note_bus_reset(void)
{
    if (sysreg_holds(SYSREG_MMUART1)) {
        serial_bus_reset();
    }
    can_bus_note_reset();
}

static void watchdog_rearm(void)
{
    if (watchdog.expires_at == SIM_NEVER) {
        vm_timer_stop(watchdog_timer);
    } else {
        vm_timer_at(watchdog_timer, sim_to_ns_up(watchdog.expires_at));
    }
}

static void put_back(void)
{
    bool was_held = chip_holds_fabric();
    sysreg_put_back();
    watchdog_switched(&watchdog, present());
    watchdog_rearm();
    note_fabric_reset(was_held);
    note_bus_reset();
}

/* Before each access. The time until the watchdog ends one that hangs is left out: nothing would happen in it. */
static void fabric_accessed(bool write, uint32_t offset)
{
    if (fabric_sealed) {
        if (write || offset != fabric_last_read) {
            fprintf(stderr, "mssfoc twin: the sealed fabric is %s at offset 0x%x\n", write ? "written" : "read",
                    (unsigned)offset);
            exit(1);
        }
        fabric_last_read = SEALED_AT_ONCE;
    }
    if (fabric_hung || chip_fabric_hangs()) {
        watchdog_bite();
    }
    if (chip_traffic_puts_back()) {
        put_back();
    }
}

static uint32_t fabric_read(void *unused, uint32_t offset)
{
    (void)unused;
    fabric_accessed(false, offset);
    if (chip_holds_fabric()) {
        return 0;
    }
    return axes_read(offset);
}

static void fabric_write(void *unused, uint32_t offset, uint32_t value)
{
    (void)unused;
    fabric_accessed(true, offset);
    if (chip_holds_fabric()) {
        return;
    }
    axes_write(offset, value);
}

/* ---- watchdog ---- */

static void watchdog_expired(void *unused)
{
    (void)unused;
    watchdog.reset();
}

static uint32_t watchdog_region_read(void *unused, uint32_t offset)
{
    (void)unused;
    return watchdog_read(&watchdog, offset, present());
}

static void watchdog_region_write(void *unused, uint32_t offset, uint32_t value)
{
    (void)unused;
    watchdog_write(&watchdog, offset, value, present());
    watchdog_rearm();
}

static void watchdog_control_write(void *word, uint32_t offset, uint32_t value)
{
    sysreg_write(word, offset, value);
    watchdog_switched(&watchdog, present());
    watchdog_rearm();
}

/* ---- pins of the MSS ---- */

static void pins_write(void *pins, uint32_t offset, uint32_t value)
{
    gpio_write(pins, offset, value);
    serial_bus_drive(gpio_drives(pins, SERIAL_BUS_PIN));
}

/* ---- registers that QEMU has otherwise, or not at all ---- */

static uint32_t fixed_read(void *word, uint32_t offset)
{
    (void)offset;
    return *(const uint32_t *)word;
}

static void fixed_write(void *word, uint32_t offset, uint32_t value)
{
    (void)word;
    (void)offset;
    (void)value;
}

static void map_fixed_words(void)
{
    static uint32_t r2p1 = 0x412FC231u, two_timers = 0;
    static const struct vm_region cpuid = {"mssfoc-cpuid", 0xE000ED00u, 4, 4, fixed_read, fixed_write, &r2p1};
    static const struct vm_region mode = {"mssfoc-tim64-mode", TIMER_BASE + 0x54, 4,          4,
                                          fixed_read,          fixed_write,       &two_timers};
    vm_map_private(&cpuid);
    vm_map(&mode);
}

/* QEMU leaves its timers running through a reset of the device: control, count, interrupt of both. */
static void reset_timers(void)
{
    static const uint32_t none = 0, clear = 1;
    for (uint32_t timer = TIMER_BASE; timer <= TIMER_BASE + 0x18; timer += 0x18) {
        vm_write_memory(timer + 0x0C, &none, sizeof none);
        vm_write_memory(timer + 0x04, &none, sizeof none);
        vm_write_memory(timer + 0x10, &clear, sizeof clear);
    }
}

static uint32_t bus_read(void *unused, uint32_t offset)
{
    return sysreg_holds(SYSREG_MMUART1) ? 0 : serial_bus_read(unused, offset);
}

static void bus_write(void *unused, uint32_t offset, uint32_t value)
{
    if (!sysreg_holds(SYSREG_MMUART1)) {
        serial_bus_write(unused, offset, value);
    }
}

/* ---- reset: the MSS resets the fabric with it, however that is wired ---- */

static void soft_reset_write(void *word, uint32_t offset, uint32_t value)
{
    bool was_held = chip_holds_fabric();
    sysreg_write(word, offset, value);
    note_fabric_reset(was_held);
    note_bus_reset();
}

static void system_reset(void *unused)
{
    (void)unused;
    if (!started) {
        return; /* power-on, which attach() has set up */
    }
    axes_sync();
    axes_reset_fabric();
    envm_board_reset();
    sysreg_reset(reset_cause);
    if (openocd_at_reset) {
        openocd_leaves();
    }
    openocd_at_reset = false;
    reset_timers();
    reset_cause = RESET_SOFT;
    vm_set_interrupt(SYSREG_ECC_IRQ, false);
    memset(&mmuart, 0, sizeof mmuart);
    gpio_reset(&gpio, sysreg_value(SYSREG_GPIO_DEF));
    serial_bus_reset();
    can_bus_reset();
    dwt_reset(&dwt);
    core_reset();
    watchdog_reload(&watchdog, axes_plant(0)->now);
    watchdog_rearm();
    axes_forget_lines();
    axes_changed();
}

/* ---- the end, and what is written on the way ---- */

static void flush(void)
{
    axes_flush();
    irqlog_flush();
    serial_bus_flush();
    can_bus_flush();
}

static void report_progress(void *unused)
{
    (void)unused;
    axes_sync();
    axes_report(progress);
    fflush(progress);
    flush();
    axes_changed();
    vm_timer_at(progress_timer, vm_now_ns() + PROGRESS_NS);
}

static void finish(void)
{
    static bool finished;
    if (finished) {
        return;
    }
    finished = true;
    envm_board_keep();
    axes_complete_rows();
    flush();
    dump_write(config.dumps, config.dump_count);
}

static void end_of_run(void *unused)
{
    (void)unused;
    axes_sync();
    finish();
    vm_end();
}

/* QEMU aborts when the guest locks up; the rows so far are the evidence. */
static void aborted(int number)
{
    flush();
    signal(number, SIG_DFL);
    raise(number);
}

/* The run has ended when all axes have. */
static void end_axis(unsigned axis)
{
    static unsigned ended;
    ended |= 1u << axis;
    if (ended == (1u << config.axes) - 1) {
        end_of_run(NULL);
    }
}

__attribute__((noreturn)) static void out_of_memory(void)
{
    fputs("mssfoc twin: out of memory\n", stderr);
    exit(1);
}

/* ---- putting it together ---- */

static void map_devices(void)
{
    static const struct vm_region fabric = {"mssfoc-fabric", AXES_FABRIC_BASE, FABRIC_BYTES, 4,
                                            fabric_read,     fabric_write,     NULL};
    static const struct vm_region dog = {"mssfoc-watchdog",     WATCHDOG_BASE, WATCHDOG_BYTES, 4, watchdog_region_read,
                                         watchdog_region_write, NULL};
    static const struct vm_region uart = {
        "mssfoc-mmuart", MMUART_EXTENSION_BASE, MMUART_EXTENSION_BYTES, 1, mmuart_read, mmuart_write, &mmuart};
    static const struct vm_region pins = {"mssfoc-gpio", GPIO_BASE, GPIO_BYTES, 4, gpio_read, pins_write, &gpio};
    static const struct vm_region bus = {
        "mssfoc-mmuart1", SERIAL_BUS_BASE, SERIAL_BUS_BYTES, 1, bus_read, bus_write, NULL};
    static const struct vm_region cycles = {"mssfoc-dwt", DWT_BASE, DWT_BYTES, 4, dwt_read, dwt_write, &dwt};
    static struct vm_region words[SYSREG_WORDS];

    vm_map(&fabric);
    vm_map(&dog);
    vm_map(&uart);
    vm_map(&pins);
    vm_map(&bus);
    can_bus_map();
    vm_map_private(&cycles);
    envm_board_map(&config.envm, config.seed, power_returns);
    for (int n = 0; n < SYSREG_WORDS; n++) {
        void (*write)(void *, uint32_t, uint32_t) = sysreg_words[n].offset == SYSREG_SOFT_RESET_CR ? soft_reset_write
                                                    : sysreg_words[n].offset == SYSREG_WDOG_CR ? watchdog_control_write
                                                                                               : sysreg_write;
        words[n] = (struct vm_region){"mssfoc-sysreg", SYSREG_BASE + sysreg_words[n].offset, 4, 4, sysreg_read, write,
                                      &sysreg_words[n]};
        vm_map(&words[n]);
    }
}

static void design_registers(void)
{
    for (size_t n = 0; n < config.design_count; n++) {
        if (!sysreg_design(config.design[n].offset, config.design[n].word)) {
            fprintf(stderr, "mssfoc twin: design: SYSREG has no register at offset 0x%x here\n",
                    (unsigned)config.design[n].offset);
            exit(1);
        }
        sysreg_fix(config.design[n].offset, config.design[n].fixed);
    }
}

static void attach(void)
{
    map_devices();
    map_fixed_words();
    vm_on_reset(system_reset, NULL);
    sysreg_design(SYSREG_WDOGLOAD, config.watchdog_load);
    design_registers();
    chip_init(&config.chip, config.seed);
    sysreg_reset(RESET_POWER_ON);
    gpio_reset(&gpio, sysreg_value(SYSREG_GPIO_DEF));
    dwt_init(&dwt, config.count_instructions ? cycles_instructions : core_cycles);
    if (!config.main_loop_wakes) {
        vm_sleep_alone();
    }
}

static void start(void)
{
    started = true;
    envm_board_start(config.envm_path);
    axes_start();
    watchdog_timer = vm_timer_new(watchdog_expired, NULL);
    watchdog_init(&watchdog, watchdog_bite);
    watchdog_rearm();
    if (config.console_id) {
        console_attach(config.console_id);
    }
    serial_bus_open(config.bus_id, config.bus_log_path);
    can_bus_open(config.can_id, config.can_slcan, config.can_log_path);
    const struct scenario_board board = {
        axes_plant, axes_sync, axes_changed, axes_delay_interrupt, axes_block_interrupt, envm_board_power_cut,
        reset_by,   openocd,   put_back,     vm_set_interrupt,     seal_fabric,          hang_fabric,
        end_axis};
    if (!scenario_start(&config, &board)) {
        out_of_memory();
    }
    if (config.live_path) {
        live_start(config.live_path);
    }
    if (progress) {
        progress_timer = vm_timer_new(report_progress, NULL);
        vm_timer_at(progress_timer, PROGRESS_NS);
    }
    if (config.end_s > 0) {
        end_timer = vm_timer_new(end_of_run, NULL);
        vm_timer_at(end_timer, sim_to_ns_up(sim_from_s(config.end_s)));
    }
}

static void open_outputs(void)
{
    dump_open(config.dumps, config.dump_count);
    if (config.progress_path && !(progress = fopen(config.progress_path, "w"))) {
        fprintf(stderr, "mssfoc twin: progress %s: %s\n", config.progress_path, strerror(errno));
        exit(1);
    }
}

__attribute__((visibility("default"))) int qemu_plugin_install(uint64_t id, const void *info, int argc, char **argv);

int qemu_plugin_install(uint64_t id, const void *info, int argc, char **argv)
{
    static const char option[] = "config=";
    (void)info;
    if (argc != 1 || strncmp(argv[0], option, strlen(option)) != 0) {
        fputs("mssfoc twin: expected -plugin twin.so,config=FILE\n", stderr);
        exit(1);
    }
    vm_resolve();
    config_load(&config, argv[0] + strlen(option), false);
    axes_init(&config);
    open_outputs();
    signal(SIGABRT, aborted);
    vm_on_exit(id, finish);
    core_watch(id, &config);
    vm_on_attach(id, attach, start);
    return 0;
}
