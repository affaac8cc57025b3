/* SPDX-License-Identifier: MIT */
#include "firmware/operate/canopen.h"

enum { GENERIC = 1u << 0, CURRENT = 1u << 1, VOLTAGE = 1u << 2, HEAT = 1u << 3, BUS = 1u << 4, OWN = 1u << 7 };

static uint8_t register_of(uint32_t code)
{
    static const uint8_t of_class[16] = {[2] = CURRENT, [3] = VOLTAGE, [4] = HEAT, [8] = BUS, [15] = OWN};
    return code == 0u ? 0u : (uint8_t)(GENERIC | of_class[code >> 12 & 15u]);
}

static void store_error(struct canopen *c, uint32_t entry)
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

void canopen_clear_history(struct canopen *c)
{
    c->errors = 0u;
    for (uint32_t n = 0; n < CANOPEN_ERRORS; n++) {
        c->error[n] = 0u;
    }
}

/* Code and detail 0: error reset. */
static bool send_emergency(struct canopen *c, uint32_t code, uint32_t detail)
{
    uint8_t data[8] = {0};
    canopen_put(data, code, 2);
    data[2] = c->error_register;
    canopen_put(&data[3], detail, 4);
    if ((c->emergency_id & CANOPEN_INVALID) != 0u) {
        return true; /* disabled by a master */
    }
    if (!canopen_send(c, c->emergency_id, data, sizeof data)) {
        return false;
    }
    c->emergency_ms = canopen_now_ms(c);
    return true;
}

/* Object 0x1001, of all present errors. */
static void set_register(struct canopen *c)
{
    uint32_t found = c->comm_errors != 0u ? GENERIC | BUS : 0u;
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        found |= register_of(cia402_error_code((enum fault)c->fault[n]));
    }
    c->error_register = (uint8_t)found;
}

/* ---- communication ---- */

static const uint16_t comm_error_codes[COMM_ERRORS] = {
    [COMM_ERROR_LENGTH] = 0x8210,    /* PDO too short */
    [COMM_ERROR_HEARTBEAT] = 0x8130, /* the master's is missing */
    [COMM_ERROR_BUS_OFF] = 0x8140,   /* the node has recovered from it */
};

void canopen_set_error(struct canopen *c, enum canopen_comm_error what, uint32_t detail)
{
    if ((c->comm_errors >> what & 1u) == 0u) {
        c->comm_errors |= (uint8_t)(1u << what);
        c->comm_errors_due |= (uint8_t)(1u << what);
        c->comm_detail = detail;
        store_error(c, (detail & 0xFFFFu) << 16 | comm_error_codes[what]);
    }
}

void canopen_clear_error(struct canopen *c, enum canopen_comm_error what)
{
    if ((c->comm_errors >> what & 1u) != 0u) {
        c->comm_errors &= (uint8_t) ~(1u << what);
        c->comm_clear_due = true;
    }
}

/* Bus-off is sent when it is over: nothing gets out before. */
static void send_comm_errors(struct canopen *c)
{
    for (uint32_t what = 0; what < COMM_ERRORS; what++) {
        const bool unreachable = what == COMM_ERROR_BUS_OFF && (c->comm_errors >> what & 1u) != 0u;
        const uint32_t detail = what == COMM_ERROR_BUS_OFF ? 0u : c->comm_detail;
        if ((c->comm_errors_due >> what & 1u) == 0u || unreachable) {
            continue;
        }
        c->error_register |= GENERIC | BUS; /* which may have ended already */
        const bool sent = send_emergency(c, comm_error_codes[what], detail);
        c->comm_errors_due &= (uint8_t) ~(sent ? 1u << what : 0u);
        set_register(c);
    }
    if (c->comm_clear_due && c->comm_errors_due == 0u && send_emergency(c, 0u, 0u)) {
        c->comm_clear_due = false;
    }
}

/* ---- faults ---- */

static void update_fault(struct canopen *c, uint32_t n, const struct axis *a)
{
    const uint32_t cause = a->faults.cause;
    if (a->faults.count == c->faults[n] && cause == c->fault[n]) {
        return;
    }
    c->faults[n] = a->faults.count;
    c->fault[n] = cause;
    c->fault_due[n] = true;
    if (cause != FAULT_NONE) {
        store_error(c, (cause | of_axis(n)) << 16 | cia402_error_code((enum fault)cause));
    }
}

/* Detail: the fault's number, as in Modbus register `fault`; with several axes the next byte has the axis, from 1. */
static void send_fault(struct canopen *c, uint32_t n)
{
    const uint32_t code = cia402_error_code((enum fault)c->fault[n]);
    if (c->fault_due[n] && canopen_elapsed_ms(c, &c->emergency_ms) * 10u >= c->emergency_inhibit) {
        c->fault_due[n] = !send_emergency(c, code, c->fault[n] | of_axis(n));
    }
}

void canopen_send_errors(struct canopen *c)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        update_fault(c, n, c->drives[n].axis);
    }
    set_register(c);
    if (c->state != NMT_OPERATIONAL && c->state != NMT_PRE_OPERATIONAL) {
        return;
    }
    send_comm_errors(c);
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        send_fault(c, n);
    }
}

void canopen_forget_faults(struct canopen *c)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        c->fault[n] = FAULT_NONE;
        c->fault_due[n] = false;
    }
}

void canopen_repeat_errors(struct canopen *c)
{
    c->comm_errors_due |= c->comm_errors;
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        c->fault_due[n] = c->fault_due[n] || c->fault[n] != FAULT_NONE;
    }
}
