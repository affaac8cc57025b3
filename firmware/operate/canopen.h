/* SPDX-License-Identifier: MIT */
/*
 * The drive as a node of CANopen (CiA 301 4.2) with the profile of drives (cia402.h), all axes in one dictionary. All of it in
 * the thread; the CAN interrupt only fills and empties the driver's queues. Parameters can_node, can_kbit, can_recover of the
 * first axis take effect at once.
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
 * (firmware/tables/eds_packed.py) and this unpacks, a character at a time. Packed it is bits, the highest of each byte first,
 * one of these behind the other:
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
#define CANOPEN_NO_NUMBER 255u /* on the bus, but silent until a master has given it a number */

enum nmt_state { NMT_BOOT = 0, NMT_STOPPED = 4, NMT_OPERATIONAL = 5, NMT_PRE_OPERATIONAL = 127 };

/* Why the master is missing: detail of FAULT_MASTER_LOST. */
enum canopen_lost { CANOPEN_LOST_HEARTBEAT = 1, CANOPEN_LOST_NMT, CANOPEN_LOST_BUS };

/* EMCY and bit 4 of 0x1001 (CiA 301, 7.2.7), in the order in which they are told. */
enum canopen_trouble { TROUBLE_LENGTH, TROUBLE_HEARTBEAT, TROUBLE_BUS_OFF, TROUBLES };

struct canopen_pdo {
    uint32_t id;
    uint32_t map[CANOPEN_MAPPED];
    uint16_t inhibit;  /* 100 us */
    uint16_t event_ms; /* sent so often at least; 0: only when it changes */
    uint8_t type, count;
    uint8_t syncs; /* since it was sent; of an RPDO: 1 that data waits for the next SYNC */
    uint8_t bytes; /* it has been sent with these, or has come with them */
    uint8_t data[8];
    uint32_t sent_ms;
};

/* A segmented transfer under way. */
struct canopen_sdo {
    enum { SDO_IDLE, SDO_UPLOAD, SDO_DOWNLOAD } under_way;
    const char *text; /* what is uploaded; NULL: the data sheet */
    uint32_t left, done;
    uint16_t index;
    uint8_t subindex;
    bool toggle;
    uint8_t data[4]; /* what is downloaded */
};

/* The parameters of the line, as they were when they took effect or layer setting stored them. */
struct canopen_line {
    int32_t node, kbit, recover;
};

/* Layer setting (CiA 305). */
struct canopen_lss {
    bool configures;   /* its state is `configuration`; else `waiting` */
    uint8_t matched;   /* parts of the identity that a master has named rightly, to switch this one alone */
    uint8_t part;      /* of the identity: fastscan is there */
    uint8_t node;      /* from the next reset of communication on; CANOPEN_NO_NUMBER: none */
    uint16_t kbit;     /* by the next `activate bit timing` */
    uint16_t delay_ms; /* of silence, before and behind a change of rate */
    uint32_t since_ms; /* it began */
    enum { LSS_NO_CHANGE, LSS_WAITS, LSS_SETTLES } change;
};

