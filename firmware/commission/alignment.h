/* SPDX-License-Identifier: MIT */
/*
 * Finds the magnets with a direct current, since an incremental encoder does not know their position.
 *
 * The current pulls the rotor to two angles 90 degrees apart, because there is no torque at 180 degrees; then the field turns
 * one electrical turn forward and back, and a part of one with less current. Counts per turn verify pole_pairs and
 * encoder_counts, their sign the direction; the field's lead over the encoder gives the offset (measure.h), its growth with
 * less current the load. Every failed check has its own result.
 *
 * The rotor turns by two and a half electrical turns, according to pole_pairs, to either side of its starting point; one that
 * turns by more than ALIGNMENT_TURNS is driven by a load, and released. The pull uses i_align, the turns up to i_max; a second
 * attempt uses that from the beginning.
 */
#ifndef FIRMWARE_COMMISSION_ALIGNMENT_H
#define FIRMWARE_COMMISSION_ALIGNMENT_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/commission/measure.h"
#include "firmware/control/current_loop.h"
#include "firmware/settings/tuning.h"

/* ==== the encoder's direction ==== */

/*
 * Finds the encoder's counting direction from any motion of the magnets, at any angle of the field.
 *
 * The EMF, e = j w psi exp(j angle), is a vector that turns with the rotor. Divided by the speed and compared with the
 * encoder's angle x, it is a rotation of (cos x, sin x) if the encoder counts with the rotor, and a reflection if it counts
 * backwards. The sums over the motion
 *
 *     cd = sum n e_d cos x    sd = sum n e_d sin x
 *     cq = sum n e_q cos x    sq = sum n e_q sin x        n: counts per step
 *
 * estimate that mapping; the sign of its determinant cd sq - cq sd distinguishes the two. A constant part of e, from a wrong
 * resistance or dead time, cancels between forward and back. Some motion is needed.
 */

struct encoder_sense {
    int64_t cd, sd, cq, sq; /* Q15 times Q15 times counts */
};

/* Clears the sums. Slow loop. */
void encoder_sense_start(struct encoder_sense *s);

/*
 * One step: `e_d_q15`, `e_q_q15` are the EMF along and across the field at `field_q32`; the encoder is at `angle_q32`,
 * electrical, and has moved by `moved` counts. Slow loop.
 */
void encoder_sense_step(struct encoder_sense *s, int32_t e_d_q15, int32_t e_q_q15, uint32_t field_q32,
                        uint32_t angle_q32, int32_t moved);

/*
 * Relative fit of both directions: (|E+|^2 - |E-|^2) / (|E+|^2 + |E-|^2), 1.0 = 32768; negative: it counts backwards. Without
 * noise a motion by 60 degrees gives 0.19, one by 90 degrees 0.42, one by half a turn 1. Slow loop.
 */
int32_t encoder_sense_q15(const struct encoder_sense *s);

/* ==== the load's angle ==== */

/*
 * Compensates the encoder's offset for load: a load shifts the rotor from the field by an angle c that the encoder does not
 * show, but that changes with the current, because the torque is
 *
 *     T(I, c) = 1.5 p I sin c (psi - (Lq - Ld) I cos c)
 *
 * Measured is m = c + offset, at two currents in both directions. Friction changes sign with the direction, a load does not:
 * summed over both directions, the torques at both currents are equal at one offset only. Bisection finds it, a step a
 * millisecond.
 */

struct load_angle {
    uint32_t forward_q32[2], back_q32[2]; /* mean of field less encoder at the larger current and at the smaller */
    int32_t ratio_q15;                    /* smaller current over the larger */
    int32_t saliency_q15;                 /* (Lq - Ld) I / psi, at the larger current */
    uint32_t centre_q32;
    int32_t low_q32, high_q32; /* the offset lies between, relative to the centre */
    int32_t more_salient_q32;  /* the offset if the saliency is larger by a quarter */
    uint32_t steps;
};

/* Starts, with the measured angles and both ratios set. Slow loop. */
void load_angle_start(struct load_angle *a);

