/* SPDX-License-Identifier: MIT */
#include "firmware/operate/messages.h"

#include <stddef.h>

#include "firmware/drive/start_parts.h"

#define OF(feature, text) (FEATURE_IN(feature) ? text : NULL)

static const char *const error_texts[ERROR_COUNT] = {
    [ERROR_NONE] = "ok",
    [ERROR_CURRENT_GAIN] =
        "current gain out of range: ld_uh, lq_uh and the apparent ones can be at most @ uH with this current_bw_hz and "
        "v_range_mv/i_range_ma",
    [ERROR_CURRENT_INTEGRAL_GAIN] =
        "integral gain out of range: a resistance_mohm of @ would fit current_bw_hz and v_range_mv/i_range_ma",
    [ERROR_DECOUPLING] = "decoupling out of range: flux_uwb can be at most @ uWb with this v_range_mv",
    [ERROR_I_TRIP_BEYOND_RANGE] =
        "i_trip_ma must be at most 95 % of i_range_ma, @ mA, or the sensor clips before it trips",
    [ERROR_I_MAX_BEYOND_TRIP] = "i_max_ma must be at most 85 % of i_trip_ma, @ mA, to leave room for overshoot",
    [ERROR_I_ALIGN_BEYOND_MAX] = "i_align_ma must not exceed i_max_ma, @ mA",
    [ERROR_CHOPPER_LEVELS] =
        "chopper_off_mv must be above 0 and by 0.1 % of v_range_mv below chopper_on_mv, and that below v_max_mv",
    [ERROR_V_LIMITS] = "v_min_mv must be below v_max_mv, and that at most 98 % of v_range_mv, @ mV",
    [ERROR_SPEED_MAX_BEYOND_OVERSPEED] = "speed_max_rpm must be below overspeed_rpm: at most @ rpm",
    [ERROR_V_MIN_BELOW_MODULATOR] = "v_min_mv must be at least a quarter of v_range_mv, the modulator's range: @ mV",
    [ERROR_SAMPLES_OF_SHUNTS] =
        "pwm_samples 2 needs sensors in line with the phases: low_side_shunts see nothing at every second sample",
    [ERROR_SAMPLES_AT_VALLEY] =
        "pwm_samples 2 needs pwm_update 1 or 2: at the valley every second sample goes unanswered",
    [ERROR_SAMPLES_TOO_FAST] = "pwm_samples 2 needs a PWM of 20 kHz or less",
    [ERROR_MODULATOR_OSR] = "modulator_osr must be 32, 64, 128 or 256; or 0: the serial converters",
    [ERROR_MODULATOR_OF_SHUNTS] = "modulator_osr needs sensors in line with the phases: low_side_shunts 0",
    [ERROR_MODULATOR_TOO_SLOW] = "modulator_osr takes too long for this time between two samples: choose a smaller one",
    [ERROR_CURRENT_MARGIN] = "current_bw_hz leaves too little phase margin with this pwm_update: at most @",
    [ERROR_SPEED_MARGIN] = "speed_bw_hz leaves less than 45 degrees of phase margin: at most @",
    [ERROR_SPEED_RESOLUTION] =
        "speed_bw_hz is too much for encoder_counts with this inertia_gmm2 and i_max_ma: at most @",
    [ERROR_SPEED_UNRESOLVED] =
        "encoder_counts is too small for this inertia_gmm2 and i_max_ma, whatever speed_bw_hz is",
    [ERROR_ENCODER_COARSE] = "encoder_counts is too small for pole_pairs: at least @, or another angle_source",
    [ERROR_CURRENT_TOO_SLOW] = "current_bw_hz is too small for any speed_bw_hz",
    [ERROR_SPEED_GAIN] = "speed gain out of range: an inertia_gmm2 of @ would fit flux_uwb, speed_bw_hz and i_range_ma",
    [ERROR_LD_APPARENT] = "ld_apparent_uh must be at most 8 times ld_uh, @ uH; or 0: the same",
    [ERROR_LQ_APPARENT] = "lq_apparent_uh must be at most 8 times lq_uh, @ uH; or 0: the same",
    [ERROR_LQ_REST] = "lq_rest_uh must be at most 16 times lq_uh, @ uH; or 0: the same",
    [ERROR_INERTIA] = "inertia_gmm2 takes more than 5 minutes from 0 to speed_max_rpm with i_max_ma: at most @ g mm2 "
                      "(1 kg cm2 is 100000)",
    [ERROR_FAULT_LATCHED] = "a fault is latched; see 'fault', then 'clear'",
    [ERROR_ALREADY_ON] = "the drive is on already",
    [ERROR_BUS_LOW] = "the bus voltage is below v_min_mv, @ mV; see 'status'",
    [ERROR_BUS_HIGH] = "the bus voltage is above v_max_mv, @ mV; see 'status'",
    [ERROR_TURNING] = "the motor is turning; wait until it stands still, or brake it; angle_source 1 and 2 catch it",
    [ERROR_NOT_OPERATING] = "the drive is not in operation; use 'on' and wait for it",
    [ERROR_NO_FAULT] = "no fault is latched",
    [ERROR_GATE_INPUT_ACTIVE] = "the cause is still there: an input of the gate driver is active",
    [ERROR_NO_ENCODER_SIGNAL] = "the cause is still there: no encoder signal",
    [ERROR_FABRIC] = "the cause is still there: the fabric does not carry the expected design",
    [ERROR_CLOCK] = "the cause is still there: the clock ratios are not those of the board, or a PLL is not locked",
    [ERROR_STACK_GUARD] = "the cause is still there: the stack guard is not in effect; reset the device",
    [ERROR_WATCHDOG_OFF] = "the cause is still there: the watchdog is off, or does not reset",
    [ERROR_FABRIC_DOUBTED] = "the fabric is not touched after this fault; mend the cause, then reset the device",
    [ERROR_BEYOND_SPEED_MAX] = "beyond speed_max_rpm: at most @ rpm",
    [ERROR_BEYOND_I_MAX] = "beyond i_max_ma: at most @ mA",
    [ERROR_DRIVE_IS_ON] = "parameters can change only while the drive is off",
    [ERROR_TOO_HOT] = "the winding or the power stage is too hot; see 'status'",
    [ERROR_REACTION_NOT_ALLOWED] = "this fault does not allow that; 'reaction' lists what each allows",
    [ERROR_SWITCHED_OFF] = "switched off again before it was on",
    [ERROR_NOT_IN_BUILD] = "this build leaves $ out; 'make FEATURES=...' names what a build has",
    [ERROR_BUSY] = "the last request has not been carried out yet; try again",
    /* position */
    [ERROR_POSITION_MARGIN] =
        OF(POSITION, "position_bw_hz leaves less than 60 degrees of phase margin with this speed_bw_hz: at "
                     "most @; 0 is a fifth of it"),
    [ERROR_NEEDS_ENCODER] = "a position takes an encoder: angle_source 0",
    [ERROR_BEYOND_CYCLE] =
        OF(POSITION, "farther than speed_max_rpm goes in cyclic_ms: at most @ counts from the one before"),
    [ERROR_HOMING] = OF(POSITION, "the drive is homing; wait for its end"),
    [ERROR_HOME_SPEED] = OF(POSITION, "home_rpm must not be 0, nor beyond speed_max_rpm, @ rpm"),
    [ERROR_SPEED_BEYOND_OBSERVER] =
        "overspeed_rpm is beyond what the loops follow with these pole_pairs: at most @ rpm",
    /* sensorless */
    [ERROR_OBSERVER] =
        OF(SENSORLESS,
           "angle_source 1: resistance_mohm, ld_uh, lq_uh and flux_uwb do not fit one another at this PWM rate"),
    [ERROR_SENSORLESS_RELUCTANT] = OF(
        SENSORLESS,
        "angle_source 1 does not start a motor whose reluctance outweighs its magnets without injection_mv; a fifth of "
        "v_min_mv is a beginning"),
    /* injection */
    [ERROR_INJECTION_UPDATE] = OF(
        INJECTION, "injection_mv needs pwm_update 0 or 2: between two samples at both ends the voltage's signs cancel"),
    /* hall */
    [ERROR_HALL_STATES] =
        OF(HALL, "hall_states needs six different digits 0 to 7, each and the next one (the last and the first, too) "
                 "one switch apart: 513264 for instance"),
    [ERROR_HALL_EDGES] = OF(HALL, "hall_edge_1_cdeg to hall_edge_6_cdeg must grow, round one turn, by 2500 to 9500 "
                                  "each: 'learn hall' finds them"),
    [ERROR_NEEDS_HALL] = OF(HALL, "Hall switches are learned with angle_source 2"),
    /* the source of the angle */
    [ERROR_SOURCE_MODE] = "the angle's source changes in control of speed or torque: 'speed' or 'torque' first",
    [ERROR_SOURCE_WEAKENS] =
        "a field that is weakened or overmodulated takes an encoder: with a speed_max_rpm that the "
        "bus reaches without, and overmodulation 0, others can tell the angle",
    [ERROR_SOURCE_RELUCTANT] =
        "this motor's reluctance outweighs its magnets: without a sensor it goes from 'on' only, "
        "with angle_source 1 and injection_mv",
    [ERROR_SOURCE_FIELD] =
        "a prescribed field leads, and the rotor's angle is not known: faster, until the observer leads",
    [ERROR_SOURCE_ENCODER] = "the encoder shows no signal, or one that is illegal: its lines and supply",
    [ERROR_SOURCE_HALL] =
        "the Hall switches do not show the six states of hall_states: their wires and supply, or 'learn hall'",
    [ERROR_SOURCE_SLOW] = "both angles are compared over an electrical turn, within a second: at least @ rpm",
    [ERROR_SOURCE_MARGIN] = "the observer would see too little EMF at this speed and current: at least @ rpm",
    [ERROR_SOURCE_APART] =
        "the two angles are @ degrees apart, and 15 may be: 'off' and 'on' find the encoder's place, "
        "'learn hall' that of the switches",
    /* weakening */
    [ERROR_OVERMODULATION_OF_SHUNTS] =
        OF(WEAKENING, "overmodulation needs sensors in line with the phases: low_side_shunts 0"),
    [ERROR_EMF_BEYOND_V_MAX] =
        OF(WEAKENING, "at overspeed_rpm the magnets alone bring the bus beyond v_max_mv: emf_beyond_v_max 1 "
                      "allows it, else at most @"),
    /* learn */
    [ERROR_LEARNING] = OF(LEARN, "the drive is learning; wait for its end"),
    [ERROR_LEARN_SPEED] = OF(LEARN, "learn_rpm is beyond speed_max_rpm, @ rpm"),
    /* settings */
    [ERROR_NOTHING_STORED] = OF(SETTINGS, "no settings are stored"),
    [ERROR_STORED_FORMAT] = OF(SETTINGS, "a stored record has a form that this firmware does not know"),
    [ERROR_STORED_RANGE] = OF(SETTINGS, "a stored value is outside its range"),
    [ERROR_SAVE_WHILE_ON] = OF(SETTINGS, "settings are saved only while the drive is off: 'off' first"),
    [ERROR_SAVE_FULL] = OF(SETTINGS, "the settings do not fit into their place in eNVM; after 'defaults', 'save' drops "
                                     "what other firmware has stored"),
    [ERROR_ENVM_CLOCK] = OF(SETTINGS, "nothing is programmed at a clock that is not right: see 'fault'"),
    [ERROR_ENVM_NOT_GRANTED] = OF(SETTINGS, "eNVM: something else in the device uses its controller; try again"),
    [ERROR_ENVM_TIMED_OUT] = OF(SETTINGS, "eNVM: programming a page did not end in time; try again"),
    [ERROR_ENVM_DENIED] = OF(SETTINGS, "eNVM: the design protects the pages of the settings"),
    [ERROR_ENVM_BUSY] = OF(SETTINGS, "eNVM: its controller was busy with another command; try again"),
    [ERROR_ENVM_LOCKED] = OF(SETTINGS, "eNVM: a page of the settings is locked; a programmer unlocks it"),
    [ERROR_ENVM_ERASE] = OF(SETTINGS, "eNVM: a page cannot be erased: worn out, or the supply is too low"),
    [ERROR_ENVM_WRITE] = OF(SETTINGS, "eNVM: a page does not take what is written: worn out, or the supply is too low"),
    [ERROR_ENVM_VERIFY] = OF(SETTINGS, "eNVM: a page does not read back as it was written"),
    /* scope */
    [ERROR_SCOPE_ARMED] = OF(SCOPE, "a capture is under way; wait for its end, or 'scope off'"),
    [ERROR_SCOPE_NOT_ARMED] = OF(SCOPE, "no capture waits for its trigger; 'scope arm' begins one"),
    [ERROR_SCOPE_BEFORE] =
        OF(SCOPE, "with these signals at most @ samples stand before the trigger; 'scope before' sets them"),
    [ERROR_SWEEPING] = OF(SCOPE, "a sweep is under way; wait for its end, or 'sweep off'"),
    [ERROR_SWEEP_MODE] = OF(SCOPE, "the speed loop is swept while it controls: 'speed' first"),
    [ERROR_SAVE_BESIDE_ON] =
        OF(SETTINGS, "saving keeps the core from both motors: the other axis off and at rest first"),
    [ERROR_IDENTIFY_BESIDE] = OF(IDENTIFY, "the other axis is identified; wait for its end, or switch it off"),
    [ERROR_CATCHES_BESIDE] = OF(IDENTIFY, "the other axis starts without an encoder; wait until it operates"),
    [ERROR_AXIS_RANGE] = "there is no such axis: they count from 1 to @",
    [ERROR_SCOPE_ELSEWHERE] = OF(SCOPE, "the scope is with the axis that 'axis' has chosen: choose this one first"),
    [ERROR_SWEEP_AMPLITUDE] = OF(SCOPE, "the amplitude must be above 0, and at most an eighth of i_max_ma, @ mA"),
};

