/* SPDX-License-Identifier: MIT */
/*
 * Faults: the list of causes, and the latch. fault_raise() shuts the gates, then latches the first cause with a snapshot of the
 * drive at that instant. The current loop's interrupt may preempt a call from a lower level; then the interrupt's cause stays.
 *
 * Every fault: X(number, name, code, allowed, initial, retry, stored, "name for people", "what to look at", "its details"), and
 * a remark: what it is.
 *
 *   number   on the buses: a new fault gets the next one, and none is used twice (tests/unit/numbers.toml)
 *   code     of CiA 402 (IEC 61800-7-201, object 0x603F; CiA 301 has the classes); 0xFF00 and up are the manufacturer's
 *   allowed  reactions: a stop needs a working current loop, encoder and bridge; a warning only where operation may continue
 *   initial  the default reaction
 *   retry    automatic restart allowed, for causes that may pass: supply, load, heat
 *   stored   its name in a record of settings (drive/nvm.h), if there is a choice of reactions: must never change
 *   details  @ and # stand for the numbers of fault_record.detail
 *
 * The order is the priority between causes seen in the same sample: what hardware found comes before what software concludes
 * from it. docs/faults.md has a line for each.
 */
#ifndef FIRMWARE_FAULT_FAULT_H
#define FIRMWARE_FAULT_FAULT_H

#include <stdbool.h>
#include <stdint.h>

struct axis;