/* One step; true when the offset is known. About 300 cycles. Slow loop. */
bool load_angle_step(struct load_angle *a);

/* Change of the offset by a quarter more saliency: zero without a load. */
uint32_t load_angle_uncertainty_q32(const struct load_angle *a);

/* From the encoder's angle to the magnets'. */
static inline uint32_t load_angle_offset_q32(const struct load_angle *a)
{
    return a->centre_q32 + (uint32_t)a->low_q32;
}

/*
 * Remaining difference between the torques at both currents in one direction, as an angle at the larger current: zero with only
 * load and friction; larger with stick-slip.
 */
int32_t load_angle_spread_q15(const struct load_angle *a);

/* The field's lead over the rotor at the larger current, the larger of both directions. */
uint32_t load_angle_largest_q32(const struct load_angle *a);

/* T(I, c) from above, 1.0 = the torque of the larger current in a machine without saliency. */
int32_t load_angle_torque_q15(int32_t current_q15, int32_t saliency_q15, uint32_t angle_q32);

/* ==== speed limit of the pull ==== */

/*
 * Limits the rotor's speed during the pull, before the encoder is verified. A rotor opposite the field would reach 2 w0; so the
 * current decreases as the rotor approaches the speed that the tuning allows, and is zero beyond. Only the magnitude of the
 * speed is used: it is right with a reversed encoder, swapped phases, or wrong pole pairs. Past the field's angle the current
 * brakes, and is not limited: there the EMF along the field is negative, e_d = v_d - R i_d < 0. This is decided at zero
 * current, where an error of R has no effect.
 */

struct pull_speed {
    int32_t speed_q32; /* electrical turns per millisecond, over tuning.align_speed_ms */
    int32_t i_d_q15;   /* at the sample of the loop's v_d_q15 */
    int32_t drop_q15;  /* of the resistance */
    int32_t e_d_q15;   /* EMF along the field in the millisecond that ended */
    int32_t along_q15; /* the same, filtered; 0 while the current changes */
    bool brakes;       /* the rotor has passed the field and slows down since */
    int32_t slowest_q32;
    int32_t free_ms;    /* how long it has been above the limit without current */
    int32_t let_go_q32; /* the lowest speed since then */
};

/* `moved_q32`: electrical travel by the encoder in the millisecond that ends. Slow loop. */
void pull_speed_step(struct pull_speed *s, const volatile struct current_loop *c, const struct tuning *t,
                     int32_t moved_q32);

/* The current, reduced by the speed limit. Slow loop. */
int32_t pull_speed_current_q15(const struct pull_speed *s, const struct tuning *t, int32_t current_q15);

/* The field moves: the EMF along it is then not evaluated. Slow loop. */
void pull_speed_field_moves(struct pull_speed *s);

/* True if it accelerates above the limit without current: a load drives it. Slow loop. */
bool pull_speed_falls(const struct pull_speed *s, const struct tuning *t);

/* ==== saliency ==== */

/*
 * Finds the magnets at standstill in a machine whose reluctance outweighs them: an alternating voltage along one angle after
 * another over half a turn, and the current response. A voltage V along the angle a gives, in the frame of a,
 *
 *     d_i + j d_q  ~  V (Y0 + Y1 exp(2j (m - a))),    Y0, Y1 = (1/Ld +- 1/Lq) / 2
 *
 * with the magnets at m: times exp(2j a) and summed over a, only Y1 exp(2j m) is left. That is m up to half a turn. The
 * torque alternates, so nothing moves; the magnets' axis is one of symmetry, even where iron saturates.
 */

#define SALIENCY_ANGLES 16u

struct saliency {
    uint32_t angle; /* index of the angle */
    uint32_t ms;    /* within its voltage pattern */
    int32_t v_q15, i_q15;
    int32_t steady_d_q15, steady_q_q15; /* voltage on top of the alternating one */
    struct measure_axes sums;
};

