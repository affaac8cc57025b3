/* SPDX-License-Identifier: MIT */
/*
 * Identifies the motor from the inverter's ratings and the rated current alone. It runs a script (below). Each step has two
 * halves: the slow loop measures, bridge on; then, at zero voltage, the thread evaluates the sums and prepares the next step.
 * So interrupts need no divisions, and each step uses the results of those before it. Common primitives: measure.h.
 *
 * From the push on the currents are regulated in the rotor's frame, by the encoder: identify_takes_over().
 *
 * A result is either known, with its 95 % interval, or refused with a reason. Results become parameters only by identify_use().
 *
 * The interval is 2 sqrt(s^2 + sum a^2 / 3): s, the standard deviation of the mean; a, the bound of each systematic error,
 * mainly of the sensor gains, which these sensors cannot measure (GUM, JCGM 100:2008, 4.3.7 and 6.2).
 */
#ifndef FIRMWARE_COMMISSION_IDENTIFY_H
#define FIRMWARE_COMMISSION_IDENTIFY_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/commission/measure.h"
#include "firmware/commission/pulses.h"
#include "firmware/settings/error.h"
#include "firmware/settings/params.h"
#include "firmware/settings/tuning.h"

/* ==== the script, its results and refusals ==== */

/*
 * The script of identify: one line a step, in their order. A new step is one file, with identify_measure_NAME() and
 * identify_evaluate_NAME(), its measurements in union identify_work, and one line here:
 *
 *     NAME, name    of the enum's and the functions
 *     "text"        its name on console and bus
 *     needs         enum identify_needs
 *     from, to      its results, of enum identify_quantity
 */

enum identify_needs {
    IDENTIFY_NEEDS_VOLTAGE, /* held: currents cannot be regulated yet */
    IDENTIFY_NEEDS_CURRENT,
    IDENTIFY_NEEDS_GRIP,    /* a current that holds the rotor; if reluctance would turn it, zero voltage brakes */
    IDENTIFY_NEEDS_ENCODER, /* turns */
    IDENTIFY_NEEDS_OPEN,    /* the same, and its results are not refused yet */
};

/* clang-format off */
#define IDENTIFY_SCRIPT(STEP) \
    STEP(PULSES, pulses, "pulses", VOLTAGE, RESISTANCE, LQ) /* identify_resistance.c: a first inductance */ \
    STEP(HOLD, hold, "first current", CURRENT, RESISTANCE, DEAD_TIME) /* and a first resistance, from a steady current */ \
    STEP(RESISTANCE, resistance, "resistance", GRIP, RESISTANCE, DEAD_TIME) /* and the remaining dead-time error */ \
    STEP(AXES, axes, "axes", CURRENT, LD, LQ) /* identify_inductance.c: their angle */ \
    STEP(INDUCTANCE, inductance, "inductance", CURRENT, LD, LQ) /* along each, for small changes */ \
    STEP(TURN, turn, "turn", ENCODER, DIRECTION, DIRECTION) /* the field turns slowly: counts per electrical turn */ \
    STEP(PUSH, push, "push", ENCODER, FLUX, INERTIA) /* across the magnets, forward and back: first flux and inertia */ \
    STEP(INDEX, index, "index", ENCODER, POLE_PAIRS, COUNTS) /* counts from one index to the next, and so pole pairs */ \
    STEP(RAMPS, ramps, "ramps", ENCODER, FLUX, INERTIA) /* accelerating and braking at one current */ \
    STEP(SPEEDS, speeds, "speeds", ENCODER, OFFSET, VISCOUS) /* in both directions: friction, the encoder's offset */ \
    STEP(ALONG, along, "map along d", OPEN, LD_D2_BACK, LD_D2) /* identify_map.c: over the current, along the magnets */ \
    STEP(ACROSS, across, "map across", OPEN, LD_Q1, LQ_Q3) /* and across */ \
    STEP(TORQUE, torque, "map of most torque", OPEN, TORQUE_ID, CROSS) /* fluxes and coupling at MTPA */

