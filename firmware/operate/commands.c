/* SPDX-License-Identifier: MIT */
#include "firmware/operate/commands.h"
#include "firmware/axis/rotor.h"

#include <stddef.h>

#include "drivers/mss/sysreg.h"
#include "firmware/operate/identify_text.h"
#include "firmware/operate/messages.h"
#include "firmware/operate/postmortem_text.h"
#include "firmware/operate/text.h"
#include "firmware/settings/config.h"
#include "firmware/system/measure.h"

#define WORDS_MAX 3u

struct command {
    const char *name;
    const char *arguments;
    const char *help;
    size_t words; /* of the whole line */
    void (*run)(struct session *s, char *const *words);
};

static void error_about(struct session *s, const char *word, const char *what)
{
    text_put(&s->out, "error: ");
    text_put(&s->out, word);
    text_put(&s->out, ": ");
    text_put_line(&s->out, what);
}

/* A '@' in the text stands for the first value, a '#' for the second. */
static void put_filled(struct session *s, const char *text, int32_t first, int32_t second)
{
    for (; *text != '\0'; text++) {
        if (*text == '@' || *text == '#') {
            text_put_int(&s->out, *text == '@' ? first : second);
        } else {
            text_put_char(&s->out, *text);
        }
    }
    text_put_line(&s->out, "");
}

static void answer(struct session *s, struct outcome outcome)
{
    if (outcome.error != ERROR_NONE) {
        text_put(&s->out, "error: ");
    }
    put_filled(s, message_of_error(outcome.error), outcome.value, 0);
}

/* "name: 1.234 unit" */
static void put_milli(struct session *s, const char *name, int32_t q15, int32_t range_milli, const char *unit)
{
    text_put(&s->out, name);
    text_put_milli(&s->out, tuning_milli_from_q15(q15, range_milli));
    text_put(&s->out, unit);
}

static void put_rpm(struct session *s, const char *name, int32_t rpm_q4)
{
    text_put(&s->out, name);
    text_put_milli(&s->out, (int32_t)((int64_t)rpm_q4 * 1000 / 16));
    text_put(&s->out, " rpm");
}

static void put_heat(struct session *s)
{
    text_put(&s->out, ", winding: ");
    text_put_int(&s->out, s->axis->thermal.winding_q4 / 16);
    text_put(&s->out, " degC");
    if (s->axis->thermal.factor_q15 < Q15_ONE) {
        text_put(&s->out, ", current limit held to ");
        text_put_int(&s->out, s->axis->thermal.factor_q15 * 100 / Q15_ONE);
        text_put(&s->out, " %");
    }
    text_put_line(&s->out, "");
}

static void put_warnings(struct session *s)
{
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        if (reaction_warned(&s->axis->reactions, (enum fault)cause)) {
            text_put(&s->out, "warning: ");
            text_put_line(&s->out, message_of_fault((enum fault)cause));
        }
    }
}

/* The newest voltage of each millisecond is looked at, since the last `on`. */
static void put_update(struct session *s)
{
    text_put(&s->out, "voltages act: ");
    text_put(&s->out, message_of_update(s->axis->tuning.update));
    if (s->axis->tuning.samples == 2) {
        text_put(&s->out, ", two samples a period");
    }
    if (s->axis->tuning.update == PWM_UPDATE_ONCE) {
        text_put(&s->out, ", milliseconds in which one had to wait for the next end: ");
        text_put_int(&s->out, (int32_t)s->axis->loop.fell_back);
    }
    text_put_line(&s->out, "");
}

static void put_position(struct session *s, const struct axis_status *now)
{
    text_put(&s->out, "mode: ");
    text_put(&s->out, message_of_mode(now->mode));
    text_put(&s->out, ", position: ");
    text_put_long(&s->out, now->position);
    if (axis_mode_is_position(now->mode)) {
        text_put(&s->out, ", target ");
        text_put_long(&s->out, now->target);
        text_put(&s->out, ", following error ");
        text_put_int(&s->out, now->error_counts);
    }
    text_put(&s->out, " counts");
    text_put_line(&s->out, now->homed ? ", homed" : "");
}

