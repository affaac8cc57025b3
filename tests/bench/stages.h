/* SPDX-License-Identifier: MIT */
/*
 * The current loop cut into stages that can be timed one by one, on a state of their own. The sum of the stages is more
 * than the whole: what the interrupt keeps in registers from one stage to the next passes through memory here.
 */
#ifndef TESTS_BENCH_STAGES_H
#define TESTS_BENCH_STAGES_H

struct current_loop;

/* The state that the stages work on. */
struct current_loop *stages_state(void);

void stage_fetch(void);     /* registers of ADC and encoder; acknowledge */
void stage_scale(void);     /* codes to Q15, reciprocal of the bus voltage */
void stage_observe(void);   /* angle and speed */
void stage_transform(void); /* sine and cosine, Clarke, Park */
void stage_regulate(void);  /* decoupling, voltage circle, both PI controllers */
void stage_advance(void);   /* sine and cosine of the angle at which the voltages act */
void stage_modulate(void);  /* to on-times with dead-time compensation, and into CorePWM */
void stage_publish(void);   /* results for others */
void stage_protect(void);   /* gate and encoder status, thresholds */

/* Of stage_modulate(): the fourteen writes to CorePWM and the limits of the edges. */
void stage_write_pwm(void);

#endif
