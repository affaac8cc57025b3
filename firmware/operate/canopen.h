/* SPDX-License-Identifier: MIT */
/*
 * The drive as a node of CANopen (CiA 301 4.2) with the profile of drives (cia402.h), all axes in one dictionary. Thread; the
 * CAN interrupt only fills and empties the driver's queues. Parameters can_node, can_kbit, can_recover of the first axis take
 * effect immediately.
 */
#ifndef FIRMWARE_OPERATE_CANOPEN_H
#define FIRMWARE_OPERATE_CANOPEN_H

#include <stdint.h>

#include "drivers/mss/can.h"
#include "firmware/operate/canopen_objects.h"
#include "firmware/operate/objects.h"

/* ==== the electronic data sheet ==== */

/*
 * The electronic data sheet of this image (CiA 306): the text of `make eds`, which the build packs
 * (firmware/tables/eds_packed.py) and this unpacks, a character at a time. Packed it is a stream of bits, the highest of each
 * byte first, made of these:
 *
 *     0, 0, 4 bits            one of the sixteen most frequent characters
 *     0, 1, 7 bits            any other
 *     1, 10 bits d, 6 bits n  n + 3 characters more, each as the one that came d + 1 before it
 */
#define DATA_SHEET_WINDOW 1024u

struct data_sheet {
    uint32_t bit;            /* the next one of the packed text */
    uint32_t distance, left; /* of the characters that are being repeated */
    uint32_t place;          /* characters so far: the next one goes there, around the window */
    uint8_t recent[DATA_SHEET_WINDOW];
};

/* ==== the node ==== */

#define CANOPEN_PDOS_EACH 4u
#define CANOPEN_MAPPED    8u
#define CANOPEN_ERRORS    4u
#define CANOPEN_NODES     127u
#define CANOPEN_NO_NUMBER 255u /* unconfigured: silent until a master assigns a node number by LSS */

enum nmt_state { NMT_BOOT = 0, NMT_STOPPED = 4, NMT_OPERATIONAL = 5, NMT_PRE_OPERATIONAL = 127 };

/* Why the master counts as lost: detail of FAULT_MASTER_LOST. */
enum canopen_lost { CANOPEN_LOST_HEARTBEAT = 1, CANOPEN_LOST_NMT, CANOPEN_LOST_BUS };

/* Communication errors: EMCY and bit 4 of 0x1001 (CiA 301, 7.2.7), in the order in which they are sent. */
enum canopen_comm_error { COMM_ERROR_LENGTH, COMM_ERROR_HEARTBEAT, COMM_ERROR_BUS_OFF, COMM_ERRORS };

struct canopen_pdo {
    uint32_t id;
    uint32_t map[CANOPEN_MAPPED];
    uint16_t inhibit;  /* 100 us */
    uint16_t event_ms; /* event timer: longest time between two; 0: only on change */
    uint8_t type, count;
    uint8_t syncs; /* TPDO: SYNCs since it was sent; RPDO: 1, data waits for the next SYNC */
    uint8_t bytes; /* last sent or received */
    uint8_t data[8];
    uint32_t sent_ms;
};

/* A segmented transfer in progress. */
struct canopen_sdo {
    enum { SDO_IDLE, SDO_UPLOAD, SDO_DOWNLOAD } under_way;
    const char *text; /* what is uploaded; NULL: the data sheet */
    uint32_t left, done;
    uint16_t index;
    uint8_t subindex;
    bool toggle;
    uint8_t data[4]; /* what is downloaded */
};

/* Parameters of the line, as when they took effect or LSS stored them. */
struct canopen_line {
    int32_t node, kbit, recover;
};

/* Layer setting services, LSS (CiA 305). */
struct canopen_lss {
    bool configures;   /* LSS state `configuration`; else `waiting` */
    uint8_t matched;   /* parts of the identity that have matched so far, for `switch state selective` */
    uint8_t part;      /* of the identity at which fastscan is */
    uint8_t node;      /* pending, from the next reset of communication on; or CANOPEN_NO_NUMBER */
    uint16_t kbit;     /* pending, until `activate bit timing` */
    uint16_t delay_ms; /* of silence, before and after a change of rate */
    uint32_t since_ms; /* when this delay began */
    enum { LSS_NO_CHANGE, LSS_WAITS, LSS_SETTLES } change;
};