/* The first harmonics are the largest. */
static void put_cogging(struct session *s)
{
    const struct cogging_map *const m = &s->axis->motion.cogging;
    if (s->axis->mode == AXIS_MODE_LEARNING) {
        text_put_line(&s->out, "cogging: learning");
        return;
    }
    if (m->count == 0) {
        return;
    }
    text_put(&s->out, "cogging: learned, times a turn:");
    for (int32_t n = 0; n < m->count; n++) {
        text_put(&s->out, " ");
        text_put_int(&s->out, (int32_t)m->harmonics[n].order);
    }
    text_put_line(&s->out, "");
}

/* Without an encoder: how well the EMF shows the rotor, and whether that leads or a prescribed field does. */
static void put_margin(struct session *s)
{
    const struct axis *const a = s->axis;
    if (rotor_has_encoder(a)) {
        return;
    }
    text_put(&s->out, "margin of observability: ");
    text_put_milli(&s->out, (int32_t)((int64_t)a->loop.flux.margin_q8 * 1000 / 256));
    text_put_line(&s->out, rotor_is_known(a) ? ", the observer leads" : ", a prescribed field leads");
}

static void run_status(struct session *s, char *const *words)
{
    (void)words;
    const struct axis_status now = axis_status(s->axis);
    const int32_t i_range_ma = s->axis->params.i_range_ma;
    text_put(&s->out, "state: ");
    text_put_line(&s->out, message_of_state(now.state));
    text_put(&s->out, "fault: ");
    text_put_line(&s->out, message_of_fault(now.fault));
    put_rpm(s, "speed: ", now.speed_rpm_q4);
    put_rpm(s, ", reference ", now.speed_ref_rpm_q4);
    text_put_line(&s->out, "");
    put_position(s, &now);
    put_cogging(s);
    put_milli(s, "current: d ", now.i_d_q15, i_range_ma, " A");
    put_milli(s, ", q ", now.i_q_q15, i_range_ma, " A");
    put_milli(s, ", reference d ", now.i_d_ref_q15, i_range_ma, " A");
    put_milli(s, ", q ", now.i_q_ref_q15, i_range_ma, " A");
    text_put_line(&s->out, "");
    put_milli(s, "bus: ", now.vbus_q15, s->axis->params.v_range_mv, " V");
    put_heat(s);
    identify_text_running(&s->out, &s->axis->identify);
    put_warnings(s);
    text_put(&s->out, "current loop: ");
    text_put_int(&s->out, (int32_t)measure_current_loop_cycles(&s->axis->time_ms));
    text_put_line(&s->out, " cycles");
    put_update(s);
    put_margin(s);
    text_put(&s->out, "memory errors corrected: ");
    text_put_int(&s->out, (int32_t)sysreg_edac_corrected());
    text_put_line(&s->out, "");
    text_put(&s->out, "up: ");
    text_put_seconds(&s->out, now.up_ms);
    text_put_line(&s->out, " s");
}

static void run_on(struct session *s, char *const *words)
{
    (void)words;
    const struct outcome outcome = axis_switch_on(s->axis);
    answer(s, outcome);
    if (outcome.error == ERROR_NONE) {
        text_put(&s->out, "phase margin of the current loop: ");
        text_put_int(&s->out, s->axis->tuning.current_margin_u16 * 360 / 65536);
        text_put_line(&s->out, " degrees");
    }
}

static void run_off(struct session *s, char *const *words)
{
    (void)words;
    answer(s, axis_switch_off(s->axis));
}

static void run_quick_stop(struct session *s, char *const *words)
{
    (void)words;
    answer(s, axis_quick_stop(s->axis));
}

/* A whole number, or a line that says `what` the word is not. */
static bool parse_whole(struct session *s, const char *word, int32_t *value, const char *what)
{
    const bool whole = text_parse_int(word, value);
    if (!whole) {
        error_about(s, word, what);
    }
    return whole;
}

static bool parse_rpm(struct session *s, const char *word, int32_t *rpm)
{
    return parse_whole(s, word, rpm, "not a whole number of rpm");
}

static bool parse_counts(struct session *s, const char *word, int32_t *counts)
{
    return parse_whole(s, word, counts, "not a whole number of counts");
}

static bool parse_current(struct session *s, const char *word, int32_t *milliamp)
{
    const bool current = text_parse_milli(word, milliamp);
    if (!current) {
        error_about(s, word, "not a current in amperes, like 1.5");
    }
    return current;
}