/* Results of identify: name, text, unit, and thousandths of the unit per LSB. */
#define IDENTIFY_RESULTS(RESULT) \
    RESULT(RESISTANCE, "resistance", " mohm", 1) /* one phase and its switches, at their present temperature: uohm */ \
    RESULT(DEAD_TIME, "dead time", " ns", 100) /* voltage error of a leg in a period, as time at the bus voltage: 0.1 ns */ \
    RESULT(LD, "ld", " uH", 1) /* small-signal, at zero current: nH */ \
    RESULT(LQ, "lq", " uH", 1) \
    RESULT(POLE_PAIRS, "pole pairs", "", 1000) /* exactly */ \
    RESULT(COUNTS, "encoder counts", "", 1000) /* of the encoder per mechanical turn, exactly */ \
    RESULT(DIRECTION, "encoder direction", "", 1000) /* 1: it counts up as the field turns; -1: down */ \
    RESULT(OFFSET, "offset", " degrees, electrical, at the index", 10) /* where the index begins, turning forward */ \
    RESULT(FLUX, "flux", " uWb", 100) /* of the magnets, at almost no current and their present temperature */ \
    RESULT(INERTIA, "inertia", " kgmm2", 1) /* rotor and load: gmm2 */ \
    RESULT(COULOMB, "friction", " mNm", 1) /* independent of speed, bearings and iron: uNm */ \
    RESULT(VISCOUS, "viscous friction", " uNms", 1) /* grows with speed: nNms */ \
    /* the map, small-signal, nH; i_d in halves of the rated current, BACK: against the magnets, i_q = 0 */ \
    RESULT(LD_D2_BACK, "ld at -1 of rated current in d", " uH", 1) \
    RESULT(LD_D1_BACK, "ld at -1/2 in d", " uH", 1) \
    RESULT(LD_D1, "ld at 1/2 in d", " uH", 1) \
    RESULT(LD_D2, "ld at 1 in d", " uH", 1) \
    /* i_q in thirds of the rated current, i_d = 0 */ \
    RESULT(LD_Q1, "ld at 1/3 of rated current in q", " uH", 1) \
    RESULT(LD_Q2, "ld at 2/3 in q", " uH", 1) \
    RESULT(LD_Q3, "ld at 1 in q", " uH", 1) \
    RESULT(LQ_Q1, "lq at 1/3 in q", " uH", 1) \
    RESULT(LQ_Q2, "lq at 2/3 in q", " uH", 1) \
    RESULT(LQ_Q3, "lq at 1 in q", " uH", 1) \
    /* at maximum torque of the rated current, if i_d contributes to it */ \
    RESULT(TORQUE_ID, "rated current in d for most torque, in mA", "", 1000) \
    RESULT(TORQUE_IQ, "and in q, in mA", "", 1000) \
    RESULT(TORQUE_FLUX, "flux in d there", " uWb", 100) /* along the magnets */ \
    RESULT(TORQUE_ACROSS, "flux in q there", " uWb", 100) \
    RESULT(CROSS, "ldq by lqq there, in thousandths", "", 1000) /* L_dq / L_qq; with the sign of i_q */

