/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "scenario.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "can_bus.h"
#include "console.h"
#include "qemu_api.h"
#include "serial_bus.h"
#include "sysreg.h"

#define TURN_RAD 6.283185307179586

static struct scenario_board board;
static struct event *queue, *next, *end; /* what is to come, in order of time; with room for all late events */
static struct late_event *late;
static size_t late_count;
static unsigned axes;
static struct vm_timer *timer;

static struct plant *plant_of(const struct event *e)
{
    return board.plant(e->axis);
}

static void disturb_motor(const struct event *e, struct motor *m)
{
    switch (e->kind) {
    case EVENT_LOAD:
        m->load_nm = e->number;
        break;
    case EVENT_LOAD_FAN:
        m->load.fan_nms2 = e->number;
        break;
    case EVENT_LOAD_COULOMB:
        m->load.coulomb_nm = e->number;
        break;
    case EVENT_LOAD_HOIST:
        m->hoist_nm = e->number;
        break;
    case EVENT_WINDING_SHORT:
        if (e->on) {
            motor_short_winding(m, e->phase, e->fraction, e->number);
        } else {
            motor_mend_winding(m);
        }
        break;
    case EVENT_LOCK:
        motor_lock(m, e->on);
        break;
    case EVENT_SPIN:
        motor_spin(m, e->number);
        break;
    default:
        motor_release(m);
        break;
    }
}

static void disturb_inverter(const struct event *e, struct inverter *inv)
{
    switch (e->kind) {
    case EVENT_SUPPLY_V:
        inv->p.vbus_v = e->number;
        break;
    case EVENT_SUPPLY_SINKS:
        inv->p.supply_sinks = e->on;
        break;
    case EVENT_PHASE_OPEN:
        inverter_open_wire(inv, e->phase, e->on);
        break;
    case EVENT_PHASE_SWAP:
        if (e->on) {
            inverter_swap_wires(inv, e->phase, e->other_phase);
        } else {
            inverter_swap_off(inv);
        }
        break;
    case EVENT_CHOPPER:
        inverter_chopper(inv, e->on);
        break;
    default:
        if (e->on) {
            inverter_short(inv, e->phase, e->other_phase, e->number);
        } else {
            inverter_short_off(inv);
        }
        break;
    }
}

static void disturb_sensor(const struct event *e, struct current_sensor *sensor)
{
    switch (e->kind) {
    case EVENT_SENSOR_ADD:
        sensor->add_a = e->number;
        break;
    case EVENT_SENSOR_GAIN:
        sensor->gain = e->number;
        break;
    case EVENT_SENSOR_OFFSET:
        sensor->offset_lsb = e->number;
        break;
    default:
        sensor->stuck_code = e->on ? (int)e->number : -1;
        break;
    }
}

static void disturb_hall(const struct event *e, struct hall *h)
{
    switch (e->kind) {
    case EVENT_HALL_OPEN:
        hall_open_wire(h, e->phase, e->on);
        break;
    case EVENT_HALL_INVERT:
        hall_invert_wire(h, e->phase, e->on);
        break;
    default:
        hall_swap_wires(h, e->on ? e->phase : 0, e->on ? e->other_phase : 0);
        break;
    }
}

/* The direction stands still and counts from where the rotor's d axis is now. */
static void inject(const struct event *e, const struct motor *m, struct sensors *sensors)
{
    sensors_inject(sensors, e->number, e->second, m->p.pole_pairs * m->theta_rad + e->third, e->t_s);
}

static void disturb_encoder(const struct event *e)
{
    struct fabric *f = plant_of(e)->fabric;
    switch (e->kind) {
    case EVENT_ENCODER_CUT:
        f->ops->disturb_cable(f, CABLE_CUT, e->on);
        break;
    case EVENT_ENCODER_FREEZE:
        f->ops->disturb_cable(f, CABLE_FROZEN, e->on);
        break;
    case EVENT_ENCODER_ILLEGAL:
        f->ops->disturb_cable(f, CABLE_ILLEGAL, 0);
        break;
    case EVENT_ENCODER_REVERSE:
        f->ops->disturb_cable(f, CABLE_REVERSED, e->on);
        break;
    default:
        f->ops->disturb_cable(f, CABLE_SLIP, (int64_t)e->number);
        break;
    }
}