/* `v_q15`: the voltage; along the magnets it changes the current by `i_q15` peak to peak in a millisecond. Slow loop. */
void saliency_start(struct saliency *s, int32_t v_q15, int32_t i_q15);

/*
 * One step a millisecond; true when complete, with zero voltage. Meanwhile the current loop holds voltages (gains of zero) with
 * LOOP_FORCED as its source. `encoder_q32`: electrical angle of the encoder. Slow loop.
 */
bool saliency_step(struct saliency *s, volatile struct current_loop *c, uint32_t encoder_q32);

/* From the encoder's angle to the magnets', or half a turn more. Slow loop. */
uint32_t saliency_offset_q32(const struct saliency *s);

/* True if Y1 is at least a tenth of Y0: there is an axis to find. Slow loop. */
bool saliency_seen(const struct saliency *s);

#define ALIGNMENT_TURNS 6

/* Load angle reported in a fault if the rotor did not stay with the field at all. */
#define ALIGNMENT_OUT_DEGREES 180

enum alignment_result {
    ALIGNMENT_RUNNING,
    ALIGNMENT_DONE,
    ALIGNMENT_ENCODER_DEAD, /* the field turned, the magnets induced a voltage, but no counts came */
    ALIGNMENT_DIRECTION,    /* encoder reversed or two phases swapped */
    ALIGNMENT_POLE_PAIRS,   /* detail: pole pairs and counts that would fit */
    ALIGNMENT_COUNTS,       /* the same */
    ALIGNMENT_BLOCKED,      /* nothing turned, or not evenly */
    ALIGNMENT_LOAD,         /* detail: load angle in degrees at the larger current */
};

struct alignment {
    uint32_t stage;
    uint32_t attempt;
    uint32_t level; /* of TUNING_ALIGN_LEVELS: how much current */
    uint32_t pass;
    uint32_t stage_ms;
    int32_t period_ms; /* the rotor's, or longer: times scale with it */
    int32_t counts;    /* of the encoder since the start */
    struct encoder_sense turned_with;
    int64_t sense_sum; /* q voltage times the encoder's motion since the field was last at rest */
    int32_t v_q_sum_q15;
    uint32_t swing_ms;
    int32_t swing_from;  /* counts then */
    int32_t furthest;    /* from there since then */
    int32_t fastest_q32; /* since then */
    int32_t origin;      /* counts when this attempt began */
    int32_t jump_from;   /* counts when the field jumped */
    uint32_t ratio;      /* the rotor's motion over what it should be as the field jumped; 8: right, or not known */
    uint32_t latched;    /* counter at the last step */
    uint32_t field_q32;
    int32_t current_q15, target_q15;
    int32_t pull_q15; /* as much of it as the rotor's speed allows */
    struct pull_speed speed;
    bool held_firmly; /* it fell, and more current caught it */
    bool even;        /* the whole turns were even */
    bool lost;        /* with less current the rotor did not follow */
    struct pendulum rotor;
    struct field_pass passing;
    int32_t turn_counts_q4[2]; /* of the whole turns, forward and back */
    int32_t turn_v_q_q15[2];
    struct load_angle load;
    struct saliency axis;
    uint32_t first_offset_q32; /* of the axis, before anything turned */
    int32_t stood_at;          /* counts when the axis began to be measured, */
    bool stood;                /* and it has stayed there */
    uint32_t still_ms;         /* since the encoder's last count */
    bool turned;               /* the passes are done */
    bool silent;               /* and the encoder did not count */
    int32_t detail[2];
};

/* `latched`: the encoder's counter. Slow loop, before the bridge is switched on. */
void alignment_start(struct alignment *a, volatile struct current_loop *c, const struct tuning *t, uint32_t latched);

/* One step a millisecond; sets the current references and the angle. Slow loop, bridge on. */
enum alignment_result alignment_step(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                     uint32_t latched);

/* True if the current loop must hold voltages (wiring_tuning). Slow loop, after the step. */
bool alignment_holds_voltage(const struct alignment *a);

#endif
