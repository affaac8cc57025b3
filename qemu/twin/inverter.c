/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "inverter.h"

#include <math.h>
#include <string.h>

#include "circuit.h"
#include "coss.h"
#include "terminals.h"

#define KEY(field, lo, hi, init) ((struct config_key){#field, offsetof(struct inverter_params, field), lo, hi, init})
const struct config_key inverter_keys[] = {
    KEY(vbus_v, 0, 2000, CONFIG_REQUIRED),
    KEY(supply_sinks, 0, 1, 1),
    KEY(supply_resistance_ohm, 0, 1e3, 0.05),
    KEY(supply_inductance_h, 0, 1, 0),
    KEY(supply_r2_ohm, 0, 1e3, 0),
    KEY(supply_c2_f, 0, 1e6, 0),
    KEY(rectifier_hz, 0, 1e3, 0),
    KEY(bus_capacitance_f, 1e-7, 10, 470e-6),
    KEY(bus_esr_ohm, 0, 100, 0),
    KEY(chopper_ohm, 0, 1e4, 0),
    KEY(chopper_on_v, 0, 4000, 0),
    KEY(chopper_off_v, 0, 4000, 0),
    KEY(r_on_ohm, 1e-5, 10, 0.005),
    KEY(switch_v, 0, 10, 0),
    KEY(diode_v, 0, 5, 0.8),
    KEY(diode_ohm, 0, 10, 0),
    KEY(coss_c, 0, 1e-3, 0),
    KEY(switching_s, 0, 1e-5, 0),
    KEY(in_en, 0, 1, 0),
    KEY(turn_on_delay_s, 0, 1e-5, 0),
    KEY(turn_off_delay_s, 0, 1e-5, 0),
    KEY(oc_trip_a, 1e-3, 1e5, CONFIG_REQUIRED),
    KEY(oc_blanking_s, 0, 1e-4, 0),
    KEY(oc_delay_s, 0, 1e-4, 0),
    CONFIG_KEYS_END,
};
#undef KEY

static bool is_flag(double value)
{
    return value == 0 || value == 1;
}

const char *inverter_mismatch(const struct inverter_params *p)
{
    bool source_impedance = p->supply_resistance_ohm > 0 || p->supply_inductance_h > 0;
    bool parts = p->bus_esr_ohm > 0 || p->chopper_ohm > 0 || p->rectifier_hz > 0 || p->supply_c2_f > 0;
    if (!is_flag(p->supply_sinks)) {
        return "supply_sinks is 0 or 1";
    }
    if (!is_flag(p->in_en)) {
        return "in_en is 0 or 1";
    }
    if ((p->supply_r2_ohm > 0) != (p->supply_c2_f > 0)) {
        return "supply_r2_ohm and supply_c2_f go together";
    }
    if (parts && !source_impedance) {
        return "bus_esr_ohm, chopper_ohm, rectifier_hz, supply_c2_f need a supply_resistance_ohm or "
               "supply_inductance_h";
    }
    if (p->chopper_ohm > 0 && p->chopper_on_v > 0 &&
        !(p->vbus_v < p->chopper_off_v && p->chopper_off_v <= p->chopper_on_v)) {
        return "a chopper with levels needs vbus_v < chopper_off_v <= chopper_on_v";
    }
    if (p->coss_c > 0 && p->vbus_v == 0) {
        return "coss_c needs a vbus_v";
    }
    return NULL;
}

void inverter_init(struct inverter *inv, const struct inverter_params *p)
{
    memset(inv, 0, sizeof *inv);
    inv->p = *p;
    inv->bus_v = p->vbus_v;
    inv->node_f = p->vbus_v > 0 ? 2 * p->coss_c / p->vbus_v : 0;
    inv->short_from = -1;
    supply_init(&inv->supply, p);
    comparators_init(&inv->comparators);
    for (int n = 0; n < 6; n++) {
        inv->switch_at[n] = SIM_NEVER;
    }
    for (int k = 0; k < 3; k++) {
        inv->leg[k] = LEG_BLOCKED;
        inv->feeds[k] = k;
    }
}

/* ---- switches ---- */

/* Edges may be told ahead of the physics. One that turns a switch off anyway must not keep it on when all are turned off
 * at an earlier time. */
static void bring_forward(struct inverter *inv, int n, bool on, sim_ps now)
{
    if (!on && (inv->conduct >> n) & 1) {
        sim_ps off_at = now + sim_from_s(inv->p.turn_off_delay_s);
        inv->switch_at[n] = off_at < inv->switch_at[n] ? off_at : inv->switch_at[n];
    }
}