static void run_speed(struct session *s, char *const *words)
{
    int32_t rpm;
    if (parse_rpm(s, words[1], &rpm)) {
        answer(s, axis_command_speed(s->axis, rpm));
    }
}

static void run_torque(struct session *s, char *const *words)
{
    int32_t milliamp;
    if (parse_current(s, words[1], &milliamp)) {
        answer(s, axis_command_current(s->axis, milliamp));
    }
}

static void run_position(struct session *s, char *const *words)
{
    int32_t counts;
    if (parse_counts(s, words[1], &counts)) {
        answer(s, axis_command_position(s->axis, counts, false));
    }
}

static void run_position_by(struct session *s, char *const *words)
{
    int32_t counts;
    if (!text_equal(words[1], "by")) {
        error_about(s, words[1], "not 'by'");
    } else if (parse_counts(s, words[2], &counts)) {
        answer(s, axis_command_position(s->axis, counts, true));
    }
}

static void run_cyclic_position(struct session *s, char *const *words)
{
    int32_t counts;
    if (parse_counts(s, words[1], &counts)) {
        answer(s, axis_command_cyclic_position(s->axis, counts));
    }
}

static void run_cyclic_speed(struct session *s, char *const *words)
{
    int32_t rpm;
    if (parse_rpm(s, words[1], &rpm)) {
        answer(s, axis_command_cyclic_speed(s->axis, rpm));
    }
}

static void run_cyclic_torque(struct session *s, char *const *words)
{
    int32_t milliamp;
    if (parse_current(s, words[1], &milliamp)) {
        answer(s, axis_command_cyclic_current(s->axis, milliamp));
    }
}

static void run_home(struct session *s, char *const *words)
{
    if (text_equal(words[1], "index")) {
        answer(s, axis_command_home(s->axis, HOMING_INDEX));
    } else if (text_equal(words[1], "block")) {
        answer(s, axis_command_home(s->axis, HOMING_BLOCK));
    } else {
        error_about(s, words[1], "not one of index, block");
    }
}

static void run_learn(struct session *s, char *const *words)
{
    if (text_equal(words[1], "cogging")) {
        answer(s, axis_learn_cogging(s->axis));
    } else {
        error_about(s, words[1], "not 'cogging'");
    }
}

static void run_zero(struct session *s, char *const *words)
{
    (void)words;
    answer(s, axis_set_zero(s->axis));
}

static void put_detail(struct session *s)
{
    const char *const text = message_fault_detail(s->axis->faults.cause);
    if (*text != '\0') {
        text_put(&s->out, "found: ");
        put_filled(s, text, s->axis->faults.detail[0], s->axis->faults.detail[1]);
    }
}

static void run_fault(struct session *s, char *const *words)
{
    (void)words;
    const struct axis *const a = s->axis;
    postmortem_print(&s->out, s->last_life);
    text_put(&s->out, "fault: ");
    text_put_line(&s->out, message_of_fault(a->faults.cause));
    if (a->faults.cause == FAULT_NONE) {
        return;
    }
    put_detail(s);
    text_put(&s->out, "look at: ");
    text_put_line(&s->out, message_fault_hint(a->faults.cause));
    if (axis_fabric_doubted(a)) {
        return; /* there was nothing to read */
    }
    const struct fault_snapshot *const f = &a->faults.snapshot;
    text_put(&s->out, "at: ");
    text_put_seconds(&s->out, f->up_ms);
    text_put(&s->out, " s, state ");
    text_put_line(&s->out, message_of_state(f->state));
    put_milli(s, "phase currents: a ", f->i_a_q15, a->params.i_range_ma, " A");
    put_milli(s, ", b ", f->i_b_q15, a->params.i_range_ma, " A");
    put_milli(s, ", c ", f->i_c_q15, a->params.i_range_ma, " A");
    put_milli(s, "; d ", f->i_d_q15, a->params.i_range_ma, " A");
    put_milli(s, ", q ", f->i_q_q15, a->params.i_range_ma, " A");
    text_put_line(&s->out, "");
    put_milli(s, "bus: ", f->vbus_q15, a->params.v_range_mv, " V");
    put_rpm(s, ", speed: ", f->speed_rpm_q4);
    text_put(&s->out, ", angle: ");
    text_put_int(&s->out, (int32_t)(f->angle_u16 * 3600u / 65536u) / 10);
    text_put(&s->out, " deg, gate status: ");
    text_put_hex(&s->out, f->gate_status);
    text_put_line(&s->out, "");
}