static const char *const state_names[] = {
    [AXIS_NOT_READY] = "not ready to switch on",
    [AXIS_SWITCH_ON_DISABLED] = "switch on disabled",
    [AXIS_READY] = "ready to switch on",
    [AXIS_SWITCHED_ON] = "switched on",
    [AXIS_OPERATION_ENABLED] = "operation enabled",
    [AXIS_QUICK_STOP] = "quick stop active",
    [AXIS_FAULT_REACTION] = "fault reaction active",
    [AXIS_FAULT] = "fault",
};

static const char *const phase_names[START_PHASES] = {
    [START_CALIBRATE] = "zeros of the current sensors",
    [START_WIRING] = "wiring test",
    [START_ALIGN] = "aligning",
    [START_CONFIRM] = "checking the offset",
    [START_FOLLOW] = "aligned",
    [START_FIELD] = "aligning",
    [START_IDENTIFY] = "identifying",
    [START_CATCH] = "does it turn already?",
    [START_DOUBT] = "wiring test",
    [START_INJECTION] = "saliency test",
    [START_HALL] = "Hall switches",
    [START_LAY_HALL] = "aligning",
    [START_LEARN_HALL] = "learning the Hall switches",
};

static const char *const mode_names[AXIS_MODES] = {
    [AXIS_MODE_SPEED] = "pv (profile velocity)",
    [AXIS_MODE_TORQUE] = "tq (torque)",
    [AXIS_MODE_POSITION] = "pp (profile position)",
    [AXIS_MODE_HOMING] = "hm (homing)",
    [AXIS_MODE_CYCLIC_POSITION] = "csp (cyclic synchronous position)",
    [AXIS_MODE_CYCLIC_SPEED] = "csv (cyclic synchronous velocity)",
    [AXIS_MODE_CYCLIC_TORQUE] = "cst (cyclic synchronous torque)",
    [AXIS_MODE_LEARNING] = "learning",
};