/* Reasons of a refusal. */
#define IDENTIFY_REFUSALS(REASON) \
    REASON(STOPPED, "it ended before this was measured") /* off or a fault */ \
    REASON(RATED_SMALL, "i_rated_ma is too small for i_range_ma: the sensors hardly see it") \
    REASON(NO_CURRENT, "next to no current answers the voltage: motor cable, i_rated_ma, i_range_ma") \
    REASON(NOT_RESISTIVE, "the voltage does not grow with the current: does something turn the motor?") \
    REASON(TURNED, "reluctance turns the rotor whenever the current changes") \
    REASON(SCATTER, "repeated measurements differ by more than a tenth: contacts, a rotor that moves") \
    REASON(NO_ENCODER, "angle_source says that there is no encoder") \
    REASON(NOT_FOLLOWED, "the encoder does not show the field's turn: rotor blocked or loaded, encoder dead") \
    REASON(NOT_PUSHED, "most of the rated current does not turn the rotor as it should: blocked, loaded") \
    REASON(NO_INDEX, "no index from turn to turn: pole pairs and encoder counts cannot be told apart") \
    REASON(LOADED, "a load drives the shaft or holds it back") /* or speeds are not reached */ \
    REASON(TOO_SLOW, "what the magnets induce is too little at the speeds that are allowed: speed_max_rpm") \
    REASON(UNRESOLVED, "it is too small for the sensors at the speeds that are allowed: speed_max_rpm") \
    REASON(TOO_LIGHT, "this current turns the rotor too quickly to be measured meanwhile, or something holds it back") \
    REASON(SWINGS, "the speed swings as it grows: an elastic coupling, or a load that changes") \
    REASON(RIPPLED, "ripple and dead time hide it beside so small a current") /* phase currents change sign within a period */ \
    REASON(NOT_SALIENT, "no current in d, or little, makes most torque: the magnets make nearly all of it")
/* clang-format on */

#define IDENTIFY_STEP_OF(NAME, ...) IDENTIFY_STEP_##NAME,
#define IDENTIFY_NAME_OF(NAME, ...) IDENTIFY_##NAME,

enum identify_step {
    IDENTIFY_STEP_NONE,
    IDENTIFY_SCRIPT(IDENTIFY_STEP_OF) /* from TURN on the rotor turns; from PUSH on in its own frame */
    IDENTIFY_STEP_DONE,
    IDENTIFY_STEPS
};

enum identify_quantity { IDENTIFY_RESULTS(IDENTIFY_NAME_OF) IDENTIFY_QUANTITIES };

enum identify_reason { IDENTIFY_NO_REASON, IDENTIFY_REFUSALS(IDENTIFY_NAME_OF) IDENTIFY_REASONS };

enum identify_state {
    IDENTIFY_UNKNOWN, /* not reached yet */
    IDENTIFY_KNOWN,
    IDENTIFY_REFUSED,
};

struct identify_result {
    uint32_t state;   /* enum identify_state */
    uint32_t reason;  /* enum identify_reason, of a refused one */
    int32_t value;    /* in the quantity's unit */
    int32_t interval; /* +- around the value in 95 % of cases */
};

/* Steps begin on multiples of this, so that they do not depend on the duration of the thread's arithmetic. */
#define IDENTIFY_PACE_MS 16u

#define IDENTIFY_LEVELS 10 /* of current: tenths of the rated one */
#define IDENTIFY_ANGLES 6  /* of 60 degrees: both signs along each phase */
#define IDENTIFY_AXES   16 /* angles over half a turn */

/* Sensor gain errors, which measurements with them cannot reveal. Bounds, in thousandths. */
#define IDENTIFY_CURRENT_GAIN_PERMILLE 15
#define IDENTIFY_BUS_GAIN_PERMILLE     7

/* ---- memory of a step, cleared at its begin, valid until it is evaluated ---- */

struct identify_pulses {
    uint32_t count;            /* bursts at the final height */
    struct burst_sums sums[3]; /* one for each angle */
};

struct identify_hold {
    int64_t v_sum; /* steps times bus voltage, Q15 */
    int32_t i_sum_q15, count;
};

struct identify_resistance {
    uint32_t angle, visit;
    int64_t v_sum[2][IDENTIFY_ANGLES][IDENTIFY_LEVELS]; /* decreasing and increasing */
    int64_t vbus_sum_q15;
    int32_t from;         /* counts at the last millisecond */
    int32_t led, drifted; /* counts while the field moved, and while it did not */
};

enum identify_pass {
    IDENTIFY_HELD, /* the rotor, by a current */
    IDENTIFY_FREE,
    IDENTIFY_PASSES
};