/* clang-format off */
#define FAULTS(X) \
    X(1, STO_A, 0xFF01, OFF, OFF, NO_RETRY, NULL, "safe torque off A", \
      "the first input requested a stop: its switch, line, supply", "") \
    /* first safe-torque-off input; the fabric has switched off already */ \
    X(2, STO_B, 0xFF02, OFF, OFF, NO_RETRY, NULL, "safe torque off B", \
      "the second input requested a stop: its switch, line, supply", "") \
    /* second input */ \
    X(3, OVERCURRENT_HARDWARE, 0x2320, OFF, OFF, NO_RETRY, NULL, "over-current (hardware)", \
      "short circuit? motor cable, gains, comparator threshold", "") \
    /* the power stage's comparators; the fabric has switched off already */ \
    X(4, GATE_DRIVER, 0x5400, OFF, OFF, NO_RETRY, NULL, "gate driver", "gate supply, driver temperature, bridge", "") \
    /* the gate driver's fault pin */ \
    X(5, INTERLOCK, 0x5400, OFF, OFF, NO_RETRY, NULL, "interlock", \
      "both sides of a phase were commanded on: dead time, PWM driver", "") \
    /* both sides of a phase commanded on */ \
    X(6, LOOP_OVERRUN, 0x6100, OFF, OFF, NO_RETRY, NULL, "loop overrun", \
      "the current loop missed a sample: interrupt load, debugger halt", "") \
    /* a sample was not taken within its PWM period */ \
    X(7, ENCODER, 0x7305, OFF | CARRY, OFF, NO_RETRY, "encoder", "encoder", "encoder cable, supply, line receiver", "") \
    /* signal lost, or an impossible transition */ \
    X(8, OVERCURRENT, 0x2310, OFF, OFF, RETRY, NULL, "over-current", "current gains, i_trip_ma, load", "") \
    /* a phase current beyond i_trip */ \
    X(9, CURRENT_SUM, 0x2330, OFF, OFF, NO_RETRY, NULL, "current sum", "a current sensor, its gain, or a leak to earth", "") \
    /* the three phase currents do not add up to zero */ \
    X(10, OVERVOLTAGE, 0x3210, OFF, OFF, RETRY, NULL, "over-voltage", \
      "braking energy has nowhere to go: ramp_rpm_s, brake resistor, v_max_mv", "") \
    /* the bus above v_max */ \
    X(11, UNDERVOLTAGE, 0x3220, OFF, OFF, RETRY, NULL, "under-voltage", "supply, its current limit, v_min_mv", "") \
    /* the bus below v_min while the bridge is on */ \
    X(12, OVERSPEED, 0x8400, OFF | STOP, OFF, NO_RETRY, "over-speed", "over-speed", \
      "overhauling load, encoder_counts, overspeed_rpm", "") \
    /* the shaft beyond overspeed_rpm */ \
    X(13, CURRENT_OFFSET, 0x5210, OFF, OFF, NO_RETRY, NULL, "current offset", \
      "a current sensor's zero is out of range: amplifier, reference", "@ mA of the three added up, on average; 0: at 'on'") \
    /* a current sensor's zero is out of range */ \
    X(14, STALL, 0x7121, OFF | WARN, OFF, RETRY, "stall", "stall", \
      "the rotor is blocked, the load too heavy, or the encoder stands still", "") \
    /* full current, no motion */ \
    X(15, LOOP_STOPPED, 0x6100, OFF, OFF, NO_RETRY, NULL, "loop stopped", \
      "no end-of-conversion interrupts: fabric clock, PWM, ADC", "") \
    /* the current loop's interrupt has gone silent, or comes too often */ \
    X(16, WATCHDOG, 0x6010, OFF, OFF, NO_RETRY, NULL, "watchdog reset", "the program hung or the refresh came late", "") \
    /* the last reset came from the watchdog */ \
    X(17, EXCEPTION, 0x6010, OFF, OFF, NO_RETRY, NULL, "processor exception", "'fault' shows the registers", "") \
    /* the last reset followed a processor fault; the console has the details */ \
    X(18, CLOCK, 0x5000, OFF, OFF, NO_RETRY, NULL, "clock", \
      "clock ratios differ from drivers/board.h, or a PLL is not locked: Libero clock settings", "") \
    /* the clocks do not match the board header, or are not locked */ \
    X(19, FABRIC, 0x5000, OFF, OFF, NO_RETRY, NULL, "fabric", "the FPGA does not carry the design of docs/fabric.md", "") \
    /* the fabric does not carry the expected design */ \
    X(20, LOCKUP, 0x6010, OFF, OFF, NO_RETRY, NULL, "lock-up reset", \
      "a fault inside the fault's handler: bus errors, a broken stack or memory", "") \
    /* the last reset came from a lock-up: a fault inside a fault handler */ \
    X(21, STACK_GUARD, 0x5000, OFF, OFF, NO_RETRY, NULL, "stack guard", \
      "no memory protection unit: MPU switched off in Libero", "") \
    /* the memory protection below the stack is not in effect */ \
    X(22, WATCHDOG_OFF, 0x5000, OFF, OFF, NO_RETRY, NULL, "watchdog off", \
      "start-up could not switch it on: the design locks WDOG_CR or sets interrupt mode, docs/fabric.md", "") \
    /* the watchdog is off, or does not reset */ \
    X(23, PLL, 0x5000, OFF, OFF, NO_RETRY, NULL, "PLL lost its lock", "reference clock, PLL supply and its filter", "") \
    /* a PLL lost its lock while the program ran */ \
    X(24, ECC, 0x5500, OFF, OFF, NO_RETRY, NULL, "memory error", \
      "two wrong bits in a word of eSRAM: supply, radiation, a worn device", "") \
    /* an uncorrectable memory error while the program ran */ \
    X(25, ENCODER_SLIP, 0x7305, OFF | CARRY, OFF, NO_RETRY, "encoder_slip", "encoder slip", \
      "coupling between encoder and shaft, disturbance on the encoder's lines", "off by @ deg electrical") \
    /* the counted angle is not the rotor's */ \
    X(26, ENCODER_DEAD, 0x7305, OFF | CARRY, OFF, NO_RETRY, "encoder_dead", "encoder dead", \
      "the motor turned and no counts came: encoder cable, supply, coupling; or the shaft was held", \
      "@ counts in an electrical turn, instead of #") \
    /* no counts although the rotor turns */ \
    X(27, ENCODER_COUNTS, 0x7305, OFF | STOP | WARN | CARRY, OFF, NO_RETRY, "encoder_counts", "encoder counts", \
      "encoder_counts does not fit pole_pairs or the index: the setting, dirt on the disc, disturbance on the lines", \
      "encoder_counts # would fit") \
    /* the index does not come where the count says */ \
    X(28, OPEN_PHASE, 0x3130, OFF, OFF, NO_RETRY, NULL, "open phase", \
      "motor cable, plug, a bridge leg, or a current sensor that shows nothing: low_side_shunts?", \
      "phase @: 1 is A, 2 is B, 3 is C; 0: more than one") \
    /* a phase that should carry current does not */ \
    X(29, SPEED_DEVIATION, 0x8400, OFF | STOP | WARN, OFF, RETRY, "speed_deviation", "speed deviation", \
      "load, i_max_ma, deviation_pct", "@ rpm from the reference") \
    /* the speed has left its reference */ \
    X(30, OVERTEMPERATURE, 0x4310, OFF | STOP | WARN, STOP, RETRY, "over-temperature", "over-temperature", \
      "load, cooling, i_rated_ma, t_max_c", "winding at @ degC") \
    /* the winding is beyond t_max */ \
    X(31, INVERTER_OVERLOAD, 0x2350, OFF | STOP | WARN, STOP, RETRY, "inverter_overload", "inverter overload", \
      "load, inverter_ma, inverter_tau_ms", "") \
    /* I2t of the power stage */ \
    X(32, VOLTAGE_LIMIT, 0x3220, OFF | STOP | WARN, WARN, RETRY, "voltage_limit", "voltage limit", \
      "supply, speed_max_rpm, flux_uwb: the bus does not drive the current", "") \
    /* the bus voltage cannot drive the requested current */ \
    X(33, LIMIT_CYCLE, 0x8400, OFF | STOP | WARN, OFF, NO_RETRY, "limit_cycle", "limit cycle", \
      "speed_bw_hz, inertia_gmm2: the speed loop swings", "at @ Hz") \
    /* the speed loop oscillates by itself */ \
    X(34, COMMAND_TIMEOUT, 0x8100, OFF | STOP | WARN, STOP, NO_RETRY, "command_time-out", "command time-out", \
      "the controller of this drive; command_timeout_ms", "no command for @ ms") \
    /* no command for too long */ \
    X(35, ROTOR_TURNING, 0xFF10, OFF, OFF, NO_RETRY, NULL, "rotor turning", \
      "something else turns the motor: wait until it stands still, close the brake", "it moved by @ of # counts in 0.13 s") \
    /* start: the rotor did not come to rest */ \
    X(36, SENSOR_SIGN, 0x5210, OFF, OFF, NO_RETRY, NULL, "current sensor sign", \
      "a current sensor counts backwards: its wiring, amplifier or gain", "phase @: 1 is A, 2 is B, 3 is C") \
    /* start: a current sensor counts backwards */ \
    X(37, ENCODER_DIRECTION, 0x7305, OFF, OFF, NO_RETRY, NULL, "encoder direction or phase order", \
      "exchange A and B of the encoder, or two phases of the motor", "@ counts in an electrical turn, instead of #") \
    /* start: encoder reversed or phase order wrong, which look alike */ \
    X(38, POLE_PAIRS, 0x6320, OFF, OFF, NO_RETRY, NULL, "pole pairs", "pole_pairs does not fit the encoder's counts", \
      "pole_pairs @ would fit, or else encoder_counts #") \
    /* start: pole_pairs does not fit the encoder's counts */ \
    X(39, ROTOR_BLOCKED, 0x7121, OFF, OFF, NO_RETRY, NULL, "rotor blocked", \
      "rotor blocked, brake not released, load too heavy, or i_align_ma too small", \
      "@ counts in an electrical turn, instead of #") \
    /* start: the rotor does not follow the field */ \
    X(40, LOAD_TOO_HIGH, 0xFF11, OFF, OFF, NO_RETRY, NULL, "load too high at start", \
      "less load while it starts, or a larger i_align_ma and i_max_ma", \
      "it turned the rotor out of the field by @ degrees electrical") \
    /* start: the load pulls the rotor out of the field */ \
    X(41, GATES_OFF, 0x5400, OFF, OFF, NO_RETRY, NULL, "gates off", \
      "the fabric let go and says no cause: its design, its reset or clock", "") \
    /* the fabric switched the gates off but latched no cause */ \
    X(42, FOLLOWING_ERROR, 0x8611, OFF | STOP | WARN, STOP, NO_RETRY, "following_error", "following error", \
      "load, profile_rpm_s, following_mturn, position_bw_hz", "@ counts from where it should be") \
    /* the shaft is not where it should be */ \
    X(43, HOMING, 0x8613, OFF | STOP, STOP, NO_RETRY, "homing", "homing", \
      "no index came, or no block within home_turns; or blocked before: home_rpm, home_pct", "gave up after @ counts") \
    /* the search for index or hard stop found nothing */ \
    X(44, LOCK_LOST, 0xFF12, OFF, OFF, RETRY, NULL, "lock lost", \
      "a load step, a bus voltage or a resistance_mohm beyond what the observer tolerates", \
      "what shows it is off by @ %, margin # tenths") \
    /* without an encoder: the observer has lost the rotor */ \
    X(45, OUT_OF_STEP, 0xFF13, OFF, OFF, RETRY, NULL, "out of step", \
      "the load is too much for the field that leads: load, i_max_ma, ramp_rpm_s", \
      "@ % of the EMF is where it should be, margin # tenths") \
    /* without an encoder: the rotor has fallen out of step with the prescribed field */ \
    X(46, SALIENCY, 0xFF14, OFF, OFF, NO_RETRY, NULL, "saliency not seen", \
      "a larger injection_mv; or the motor has too little saliency: use an encoder", \
      "the current answered by @ LSB a degree, # hundredths; it takes 4") \
    /* start: the current does not show the rotor's position */ \
    X(47, POLARITY, 0xFF15, OFF, OFF, NO_RETRY, NULL, "north pole not found", \
      "a rotor that is free and at rest, or a larger i_max_ma or injection_mv", \
      "torque for @ ms in both directions did not show it") \
    /* start: cannot tell which end of the rotor's axis is north */ \
    X(48, HALL_INVALID, 0x7306, OFF | CARRY, OFF, RETRY, "hall_state", "Hall state", \
      "a Hall wire is broken, the switches have no supply, or hall_states is wrong", \
      "state @ (4 C + 2 B + A) is not in hall_states") \
    /* the Hall switches show a state that hall_states does not have */ \
    X(49, HALL_SEQUENCE, 0x7300, OFF | CARRY, OFF, RETRY, "hall_sequence", "Hall sequence", \
      "exchanged Hall wires or a wrong hall_states: learn hall; or disturbance: screen, pull-ups", \
      "the rotor is not where state @ says") \
    /* they skip a sector, or the EMF is elsewhere */ \
    X(50, HALL_UNKNOWN, 0x7300, OFF, OFF, NO_RETRY, NULL, "Hall switches not learned", \
      "the rotor must turn freely with i_align_ma; a Hall wire, their supply", \
      "@ edges in an electrical turn and # states, instead of 6 and 6") \
    /* `learn hall`: did not find their table */ \
    X(51, SLOW_LOOP_STOPPED, 0x6100, OFF, OFF, NO_RETRY, NULL, "slow loop stopped", \
      "its interrupt hung, or was held off for milliseconds", "") \
    /* no watchdog write by the slow loop; the fabric has switched off already */ \
    X(52, THREAD_STOPPED, 0x6100, OFF | STOP, STOP, NO_RETRY, "thread_stopped", "thread stopped", \
      "console, bus or other work hung", "it made no progress for @ ms") \
    /* console and buses made no progress for 100 ms; a controlled stop */ \
    X(53, OSCILLATION, 0x8400, OFF | STOP | WARN | SLOWER, CARRY, NO_RETRY, "oscillation", "oscillation", \
      "a coupling that swings, inertia_gmm2, speed_bw_hz", "at @ Hz, or folded to it") \
    /* the speed loop swings with its shaft: a coupling, or an inertia far from inertia_gmm2 */ \
    X(54, MASTER_LOST, 0x8130, OFF | STOP | WARN, STOP, NO_RETRY, "master_lost", "master lost", \
      "the CAN bus and its master", "why: @ (1 heartbeat, 2 NMT, 3 bus-off)") \
    /* the master of the CAN bus no longer commands it */ \
    X(55, OFFSET, 0x7305, OFF, OFF, NO_RETRY, NULL, "offset", \
      "motor, encoder or phases changed; offset dropped: the next 'on' aligns", \
      "the magnets are @ degrees from where the encoder's offset says") \
    /* the remembered angle between encoder and magnets is not the rotor's */ \
    X(56, SENSORS_EXCHANGED, 0x5210, OFF, OFF, NO_RETRY, NULL, "current sensors exchanged", \
      "exchange their lines to the converter; or a leg's gate signals go to another leg", \
      "A, B, C show the currents of @: 1 is A, 2 is B, 3 is C") \
    /* start: a current sensor shows another phase's current */ \
    X(57, TEMPERATURE_SENSOR, 0x7300, OFF, OFF, NO_RETRY, NULL, "temperature sensor", \
      "its line is cut or shorted, or it is not at the winding; the model protects", "") \
    /* the winding's temperature sensor shows what cannot be */ \
    X(58, STO_APART, 0xFF03, OFF, OFF, NO_RETRY, NULL, "safe torque off inputs differ", \
      "one input asked alone for 0.5 s: its switch, line, supply; both must ask once before 'clear' works", "") \
    /* the two inputs of safe torque off do not agree */
