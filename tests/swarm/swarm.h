/* SPDX-License-Identifier: MIT */
/* The drive's own code between a plant and its three lines, who speaks on those, and who judges. */
#ifndef TESTS_SWARM_SWARM_H
#define TESTS_SWARM_SWARM_H

#include "firmware/drive/drive.h"
#include "firmware/operate/canopen.h"
#include "firmware/operate/console.h"
#include "firmware/operate/modbus.h"

/* ---- plant.c: the motor of the initial parameters, its inverter, supply and sensors behind the fabric's registers ---- */

enum encoder_fault { ENCODER_FINE, ENCODER_STANDS, ENCODER_SILENT, ENCODER_JUMPS };

struct plant {
    double i_d_a, i_q_a; /* in the rotor's frame */
    double w_rad_s;      /* mechanical */
    double turns;        /* of the shaft */
    double vbus_v, torque_nm;
    double duty[3];       /* in effect until the next valley */
    int32_t counts, zero; /* seen by the encoder; where its counter began, and slips */
    uint32_t noise;
    /* what is wrong */
    int32_t load_mnm, offset_q15; /* of the sensor of phase A */
    int32_t blocked, encoder;     /* the shaft; enum encoder_fault */
    int32_t latches;              /* GATE_STATUS_* whose inputs are active */
};

void plant_init(struct plant *p);
void plant_period(struct plant *p, struct fabric *f); /* one, and what the fabric shows of it behind the next trigger */
void plant_short(struct plant *p, struct fabric *f, double seconds); /* a short pulse through all low sides */
void plant_gate(struct plant *p, struct fabric *f); /* LIVE follows ENABLE, which a latch clears: docs/fabric.md */
void plant_encoder_begins(struct plant *p, struct fabric *f);
uint32_t plant_angle_q32(const struct plant *p); /* electrical, of a turn */
double plant_rpm(const struct plant *p);

/* ---- world.c: time passes a millisecond at a time, in main()'s order ---- */

struct world {
    struct axis axes[AXIS_COUNT];
    struct fabric fabrics[AXIS_COUNT];
    struct plant plants[AXIS_COUNT];
    struct console console;
    struct modbus modbus;
    struct canopen canopen;
    uint32_t now_ms;
    bool powered;
    int32_t supply_mv; /* another one than usual */
    int32_t cut;       /* the CAN bus is broken */
    int32_t hung_ms;   /* so long the thread does not come */
    int32_t skipped;   /* conversions of which the slow loop does not hear */
    int32_t flash_cut; /* the power fails behind so many more writes to the flash; 0: it does not */
};

extern struct world world;

void world_new(bool (*commission)(struct axis *)); /* the device leaves the factory, and its settings are stored */
void world_power(bool on);
void world_millisecond(void);

/* lines.c: what they carry to the drive, before the thread's next turn; false: nobody hears it. */
bool world_type(const char *text);
bool world_can(uint32_t id, const uint8_t *data, uint32_t count);
bool world_modbus(const uint8_t *bytes, uint32_t count);
bool world_can_is_up(void);

/* To the masters, behind the thread's turn; all is lost with the power. */
void lines_deliver(void);
void lines_reset(void);
extern struct rs485 lines_rs485;
extern struct can lines_can;

bool world_is_live(uint32_t axis);
bool world_operates(uint32_t axis);
bool world_wants(uint32_t axis); /* it is on, starts, or waits to restart */

/* ---- samples.c: the current loop's interrupts ---- */

void samples_take(void);          /* of each axis */
void samples_look_at_gates(void); /* at each basic block: gates that open and shut within a millisecond are seen, too */
extern uint32_t samples_taken;    /* of this millisecond */
const struct loop_handlers *samples_handlers(uint32_t axis);

/* ---- masters.c: who commands by Modbus and CAN ---- */

enum master_kind {
    MASTER_CYCLIC = 1,   /* says its word each cycle, not only another one */
    MASTER_RESETS = 2,   /* clears faults as long as it wants operation */
    MASTER_SDO = 4,      /* CAN: by SDO, the node stays pre-operational */
    MASTER_NMT = 8,      /* CAN: resets the node when it starts */
    MASTER_WAITS = 16,   /* keeps its enable bits in a fault: the drive may try again */
    MASTER_REJOINS = 32, /* CAN: sets the node up again when that has booted */
    MASTER_TAKES = 64,   /* takes over what another one commands */
};