struct identify_axes {
    uint32_t bursts;                /* in this pass */
    int32_t held_steps, free_steps; /* amplitudes of the wave */
    struct measure_axes sums[IDENTIFY_PASSES];
};

struct identify_inductance {
    uint32_t bursts;
    struct burst_sums sums[2][2]; /* of d and q, each in two halves: their difference gives the uncertainty */
};

struct identify_turn {
    struct field_pass field;
    struct pendulum rotor;     /* moved by the field, without damping */
    int32_t travel_counts[2];  /* counts from one turn of the field, forward and back */
    uint32_t field_q32[2];     /* its mean angle */
    int32_t mean_counts_q8[2]; /* and the encoder's mean count meanwhile */
    bool uneven, unsteady;     /* does not follow the field; or not evenly */
    bool slowly;               /* repeated more slowly */
};

struct identify_push {
    int32_t i_q15;             /* pushing current */
    int32_t emf_q18;           /* induced in q, a mean over 8 ms, 3 more bits */
    struct measure_run run[2]; /* back and forward */
};

struct identify_index {
    uint32_t seen;         /* how often */
    int32_t first, second; /* their counts */
    int32_t from;          /* where the search began */
};

#define IDENTIFY_POINTS 4
#define IDENTIFY_BLOCKS 8

struct identify_point {
    int64_t i_q[IDENTIFY_BLOCKS]; /* sums over the samples, Q15 */
    int64_t v_d, v_q, x;          /* the same of all blocks; x: speed, rpm Q15 */
};

struct identify_speeds {
    uint32_t settled_ms, waited_ms, measured_ms;
    uint32_t offset_q32; /* of the frame meanwhile */
    bool index_seen;
    uint32_t index; /* counter at its beginning, turning forward */
    struct identify_point points[IDENTIFY_POINTS];
};

#define IDENTIFY_RAMPS 5

struct identify_ramps {
    uint32_t led_ms;                                                 /* at the start speed of the first ramp */
    struct measure_run slows[IDENTIFY_RAMPS], gains[IDENTIFY_RAMPS]; /* braking, then accelerating */
};

#define IDENTIFY_MAP_POINTS 4

/* A point of the map: a current, the waves on top of it, and the EMF at different speeds. */
struct identify_map_point {
    int32_t i_d_q15, i_q_q15; /* the latter with alternating sign */
    int32_t rpm;              /* maximum speed of the rotor */
    int32_t v_steps;          /* height of its waves */
    bool fluxes;              /* whether fluxes are wanted as well */
    uint32_t bursts[2];
    struct burst_sums sums[2][2]; /* of d and q, each in two halves: i_q to either side */
    struct measure_run run[2]
                          /* both signs of i_q; of v_q and of -v_d times the sign of i_q: both increase with speed */
                          [2];
};

struct identify_map {
    uint32_t points;
    uint32_t run_ms, runs; /* time since i_q changed its sign; number of changes */
    int32_t sign;          /* of i_q */
    struct identify_map_point at[IDENTIFY_MAP_POINTS];
};

union identify_work {
    struct identify_pulses pulses;
    struct identify_hold hold;
    struct identify_resistance resistance;
    struct identify_axes axes;
    struct identify_inductance inductance;
    struct identify_turn turn;
    struct identify_push push;
    struct identify_index index;
    struct identify_ramps ramps;
    struct identify_speeds speeds;
    struct identify_map map;
};