/* clang-format on */

#define FAULT_NUMBER(number, name, ...) FAULT_##name = (number),

enum fault { FAULT_NONE, FAULTS(FAULT_NUMBER) FAULT_COUNT };

/* True if a start-up fault means that the fabric's identity or clock is unknown: none of its registers may be accessed. */
static inline bool fault_fabric_is_untrusted(enum fault cause)
{
    return cause == FAULT_CLOCK || cause == FAULT_FABRIC;
}

struct fault_snapshot {
    uint64_t up_ms;
    uint32_t state; /* enum axis_state */
    int32_t i_a_q15, i_b_q15, i_c_q15;
    int32_t i_d_q15, i_q_q15;
    int32_t vbus_q15;
    int32_t speed_rpm_q4;
    uint32_t angle_u16;
    uint32_t gate_status;
};

struct fault_record {
    volatile uint32_t cause; /* enum fault: the first, until cleared */
    volatile uint32_t count; /* faults latched since start-up, including cleared ones */
    int32_t detail[2];       /* details of the cause; message_fault_detail() says what they mean */
    struct fault_snapshot snapshot;
};

/* Reactions to a fault. Each class allows some; hardware faults, and those without control of the motor, only OFF. */
enum reaction {
    REACTION_OFF,  /* bridge off immediately */
    REACTION_STOP, /* quick stop, then off; the fault is latched */
    REACTION_WARN, /* operation continues, the console reports it once */
    REACTION_CARRY, /* the same, with less: without the encoder, if the observer sees the rotor (drive/failover.h; else stop or
                       off); with a slower speed loop (control/oscillation.h; else off) */
    REACTION_COUNT
};

