/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Lines of events, and parameters of the power stage that do not go together. */
#include "events.h"

#include <stdio.h>
#include <string.h>

#include "bench.h"
#include "check.h"

static void accepted(const char *line, enum event_kind kind, bool on, int phase, int other_phase)
{
    struct event e = {.phase = -1, .other_phase = -1};
    const char *wrong = event_parse(line, &e);
    char text[100];
    snprintf(text, sizeof text, "'%s' is understood", line);
    check_true(text, wrong == NULL && e.kind == kind && e.on == on && e.phase == phase && e.other_phase == other_phase);
}

static void refused(const char *line)
{
    struct event e = {0};
    char text[100];
    snprintf(text, sizeof text, "'%s' is refused, with its usage", line);
    const char *wrong = event_parse(line, &e);
    check_true(text, wrong != NULL && strstr(wrong, "expected: ") != NULL);
}

static void lines(void)
{
    accepted("phase_swap AB", EVENT_PHASE_SWAP, true, 0, 1);
    accepted("phase_swap BC", EVENT_PHASE_SWAP, true, 1, 2);
    accepted("phase_swap CA", EVENT_PHASE_SWAP, true, 2, 0);
    accepted("phase_swap off", EVENT_PHASE_SWAP, false, -1, -1);
    refused("sensor_order");
    refused("sensor_order AB");
    refused("sensor_order ABB");
    refused("sensor_order ABCA");
    struct event order;
    check_true("sensor_order CAB", event_parse("sensor_order CAB", &order) == NULL && order.order[0] == 2 &&
                                       order.order[1] == 0 && order.order[2] == 1);
    accepted("hall_swap CA", EVENT_HALL_SWAP, true, 2, 0);
    accepted("hall_open B 1", EVENT_HALL_OPEN, true, 1, -1);
    accepted("hall_invert C 0", EVENT_HALL_INVERT, false, 2, -1);
    accepted("chopper 1", EVENT_CHOPPER, true, -1, -1);
    accepted("chopper 0", EVENT_CHOPPER, false, -1, -1);
    accepted("encoder_reverse 1", EVENT_ENCODER_REVERSE, true, -1, -1);
    accepted("temperature_c -20.5", EVENT_TEMPERATURE, true, -1, -1);
    accepted("temperature_c off", EVENT_TEMPERATURE, false, -1, -1);
    refused("temperature_c 301");
    refused("temperature_c");
    refused("encoder_reverse off");
    refused("phase_swap");
    refused("phase_swap AC");
    refused("phase_swap AB BC");
    refused("chopper 2");
    refused("chopper off");
}

static void mismatch(const char *name, const struct inverter_params *p, const char *key)
{
    const char *wrong = inverter_mismatch(p);
    check_true(name, wrong != NULL && strstr(wrong, key) != NULL);
}

static void parameters(void)
{
    struct inverter_params good = bench_inverter, p = good;
    check_true("the bench's go together", inverter_mismatch(&good) == NULL);
    p.supply_sinks = 0.5;
    mismatch("half a sink", &p, "supply_sinks");
    p = good;
    p.supply_r2_ohm = 0.1;
    mismatch("a slow branch without its capacitor", &p, "supply_c2_f");
    p = good;
    p.supply_resistance_ohm = 0;
    check_true("an ideal source alone", inverter_mismatch(&p) == NULL);
    p.bus_esr_ohm = 0.1;
    mismatch("an ideal source beside a capacitor's resistance", &p, "bus_esr_ohm");
    p.supply_inductance_h = 1e-6;
    check_true("an inductance will do", inverter_mismatch(&p) == NULL);
    p = good;
    p.chopper_ohm = 5;
    p.chopper_on_v = 30;
    p.chopper_off_v = 20;
    mismatch("a chopper that never goes off", &p, "chopper_off_v");
    p.chopper_off_v = 31;
    mismatch("a chopper with its levels crossed", &p, "chopper_off_v");
    p = good;
    p.vbus_v = 0;
    p.coss_c = 1e-9;
    mismatch("a charge at no voltage", &p, "coss_c");
}

int main(void)
{
    lines();
    parameters();
    return check_end();
}