static void show_temperature(const struct event *e, struct thermometer *thermometer)
{
    if (e->on) {
        thermometer_hold(thermometer, e->number);
    } else {
        thermometer_let_go(thermometer);
    }
}

static void poke(const struct event *e)
{
    uint8_t bytes[4] = {(uint8_t)e->word, (uint8_t)(e->word >> 8), (uint8_t)(e->word >> 16), (uint8_t)(e->word >> 24)};
    if (e->kind == EVENT_POKE) {
        vm_write_memory(e->address, bytes, 4);
    } else {
        vm_write_rom(e->address, bytes, 2);
    }
}

static uint32_t read_word(uint32_t address)
{
    uint8_t b[4];
    vm_read_memory(address, b, sizeof b);
    return b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

/* By how much the d axis is ahead of the angle that stands at the second address, 2^32 a turn. */
static void poke_offset(struct event e)
{
    const struct motor *m = &plant_of(&e)->motor;
    const double turns = m->p.pole_pairs * m->theta_rad / TURN_RAD;
    const uint32_t axis = (uint32_t)(int64_t)llround((turns - floor(turns)) * 4294967296.0);
    e.kind = EVENT_POKE;
    e.word = axis - read_word(e.word);
    poke(&e);
}

/* A pin that all axes have. */
static void stop_all(enum gate_latch which, bool stops)
{
    for (unsigned k = 0; k < axes; k++) {
        plant_stop(board.plant(k), which, stops);
    }
}

static void disguise_all(bool other)
{
    for (unsigned k = 0; k < axes; k++) {
        struct fabric *f = board.plant(k)->fabric;
        f->ops->disguise(f, other);
    }
}

/* What happens to the MSS. */
static void disturb_device(const struct event *e)
{
    switch (e->kind) {
    case EVENT_FLASH_BITS:
        sysreg_design(e->address, e->word);
        break;
    case EVENT_PLL_LOST:
        sysreg_set_lock(SYSREG_MSS_PLL, !e->on);
        board.interrupt(SYSREG_MSS_PLL_IRQ, e->on);
        break;
    case EVENT_FABRIC_PLL_LOST:
        sysreg_set_lock(SYSREG_FABRIC_PLL, !e->on);
        stop_all(GATE_CLOCK_LOST, e->on);
        board.interrupt(SYSREG_FABRIC_PLL_IRQ, e->on);
        break;
    case EVENT_MEMORY_ERROR:
        board.interrupt(SYSREG_ECC_IRQ, sysreg_memory_error(e->on));
        break;
    default:
        board.put_back();
        break;
    }
}

static void play(const struct event *e)
{
    switch (e->kind) {
    case EVENT_CONSOLE:
        console_type(e->text);
        break;
    case EVENT_KEYS:
        console_keys(e->text);
        break;
    case EVENT_BUS:
        serial_bus_send(e->text);
        break;
    case EVENT_CAN:
        can_bus_send(e->text);
        break;
    case EVENT_CAN_BREAK:
        can_bus_break(e->word);
        break;
    case EVENT_CAN_CUT:
        can_bus_cut(e->on);
        break;
    case EVENT_LOAD:
    case EVENT_LOAD_FAN:
    case EVENT_LOAD_COULOMB:
    case EVENT_LOAD_HOIST:
    case EVENT_WINDING_SHORT:
    case EVENT_LOCK:
    case EVENT_SPIN:
    case EVENT_SPIN_OFF:
        disturb_motor(e, &plant_of(e)->motor);
        break;
    case EVENT_SUPPLY_V:
    case EVENT_SUPPLY_SINKS:
    case EVENT_SHORT:
    case EVENT_PHASE_OPEN:
    case EVENT_PHASE_SWAP:
    case EVENT_CHOPPER:
        disturb_inverter(e, &plant_of(e)->inverter);
        break;
    case EVENT_SENSOR_ADD:
    case EVENT_SENSOR_GAIN:
    case EVENT_SENSOR_OFFSET:
    case EVENT_SENSOR_STUCK:
        disturb_sensor(e, &plant_of(e)->sensors.current[e->phase]);
        break;
    case EVENT_SENSOR_ORDER:
        memcpy(plant_of(e)->sensors.shows, e->order, sizeof e->order);
        break;
    case EVENT_SENSOR_SINE:
        inject(e, &plant_of(e)->motor, &plant_of(e)->sensors);
        break;
    case EVENT_DRIVER_FAULT:
        plant_stop(plant_of(e), GATE_DRIVER_FAULT, e->on);
        break;
    case EVENT_STO:
        stop_all(e->phase == 0 ? GATE_STO_A : GATE_STO_B, e->on);
        break;
    case EVENT_ENCODER_CUT:
    case EVENT_ENCODER_FREEZE:
    case EVENT_ENCODER_ILLEGAL:
    case EVENT_ENCODER_SLIP:
    case EVENT_ENCODER_REVERSE:
        disturb_encoder(e);
        break;
    case EVENT_HALL_OPEN:
    case EVENT_HALL_INVERT:
    case EVENT_HALL_SWAP:
        disturb_hall(e, &plant_of(e)->sensors.hall);
        break;
    case EVENT_TEMPERATURE:
        show_temperature(e, &plant_of(e)->thermometer);
        break;
    case EVENT_IRQ_DELAY:
        board.delay_interrupt(e->axis, sim_from_s(e->number));
        break;
    case EVENT_IRQ_BLOCK:
        board.block_interrupt(e->axis, e->on);
        break;
    case EVENT_WATCHDOG_RESET:
        board.reset(RESET_WATCHDOG);
        break;
    case EVENT_LOCKUP_RESET:
        board.reset(RESET_LOCKUP);
        break;
    case EVENT_SOFT_RESET:
        board.reset(RESET_SOFT);
        break;
    case EVENT_USER_RESET:
        board.reset(RESET_USER);
        break;
    case EVENT_OPENOCD:
        board.openocd();
        break;
    case EVENT_POWER_CUT:
        board.power_cut();
        break;
    case EVENT_END:
        board.end(e->axis);
        break;
    case EVENT_FABRIC_OTHER:
        disguise_all(e->on);
        break;
    case EVENT_FABRIC_SEALED:
        board.seal_fabric(e->on, SEALED_AT_ONCE);
        break;
    case EVENT_FABRIC_SEALED_BEHIND:
        board.seal_fabric(true, e->word);
        break;
    case EVENT_FABRIC_HANGS:
        board.hang_fabric(e->on);
        break;
    case EVENT_FLASH_BITS:
    case EVENT_PLL_LOST:
    case EVENT_FABRIC_PLL_LOST:
    case EVENT_MEMORY_ERROR:
    case EVENT_PUT_BACK:
        disturb_device(e);
        break;
    case EVENT_POKE:
    case EVENT_POKE_ROM:
        poke(e);
        break;
    case EVENT_POKE_OFFSET:
        poke_offset(*e);
        break;
    }
}

static void wait_for_next(void)
{
    if (next < end) {
        vm_timer_at(timer, sim_to_ns_up(sim_from_s(next->t_s)));
    }
}

static void play_due(void *unused)
{
    (void)unused;
    board.sync();
    while (next < end && sim_to_ns_up(sim_from_s(next->t_s)) <= vm_now_ns()) {
        play(next++);
    }
    board.changed();
    wait_for_next();
}

void scenario_play_now(const struct event *event)
{
    board.sync();
    play(event);
    board.changed();
}

static void enqueue(struct event e)
{
    struct event *place = end++;
    for (; place > next && place[-1].t_s > e.t_s; place--) {
        *place = place[-1];
    }
    *place = e;
    wait_for_next();
}

void scenario_look(unsigned axis, const double *probe_values, double now_s)
{
    for (struct late_event *l = late; l < late + late_count; l++) {
        bool shown = l->event.axis == axis && l->seen < l->count && probe_values[l->probe] == l->values[l->seen];
        if (shown && ++l->seen == l->count) {
            struct event e = l->event;
            e.t_s += now_s;
            enqueue(e);
        }
    }
}

bool scenario_start(const struct config *config, const struct scenario_board *the_board)
{
    board = *the_board;
    axes = config->axes;
    late = config->late;
    late_count = config->late_count;
    queue = calloc(config->event_count + late_count + 1, sizeof *queue);
    if (!queue) {
        return false;
    }
    memcpy(queue, config->events, config->event_count * sizeof *queue);
    next = queue;
    end = queue + config->event_count;
    timer = vm_timer_new(play_due, NULL);
    wait_for_next();
    return true;
}