static void run_clear(struct session *s, char *const *words)
{
    (void)words;
    answer(s, axis_clear_fault(s->axis));
}

static void put_param(struct session *s, const struct params *p, const struct param_info *info)
{
    text_put(&s->out, info->name);
    text_put(&s->out, " = ");
    text_put_int(&s->out, param_get(p, info));
    text_put(&s->out, "  (");
    text_put_int(&s->out, info->min);
    text_put(&s->out, "...");
    text_put_int(&s->out, info->max);
    text_put_line(&s->out, ")");
}

static void run_get(struct session *s, char *const *words)
{
    if (text_equal(words[1], "all")) {
        for (size_t i = 0; i < param_count; i++) {
            put_param(s, &s->axis->params, &param_table[i]);
        }
        return;
    }
    const struct param_info *const info = param_find(words[1]);
    if (info == NULL) {
        error_about(s, words[1], "no such parameter; 'get all' lists them");
        return;
    }
    put_param(s, &s->axis->params, info);
}

static void run_set(struct session *s, char *const *words)
{
    const struct param_info *const info = param_find(words[1]);
    int32_t value;
    if (info == NULL) {
        error_about(s, words[1], "no such parameter; 'get all' lists them");
    } else if (!text_parse_int(words[2], &value)) {
        error_about(s, words[2], "not a whole number");
    } else if (value < info->min || value > info->max) {
        text_put(&s->out, "error: ");
        text_put(&s->out, info->name);
        text_put(&s->out, " must be ");
        text_put_int(&s->out, info->min);
        text_put(&s->out, "...");
        text_put_int(&s->out, info->max);
        text_put_line(&s->out, "");
    } else if (!axis_is_off(s->axis)) {
        answer(s, outcome_of(ERROR_DRIVE_IS_ON));
    } else {
        param_set(&s->axis->params, info, value);
        text_put_line(&s->out, "ok");
    }
}

/* A fault that leaves a choice: which, and which it has. */
static void put_reaction(struct session *s, enum fault cause)
{
    text_put(&s->out, message_of_fault(cause));
    text_put(&s->out, ": ");
    text_put(&s->out, message_of_reaction(s->axis->reactions.choice[cause]));
    text_put(&s->out, "  (");
    const char *before = "";
    for (uint32_t choice = 0; choice < REACTION_COUNT; choice++) {
        if (((fault_class(cause)->allowed >> choice) & 1u) != 0u) {
            text_put(&s->out, before);
            text_put(&s->out, message_of_reaction((enum reaction)choice));
            before = ", ";
        }
    }
    text_put_line(&s->out, ")");
}

static void run_reactions(struct session *s, char *const *words)
{
    (void)words;
    for (uint32_t cause = FAULT_NONE + 1u; cause < FAULT_COUNT; cause++) {
        if (fault_class((enum fault)cause)->allowed != 1u << REACTION_OFF) {
            put_reaction(s, (enum fault)cause);
        }
    }
}

static void run_reaction(struct session *s, char *const *words)
{
    const enum fault cause = message_find_fault(words[1]);
    uint32_t choice = 0;
    while (choice < REACTION_COUNT && !text_equal(words[2], message_of_reaction((enum reaction)choice))) {
        choice++;
    }
    if (cause == FAULT_COUNT) {
        error_about(s, words[1], "no such fault; 'reaction' lists those with a choice, '_' stands for a blank");
    } else if (choice == REACTION_COUNT) {
        error_about(s, words[2], "not one of off, stop, warn");
    } else {
        answer(s, axis_choose_reaction(s->axis, cause, (enum reaction)choice));
    }
}

static void run_identify(struct session *s, char *const *words)
{
    (void)words;
    answer(s, axis_identify(s->axis));
}

static void run_identify_what(struct session *s, char *const *words)
{
    if (text_equal(words[1], "show")) {
        identify_text_show(&s->out, &s->axis->identify);
    } else if (text_equal(words[1], "use")) {
        const struct outcome outcome = axis_identify_use(s->axis);
        answer(s, outcome);
        if (outcome.error == ERROR_NONE) {
            identify_text_used(&s->out, outcome.value);
        }
    } else {
        error_about(s, words[1], "not one of show, use");
    }
}

