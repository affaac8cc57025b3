/* SPDX-License-Identifier: MIT */
/*
 * Why a request was refused, shared by all parts of the firmware: every interface reports the same.
 *
 * X(number, name, "text"), and a remark: what helps. OF(FEATURE, "text") is the text of an error that only this feature makes.
 * @ stands for the outcome's value, $ for a feature, & for who commands.
 *
 * The numbers are those of the Modbus register `refusal`: a new one gets the next number, and none is used twice
 * (tests/unit/numbers.toml).
 */
#ifndef FIRMWARE_SETTINGS_ERROR_H
#define FIRMWARE_SETTINGS_ERROR_H

#include <stdint.h>

/* clang-format off */
#define ERRORS(X) \
    X(1, CURRENT_GAIN, \
      "current gain out of range: ld_uh, lq_uh and the apparent ones can be at most @ uH with this current_bw_hz and " \
      "v_range_mv/i_range_ma") \
    /* inductances of one phase in uH, or a smaller current_bw_hz */ \
    X(2, CURRENT_INTEGRAL_GAIN, \
      "integral gain out of range: a resistance_mohm of @ would fit current_bw_hz and v_range_mv/i_range_ma") \
    /* the resistance of one phase, or another current_bw_hz */ \
    X(3, DECOUPLING, "decoupling out of range: flux_uwb can be at most @ uWb with this v_range_mv") \
    /* the flux in uWb, or another power stage */ \
    X(4, SPEED_GAIN, "speed gain out of range: an inertia_gmm2 of @ would fit flux_uwb, speed_bw_hz and i_range_ma") \
    /* inertia_gmm2 of rotor and load, flux_uwb; another speed_bw_hz */ \
    X(5, I_TRIP_BEYOND_RANGE, "i_trip_ma must be at most 95 % of i_range_ma, @ mA, or the sensor clips before it trips") \
    /* a smaller i_trip_ma */ \
    X(6, I_MAX_BEYOND_TRIP, "i_max_ma must be at most 85 % of i_trip_ma, @ mA, to leave room for overshoot") \
    /* a smaller i_max_ma or a larger i_trip_ma */ \
    X(7, I_ALIGN_BEYOND_MAX, "i_align_ma must not exceed i_max_ma, @ mA") \
    /* a smaller i_align_ma */ \
    X(8, V_LIMITS, "v_min_mv must be below v_max_mv, and that at most 98 % of v_range_mv, @ mV") \
    /* v_min_mv and v_max_mv around the supply's voltage */ \
    X(9, CHOPPER_LEVELS, \
      "chopper_off_mv must be above 0 and by 0.1 % of v_range_mv below chopper_on_mv, and that below v_max_mv") \
    /* levels between the supply's voltage and v_max_mv, or 0 for no chopper */ \
    X(10, SPEED_MAX_BEYOND_OVERSPEED, "speed_max_rpm must be below overspeed_rpm: at most @ rpm") \
    /* a smaller speed_max_rpm or a larger overspeed_rpm */ \
    X(11, V_MIN_BELOW_MODULATOR, "v_min_mv must be at least a quarter of v_range_mv, the modulator's range: @ mV") \
    /* a larger v_min_mv */ \
    X(12, SAMPLES_OF_SHUNTS, \
      "pwm_samples 2 needs sensors in line with the phases: low_side_shunts see nothing at every second sample") \
    /* pwm_samples 1; or low_side_shunts 0 if the sensors are in line */ \
    X(13, SAMPLES_AT_VALLEY, "pwm_samples 2 needs pwm_update 1 or 2: at the valley every second sample goes unanswered") \
    /* pwm_update 1 or 2 */ \
    X(14, SAMPLES_TOO_FAST, "pwm_samples 2 needs a PWM of 20 kHz or less") \
    /* pwm_samples 1, or an image for a lower PWM rate */ \
    X(15, OVERMODULATION_OF_SHUNTS, OF(WEAKENING, \
      "overmodulation needs sensors in line with the phases: low_side_shunts 0")) \
    /* overmodulation 0; or low_side_shunts 0 if the sensors are in line */ \
    X(16, MODULATOR_OSR, "modulator_osr must be 32, 64, 128 or 256; or 0: the serial converters") \
    /* one of these ratios */ \
    X(17, MODULATOR_OF_SHUNTS, "modulator_osr needs sensors in line with the phases: low_side_shunts 0") \
    /* low_side_shunts 0: a modulator's filter needs the whole period */ \
    X(18, MODULATOR_TOO_SLOW, "modulator_osr takes too long for this time between two samples: choose a smaller one") \
    /* a smaller modulator_osr, or pwm_samples 1 */ \
    X(19, SPEED_BEYOND_OBSERVER, "overspeed_rpm is beyond what the loops follow with these pole_pairs: at most @ rpm") \
    /* a smaller overspeed_rpm */ \
    X(20, OBSERVER, OF(SENSORLESS, \
      "angle_source 1: resistance_mohm, ld_uh, lq_uh and flux_uwb do not fit one another at this PWM rate")) \
    /* these four by the data sheet, or by `identify` */ \
    X(21, SENSORLESS_RELUCTANT, OF(SENSORLESS, \
      "angle_source 1 does not start a motor whose reluctance outweighs its magnets without injection_mv; a fifth of " \
      "v_min_mv is a beginning")) \
    /* injection_mv, or an encoder */ \
    X(22, INJECTION_UPDATE, OF(INJECTION, \
      "injection_mv needs pwm_update 0 or 2: between two samples at both ends the voltage's signs cancel")) \
    /* pwm_update 0 or 2 */ \
    X(23, HALL_STATES, OF(HALL, \
      "hall_states needs six different digits 0 to 7, each and the next one (the last and the first, too) one switch " \
      "apart: 513264 for instance")) \
    /* `learn hall`, or the order in the data sheet */ \
    X(24, HALL_EDGES, OF(HALL, \
      "hall_edge_1_cdeg to hall_edge_6_cdeg must grow, round one turn, by 2500 to 9500 each: 'learn hall' finds them")) \
    /* `learn hall` */ \
    X(25, ENCODER_COARSE, "encoder_counts is too small for pole_pairs: at least @, or another angle_source") \
    /* an encoder with more counts, or another angle_source */ \
    X(26, CURRENT_MARGIN, "current_bw_hz leaves too little phase margin with this pwm_update: at most @") \
    /* a smaller current_bw_hz, or pwm_update 2 */ \
    X(27, SPEED_MARGIN, "speed_bw_hz leaves less than 45 degrees of phase margin: at most @") \
    /* a smaller speed_bw_hz, or a larger current_bw_hz */ \
    X(28, SPEED_RESOLUTION, "speed_bw_hz is too much for encoder_counts with this inertia_gmm2 and i_max_ma: at most @") \
    /* a smaller speed_bw_hz */ \
    X(29, SPEED_UNRESOLVED, "encoder_counts is too small for this inertia_gmm2 and i_max_ma, at any speed_bw_hz") \
    /* an encoder with more counts, or a smaller i_max_ma */ \
    X(30, CURRENT_TOO_SLOW, "current_bw_hz is too small for any speed_bw_hz") \
    /* a larger current_bw_hz */ \
    X(31, POSITION_MARGIN, OF(POSITION, \
      "position_bw_hz leaves less than 60 degrees of phase margin with this speed_bw_hz: at most @; 0 is a fifth of it")) \
    /* a smaller position_bw_hz */ \
    X(32, EMF_BEYOND_V_MAX, OF(WEAKENING, \
      "at overspeed_rpm the magnets alone bring the bus beyond v_max_mv: emf_beyond_v_max 1 allows it, else at most @")) \
    /* a smaller overspeed_rpm, or a power stage that withstands it */ \
    X(33, FAULT_LATCHED, "a fault is latched; see 'fault', then 'clear'") \
    /* `fault` says what to look at */ \
    X(34, ALREADY_ON, "the drive is on already") \
    /* `off` first, to begin again */ \
    X(35, NOT_OPERATING, "the drive is not in operation; use 'on' and wait for it") \
    /* `on`; `status` says how far it is */ \
    X(36, NEEDS_ENCODER, "a position takes an encoder: angle_source 0") \
    /* an encoder, and angle_source 0 */ \
    X(37, NEEDS_HALL, OF(HALL, "Hall switches are learned with angle_source 2")) \
    /* `set angle_source 2` */ \
    X(38, NO_FAULT, "no fault is latched") \
    /* nothing to do */ \
    X(39, DRIVE_IS_ON, "parameters can change only while the drive is off") \
    /* `off` first */ \
    X(40, BUSY, "the last request has not been carried out yet; try again") \
    /* the same again, a millisecond later */ \
    X(41, BUS_LOW, "the bus voltage is below v_min_mv, @ mV; see 'status'") \
    /* the supply, or v_min_mv */ \
    X(42, BUS_HIGH, "the bus voltage is above v_max_mv, @ mV; see 'status'") \
    /* the supply, or v_max_mv */ \
    X(43, TURNING, "the motor is turning; wait until it stands still, or brake it; angle_source 1 and 2 catch it") \
    /* wait, close the brake; or angle_source 1 or 2, whose start catches a turning rotor */ \
    X(44, BEYOND_SPEED_MAX, "beyond speed_max_rpm: at most @ rpm") \
    /* a smaller speed, or a larger speed_max_rpm */ \
    X(45, BEYOND_I_MAX, "beyond i_max_ma: at most @ mA") \
    /* a smaller current, or a larger i_max_ma */ \
    X(46, BEYOND_CYCLE, OF(POSITION, "farther than speed_max_rpm goes in cyclic_ms: at most @ counts from the one before")) \
    /* smaller steps, or a larger cyclic_ms */ \
    X(47, HOME_SPEED, OF(POSITION, "home_rpm must not be 0, nor beyond speed_max_rpm, @ rpm")) \
    /* a home_rpm other than 0, within speed_max_rpm */ \
    X(48, HOMING, OF(POSITION, "the drive is homing; wait for its end")) \
    /* wait for its end, or `off` */ \
    X(49, LEARNING, OF(LEARN, "the drive is learning; wait for its end")) \
    /* wait for its end, or `off` */ \
    X(50, LEARN_SPEED, OF(LEARN, "learn_rpm is beyond speed_max_rpm, @ rpm")) \
    /* a smaller learn_rpm */ \
    X(51, TOO_HOT, "the winding or the power stage is too hot; see 'status'") \
    /* wait until it has cooled */ \
    X(52, REACTION_NOT_ALLOWED, "this fault does not allow that; 'reaction' lists what each allows") \
    /* one of those that `reaction` lists */ \
    X(53, NOTHING_STORED, OF(SETTINGS, "no settings are stored")) \
    /* `save` first */ \
    X(54, STORED_FORMAT, OF(SETTINGS, "a stored record has a form that this firmware does not know")) \
    /* the firmware that stored it, or `save` again */ \
    X(55, STORED_RANGE, OF(SETTINGS, "a stored value is outside its range")) \
    /* set what does not fit, then `save` */ \
    X(56, SAVE_WHILE_ON, OF(SETTINGS, "settings are saved only while the drive is off: 'off' first")) \
    /* `off` first */ \
    X(57, SAVE_FULL, OF(SETTINGS, \
      "the settings do not fit into their place in eNVM; after 'defaults', 'save' drops what other firmware has stored")) \
    /* a smaller cogging map: learn again */ \
    X(58, ENVM_CLOCK, OF(SETTINGS, "nothing is programmed at a clock that is not right: see 'fault'")) \
    /* clocks as in drivers/board.h */ \
    X(59, ENVM_NOT_GRANTED, OF(SETTINGS, "eNVM: something else in the device uses its controller; try again")) \
    /* again; then look for what else uses the eNVM */ \
    X(60, ENVM_TIMED_OUT, OF(SETTINGS, "eNVM: programming a page did not end in time; try again")) \
    /* again */ \
    X(61, ENVM_DENIED, OF(SETTINGS, "eNVM: the design protects the pages of the settings")) \
    /* a design that leaves these pages unprotected */ \
    X(62, ENVM_BUSY, OF(SETTINGS, "eNVM: its controller was busy with another command; try again")) \
    /* again */ \
    X(63, ENVM_LOCKED, OF(SETTINGS, "eNVM: a page of the settings is locked; a programmer unlocks it")) \
    /* unlock the pages with a programmer */ \
    X(64, ENVM_ERASE, OF(SETTINGS, "eNVM: a page cannot be erased: worn out, or the supply is too low")) \
    /* the supply; another device if it stays */ \
    X(65, ENVM_WRITE, OF(SETTINGS, "eNVM: a page does not take what is written: worn out, or the supply is too low")) \
    /* the supply; another device if it stays */ \
    X(66, ENVM_VERIFY, OF(SETTINGS, "eNVM: a page does not read back as it was written")) \
    /* again; another device if it stays */ \
    X(67, GATE_INPUT_ACTIVE, "the cause is still there: an input of the gate driver is active") \
    /* the driver's fault line, safe torque off, the comparators */ \
    X(68, NO_ENCODER_SIGNAL, "the cause is still there: no encoder signal") \
    /* the encoder's cable and supply */ \
    X(69, FABRIC, "the cause is still there: the fabric does not carry the expected design") \
    /* program the design of docs/fabric.md */ \
    X(70, CLOCK, "the cause is still there: the clock ratios are not those of the board, or a PLL is not locked") \
    /* Libero's clock settings as in drivers/board.h */ \
    X(71, STACK_GUARD, "the cause is still there: the stack guard is not in effect; reset the device") \
    /* reset; the memory protection unit switched on in Libero */ \
    X(72, WATCHDOG_OFF, "the cause is still there: the watchdog is off, or does not reset") \
    /* the watchdog switched on in Libero, in reset mode */ \
    X(73, FABRIC_DOUBTED, "the fabric is not touched after this fault; fix the cause, then reset the device") \
    /* fix what `fault` names, then reset */ \
    X(74, SCOPE_ARMED, OF(SCOPE, "a capture is under way; wait for its end, or 'scope off'")) \
    /* `scope off` first */ \
    X(75, SCOPE_NOT_ARMED, OF(SCOPE, "no capture waits for its trigger; 'scope arm' begins one")) \
    /* `scope arm` first */ \
    X(76, SCOPE_BEFORE, OF(SCOPE, \
      "with these signals at most @ samples stand before the trigger; 'scope before' sets them")) \
    /* fewer samples before the trigger, or fewer signals */ \
    X(77, SWITCHED_OFF, "switched off again before it was on") \
    /* `on` again, if that was not meant */ \
    X(78, SOURCE_MODE, "the angle's source changes in control of speed or torque: 'speed' or 'torque' first") \
    /* `speed` or `torque` first */ \
    X(79, SOURCE_WEAKENS, \
      "a field that is weakened or overmodulated takes an encoder: with a speed_max_rpm that the bus reaches without, " \
      "and overmodulation 0, other sources are possible") \
    /* a smaller speed_max_rpm, and overmodulation 0 */ \
    X(80, SOURCE_RELUCTANT, \
      "this motor's reluctance outweighs its magnets: without a sensor it goes from 'on' only, with angle_source 1 and " \
      "injection_mv") \
    /* `off`, then `on` with angle_source 1 and injection_mv */ \
    X(81, SOURCE_FIELD, "a prescribed field leads, and the rotor's angle is not known: faster, until the observer leads") \
    /* a higher speed */ \
    X(82, SOURCE_ENCODER, "the encoder shows no signal, or one that is illegal: its lines and supply") \
    /* the encoder's cable and supply */ \
    X(83, SOURCE_HALL, \
      "the Hall switches do not show the six states of hall_states: their wires and supply, or 'learn hall'") \
    /* the switches' wires and supply, or `learn hall` */ \
    X(84, SOURCE_SLOW, "both angles are compared over an electrical turn, within a second: at least @ rpm") \
    /* a higher speed */ \
    X(85, SOURCE_MARGIN, "the observer would see too little EMF at this speed and current: at least @ rpm") \
    /* a higher speed or less current */ \
    X(86, SOURCE_APART, \
      "the two angles are @ degrees apart, and 15 may be: 'off' and 'on' find the encoder's place, 'learn hall' that of " \
      "the switches") \
    /* `off` and `on`, or `learn hall` */ \
    X(87, NOT_IN_BUILD, "this build leaves $ out; 'make FEATURES=...' names what a build has") \
    /* an image with that feature */ \
    X(88, SWEEPING, OF(SCOPE, "a sweep is under way; wait for its end, or 'sweep off'")) \
    /* `sweep off`, or wait for its end */ \
    X(89, SWEEP_MODE, OF(SCOPE, "the speed loop is swept while it controls: 'speed' first")) \
    /* `speed` or `pp` first */ \
    X(90, SWEEP_AMPLITUDE, OF(SCOPE, "the amplitude must be above 0, and at most an eighth of i_max_ma, @ mA")) \
    /* a smaller amplitude */ \
    X(91, SAVE_BESIDE_ON, OF(SETTINGS, "saving keeps the core from both motors: the other axis off and at rest first")) \
    /* the other axis off and at rest first */ \
    X(92, AXIS_RANGE, "there is no such axis: they count from 1 to @") \
    /* a number that there is */ \
    X(93, SCOPE_ELSEWHERE, OF(SCOPE, "the scope is with the axis that 'axis' has chosen: choose this one first")) \
    /* `axis` with this axis' number first: the scope goes with it */ \
    X(94, IDENTIFY_BESIDE, OF(IDENTIFY, "the other axis is identified; wait for its end, or switch it off")) \
    /* wait for its end, or the other axis off */ \
    X(95, CATCHES_BESIDE, OF(IDENTIFY, "the other axis starts without an encoder; wait until it operates")) \
    /* wait until the other axis operates */ \
    X(96, LD_APPARENT, "ld_apparent_uh must be at most 8 times ld_uh, @ uH; or 0: the same") \
    /* both d inductances of one phase at rated current, or 0 */ \
    X(97, LQ_APPARENT, "lq_apparent_uh must be at most 8 times lq_uh, @ uH; or 0: the same") \
    /* both q inductances of one phase at rated current, or 0 */ \
    X(98, LQ_REST, "lq_rest_uh must be at most 16 times lq_uh, @ uH; or 0: the same") \
    /* both q inductances of one phase, or 0 */ \
    X(99, INERTIA, \
      "inertia_gmm2 takes more than 5 minutes from 0 to speed_max_rpm with i_max_ma: at most @ g mm2 (1 kg cm2 is 100000)") \
    /* inertia_gmm2 of rotor and load: 1 kg cm2 is 100000 g mm2; a smaller speed_max_rpm */ \
    X(100, COMMANDED, "& commands the drive: 'take' takes over, 'off' stops it") \
    /* `take` at the console, the owner's number into object `owner`; or `off` stops it */ \
    X(101, STOPPED, "& has stopped the drive") \
    /* enable it again, if that was not meant */ \
    X(102, NEEDS_SENSOR, OF(SENSORLESS, \
      "csv and cst take an encoder or Hall switches; without, 'speed' and 'torque' (pv, tq) go")) \
    /* an encoder or Hall switches; or `speed`, `torque` */
/* clang-format on */

#define ERROR_NUMBER(number, name, text) ERROR_##name = (number),

enum error { ERROR_NONE, ERRORS(ERROR_NUMBER) ERROR_COUNT };

/* `value` completes messages with a number: the limit, or what would work, in the text's unit. */
struct outcome {
    enum error error;
    int32_t value;
};

static inline struct outcome outcome_of(enum error error)
{
    return (struct outcome){error, 0};
}

#define OUTCOME_OK outcome_of(ERROR_NONE)

#endif
