/* SPDX-License-Identifier: MIT */
#include "firmware/operate/canopen.h"

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

static uint32_t of_axis(uint32_t n)
{
    return AXIS_COUNT > 1u ? (n + 1u) << 8 : 0u;
}

void canopen_forget_errors(struct canopen *c)
{
    c->errors = 0u;
    for (uint32_t n = 0; n < CANOPEN_ERRORS; n++) {
        c->error[n] = 0u;
    }
}

/* 0 of a detail and a code: an error is over. */
static bool send_emergency(struct canopen *c, uint32_t code, uint32_t detail)
{
    uint8_t data[8] = {0};
    canopen_put(data, code, 2);
    data[2] = c->error_register;
    canopen_put(&data[3], detail, 4);
    if ((c->emergency_id & CANOPEN_INVALID) != 0u) {
        return true; /* a master wants none */
    }
    if (!canopen_send(c, c->emergency_id, data, sizeof data)) {
        return false;
    }
    c->emergency_ms = canopen_now_ms(c);
    return true;
}

/* Of all that has not been cleared. */
static void set_register(struct canopen *c)
{
    uint32_t found = c->trouble != 0u ? GENERIC | BUS : 0u;
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        found |= register_of(cia402_error_code((enum fault)c->fault[n]));
    }
    c->error_register = (uint8_t)found;
}

/* ---- communication ---- */

static const uint16_t trouble_codes[TROUBLES] = {
    [TROUBLE_LENGTH] = 0x8210,    /* a PDO that is too short */
    [TROUBLE_HEARTBEAT] = 0x8130, /* the master's has stopped */
    [TROUBLE_BUS_OFF] = 0x8140,   /* the node is back from it */
};

void canopen_trouble(struct canopen *c, enum canopen_trouble what, uint32_t detail)
{
    if ((c->trouble >> what & 1u) == 0u) {
        c->trouble |= (uint8_t)(1u << what);
        c->trouble_due |= (uint8_t)(1u << what);
        c->trouble_detail = detail;
        remember(c, (detail & 0xFFFFu) << 16 | trouble_codes[what]);
    }
}

void canopen_relief(struct canopen *c, enum canopen_trouble what)
{
    if ((c->trouble >> what & 1u) != 0u) {
        c->trouble &= (uint8_t) ~(1u << what);
        c->relief_due = true;
    }
}

/* While the node is bus-off nobody hears of it. */
static void tell_trouble(struct canopen *c)
{
    for (uint32_t what = 0; what < TROUBLES; what++) {
        const bool deaf = what == TROUBLE_BUS_OFF && (c->trouble >> what & 1u) != 0u;
        const uint32_t detail = what == TROUBLE_BUS_OFF ? 0u : c->trouble_detail;
        if ((c->trouble_due >> what & 1u) == 0u || deaf) {
            continue;
        }
        c->error_register |= GENERIC | BUS; /* over already, it may be */
        const bool told = send_emergency(c, trouble_codes[what], detail);
        c->trouble_due &= (uint8_t) ~(told ? 1u << what : 0u);
        set_register(c);
    }
    if (c->relief_due && c->trouble_due == 0u && send_emergency(c, 0u, 0u)) {
        c->relief_due = false;
    }
}

/* ---- faults ---- */

static void see_fault(struct canopen *c, uint32_t n, const struct axis *a)
{
    const uint32_t cause = a->faults.cause;
    if (a->faults.count == c->faults[n] && cause == c->fault[n]) {
        return;
    }
    c->faults[n] = a->faults.count;
    c->fault[n] = cause;
    c->fault_due[n] = true;
    if (cause != FAULT_NONE) {
        remember(c, (cause | of_axis(n)) << 16 | cia402_error_code((enum fault)cause));
    }
}

/* Detail: the fault's number, as Modbus's register `fault` has it; of several axes the byte above it says which, from 1. */
static void tell_fault(struct canopen *c, uint32_t n)
{
    const uint32_t code = cia402_error_code((enum fault)c->fault[n]);
    if (c->fault_due[n] && canopen_since_ms(c, &c->emergency_ms) * 10u >= c->emergency_inhibit) {
        c->fault_due[n] = !send_emergency(c, code, c->fault[n] | of_axis(n));
    }
}

void canopen_watch_faults(struct canopen *c)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        see_fault(c, n, c->drives[n].axis);
    }
    set_register(c);
    if (c->state != NMT_OPERATIONAL && c->state != NMT_PRE_OPERATIONAL) {
        return;
    }
    tell_trouble(c);
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        tell_fault(c, n);
    }
}

void canopen_see_again(struct canopen *c)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        c->fault[n] = FAULT_NONE;
        c->fault_due[n] = false;
    }
}

void canopen_tell_again(struct canopen *c)
{
    c->trouble_due |= c->trouble;
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        c->fault_due[n] = c->fault_due[n] || c->fault[n] != FAULT_NONE;
    }
}