struct identify {
    volatile uint32_t step;   /* enum identify_step: the thread advances it while `evaluating` */
    volatile bool evaluating; /* the slow loop has measured; the thread evaluates */
    bool pausing;             /* the next step waits for a multiple of IDENTIFY_PACE_MS */
    volatile bool running;
    uint32_t stopped_in; /* enum identify_step in which it ended: DONE, or at a fault or `off` */
    uint32_t fault;      /* enum fault that ended it, 0: none */
    uint32_t total_ms;
    uint32_t ms;              /* in this step */
    uint32_t phase, phase_ms; /* of this step, and in it */
    bool open;                /* the step has something left to find */
    union identify_work work; /* of this step */
    struct identify_result results[IDENTIFY_QUANTITIES];
    /* results for later steps */
    struct params params;  /* results so far, and the inverter's parameters; for tuning */
    struct params nominal; /* as set by the user: gives the permitted speed */
    struct tuning tuning;  /* of the current loop meanwhile */
    struct burst burst;
    int32_t i_rated_q15;
    int64_t bus_nv;     /* of the pulses */
    int32_t rough_mohm; /* first resistance, from a steady current */
    uint32_t settle_ms; /* until iron and rotor have settled after a current step */
    uint32_t axis_q32;  /* the magnets' angle in the field's frame, or half a turn more */
    bool reluctant;     /* one inductance is twice the other, or more */
    /* turning */
    bool backwards;       /* the encoder counts down as the field turns: its counter must be reversed */
    bool indexed;         /* pole pairs and counts are known; until then assumed values of the same ratio */
    bool retuned;         /* the tuning must be put into effect */
    bool taken;           /* it is in effect, in the rotor's frame */
    int32_t counts;       /* of the encoder since identify began, or since the last take-over */
    int32_t axis_counts;  /* where the axis was measured */
    uint32_t start_q32;   /* rotor's angle at the first one */
    int32_t rpm_max;      /* speed limit from now on */
    int32_t ramp_i_q15;   /* current of the ramps; before that of the push: they take it at least */
    int64_t ramp_mrad_s2; /* acceleration */
    int32_t flux_e1_uwb;  /* flux so far, tenths */
    int32_t swing_rpm;    /* speed from which rated current reverses the rotor in the time needed for the waves */
    int32_t ripple_q10;   /* of the tuning, where current ripple matters; or 0 */
    int32_t wave_steps;   /* height of the waves used to measure inductance */
    uint32_t ahead_q32;   /* the frame's lead over the rotor, from constant speeds: corrected at the next take-over */
    int32_t torque_d_q15, torque_q_q15; /* the split of rated current with most torque */
};

/*
 * Before the first step: takes the inverter's ratings and i_rated_ma from `p`. ERROR_NONE, or why these ratings do not fit
 * together. Clears earlier results. Thread, bridge off.
 */
struct outcome identify_begin(struct identify *d, const struct params *p);

/* One millisecond. True when finished: the bridge may go off. Slow loop, bridge on, wiring good. */
bool identify_step(struct identify *d, const struct measure_io *io);

/*
 * True once before a step that needs it: the rotor is at rest or turns slowly, and the caller must put d->tuning into effect in
 * the rotor's frame, at identify_angle_q32(), with its encoder counts from 0, reversed if d->backwards. Then identify_taken().
 * Slow loop.
 */
bool identify_takes_over(const struct identify *d);
uint32_t identify_angle_q32(const struct identify *d, const volatile struct current_loop *c);
void identify_taken(struct identify *d);

/* A step's name on console and bus. Any context. */
const char *identify_step_name(uint32_t step);

/* True if the currents are regulated in the rotor's frame: with the tuning in effect. Slow loop. */
bool identify_in_rotor_frame(const struct identify *d);

/* Another tuning will take effect: the encoder's counter must be set up again for it. Thread, bridge off. */
void identify_leave(struct identify *d);

/* The tuning for current_loop_follow() before that. Slow loop. */
const struct tuning *identify_tuning(const struct identify *d);

/* Evaluates what has been measured, if anything. Thread, often. */
void identify_evaluate(struct identify *d);

/* Ends it, by `fault` or (0) by a request. Any context. */
void identify_stop(struct identify *d, uint32_t fault);

/* Copies the known results into `p`; returns how many parameters changed. Thread, bridge off. */
uint32_t identify_use(const struct identify *d, struct params *p);

#endif
