/* SPDX-License-Identifier: MIT */
#include "firmware/operate/canopen_parts.h"

enum { GENERIC = 1u << 0, CURRENT = 1u << 1, VOLTAGE = 1u << 2, HEAT = 1u << 3, BUS = 1u << 4, OWN = 1u << 7 };

static uint8_t register_of(uint32_t code)
{
    static const uint8_t of_class[16] = {[2] = CURRENT, [3] = VOLTAGE, [4] = HEAT, [8] = BUS, [15] = OWN};
    return code == 0u ? 0u : (uint8_t)(GENERIC | of_class[code >> 12 & 15u]);
}

static void remember(struct canopen *c, uint32_t entry)
{
    for (uint32_t n = CANOPEN_ERRORS - 1u; n > 0u; n--) {
        c->error[n] = c->error[n - 1u];
    }
    c->error[0] = entry;
    c->errors = (uint8_t)(c->errors < CANOPEN_ERRORS ? c->errors + 1u : CANOPEN_ERRORS);
}

void canopen_forget_errors(struct canopen *c)
{
    c->errors = 0u;
    for (uint32_t n = 0; n < CANOPEN_ERRORS; n++) {
        c->error[n] = 0u;
    }
}

void canopen_emergency(struct canopen *c, uint32_t code, uint32_t detail)
{
    uint8_t data[8] = {0};
    canopen_put(data, code, 2);
    data[2] = c->error_register;
    canopen_put(&data[3], detail, 4);
    if (code != 0u) {
        remember(c, (detail & 0xFFFFu) << 16 | code);
    }
    const bool speaks = c->state == NMT_OPERATIONAL || c->state == NMT_PRE_OPERATIONAL;
    if (speaks && (c->emergency_id & CANOPEN_INVALID) == 0u) {
        canopen_send(c, c->emergency_id, data, sizeof data);
        c->emergency_ms = canopen_now_ms(c);
    }
}

/* Of all that is told and has not been cleared. */
static uint8_t register_of_all(const struct canopen *c)
{
    uint32_t found = 0;
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        found |= register_of(cia402_error_code((enum fault)c->fault[n]));
    }
    return (uint8_t)found;
}

/* Detail: the fault's number, as Modbus's register `fault` has it; of several axes the byte above it says which, from 1. */
static void watch_axis(struct canopen *c, uint32_t n)
{
    const struct axis *const a = c->drives[n].axis;
    const uint32_t cause = a->faults.cause;
    const bool waits = canopen_since_ms(c, &c->emergency_ms) * 10u < c->emergency_inhibit;
    if (waits || c->state == NMT_STOPPED || (a->faults.count == c->faults[n] && cause == c->fault[n])) {
        return;
    }
    c->faults[n] = a->faults.count;
    c->fault[n] = cause;
    c->error_register = register_of_all(c);
    canopen_emergency(c, cia402_error_code((enum fault)cause), cause | (AXIS_COUNT > 1u ? (n + 1u) << 8 : 0u));
}

void canopen_watch_faults(struct canopen *c)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        watch_axis(c, n);
    }
}