struct fault_class {
    uint8_t allowed; /* one bit per enum reaction */
    uint8_t initial; /* enum reaction */
    bool retry;      /* automatic restart allowed */
};

/* Never NULL; an unknown cause gets the class that allows only off. Any context. */
const struct fault_class *fault_class(enum fault cause);

/* Each fault's initial reaction. Any context. */
void fault_default_reactions(uint8_t choice[FAULT_COUNT]);

/* True if the reaction needs the observer, and that is not in the image. Any context. */
bool fault_reaction_is_absent(enum fault cause, enum reaction choice);

/* The fault of the gate block's latches; FAULT_NONE when none is set. */
enum fault fault_from_gate(uint32_t gate_flags);

/* The fault of the ADC block's flags; FAULT_NONE when none is set. */
enum fault fault_from_adc(uint32_t adc_flags);

/*
 * Gates off, and latches the cause with a snapshot if it is the first. Any context. The second also takes fault_record.detail.
 */
void fault_raise(struct axis *a, enum fault cause);
void fault_raise_with(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1);

/* Latches without switching the gates off, for a controlled stop; true if it was the first. Any context. */
bool fault_latch(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1);

/* Replaces the latched cause by a more exact one. Slow loop. */
void fault_correct_cause(struct axis *a, enum fault cause);