static void run_version(struct session *s, char *const *words)
{
    (void)words;
    text_put_line(&s->out, "mssfoc " CONFIG_VERSION);
}

static void run_help(struct session *s, char *const *words);

static const struct command commands[] = {
    {"help", "", "this list", 1, run_help},
    {"status", "", "state, fault, speed, currents, bus voltage of one instant; memory errors; time since the start", 1,
     run_status},
    {"on", "", "calibrate, align if needed, enable operation", 1, run_on},
    {"identify", "", "measure the motor, then off; needs the inverter's ratings and i_rated_ma only", 1, run_identify},
    {"identify", " show|use", "what it found, with intervals; or make parameters of what is known", 2,
     run_identify_what},
    {"off", "", "bridge off within a millisecond, the motor coasts", 1, run_off},
    {"quickstop", "", "brake to standstill, then off", 1, run_quick_stop},
    {"speed", " RPM", "speed control to RPM", 2, run_speed},
    {"torque", " A", "current control, q axis, peak amperes", 2, run_torque},
    {"pv", " RPM", "profile velocity: the same as speed", 2, run_speed},
    {"pp", " COUNTS", "profile position: to COUNTS from the zero, also on the way elsewhere", 2, run_position},
    {"pp", " by COUNTS", "so many from the last target", 3, run_position_by},
    {"hm", " index|block", "homing: search for the encoder's index or a mechanical block, which then is position 0", 2,
     run_home},
    {"csp", " COUNTS", "cyclic synchronous position: there in cyclic_ms, when the next set-point is due", 2,
     run_cyclic_position},
    {"csv", " RPM", "cyclic synchronous velocity", 2, run_cyclic_speed},
    {"cst", " A", "cyclic synchronous torque, q axis, peak amperes", 2, run_cyclic_torque},
    {"learn", " cogging", "turn slowly forth and back, and find the torque that the shaft's place asks for", 2,
     run_learn},
    {"zero", "", "the shaft's position is 0 from now on", 1, run_zero},
    {"fault", "", "first cause, what to look at, the drive's values at that instant; registers of a processor fault", 1,
     run_fault},
    {"clear", "", "forget the fault if its cause is gone", 1, run_clear},
    {"get", " PARAM", "a parameter and its range, or 'all'", 2, run_get},
    {"set", " PARAM VALUE", "change a parameter while off", 3, run_set},
    {"reaction", "", "what follows from each fault that leaves a choice", 1, run_reactions},
    {"reaction", " FAULT off|stop|warn", "choose it, while off", 3, run_reaction},
    {"version", "", "of this firmware", 1, run_version},
};

static void run_help(struct session *s, char *const *words)
{
    (void)words;
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        text_put(&s->out, commands[i].name);
        text_put(&s->out, commands[i].arguments);
        text_put(&s->out, ": ");
        text_put_line(&s->out, commands[i].help);
    }
}

/* Cuts the line at its blanks; returns the number of words, WORDS_MAX + 1 when there are more than fit. */
static size_t split(char *line, char **words)
{
    size_t count = 0;
    while (*line != '\0') {
        while (*line == ' ') {
            *line++ = '\0';
        }
        if (*line == '\0') {
            break;
        }
        if (count == WORDS_MAX) {
            return WORDS_MAX + 1u;
        }
        words[count++] = line;
        while (*line != ' ' && *line != '\0') {
            line++;
        }
    }
    return count;
}

/* The row of that name, and of those that share it the one that takes so many words; NULL when there is none. */
static const struct command *find(const char *name, size_t words)
{
    const struct command *found = NULL;
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        if (text_equal(name, commands[i].name) && (found == NULL || commands[i].words == words)) {
            found = &commands[i];
        }
    }
    return found;
}

void commands_execute(struct session *s, char *line)
{
    char *words[WORDS_MAX];
    const size_t count = split(line, words);
    if (count == 0u) {
        return;
    }
    const struct command *const command = find(words[0], count);
    if (command == NULL) {
        error_about(s, words[0], "unknown command; 'help' lists them");
    } else if (count != command->words) {
        text_put(&s->out, "error: usage: ");
        text_put(&s->out, command->name);
        text_put_line(&s->out, command->arguments);
    } else {
        command->run(s, words);
    }
}