struct fault_text {
    const char *name;
    const char *hint;
    const char *detail;
};

static const struct fault_text fault_texts[FAULT_COUNT] = {
    [FAULT_NONE] = {"none", ""},
    [FAULT_STO_A] = {"safe torque off A", "the first input asked to stop: whoever switched it, its line, its supply"},
    [FAULT_STO_B] = {"safe torque off B", "the second input asked to stop: whoever switched it, its line, its supply"},
    [FAULT_OVERCURRENT_HARDWARE] = {"over-current (hardware)",
                                    "short circuit? motor cable, gains, comparator threshold"},
    [FAULT_GATE_DRIVER] = {"gate driver", "gate supply, driver temperature, bridge"},
    [FAULT_INTERLOCK] = {"interlock", "both sides of a phase were commanded on: dead time, PWM driver"},
    [FAULT_LOOP_OVERRUN] = {"loop overrun", "the current loop missed a sample: interrupt load, debugger halt"},
    [FAULT_ENCODER] = {"encoder", "encoder cable, supply, line receiver"},
    [FAULT_OVERCURRENT] = {"over-current", "current gains, i_trip_ma, load"},
    [FAULT_CURRENT_SUM] = {"current sum", "a current sensor, its gain, or a leak to earth"},
    [FAULT_OVERVOLTAGE] = {"over-voltage", "braking energy has nowhere to go: ramp_rpm_s, brake resistor, v_max_mv"},
    [FAULT_UNDERVOLTAGE] = {"under-voltage", "supply, its current limit, v_min_mv"},
    [FAULT_OVERSPEED] = {"over-speed", "overhauling load, encoder_counts, overspeed_rpm"},
    [FAULT_CURRENT_OFFSET] = {"current offset", "a current sensor's zero is out of range: amplifier, reference",
                              "@ mA of the three added up, on average; 0: at 'on'"},
    [FAULT_STALL] = {"stall", "the rotor is blocked, the load too heavy, or the encoder stands still"},
    [FAULT_LOOP_STOPPED] = {"loop stopped", "no end-of-conversion interrupts: fabric clock, PWM, ADC"},
    [FAULT_WATCHDOG] = {"watchdog reset", "the program hung or the refresh came late"},
    [FAULT_EXCEPTION] = {"processor exception", "'fault' shows the registers"},
    [FAULT_CLOCK] = {"clock",
                     "clock ratios differ from drivers/board.h, or a PLL is not locked: Libero clock settings"},
    [FAULT_FABRIC] = {"fabric", "the FPGA does not carry the design of docs/fabric.md"},
    [FAULT_LOCKUP] = {"lock-up reset", "a fault inside the fault's handler: bus errors, a broken stack or memory"},
    [FAULT_STACK_GUARD] = {"stack guard", "no memory protection unit: MPU switched off in Libero"},
    [FAULT_WATCHDOG_OFF] =
        {"watchdog off",
         "start-up could not switch it on: the design locks WDOG_CR or sets interrupt mode, docs/fabric.md"},
    [FAULT_PLL] = {"PLL lost its lock", "reference clock, PLL supply and its filter"},
    [FAULT_ECC] = {"memory error", "two wrong bits in a word of eSRAM: supply, radiation, a worn device"},
    [FAULT_ENCODER_SLIP] = {"encoder slip", "coupling between encoder and shaft, disturbance on the encoder's lines",
                            "off by @ deg electrical"},
    [FAULT_ENCODER_DEAD] =
        {"encoder dead", "the motor turned and no counts came: encoder cable, supply, coupling; or the shaft was held",
         "@ counts in an electrical turn, instead of #"},
    [FAULT_ENCODER_COUNTS] =
        {"encoder counts",
         "encoder_counts does not fit pole_pairs or the index: the setting, dirt on the disc, disturbance on the lines",
         "encoder_counts # would fit"},
    [FAULT_OPEN_PHASE] = {"open phase",
                          "motor cable, plug, a bridge leg, or a current sensor that shows nothing: low_side_shunts?",
                          "phase @: 1 is A, 2 is B, 3 is C; 0: more than one"},
    [FAULT_SPEED_DEVIATION] = {"speed deviation", "load, i_max_ma, deviation_pct", "@ rpm from the reference"},
    [FAULT_OVERTEMPERATURE] = {"over-temperature", "load, cooling, i_rated_ma, t_max_c", "winding at @ degC"},
    [FAULT_INVERTER_OVERLOAD] = {"inverter overload", "load, inverter_ma, inverter_tau_ms"},
    [FAULT_VOLTAGE_LIMIT] = {"voltage limit", "supply, speed_max_rpm, flux_uwb: the bus does not drive the current"},
    [FAULT_LIMIT_CYCLE] = {"limit cycle", "speed_bw_hz, inertia_gmm2: the speed loop swings", "at @ Hz"},
    [FAULT_OSCILLATION] = {"oscillation", "a coupling that swings, inertia_gmm2, speed_bw_hz",
                           "at @ Hz, or folded to it"},
    [FAULT_COMMAND_TIMEOUT] = {"command time-out", "the controller of this drive; command_timeout_ms",
                               "nothing heard for @ ms"},
    [FAULT_ROTOR_TURNING] = {"rotor turning",
                             "something else turns the motor: wait until it stands still, close the brake",
                             "it moved by @ of # counts in 0.13 s"},
    [FAULT_SENSOR_SIGN] = {"current sensor sign", "a current sensor counts backwards: its wiring, amplifier or gain",
                           "phase @: 1 is A, 2 is B, 3 is C"},
    [FAULT_ENCODER_DIRECTION] = {"encoder direction or phase order",
                                 "exchange A and B of the encoder, or two phases of the motor",
                                 "@ counts in an electrical turn, instead of #"},
    [FAULT_POLE_PAIRS] = {"pole pairs", "pole_pairs does not fit the encoder's counts",
                          "pole_pairs @ would fit, or else encoder_counts #"},
    [FAULT_ROTOR_BLOCKED] = {"rotor blocked",
                             "rotor blocked, brake not released, load too heavy, or i_align_ma too small",
                             "@ counts in an electrical turn, instead of #"},
    [FAULT_LOAD_TOO_HIGH] = {"load too high at start", "less load while it starts, or a larger i_align_ma and i_max_ma",
                             "it turned the rotor out of the field by @ degrees electrical"},
    [FAULT_GATES_OFF] = {"gates off", "the fabric let go and says no cause: its design, its reset or clock"},
    /* position */
    [FAULT_FOLLOWING_ERROR] = {"following error", "load, profile_rpm_s, following_mturn, position_bw_hz",
                               "@ counts from where it should be"},
    [FAULT_HOMING] = {"homing",
                      "no index came, or no block within home_turns; or blocked on the way: home_rpm, home_pct",
                      "gave up after @ counts"},
    /* sensorless */
    [FAULT_LOCK_LOST] = {"lock lost", "a load step, a bus voltage or a resistance_mohm beyond what the observer bears",
                         "what shows it is off by @ %, margin # tenths"},
    [FAULT_OUT_OF_STEP] = {"out of step", "the load is too much for the field that leads: load, i_max_ma, ramp_rpm_s",
                           "@ % of the EMF is where it should be, margin # tenths"},
    /* injection */
    [FAULT_SALIENCY] = {"saliency not seen",
                        "a larger injection_mv; or the motor has too little saliency: use an encoder",
                        "the current answered by @ LSB a degree, # hundredths; it takes 4"},
    [FAULT_POLARITY] = {"north pole not found",
                        "a rotor that is free and at rest, or a larger i_max_ma or injection_mv",
                        "torque for @ ms either way did not tell"},
    /* hall */
    [FAULT_HALL_INVALID] = {"Hall state", "a Hall wire is broken, the switches have no supply, or hall_states is wrong",
                            "state @ (4 C + 2 B + A) is not in hall_states"},
    [FAULT_HALL_SEQUENCE] =
        {"Hall sequence", "exchanged Hall wires or a wrong hall_states: learn hall; or disturbance: screen, pull-ups",
         "the rotor is not where state @ says"},
    [FAULT_HALL_UNKNOWN] = {"Hall switches not learned",
                            "the rotor must turn freely with i_align_ma; a Hall wire, their supply",
                            "@ edges in an electrical turn and # states, instead of 6 and 6"},
    [FAULT_SLOW_LOOP_STOPPED] = {"slow loop stopped", "its interrupt hung, or was held off for milliseconds"},
    [FAULT_MASTER_LOST] = {"master lost", "the CAN bus and its master", "why: @ (1 heartbeat, 2 NMT, 3 bus-off)"},
    [FAULT_OFFSET] = {"offset", "motor, encoder or phases changed; forgotten: the next 'on' aligns",
                      "the magnets are @ degrees from where the encoder's offset says"},
    [FAULT_THREAD_STOPPED] = {"thread stopped", "console, bus or other work hung", "it made no progress for @ ms"},
    [FAULT_SENSORS_EXCHANGED] = {"current sensors exchanged",
                                 "exchange their lines to the converter; or a leg's gate signals go to another leg",
                                 "A, B, C show the currents of @: 1 is A, 2 is B, 3 is C"},
    [FAULT_TEMPERATURE_SENSOR] = {"temperature sensor",
                                  "its line is cut or shorted, or it is not at the winding; the model protects"},
};

