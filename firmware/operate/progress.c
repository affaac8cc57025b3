/* SPDX-License-Identifier: MIT */
/* Says when what a command has begun is done. What ends otherwise, a fault or another command, has said so itself. */
#include "firmware/operate/commands.h"

enum how { GOES_ON, IS_DONE, IS_OVER };

static enum how unless_off(const struct axis *a, bool done)
{
    if (done) {
        return IS_DONE;
    }
    return a->state == AXIS_OPERATION_ENABLED || a->state == AXIS_SWITCHED_ON || a->state == AXIS_READY ? GOES_ON
                                                                                                        : IS_OVER;
}

static enum how of_sweep(const struct sweep *w)
{
    return sweep_runs(w) ? GOES_ON : (w->state == SWEEP_DONE ? IS_DONE : IS_OVER);
}

static enum how how_is_it(const struct session *s, const struct axis *a, enum progress what)
{
    const bool operates = a->state == AXIS_OPERATION_ENABLED;
    switch (what) {
    case PROGRESS_ON:
        return unless_off(a, operates);
    case PROGRESS_IDENTIFY:
        return a->identify.running ? GOES_ON : IS_DONE;
    case PROGRESS_LEARN: /* cogging ends in operation, Hall switches with the bridge off */
        return unless_off(a, operates ? a->mode != AXIS_MODE_LEARNING : a->state == AXIS_SWITCH_ON_DISABLED);
    case PROGRESS_MOVE:
        return !operates || a->mode != AXIS_MODE_POSITION ? IS_OVER
                                                          : unless_off(a, profile_is_done(&a->motion.profile));
    case PROGRESS_HOME:
        return a->mode == AXIS_MODE_HOMING ? unless_off(a, false) : (operates && a->motion.homed ? IS_DONE : IS_OVER);
    case PROGRESS_SWEEP:
        return of_sweep(&s->scope->sweep);
    default:
        return IS_OVER;
    }
}

const char *progress_said(struct session *s, uint32_t axis)
{
    static const char *const texts[] = {
        [PROGRESS_ON] = "operation enabled", [PROGRESS_IDENTIFY] = "identify; 'identify show' lists what it found",
        [PROGRESS_LEARN] = "learning",       [PROGRESS_MOVE] = "in position",
        [PROGRESS_HOME] = "homed",           [PROGRESS_SWEEP] = "sweep; 'sweep read' has the result",
    };
    const struct axis *const a = AXIS_COUNT == 1u ? s->axis : &s->axes[axis];
    const enum progress what = s->progress[axis];
    if (what == PROGRESS_NONE || a->switching.under_way || a->request != AXIS_REQUEST_NONE || a->set_point.waits) {
        return NULL;
    }
    const enum how how = a->faults.cause != FAULT_NONE ? IS_OVER : how_is_it(s, a, what);
    s->progress[axis] = how == GOES_ON ? what : PROGRESS_NONE;
    return how == IS_DONE ? texts[what] : NULL;
}
