/* SPDX-License-Identifier: MIT */
/*
 * The drive's parameters: integers; the name ends with the unit.
 *
 * They are set one at a time on the console while the bridge is off, each checked against its own range. Values derived from
 * them together (gains, thresholds, scalings) are calculated once, at switch-on: see tuning.h.
 */
#ifndef FIRMWARE_SETTINGS_PARAMS_H
#define FIRMWARE_SETTINGS_PARAMS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The speed loop stores this many torque demands. */
#define PARAM_TORQUE_MEAN_MOST_MS 4

/* The profile stores this many speeds. */
#define PARAM_JERK_MOST_MS 250

/* clang-format off */
/*
 * PARAM(name, min, max, initial, "description"), and a remark: the page of docs/ that explains it, and what it affects. Only
 * operate/ makes strings of the texts; docs/reference.md lists everything. The order is that of the Modbus registers: append
 * new rows, or the addresses that controllers use will shift.
 *
 * The initial values are a Teknic M-2310P-LN-04K on the 24 V inverter: qemu/motors/ and qemu/inverters/ have the sources.
 * Those of Modbus are the standard's.
 */
#define PARAMS(PARAM) \
    PARAM(pole_pairs, 1, 50, 4, "pole pairs of the motor") \
    /* guides/your-motor.md: electrical angle and speed, torque per ampere; the start checks it against the encoder */ \
    PARAM(encoder_counts, 64, 65536, 4000, "encoder counts per mechanical turn, all four edges") \
    /* guides/your-motor.md: angle, speed, position; its resolution limits speed_bw_hz */ \
    PARAM(resistance_mohm, 1, 100000, 360, "resistance of one phase") \
    /* guides/your-motor.md: integral gain of the current loop, the observer, the wiring test */ \
    PARAM(ld_uh, 1, 1000000, 200, "inductance of one phase, d axis, incremental at rated current") \
    /* guides/your-motor.md: gain of the current loop in d, decoupling, the observer */ \
    PARAM(lq_uh, 1, 1000000, 200, "inductance of one phase, q axis, incremental at rated current") \
    /* guides/your-motor.md: gain of the current loop in q, decoupling, the observer */ \
    PARAM(ld_apparent_uh, 0, 1000000, 0, "saturating iron: d-axis flux over current at rated current; 0: ld_uh") \
    /* torque.md: current vector per torque, field weakening, the observer */ \
    PARAM(lq_apparent_uh, 0, 1000000, 0, "saturating iron: q-axis flux over current at rated current; 0: lq_uh") \
    /* torque.md: current vector per torque, field weakening, the observer */ \
    PARAM(lq_rest_uh, 0, 1000000, 0, "saturating iron: incremental q-axis inductance at no current; 0: lq_uh") \
    /* torque.md: gain of the current loop in q by current */ \
    PARAM(cross_pm, -249, 249, 0, "L_dq over L_qq at rated current, incremental; has the sign of i_q") \
    /* sensorless.md: the axis that the injection finds */ \
    PARAM(flux_uwb, 10, 10000000, 6395, "flux linkage of the magnets, peak, one phase") \
    /* guides/your-motor.md: torque per ampere, back-EMF decoupling, the observer, encoder supervision */ \
    PARAM(inertia_gmm2, 1, 2100000000, 56493, "inertia of rotor and load") \
    /* guides/your-motor.md: gains of the speed and position loops, how the start damps the rotor */ \
    PARAM(i_range_ma, 100, 2000000, 23571, "phase current 2048 ADC counts away from zero") \
    /* guides/your-motor.md: scale of all currents, and with it the gains */ \
    PARAM(v_range_mv, 1000, 2000000, 57528, "bus voltage at 4096 ADC counts") \
    /* guides/your-motor.md: scale of all voltages, and with it the gains */ \
    PARAM(i_max_ma, 10, 2000000, 10650, "largest current reference, peak") \
    /* torque.md: torque, acceleration; how fast the speed loop may be */ \
    PARAM(i_trip_ma, 10, 2000000, 15000, "over-current threshold of any phase, peak") \
    /* faults.md: the fault over-current, and current sum at a quarter of it */ \
    PARAM(i_align_ma, 10, 2000000, 5000, "d-axis current that pulls the rotor into place at the start") \
    /* design.md: how much load the start holds */ \
    PARAM(v_min_mv, 1000, 2000000, 18000, "under-voltage threshold of the bus") \
    /* faults.md: the fault under-voltage; below it the drive does not switch on */ \
    PARAM(v_max_mv, 1000, 2000000, 36000, "over-voltage threshold of the bus") \
    /* faults.md: the fault over-voltage; braking holds the bus below it */ \
    PARAM(chopper_on_mv, 0, 2000000, 0, "bus voltage at which the brake chopper switches on; 0: no chopper") \
    /* torque.md: how braking energy is spent */ \
    PARAM(chopper_off_mv, 0, 2000000, 0, "bus voltage at which the brake chopper switches off") \
    /* torque.md: how braking energy is spent */ \
    PARAM(power_max_w, 1, 2000000, 2000000, "largest mechanical power, driving") \
    /* torque.md: torque at high speed */ \
    PARAM(regen_max_w, 0, 2000000, 2000000, "largest mechanical power, braking") \
    /* torque.md: braking torque at high speed; 0 for a supply that takes nothing back */ \
    PARAM(bus_capacitance_uf, 1, 1000000, 1000, "bus capacitance at the bridge and at the supply, together") \
    /* torque.md: how quickly braking responds to a rising bus */ \
    PARAM(speed_max_rpm, 1, 30000, 4000, "largest speed command") \
    /* torque.md: speed set-points, homing, learning; how far the field is weakened */ \
    PARAM(overspeed_rpm, 1, 32000, 4800, "over-speed threshold") \
    /* faults.md: the fault over-speed */ \
    PARAM(emf_beyond_v_max, 0, 1, 0, "1: bridge and bus withstand the EMF at overspeed_rpm") \
    /* torque.md: whether `on` accepts magnets that can exceed v_max_mv */ \
    PARAM(ramp_rpm_s, 1, 1000000, 5000, "slope of the speed reference") \
    /* guides/tuning.md: acceleration and braking in speed control, a quick stop */ \
    PARAM(stop_max_ms, 100, 3600000, 60000, "longest quick stop; then the bridge goes off") \
    /* torque.md: what ends a stop that the load does not allow */ \
    PARAM(current_bw_hz, 10, 6400, 1000, "crossover frequency of the current loops") \
    /* guides/tuning.md: gains of the current loops; bounds speed_bw_hz */ \
    PARAM(pwm_update, 0, 2, 0, "a new voltage acts: 0 from the next valley, 1 from the next end, 2 at once") \
    /* design.md: delay of the current loops: how large current_bw_hz may be */ \
    PARAM(pwm_samples, 1, 2, 1, "current samples per PWM period: 1, or 2 with sensors in line") \
    /* design.md: delay of the current loops: how large current_bw_hz may be */ \
    PARAM(overmodulation, 0, 100, 0, "per cent from the voltage circle to six-step; 0: none") \
    /* torque.md: torque at high speed, and its ripple */ \
    PARAM(low_side_shunts, 0, 1, 1, "1: sensors see a phase while its low side conducts; 0: always, in line") \
    /* design.md: which phase currents are measured; pwm_samples, overmodulation */ \
    PARAM(modulator_osr, 0, 256, 0, "isolated modulators with this oversampling ratio; 0: serial converters") \
    /* fabric.md: which converters the fabric reads, their delay and noise */ \
    PARAM(speed_bw_hz, 1, 200, 60, "crossover frequency of the speed loop") \
    /* guides/tuning.md: stiffness against load; bounds position_bw_hz */ \
    PARAM(torque_mean_ms, 1, PARAM_TORQUE_MEAN_MOST_MS, 1, "mean of the torque demand, for an elastic shaft; 1: off") \
    /* guides/tuning.md: damping of an elastic shaft, delay of the speed loop */ \
    /* position */ \
    PARAM(position_bw_hz, 0, 100, 0, "crossover frequency of the position loop; 0: a fifth of speed_bw_hz") \
    /* position.md: stiffness of a position, following error */ \
    PARAM(profile_speed_pm, 1, 1000, 900, "speed of a position profile, of speed_max_rpm") \
    /* position.md: duration of a move; the rest is there to catch up */ \
    PARAM(profile_rpm_s, 0, 1000000, 0, "acceleration of a position profile; 0: ramp_rpm_s") \
    /* position.md: duration of a move */ \
    PARAM(profile_jerk_ms, 1, PARAM_JERK_MOST_MS, 50, "time in which a profile's acceleration rises from 0") \
    /* position.md: smoothness of a move */ \
    PARAM(following_mturn, 1, 10000000, 100, "largest following error") \
    /* position.md: the fault following error */ \
    PARAM(cyclic_ms, 1, 1000, 10, "time between set-points of csp, csv and cst") \
    /* position.md: interpolation in the cyclic modes */ \
    PARAM(home_rpm, -30000, 30000, 30, "speed and direction in which homing searches") \
    /* position.md: `hm` */ \
    PARAM(home_pct, 1, 100, 20, "most current that homing pushes with, of i_max_ma") \
    /* position.md: `hm block`: how hard it hits */ \
    PARAM(home_turns, 1, 10000, 10, "how far homing searches for a block") \
    /* position.md: `hm block`: when it gives up */ \
    PARAM(learn_rpm, 1, 100, 10, "speed at which cogging is learned") \
    /* position.md: `learn cogging` */ \
    /* supervision: firmware/axis/ */ \
    PARAM(i_rated_ma, 10, 2000000, 7100, "continuous motor current, peak") \
    /* guides/your-motor.md: the winding's heat; torques on the bus are relative to it */ \
    PARAM(t_max_c, 60, 250, 130, "largest winding temperature; that at i_rated_ma and 40 degC ambient") \
    /* faults.md: the fault over-temperature; from 10 K below it the current limit falls */ \
    PARAM(winding_share_pct, 1, 99, 40, "share of that rise between winding and housing") \
    /* faults.md: model of the winding's heat */ \
    PARAM(winding_tau_s, 1, 10000, 60, "thermal time constant from winding to housing") \
    /* faults.md: model of the winding's heat */ \
    PARAM(housing_tau_s, 1, 100000, 1200, "thermal time constant from housing to air") \
    /* faults.md: model of the winding's heat */ \
    PARAM(inverter_ma, 0, 2000000, 0, "continuous current of the power stage, peak; 0: no limit") \
    /* faults.md: the fault inverter overload */ \
    PARAM(inverter_tau_ms, 100, 1000000, 1000, "thermal time constant of the power stage") \
    /* faults.md: the fault inverter overload */ \
    PARAM(deviation_pct, 1, 100, 20, "largest deviation of speed from its reference, of speed_max_rpm") \
    /* faults.md: the fault speed deviation */ \
    PARAM(command_timeout_ms, 0, 60000, 0, "longest silence of console and bus while on; 0: no limit") \
    /* faults.md: the fault command time-out */ \
    PARAM(angle_source, 0, 2, 0, "source of the rotor's angle: 0 encoder, 1 observer, 2 Hall switches") \
    /* sources.md: how the drive starts, which modes it has */ \
    PARAM(injection_mv, 0, 2000000, 0, "voltage injected at low speed to see the saliency; 0: none") \
    /* sensorless.md: start and low speeds without an encoder */ \
    PARAM(retry_count, 0, 100, 0, "how often the drive clears a fault and restarts by itself; 0: never") \
    /* faults.md: automatic restart after a fault */ \
    PARAM(retry_delay_ms, 10, 60000, 1000, "time between a fault and the restart") \
    /* faults.md: automatic restart after a fault */ \
    PARAM(modbus_address, 0, 247, 1, "address on the bus; 0: the drive does not listen") \
    /* modbus.md: which requests are answered on RS-485 */ \
    PARAM(modbus_baud, 9600, 921600, 19200, "rate of the bus") \
    /* modbus.md: the line of Modbus */ \
    PARAM(modbus_parity, 0, 2, 2, "0 none, with two stop bits; 1 odd; 2 even") \
    /* modbus.md: the line of Modbus */ \
    PARAM(friction_unm, 0, 50000000, 0, "Coulomb friction of shaft and load, fed forward; 0: none") \
    /* position.md: reversals, low speeds */ \
    /* Hall switches: hall_table.h */ \
    PARAM(hall_states, 1234, 765432, 513264, "six states in forward order, one digit each: 4 C + 2 B + A") \
    /* hall.md: angle from Hall switches */ \
    PARAM(hall_edge_1_cdeg, 0, 35999, 0, "electrical angle at which the first state begins") \
    /* hall.md: angle from Hall switches */ \
    PARAM(hall_edge_2_cdeg, 0, 35999, 6000, "electrical angle at which the second state begins") \
    /* hall.md: angle from Hall switches */ \
    PARAM(hall_edge_3_cdeg, 0, 35999, 12000, "electrical angle at which the third state begins") \
    /* hall.md: angle from Hall switches */ \
    PARAM(hall_edge_4_cdeg, 0, 35999, 18000, "electrical angle at which the fourth state begins") \
    /* hall.md: angle from Hall switches */ \
    PARAM(hall_edge_5_cdeg, 0, 35999, 24000, "electrical angle at which the fifth state begins") \
    /* hall.md: angle from Hall switches */ \
    PARAM(hall_edge_6_cdeg, 0, 35999, 30000, "electrical angle at which the sixth state begins") \
    /* hall.md: angle from Hall switches */ \
    PARAM(injection_silent, 0, 1, 0, "pulses of the injection: 0 alternating, a tone; 1 pseudo-random, a noise") \
    /* sensorless.md: acoustic noise of the injection */ \
    PARAM(can_node, 0, 255, 0, "number of this drive on the CAN bus; 0: it is not there; 255: LSS gives it one") \
    /* can.md: the node */ \
    PARAM(can_kbit, 20, 1000, 500, "rate of the CAN bus: 20, 50, 125, 250, 500, 800, 1000, or the next below") \
    /* can.md: the rate */ \
    PARAM(can_recover, 0, 1, 0, "back from bus-off: 0 when a CAN parameter is set, 1 by itself") \
    /* can.md: bus-off */ \
    PARAM(can_heartbeat_ms, 0, 65535, 0, "time between heartbeats, object 0x1017 at first; 0: none") \
    /* can.md: heartbeat */ \
    PARAM(direction, 0, 1, 0, "1: inverts the direction of all set-points and displayed values") \
    /* guides/your-motor.md: forward direction */