#define PARAM_TEXT(name, least, most, initial, what) FEATURE_IN(CONSOLE) ? (what) : NULL,

static const char *const param_texts[] = {PARAMS(PARAM_TEXT)};

const char *message_of_param(uint32_t row)
{
    return param_texts[row];
}

const char *message_of_error(enum error error)
{
    const char *const text = error < ERROR_COUNT ? error_texts[error] : NULL;
    return text != NULL ? text : "unknown error";
}

#define FEATURE_NAME(name, word) #word,

const char *message_of_feature(enum feature feature)
{
    static const char *const names[FEATURE_COUNT] = {FEATURES(FEATURE_NAME)};
    return names[feature];
}

const char *message_of_state(enum axis_state state)
{
    return state < sizeof state_names / sizeof state_names[0] ? state_names[state] : "unknown";
}

const char *message_of_phase(uint32_t phase)
{
    return phase < START_PHASES ? phase_names[phase] : "unknown";
}

const char *message_of_mode(enum axis_mode mode)
{
    return mode < AXIS_MODES ? mode_names[mode] : "unknown";
}

const char *message_of_fault(enum fault cause)
{
    return cause < FAULT_COUNT ? fault_texts[cause].name : "unknown";
}

const char *message_fault_detail(enum fault cause)
{
    return cause < FAULT_COUNT && fault_texts[cause].detail != NULL ? fault_texts[cause].detail : "";
}

const char *message_of_reaction(enum reaction reaction)
{
    static const char *const names[REACTION_COUNT] = {"off", "stop", "warn", "carry"};
    return reaction < REACTION_COUNT ? names[reaction] : "unknown";
}

const char *message_of_update(enum pwm_update update)
{
    static const char *const names[] = {"at the valley", "at both ends", "at once"};
    return update < sizeof names / sizeof names[0] ? names[update] : "unknown";
}

/* As typed: a command word has no blanks, so '_' stands for one; and no capitals. */
char message_typed(char c)
{
    return c == ' ' ? '_' : (c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c);
}

static bool named(const char *name, const char *word)
{
    while (*name != '\0' && message_typed(*name) == message_typed(*word)) {
        name++;
        word++;
    }
    return *name == *word;
}

enum fault message_find_fault(const char *name)
{
    uint32_t cause = FAULT_NONE + 1u;
    while (cause < FAULT_COUNT && !named(fault_texts[cause].name, name)) {
        cause++;
    }
    return (enum fault)cause;
}

const char *message_fault_hint(enum fault cause)
{
    return cause < FAULT_COUNT ? fault_texts[cause].hint : "";
}