/* A program of a cycle; history.c starts it and makes it worse. */
struct master {
    bool there, wants;
    bool told, has_target; /* the next cycle says its word in any case; with a target */
    bool known;            /* the status */
    uint16_t word, status;
    int32_t target_rpm;
    uint32_t axis, kind, period_ms, heartbeat_ms;
    uint32_t next_ms, beat_ms, setup;
    /* what is wrong with it; silent for so long, and back as if nothing had been; this word again and again, and 65536 */
    int32_t dead, mute, stale, repeats;
};

extern struct master masters[OWNERS];

void masters_new(void);
void masters_forgotten(void); /* the node is off: what they have set up there is gone */
void masters_step(void);
void masters_nmt(uint32_t command);
void masters_hear_can(const struct can_frame *f);
void masters_hear_modbus(const uint8_t *bytes, uint32_t count);

/* ---- owner.c: who owns the drive, by what was said to it and not by what it holds ---- */

struct judged {
    enum owner owner, let_go;    /* who has said in the last turn that nobody shall operate */
    const char *lost, *when;     /* why there is none, and in which state it was lost */
    uint32_t lost_ms, within_ms; /* when; so long the gates may be live */
    uint32_t heard_ms, since_ms;
    bool wanted, began, live;
    bool free;                                   /* where it goes is not told in rpm */
    bool returns;                                /* from a fault, or taken over, and nothing has been said since */
    bool measures;                               /* identify, which ends by itself */
    bool told;                                   /* the CAN bus, of the fault */
    bool slipped;                                /* the encoder, and no gates have noticed */
    int32_t said_rpm[OWNERS], asked_rpm[OWNERS]; /* without and with a halt */
    uint32_t word[OWNERS];                       /* the last of each */
    double low_rpm, high_rpm;                    /* what may be, by what was asked for */
    uint32_t held_ms, angle_ms, astray_ms, untold_ms, misnamed_ms;
    uint32_t shown[2], cause, state; /* by Modbus and CAN; a millisecond ago */
    struct params stored, before;    /* what power-on must find: the last save, or what it replaces */
};

extern struct judged judged[AXIS_COUNT];
extern struct told {
    uint64_t explained; /* faults that what has happened explains, a bit each */
    uint32_t calm_ms;   /* until then a disturbance excuses a speed */
    uint32_t beat_ms, consumer_ms;
    char typed[81];
} told;

#define OFF_MS   12u
#define STOP_MS  1500u /* from the largest speed, and some */
#define START_MS 300u  /* a start that is given up has nothing to brake */
#define LATE_MS  20u   /* of the thread's turn and the slow loop's */

void owner_given_up(struct judged *j, const char *why, uint32_t within_ms);
void judge_new(void);
bool judge_watches(uint32_t axis); /* the drive would notice its owner's silence */

/* What somebody has said, and the drive has heard. */
bool judge_type(const char *text); /* a person who waits for the answer to the line before */
void judge_answer(const char *text);
void judge_turn(enum owner of);                                                     /* of the thread, has ended */
void judge_word(enum owner line, uint32_t axis, uint32_t word, const int32_t *rpm); /* NULL: no target with it */
void judge_take(enum owner line, uint32_t axis);
void judge_heard(enum owner line, uint32_t axis);
void judge_beat(uint32_t consumer_ms);
void judge_lost(enum owner line, const char *why);
void judge_reset_node(void);
void judge_rebooted(void);

/* ---- judge.c: what must never be, by plant and gates ---- */

void judge_emergency(uint32_t fault); /* the bus has been told of it */
void judge_disturbed(uint32_t ms);
void judge_words(uint32_t axis); /* the status words change as CiA 402 allows */
void judge_millisecond(void);
void judge_end(void); /* probe.c: the faults have stopped, nobody speaks any more */

__attribute__((format(printf, 1, 2))) void judge_wrong(const char *what, ...); /* once of each kind */
extern const char *const line_names[OWNERS];
extern uint32_t judge_findings;
extern bool judge_traces;

#endif