struct canopen {
    struct can *can;
    struct bus_drive drives[AXIS_COUNT];
    struct canopen_line line;
    uint8_t node; /* in effect; 0: not on the bus, CANOPEN_NO_NUMBER: LSS only */
    struct canopen_lss lss;
    enum nmt_state state;
    uint32_t heartbeat_sent_ms;     /* when the last one was sent, */
    uint32_t heartbeat_received_ms; /* and when the master's was received */
    bool master_alive;              /* its heartbeat has been received, and is supervised */
    uint32_t bus_offs;              /* the driver's count at the last poll */
    uint8_t lost[AXIS_COUNT];       /* enum canopen_lost, by NMT or bus-off, however briefly; 0: none */
    uint32_t faults[AXIS_COUNT];    /* of the axis: count at the last poll, */
    uint32_t fault[AXIS_COUNT];     /* and cause, enum fault */
    bool fault_due[AXIS_COUNT];     /* its EMCY, or that of its end, is to be sent */
    uint8_t comm_errors;            /* present: a bit for each enum canopen_comm_error */
    uint8_t comm_errors_due;        /* to be sent: the same, */
    bool comm_clear_due;            /* and that one has ended */
    uint32_t comm_detail;
    uint32_t emergency_ms;             /* when the last was sent */
    bool tx_stalled;                   /* no frame gets out: nothing is queued, since it would be stale when sent */
    uint32_t tx_count, tx_progress_ms; /* frames sent at the last progress, and when that was */
    int32_t heartbeat_param;           /* can_heartbeat_ms, as when it took effect */
    struct canopen_sdo sdo;
    struct data_sheet sheet;
    /* objects */
    uint8_t error_register, errors;
    uint16_t emergency_inhibit, heartbeat_ms;
    uint32_t error[CANOPEN_ERRORS];
    uint32_t sync_id, emergency_id, consumer, sdo_in, sdo_out;
    struct canopen_pdo rpdo[CANOPEN_PDOS_EACH], tpdo[CANOPEN_PDOS_EACH];
};

/*
 * Joins the bus if can_node is not 0; for LSS only if that is no valid node number. Once, when the axes have been initialised:
 * `axes` and `slots` have AXIS_COUNT elements.
 */
void canopen_start(struct canopen *c, struct can *can, struct axis *axes, const struct slots *slots);

/* Serves the bus; call it repeatedly. Takes as long as `on` if requested to enable operation. */
void canopen_poll(struct canopen *c);

/* ==== what its files share; each calls only those above it here. Thread ==== */

#define CANOPEN_INVALID  (1u << 31) /* of a PDO's identifier: it does not exist */
#define CANOPEN_NO_RTR   (1u << 30)
#define CANOPEN_EXTENDED (1u << 29)
#define CANOPEN_ID       0x7FFu

/* SDO abort codes, CiA 301 table 22 */
#define SDO_TOGGLE         0x05030000u
#define SDO_COMMAND        0x05040001u
#define SDO_ACCESS         0x06010000u
#define SDO_READ_ONLY      0x06010002u
#define SDO_NO_OBJECT      0x06020000u
#define SDO_NOT_MAPPABLE   0x06040041u
#define SDO_PDO_LENGTH     0x06040042u
#define SDO_LENGTH         0x06070010u
#define SDO_TOO_LONG       0x06070012u
#define SDO_TOO_SHORT      0x06070013u
#define SDO_NO_SUBINDEX    0x06090011u
#define SDO_VALUE          0x06090030u
#define SDO_VALUE_TOO_HIGH 0x06090031u
#define SDO_VALUE_TOO_LOW  0x06090032u
#define SDO_NOT_STORED     0x08000020u
#define SDO_LOCAL_CONTROL  0x08000021u
#define SDO_DEVICE_STATE   0x08000022u

/* During a change of rate, or without a node number: nothing is sent but LSS answers. */
static inline bool canopen_is_silent(const struct canopen *c)
{
    return c->node == CANOPEN_NO_NUMBER || c->lss.change != LSS_NO_CHANGE;
}

