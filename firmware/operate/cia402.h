/* SPDX-License-Identifier: MIT */
/*
 * The drive as CiA 402 (IEC 61800-7-201) sees it: control word and set-points in, status word out, requests of axis/axis.h in
 * between. The axis goes from "switch on disabled" through calibration and alignment to operation in one go; a controller asks
 * step by step: "ready" and "switched on" are kept here until it enables operation, and the bridge is off in both. While
 * another line commands the axis (drive/owner.h), words that stop are obeyed, others do nothing.
 *
 * Commands act after acceptance, in cia402_poll(); `refusal` holds what the axis refuses. Options of the profile: shutdown and
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
#define CIA402_REFUSED       (1u << 8) /* the last command: `refusal` says why */
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
#define CIA402_HOME_HERE_OLD 35 /* its number before, which masters still write */

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

/* The standard's states as one bus sees them: the first three are its own while it does not command, the others the axis'. */
enum cia402_state {
    CIA402_DISABLED,
    CIA402_READY,
    CIA402_SWITCHED_ON,
    CIA402_ENABLED,
    CIA402_QUICK_STOP,
    CIA402_FAULT,
};

/* What has become of this bus' command over the axis. */
enum cia402_course {
    COURSE_NONE,
    COURSE_STARTS,  /* its word has enabled operation */
    COURSE_RETURNS, /* without a word: taken over, or it starts again after a fault */
    COURSE_OPERATES,
};

struct cia402 {
    struct cia402_setpoints setpoints;
    enum owner who; /* the bus */
    enum cia402_state stage;
    enum cia402_course course;
    uint32_t faults;      /* of the axis, when last checked */
    uint32_t word_before; /* the control word last acted upon, */
    int32_t mode_before;  /* and the mode */
    bool word_due;        /* a control word waits */
    bool target_due;      /* a set-point, or another mode */
    struct outcome refusal;
    int32_t exponent; /* of 0x60C2, for masters that read it back */
    bool source_due;  /* another source of the angle was requested, and may yet be refused */
};

/* No command yet, pv, all targets 0. */
void cia402_init(struct cia402 *c, enum owner who);

/* True if these parameters allow all of them. Thread. */
bool cia402_allows(const struct cia402_setpoints *s, const struct params *p);

/* Accepts set-points; `word`: a control word is among them, `target`: a mode or a target is. Thread. */
void cia402_accept(struct cia402 *c, const struct cia402_setpoints *s, bool word, bool target);

/* Words that only stop, which everybody may; and that only the owner may give. */
bool cia402_stops(uint32_t word);
bool cia402_enables(uint32_t word);

/* This bus commands what goes on from here on; mode and target speed become those in effect, target torque 0. Thread. */
void cia402_take_over(struct cia402 *c, struct axis *a);

/* Requests another source of the angle, enum param_angle; false: refused at once, nothing has changed. Thread. */
bool cia402_change_source(struct cia402 *c, struct axis *a, uint32_t source);

/* Carries out what is pending, and follows the axis. Thread, whenever it has time; as long as `on` takes. */
void cia402_poll(struct cia402 *c, struct axis *a);

uint32_t cia402_status_word(const struct cia402 *c, const struct axis *a, const struct drive_status *now);

/* The mode in effect; the requested one while the drive is not operating, and where that waits for its edge. */
int32_t cia402_mode_display(const struct cia402 *c, const struct drive_status *now);

/* 0x6502: a bit for each mode less one. Those that features and the source of the angle allow. Thread. */
uint32_t cia402_supported_modes(const struct axis *a);

/* CiA 402 error code, 0x603F: 0 if there is no fault. Any context. */
uint32_t cia402_error_code(enum fault fault);

#endif
