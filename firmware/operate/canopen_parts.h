/* SPDX-License-Identifier: MIT */
/* What the files of the node share; each calls only those above it here. Thread. */
#ifndef FIRMWARE_OPERATE_CANOPEN_PARTS_H
#define FIRMWARE_OPERATE_CANOPEN_PARTS_H

#include "firmware/operate/canopen.h"
#include "firmware/operate/canopen_objects.h"

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
uint32_t canopen_pdo_type(const struct canopen_pdo *p, uint32_t type, bool receives);
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

/* ---- canopen_dictionary.c: 0, or the abort code ---- */
struct canopen_value {
    enum { VALUE_NUMBER, VALUE_TEXT, VALUE_SHEET } kind;
    enum object_type type; /* of a number */
    uint32_t value;
    const char *text;
};
uint32_t canopen_read(struct canopen *c, uint32_t index, uint32_t subindex, struct canopen_value *v);
/* Whether it can be written, and of which type it is. */
uint32_t canopen_writable(struct canopen *c, uint32_t index, uint32_t subindex, enum object_type *type);
uint32_t canopen_write(struct canopen *c, uint32_t index, uint32_t subindex, uint32_t value);

/* ---- canopen_sdo.c ---- */
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
