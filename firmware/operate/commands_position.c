/* SPDX-License-Identifier: MIT */
/* Positions, homing, the zero. */
#include "firmware/operate/commands.h"

static void run_position(struct session *s, const struct arguments *a)
{
    answer(s, drive_command_position(s->axis, a->value[1], false));
}

static void run_position_by(struct session *s, const struct arguments *a)
{
    answer(s, drive_command_position(s->axis, a->value[2], true));
}

static void run_home(struct session *s, const struct arguments *a)
{
    answer(s, drive_command_home(s->axis, a->value[1] == 0 ? HOMING_INDEX : HOMING_BLOCK));
}

/* clang-format off */
const struct command commands_position[] = {
    {"pp", " COUNTS", "profile position: to COUNTS from the zero, also on the way elsewhere",
     {ARGUMENT_COUNTS}, .run = run_position, .begins = PROGRESS_MOVE},
    {"pp", " by COUNTS", "so many from the last target", {ARGUMENT_BY, ARGUMENT_COUNTS},
     .run = run_position_by, .begins = PROGRESS_MOVE},
    {"hm", " index|block", "homing: search for the encoder's index or a mechanical block, which then is position 0",
     {ARGUMENT_CHOICE}, .run = run_home, .begins = PROGRESS_HOME},
    {"csp", " COUNTS", "cyclic synchronous position: there in cyclic_ms, when the next set-point is due",
     {ARGUMENT_COUNTS}, .demand = drive_command_cyclic_position},
};

const struct command commands_zero[] = {
    {"zero", "", "the shaft's position is 0 from now on", .request = drive_set_zero, .commands = true},
};
/* clang-format on */