/* Clears the latch, for the operator or a restart: the bridge may be enabled again. Slow loop. */
void fault_clear(struct axis *a);

/* ==== reporting ==== */

/*
 * Faults found by the slow loop. Modes, sources and monitors only report them; drive/reaction.h carries out the reactions, in
 * the order of the reports, at the end of the same step.
 */

#define FAULT_REPORTS_MAX 12u /* more than a step can make */
#define FAULT_WORDS       ((FAULT_COUNT + 31u) / 32u)

struct fault_report {
    enum fault cause;
    int32_t detail[2]; /* fault_record.detail */
};

struct fault_reports {
    uint32_t count;
    struct fault_report report[FAULT_REPORTS_MAX];
    volatile uint32_t warned[FAULT_WORDS]; /* a bit for each fault that was a warning since `on` */
};

/* If there is no room the fault is raised. Slow loop. */
void fault_report(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1);

/* Warns, independent of the chosen reaction. Slow loop. */
void fault_warn(struct axis *a, enum fault cause);

/* Warns while it lasts, bridge off or on. Slow loop, each step. */
void fault_warn_while(struct axis *a, enum fault cause, bool lasts);

/* True if a fault was a warning since `on`. Any context. */
bool fault_warned(const struct fault_reports *r, enum fault cause);

/* True if any was. Any context. */
bool fault_any_warned(const struct fault_reports *r);

/* Clears the warnings. Slow loop, at `on`. */
void fault_clear_warnings(struct fault_reports *r);

#endif