/* ---- canopen_frame.c ---- */
/* Opens the bus at the highest supported rate up to kbit_s; 20 kbit/s at least. */
void canopen_open(struct canopen *c, int32_t kbit_s);
struct canopen_line canopen_line(const struct params *p);
bool canopen_line_differs(const struct canopen_line *one, const struct canopen_line *other);
void canopen_set_line(struct params *p, const struct canopen_line *line);
/* False if the queue is full or stalled: the frame is dropped. */
bool canopen_send(struct canopen *c, uint32_t id, const uint8_t *data, uint32_t count);
/* True if so many frames are queued that periodic ones should wait. */
bool canopen_has_backlog(const struct canopen *c);
/* A frame has been received or sent: the bus has another live node. */
void canopen_note_progress(struct canopen *c);
/* Detects that no frame gets out, and drops what is queued; and that frames get out again. */
void canopen_watch_tx(struct canopen *c);
void canopen_put(uint8_t *bytes, uint32_t value, uint32_t count); /* the least significant byte first */
uint32_t canopen_get(const uint8_t *bytes, uint32_t count);
uint32_t canopen_now_ms(const struct canopen *c);
/* Time since then, saturated: `then_ms` is moved up so that a wrap cannot make an old time new. */
uint32_t canopen_elapsed_ms(const struct canopen *c, uint32_t *then_ms);
uint32_t canopen_bytes(enum object_type type);
/* Sign-extended by its type. */
int32_t canopen_signed(uint32_t value, enum object_type type);
/* The axis value at an index, and the number of that axis. Objects of CiA 301 belong to the first. */
struct object_place canopen_place(uint32_t index, uint32_t subindex);
static inline uint32_t canopen_axis(uint32_t index)
{
    return AXIS_COUNT > 1u && index >= OBJECTS_INDEX && (index & CANOPEN_AXIS) != 0u ? 1u : 0u;
}
/* That value; `view` is the axis's. */
static inline uint32_t canopen_value(const struct object_view *view, const struct object_place *p, uint32_t index)
{
    return AXIS_COUNT > 1u && index == CANOPEN_DEVICE ? CANOPEN_SEVERAL : object_get(view, p);
}
/* A frame was addressed to this node: restarts the command time-out of all its axes. */
void canopen_note_activity(struct canopen *c);

/* ---- canopen_emergency.c ---- */
/* Communication errors, set and cleared. */
void canopen_set_error(struct canopen *c, enum canopen_comm_error what, uint32_t detail);
void canopen_clear_error(struct canopen *c, enum canopen_comm_error what);
/* Sends EMCYs of faults and communication errors, and of their ends. */
void canopen_send_errors(struct canopen *c);
/* Object 0x1003. */
void canopen_clear_history(struct canopen *c);
/* After a reset of communication: a latched fault is sent, and stored in 0x1003, again. */
void canopen_forget_faults(struct canopen *c);
/* After a stalled line: what is latched or lasts is sent again. */
void canopen_repeat_errors(struct canopen *c);

/* ---- canopen_pdo.c ---- */
/* A restricted CAN-ID (CiA 301, table 81); those of SYNC and EMCY are none. */
bool canopen_is_restricted(uint32_t id);
/* Checks what a master sets of a PDO: 0, or the abort code. */
uint32_t canopen_pdo_id(const struct canopen_pdo *p, uint32_t id);
uint32_t canopen_pdo_type(uint32_t type);
uint32_t canopen_pdo_entry(const struct canopen_pdo *p, uint32_t entry, bool receives);
uint32_t canopen_pdo_count(const struct canopen_pdo *p, uint32_t count);
void canopen_pdo_defaults(struct canopen *c);
/* True if the frame was an RPDO. */
bool canopen_pdo_take(struct canopen *c, const struct can_frame *f);
void canopen_pdo_sync(struct canopen *c);
/* Event-driven TPDOs. */
void canopen_pdo_step(struct canopen *c);
/* Operational: all TPDOs count as not sent yet. */
void canopen_pdo_begin(struct canopen *c);

/* ---- canopen_sdo.c: 0, or the abort code ---- */
struct canopen_value {
    enum { VALUE_NUMBER, VALUE_TEXT, VALUE_SHEET } kind;
    enum object_type type; /* of a number */
    uint32_t value;
    const char *text;
};
uint32_t canopen_read(struct canopen *c, uint32_t index, uint32_t subindex, struct canopen_value *v);
uint32_t canopen_write(struct canopen *c, uint32_t index, uint32_t subindex, uint32_t value);
void canopen_sdo_take(struct canopen *c, const struct can_frame *f);

/* ---- canopen_nmt.c ---- */
/* Reset of communication: as after power-on, with the pending node number; then the boot-up message. */
void canopen_nmt_reset(struct canopen *c);
void canopen_nmt_take(struct canopen *c, const struct can_frame *f);
/* Heartbeat consumer and producer, and whether the master is lost. */
void canopen_nmt_heartbeat(struct canopen *c, const struct can_frame *f);
void canopen_nmt_step(struct canopen *c);
/* The node leaves the bus: no axis is commanded from it any more. */
void canopen_release(struct canopen *c);

/* ---- canopen_lss.c ---- */
#define LSS_COMMAND 0x7E5u
void canopen_lss_take(struct canopen *c, const struct can_frame *f);
/* Continues a change of rate. */
void canopen_lss_step(struct canopen *c);

#endif