struct canopen {
    struct can *can;
    struct bus_drive drives[AXIS_COUNT];
    struct canopen_line line;
    uint8_t node; /* in effect; 0: not on the bus, CANOPEN_NO_NUMBER: layer setting alone */
    struct canopen_lss lss;
    enum nmt_state state;
    uint32_t beat_ms;            /* when the last heartbeat was sent, */
    uint32_t heard_ms;           /* and when the master's was heard */
    bool beats;                  /* the master's heartbeat has been heard */
    uint32_t offs;               /* times the bus was off, as far as that was looked at */
    uint8_t lost[AXIS_COUNT];    /* enum canopen_lost, by NMT or a bus that was off, however briefly; 0: it is not */
    uint32_t faults[AXIS_COUNT]; /* of the axis, that were seen */
    uint32_t fault[AXIS_COUNT];  /* the last of them, enum fault */
    bool fault_due[AXIS_COUNT];  /* it, or its end, has not been told */
    uint8_t trouble;             /* of communication, that lasts: a bit for each enum canopen_trouble */
    uint8_t trouble_due;         /* has not been told: the same, */
    bool relief_due;             /* and that one is over */
    uint32_t trouble_detail;
    uint32_t emergency_ms;    /* when the last was sent */
    bool held_up;             /* the line takes no frame: nothing is queued, or it would be told when it is old */
    uint32_t moved, moved_ms; /* frames that have left, and when it was so */
    int32_t beat_param;       /* can_heartbeat_ms, as it was when it took effect */
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
 * Joins the bus if can_node is not 0; for layer setting alone if that is no number of a node. Once, when the axes have been
 * initialised: AXIS_COUNT of them, and of places to store.
 */
void canopen_start(struct canopen *c, struct can *can, struct axis *axes, const struct slots *slots);

/* Serves the bus; call it whenever there is time. Takes as long as `on` if requested to enable operation. */
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

/* Between two rates, or without a number: nothing is sent but what layer setting answers. */
static inline bool canopen_is_silent(const struct canopen *c)
{
    return c->node == CANOPEN_NO_NUMBER || c->lss.change != LSS_NO_CHANGE;
}

/* ---- canopen_frame.c ---- */
/* Joins the bus with the highest rate that is known and no higher; 20 kbit/s at least. */
void canopen_open(struct canopen *c, int32_t kbit_s);
struct canopen_line canopen_line(const struct params *p);
bool canopen_line_differs(const struct canopen_line *one, const struct canopen_line *other);
void canopen_set_line(struct params *p, const struct canopen_line *line);
/* False if there was no room, or the line takes none: it has not been sent, and will not be by itself. */
bool canopen_send(struct canopen *c, uint32_t id, const uint8_t *data, uint32_t count);
/* True if so much has been queued that what comes again by itself should wait. */
bool canopen_is_crowded(const struct canopen *c);
/* A frame has come or gone: somebody is there, and what he asks is answered. */
void canopen_line_moves(struct canopen *c);
/* Notices that the line takes no frames, and that it does again: what waits meanwhile is forgotten. */
void canopen_watch_line(struct canopen *c);
void canopen_put(uint8_t *bytes, uint32_t value, uint32_t count); /* the least significant byte first */
uint32_t canopen_get(const uint8_t *bytes, uint32_t count);
uint32_t canopen_now_ms(const struct canopen *c);
/* Since then; `then_ms` follows what is older than the longest time that a master can set, so that no wrap makes it new. */
uint32_t canopen_since_ms(const struct canopen *c, uint32_t *then_ms);
uint32_t canopen_bytes(enum object_type type);
/* Two's complement of so many bits. */
int32_t canopen_signed(uint32_t value, enum object_type type);
/* An axis's value that stands there, and the number of that axis. What CiA 301 has is the first's. */
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
/* What came was meant for this node: a sign of life for all its axes. */
void canopen_hear(struct canopen *c);

/* ---- canopen_emergency.c ---- */
void canopen_trouble(struct canopen *c, enum canopen_trouble what, uint32_t detail);
/* It is over. */
void canopen_relief(struct canopen *c, enum canopen_trouble what);
/* Tells of faults and troubles, and of their ends. */
void canopen_watch_faults(struct canopen *c);
void canopen_forget_errors(struct canopen *c);
/* Behind a reset of communication, which forgets what has been told: what is latched is told and kept anew. */
void canopen_see_again(struct canopen *c);
/* What is latched or lasts, to a line that has heard nothing for a while. */
void canopen_tell_again(struct canopen *c);

/* ---- canopen_pdo.c ---- */
/* An identifier that CiA 301 keeps for other services, table 81; those of SYNC and EMCY are none. */
bool canopen_is_restricted(uint32_t id);
/* What a master may set of a PDO; 0, or why not. */
uint32_t canopen_pdo_id(const struct canopen_pdo *p, uint32_t id);
uint32_t canopen_pdo_type(uint32_t type);
uint32_t canopen_pdo_entry(const struct canopen_pdo *p, uint32_t entry, bool receives);
uint32_t canopen_pdo_count(const struct canopen_pdo *p, uint32_t count);
void canopen_pdo_defaults(struct canopen *c);
/* True if the frame was one. */
bool canopen_pdo_take(struct canopen *c, const struct can_frame *f);
void canopen_pdo_sync(struct canopen *c);
/* Those that are due by themselves. */
void canopen_pdo_step(struct canopen *c);
/* Operational again: as if none had been sent. */
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
/* Communication as after power-on, with the number that layer setting has given; then the boot-up message. */
void canopen_nmt_reset(struct canopen *c);
void canopen_nmt_take(struct canopen *c, const struct can_frame *f);
/* Heartbeats, both ways; and whether the master is there. */
void canopen_nmt_hear(struct canopen *c, const struct can_frame *f);
void canopen_nmt_step(struct canopen *c);
/* The bus is left: nobody there commands any more. */
void canopen_leave(struct canopen *c);

/* ---- canopen_lss.c ---- */
#define LSS_COMMAND 0x7E5u
void canopen_lss_take(struct canopen *c, const struct can_frame *f);
/* A change of rate under way. */
void canopen_lss_step(struct canopen *c);

#endif
