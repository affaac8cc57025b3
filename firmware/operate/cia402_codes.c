/* SPDX-License-Identifier: MIT */
/* Error codes of CiA 402 (IEC 61800-7-201, object 0x603F; CiA 301 has the classes); 0xFF00 and up are manufacturer-specific. */
#include "firmware/operate/cia402.h"

static const uint16_t codes[FAULT_COUNT] = {
    [FAULT_STO_A] = 0xFF01,
    [FAULT_STO_B] = 0xFF02,
    [FAULT_OVERCURRENT_HARDWARE] = 0x2320, /* short circuit */
    [FAULT_GATE_DRIVER] = 0x5400,          /* power section */
    [FAULT_INTERLOCK] = 0x5400,
    [FAULT_LOOP_OVERRUN] = 0x6100, /* internal software */
    [FAULT_ENCODER] = 0x7305,      /* incremental sensor 1 */
    [FAULT_OVERCURRENT] = 0x2310,
    [FAULT_CURRENT_SUM] = 0x2330, /* earth leakage */
    [FAULT_OVERVOLTAGE] = 0x3210,
    [FAULT_UNDERVOLTAGE] = 0x3220,
    [FAULT_OVERSPEED] = 0x8400,      /* velocity controller */
    [FAULT_CURRENT_OFFSET] = 0x5210, /* measuring circuit */
    [FAULT_STALL] = 0x7121,          /* motor blocked */
    [FAULT_LOOP_STOPPED] = 0x6100,
    [FAULT_WATCHDOG] = 0x6010, /* software reset */
    [FAULT_EXCEPTION] = 0x6010,
    [FAULT_CLOCK] = 0x5000, /* device hardware */
    [FAULT_FABRIC] = 0x5000,
    [FAULT_LOCKUP] = 0x6010,
    [FAULT_STACK_GUARD] = 0x5000,
    [FAULT_WATCHDOG_OFF] = 0x5000,
    [FAULT_PLL] = 0x5000,
    [FAULT_ECC] = 0x5500, /* data storage */
    [FAULT_ENCODER_SLIP] = 0x7305,
    [FAULT_ENCODER_DEAD] = 0x7305,
    [FAULT_ENCODER_COUNTS] = 0x7305,
    [FAULT_OPEN_PHASE] = 0x3130, /* phase failure */
    [FAULT_SPEED_DEVIATION] = 0x8400,
    [FAULT_OVERTEMPERATURE] = 0x4310,   /* drive */
    [FAULT_INVERTER_OVERLOAD] = 0x2350, /* load level, I2t */
    [FAULT_VOLTAGE_LIMIT] = 0x3220,
    [FAULT_LIMIT_CYCLE] = 0x8400,
    [FAULT_OSCILLATION] = 0x8400,
    [FAULT_COMMAND_TIMEOUT] = 0x8100, /* communication */
    [FAULT_ROTOR_TURNING] = 0xFF10,
    [FAULT_SENSOR_SIGN] = 0x5210,
    [FAULT_ENCODER_DIRECTION] = 0x7305,
    [FAULT_POLE_PAIRS] = 0x6320, /* parameter error */
    [FAULT_ROTOR_BLOCKED] = 0x7121,
    [FAULT_LOAD_TOO_HIGH] = 0xFF11,
    [FAULT_GATES_OFF] = 0x5400,
    [FAULT_FOLLOWING_ERROR] = 0x8611,
    [FAULT_HOMING] = 0x8613,
    [FAULT_LOCK_LOST] = 0xFF12,
    [FAULT_OUT_OF_STEP] = 0xFF13,
    [FAULT_SALIENCY] = 0xFF14,
    [FAULT_POLARITY] = 0xFF15,
    [FAULT_HALL_INVALID] = 0x7306, /* sensor */
    [FAULT_HALL_SEQUENCE] = 0x7300,
    [FAULT_HALL_UNKNOWN] = 0x7300,
    [FAULT_SLOW_LOOP_STOPPED] = 0x6100,
    [FAULT_THREAD_STOPPED] = 0x6100,
    [FAULT_SENSORS_EXCHANGED] = 0x5210,
    [FAULT_TEMPERATURE_SENSOR] = 0x7300,
    [FAULT_MASTER_LOST] = 0x8130, /* heartbeat */
    [FAULT_OFFSET] = 0x7305,
};

uint32_t cia402_error_code(enum fault fault)
{
    return fault < FAULT_COUNT ? codes[fault] : 0xFF00u;
}
