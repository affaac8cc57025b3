/* SPDX-License-Identifier: MIT */
/*
 * The drive as CiA 402 (IEC 61800-7-201) defines it: control word and set-points in, status word out, requests of axis/axis.h
 * in between. The axis goes from "switch on disabled" through calibration and alignment to operation in one go, while a
 * controller goes step by step: "ready" and "switched on" are states of this file until it enables operation, with the bridge
 * off. While another line commands the axis (drive/owner.h), control words that stop are obeyed, others have no effect.
 *
 * Commands are carried out by cia402_poll(); `refusal` holds what the axis refuses. Options of the profile: shutdown and
 * disabling operation let the motor coast (0x605B, 0x605C: 0), quick stop brakes and ends in "switch on disabled" (0x605A: 2),
 * halt brakes along the ramp and stays enabled (0x605D: 1).
 */
#ifndef FIRMWARE_OPERATE_CIA402_H
#define FIRMWARE_OPERATE_CIA402_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/drive/drive.h"

/* bits of the control word */
#define CIA402_SWITCH_ON     (1u << 0)
#define CIA402_VOLTAGE       (1u << 1)
#define CIA402_NO_QUICK_STOP (1u << 2)
#define CIA402_ENABLE        (1u << 3)
#define CIA402_NEW_SET_POINT (1u << 4) /* pp; in hm: begin */
#define CIA402_RELATIVE      (1u << 6) /* pp */
#define CIA402_FAULT_RESET   (1u << 7)
#define CIA402_HALT          (1u << 8)

/* bits of the status word beyond the state bits */
#define CIA402_VOLTAGE_THERE (1u << 4)
#define CIA402_WARNING       (1u << 7)
#define CIA402_REFUSED       (1u << 8) /* the last command was refused: see `refusal` */
#define CIA402_REMOTE        (1u << 9)
#define CIA402_REACHED       (1u << 10)
#define CIA402_LIMITED       (1u << 11)
#define CIA402_OF_MODE       (1u << 12) /* pv: speed 0; pp: set-point taken; hm: attained; cyclic: follows */

/* modes of operation */
enum cia402_mode {
    CIA402_PP = 1,
    CIA402_PV = 3,
    CIA402_TQ = 4,
    CIA402_HM = 6,
    CIA402_CSP = 8,
    CIA402_CSV = 9,
    CIA402_CST = 10,
};

/* supported homing methods */
#define CIA402_HOME_INDEX    34
#define CIA402_HOME_BLOCK    (-1)
#define CIA402_HOME_HERE     37
#define CIA402_HOME_HERE_OLD 35 /* its former number, which masters still write */

static inline bool cia402_homes_here(int32_t method)
{
    return method == CIA402_HOME_HERE || method == CIA402_HOME_HERE_OLD;
}

struct cia402_setpoints {
    uint32_t control_word;
    int32_t mode; /* enum cia402_mode */
    int32_t target_rpm;
    int32_t target_counts;
    int32_t target_torque_pm; /* thousandths of i_rated_ma */
    int32_t homing_method;
};

/* The standard's states, for one bus: the first three are its own while it does not command, the others are the axis'. */
enum cia402_state {
    CIA402_DISABLED,
    CIA402_READY,
    CIA402_SWITCHED_ON,
    CIA402_ENABLED,
    CIA402_QUICK_STOP,
    CIA402_FAULT,
};

/* How far this bus has control over the axis. */
enum cia402_authority {
    AUTHORITY_NONE,
    AUTHORITY_STARTING, /* its control word has enabled operation */
    AUTHORITY_RETURNED, /* without one: taken over, or a restart after a fault */
    AUTHORITY_OPERATING,
};

struct cia402 {
    struct cia402_setpoints setpoints;
    enum owner who; /* the bus */
    enum cia402_state stage;
    enum cia402_authority authority;
    uint32_t faults;      /* of the axis, at the last poll */
    uint32_t word_before; /* the last control word carried out, */
    int32_t mode_before;  /* and the mode */
    bool word_due;        /* a control word is pending */
    bool target_due;      /* a set-point or a mode is */
    struct outcome refusal;
    int32_t exponent; /* 0x60C2:2, for masters that read it back */
    bool source_due;  /* a change of the angle source is pending, and may still be refused */
};

/* No command yet, pv, all targets 0. */
void cia402_init(struct cia402 *c, enum owner who);

/* True if the set-points are within what the parameters allow. Thread. */
bool cia402_allows(const struct cia402_setpoints *s, const struct params *p);

/* Accepts set-points. `word`: including a control word; `target`: including a mode or a target. Thread. */
void cia402_accept(struct cia402 *c, const struct cia402_setpoints *s, bool word, bool target);

/* Control words that only stop, which any line may give; and that enable, which only the owner may. */
bool cia402_stops(uint32_t word);
bool cia402_enables(uint32_t word);

/* This bus takes over a running axis; mode and target speed become those in effect, target torque 0. Thread. */
void cia402_take_over(struct cia402 *c, struct axis *a);

/* Requests another source of the angle, enum param_angle; false if refused: nothing has changed. Thread. */
bool cia402_change_source(struct cia402 *c, struct axis *a, uint32_t source);

/* Carries out what is pending, and follows the axis' state. Thread, repeatedly; takes up to as long as `on`. */
void cia402_poll(struct cia402 *c, struct axis *a);

uint32_t cia402_status_word(const struct cia402 *c, const struct axis *a, const struct drive_status *now);

/* The mode in effect; the requested one while not operating, or while that waits for its edge. */
int32_t cia402_mode_display(const struct cia402 *c, const struct drive_status *now);

/* 0x6502: bit n is mode n + 1; those that features and the source of the angle allow. Thread. */
uint32_t cia402_supported_modes(const struct axis *a);

/* CiA 402 error code, 0x603F: 0 if there is no fault. Any context. */
uint32_t cia402_error_code(enum fault fault);

#endif
