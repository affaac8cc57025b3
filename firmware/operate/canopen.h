/* SPDX-License-Identifier: MIT */
/*
 * The drive as a node of CANopen (CiA 301 4.2) with the profile of drives (cia402.h), all axes in one dictionary. All of it in
 * the thread; the CAN interrupt only fills and empties the driver's queues. Parameters can_node, can_kbit, can_recover of the
 * first axis take effect at once.
 */
#ifndef FIRMWARE_OPERATE_CANOPEN_H
#define FIRMWARE_OPERATE_CANOPEN_H

#include "drivers/mss/can.h"
#include "firmware/operate/data_sheet.h"
#include "firmware/operate/object_values.h"

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

#endif