void inverter_command(struct inverter *inv, unsigned gates, sim_ps now)
{
    for (int n = 0; n < 6; n++) {
        bool on = (gates >> n) & 1;
        if (on == ((inv->gates >> n) & 1)) {
            bring_forward(inv, n, on, now);
            continue;
        }
        /* A gate that returns before the switch has followed cancels the change: too short a pulse does nothing. */
        bool conducts = (inv->conduct >> n) & 1;
        double delay_s = on ? inv->p.turn_on_delay_s : inv->p.turn_off_delay_s;
        inv->switch_at[n] = on == conducts ? SIM_NEVER : now + sim_from_s(delay_s);
    }
    inv->gates = gates;
}

sim_ps inverter_next_switch(const struct inverter *inv)
{
    sim_ps next = SIM_NEVER;
    for (int n = 0; n < 6; n++) {
        next = inv->switch_at[n] < next ? inv->switch_at[n] : next;
    }
    return next;
}

/* A switch that takes over a forward current, or gives it up, has voltage and current together for a moment. Its heat comes
 * out of the bus; the terminal sees nothing of it. */
static void switching_loss(struct inverter *inv, int k, bool high, bool low)
{
    double i_a = inv->leg_a[k], before_v = inv->supply.cap_v;
    bool on = (high && !low && i_a > 0) || (low && !high && i_a < 0);
    bool off = !high && !low && ((inv->leg[k] == LEG_HIGH && i_a > 0) || (inv->leg[k] == LEG_LOW && i_a < 0));
    if (on || off) {
        double charge_as = fabs(i_a) * inv->p.switching_s / 2;
        inv->energy_supply_j += supply_take(&inv->supply, &inv->p, charge_as);
        double drawn_j = charge_as * (before_v + inv->supply.cap_v) / 2;
        inv->energy_bridge_j += drawn_j;
        inv->energy_switching_j += drawn_j;
    }
}

static void follow_switches(struct inverter *inv, int k)
{
    bool high = inv->conduct & GATE_HIGH(k);
    bool low = inv->conduct & GATE_LOW(k);
    switching_loss(inv, k, high, low);
    if (high || low) {
        coss_enter(inv, k, high && low ? LEG_BOTH : (high ? LEG_HIGH : LEG_LOW));
    } else if (inv->leg[k] < LEG_JUST_OFF) {
        coss_enter(inv, k, LEG_JUST_OFF);
    }
}

void inverter_switch(struct inverter *inv, sim_ps now)
{
    unsigned before = inv->conduct;
    for (int n = 0; n < 6; n++) {
        if (inv->switch_at[n] <= now) {
            inv->switch_at[n] = SIM_NEVER;
            inv->conduct ^= 1u << n;
        }
    }
    for (int k = 0; k < 3; k++) {
        unsigned both = GATE_HIGH(k) | GATE_LOW(k);
        if ((inv->conduct ^ before) & both) {
            follow_switches(inv, k);
        }
        if (inv->conduct & ~before & both) {
            comparators_turn_on(inv, k, now);
        }
    }
}

/* ---- wiring ---- */

void inverter_leg_currents(const struct inverter *inv, const struct motor *motor, double i_a[3])
{
    terminals_currents(inv, motor, i_a);
    if (inv->short_from >= 0) {
        double i_motor_a[3] = {i_a[0], i_a[1], i_a[2]};
        struct circuit c;
        circuit_build_now(inv, &c);
        circuit_leg_currents(inv, &c, i_motor_a, i_a);
    }
}

/* Off legs look for their diodes anew when the wiring changes. */
static void rewire(struct inverter *inv)
{
    for (int k = 0; k < 3; k++) {
        if (inv->leg[k] >= LEG_JUST_OFF) {
            coss_enter(inv, k, LEG_JUST_OFF);
        }
    }
}

void inverter_short(struct inverter *inv, int from, int to, double r_ohm)
{
    rewire(inv);
    inv->short_from = from;
    inv->short_to = to;
    inv->short_ohm = r_ohm;
}

void inverter_short_off(struct inverter *inv)
{
    rewire(inv);
    inv->short_from = -1;
}

void inverter_open_wire(struct inverter *inv, int phase, bool open)
{
    inv->wire_open[phase] = open;
}

void inverter_swap_wires(struct inverter *inv, int one, int other)
{
    inverter_swap_off(inv);
    inv->feeds[one] = other;
    inv->feeds[other] = one;
}

void inverter_chop(struct inverter *inv, bool on)
{
    inv->supply.chopper_asked = on;
}

void inverter_chopper(struct inverter *inv, bool enabled)
{
    inv->supply.chopper_enabled = enabled;
}

void inverter_swap_off(struct inverter *inv)
{
    rewire(inv);
    for (int k = 0; k < 3; k++) {
        inv->feeds[k] = k;
    }
}