/* clang-format on */

#define PARAM_FIELD(name, min, max, initial, text) int32_t name;

struct params {
    PARAMS(PARAM_FIELD)
};

struct param_info {
    const char *name;
    int32_t min;
    int32_t max;
    int32_t initial;
    size_t offset; /* of the field in struct params */
};

extern const struct param_info param_table[];
extern const size_t param_count;

/* Sets every parameter to its initial value. */
void params_init(struct params *p);

/* The table's row for a name, or NULL. */
const struct param_info *param_find(const char *name);

int32_t param_get(const struct params *p, const struct param_info *info);

/* The caller must check the range and that the bridge is off. */
void param_set(struct params *p, const struct param_info *info, int32_t value);

/* True if two strings are equal. Any context. */
bool text_equal(const char *a, const char *b);

size_t text_length(const char *s);

/* ==== sources of the angle ==== */

/*
 * The sources of the rotor's angle: X(name, feature, start, properties), in the order of parameter angle_source.
 *
 *   feature     of settings/features.h, which a build may leave out
 *   start       how it starts: start_by_... of drive/start.h
 *   properties  its capabilities. Other code asks for these (source_has(), rotor.h), never for a particular source
 */
enum source_property {
    SOURCE_COUNTS = 1u << 0,    /* an encoder: the shaft's position, an index, and what is learned by position */
    SOURCE_SWITCHES = 1u << 1,  /* Hall switches: edges at learned angles */
    SOURCE_ESTIMATES = 1u << 2, /* no sensor: by EMF, saliency, or a prescribed field */
    SOURCE_WEAKENS = 1u << 3,   /* its handler weakens the field, and overmodulates */
    SOURCE_CATCHES = 1u << 4,   /* flying start: finds the angle of a turning rotor */
};

/* clang-format off */
#define SOURCES(X) \
    X(ENCODER, ENCODER, encoder, SOURCE_COUNTS | SOURCE_WEAKENS) \
    X(SENSORLESS, SENSORLESS, observer, SOURCE_ESTIMATES | SOURCE_CATCHES) \
    X(HALL, HALL, hall, SOURCE_SWITCHES | SOURCE_CATCHES)
/* clang-format on */

#define SOURCE_NUMBER(name, feature, start, properties) PARAM_ANGLE_##name,

enum param_angle { SOURCES(SOURCE_NUMBER) PARAM_ANGLES };

#endif
