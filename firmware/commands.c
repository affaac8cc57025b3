/* SPDX-License-Identifier: MIT */
#include "firmware/commands.h"

#include <stddef.h>

#include "firmware/config.h"
#include "firmware/current_loop.h"
#include "firmware/drive.h"
#include "firmware/params.h"
#include "firmware/postmortem.h"
#include "firmware/speed_loop.h"
#include "firmware/text.h"

#define WORDS_MAX 3u

struct command {
    const char *name;
    const char *arguments;
    const char *help;
    size_t words; /* of the whole line */
    void (*run)(char *const *words);
};

static void error(const char *what)
{
    text_put("error: ");
    text_put_line(what);
}

static void error_about(const char *word, const char *what)
{
    text_put("error: ");
    text_put(word);
    text_put(": ");
    text_put_line(what);
}

static void answer(const char *problem)
{
    if (problem == NULL) {
        text_put_line("ok");
    } else {
        error(problem);
    }
}

/* "name: 1.234 unit" */
static void put_milli(const char *name, int32_t q15, int32_t range_milli, const char *unit)
{
    text_put(name);
    text_put_milli(tuning_milli_from_q15(q15, range_milli));
    text_put(unit);
}

static void put_rpm(const char *name, int32_t rpm_q4)
{
    text_put(name);
    text_put_milli((int32_t)((int64_t)rpm_q4 * 1000 / 16));
    text_put(" rpm");
}

static void run_status(char *const *words)
{
    (void)words;
    const struct current_loop *const c = &current_loop;
    text_put("state: ");
    text_put_line(drive_state_name(drive.state));
    text_put("fault: ");
    text_put_line(fault_name(drive.fault));
    put_rpm("speed: ", speed_loop.speed_rpm_q4);
    put_rpm(", reference ", speed_loop.speed_ref_rpm_q4);
    text_put_line("");
    put_milli("current: d ", c->i_d_q15, params.i_range_ma, " A");
    put_milli(", q ", c->i_q_q15, params.i_range_ma, " A");
    put_milli(", reference d ", c->i_d_ref_q15, params.i_range_ma, " A");
    put_milli(", q ", c->i_q_ref_q15, params.i_range_ma, " A");
    text_put_line("");
    put_milli("bus: ", c->vbus_q15, params.v_range_mv, " V");
    text_put_line("");
    text_put("current loop: ");
    text_put_int((int32_t)current_loop_measure_cycles());
    text_put_line(" cycles");
    text_put("up: ");
    text_put_milli((int32_t)drive.time_ms);
    text_put_line(" s");
}

static void run_on(char *const *words)
{
    (void)words;
    answer(drive_switch_on());
}

static void run_off(char *const *words)
{
    (void)words;
    answer(drive_switch_off());
}

static void run_quick_stop(char *const *words)
{
    (void)words;
    answer(drive_quick_stop());
}

static void run_speed(char *const *words)
{
    int32_t rpm;
    if (!text_parse_int(words[1], &rpm)) {
        error_about(words[1], "not a whole number of rpm");
        return;
    }
    answer(drive_command_speed(rpm));
}

static void run_torque(char *const *words)
{
    int32_t milliamp;
    if (!text_parse_milli(words[1], &milliamp)) {
        error_about(words[1], "not a current in amperes, like 1.5");
        return;
    }
    answer(drive_command_current(milliamp));
}

static void run_fault(char *const *words)
{
    (void)words;
    postmortem_print();
    text_put("fault: ");
    text_put_line(fault_name(drive.fault));
    if (drive.fault == FAULT_NONE) {
        return;
    }
    const struct fault_snapshot *const s = &fault_snapshot;
    text_put("look at: ");
    text_put_line(fault_hint(drive.fault));
    text_put("at: ");
    text_put_milli((int32_t)s->time_ms);
    text_put(" s, state ");
    text_put_line(drive_state_name(s->state));
    put_milli("phase currents: a ", s->i_a_q15, params.i_range_ma, " A");
    put_milli(", b ", s->i_b_q15, params.i_range_ma, " A");
    put_milli(", c ", s->i_c_q15, params.i_range_ma, " A");
    put_milli("; d ", s->i_d_q15, params.i_range_ma, " A");
    put_milli(", q ", s->i_q_q15, params.i_range_ma, " A");
    text_put_line("");
    put_milli("bus: ", s->vbus_q15, params.v_range_mv, " V");
    put_rpm(", speed: ", s->speed_rpm_q4);
    text_put(", angle: ");
    text_put_int((int32_t)(s->angle_u16 * 3600u / 65536u) / 10);
    text_put(" deg, gate status: ");
    text_put_hex(s->gate_status);
    text_put_line("");
}

static void run_clear(char *const *words)
{
    (void)words;
    answer(drive_clear_fault());
}

static void put_param(const struct param_info *info)
{
    text_put(info->name);
    text_put(" = ");
    text_put_int(param_get(info));
    text_put("  (");
    text_put_int(info->min);
    text_put("...");
    text_put_int(info->max);
    text_put_line(")");
}

static void run_get(char *const *words)
{
    if (text_equal(words[1], "all")) {
        for (size_t i = 0; i < param_count; i++) {
            put_param(&param_table[i]);
        }
        return;
    }
    const struct param_info *const info = param_find(words[1]);
    if (info == NULL) {
        error_about(words[1], "no such parameter; 'get all' lists them");
        return;
    }
    put_param(info);
}

static void run_set(char *const *words)
{
    const struct param_info *const info = param_find(words[1]);
    int32_t value;
    if (info == NULL) {
        error_about(words[1], "no such parameter; 'get all' lists them");
    } else if (!text_parse_int(words[2], &value)) {
        error_about(words[2], "not a whole number");
    } else if (value < info->min || value > info->max) {
        text_put("error: ");
        text_put(info->name);
        text_put(" must be ");
        text_put_int(info->min);
        text_put("...");
        text_put_int(info->max);
        text_put_line("");
    } else if (!drive_is_off()) {
        error("parameters can change only while the drive is off");
    } else {
        param_set(info, value);
        text_put_line("ok");
    }
}

static void run_version(char *const *words)
{
    (void)words;
    text_put_line("mssfoc " CONFIG_VERSION);
}

static void run_help(char *const *words);

static const struct command commands[] = {
    {"help", "", "this list", 1, run_help},
    {"status", "", "state, speed, currents, bus voltage", 1, run_status},
    {"on", "", "calibrate, align if needed, enable operation", 1, run_on},
    {"off", "", "bridge off at once, the motor coasts", 1, run_off},
    {"quickstop", "", "brake to standstill, then off", 1, run_quick_stop},
    {"speed", " RPM", "speed control to RPM", 2, run_speed},
    {"torque", " A", "current control, q axis, peak amperes", 2, run_torque},
    {"fault", "", "first cause and the drive's values at that instant", 1, run_fault},
    {"clear", "", "forget the fault if its cause is gone", 1, run_clear},
    {"get", " PARAM", "a parameter and its range, or 'all'", 2, run_get},
    {"set", " PARAM VALUE", "change a parameter while off", 3, run_set},
    {"version", "", "of this firmware", 1, run_version},
};

static void run_help(char *const *words)
{
    (void)words;
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        text_put(commands[i].name);
        text_put(commands[i].arguments);
        text_put(": ");
        text_put_line(commands[i].help);
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

void commands_execute(char *line)
{
    char *words[WORDS_MAX];
    const size_t count = split(line, words);
    if (count == 0u) {
        return;
    }
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        if (text_equal(words[0], commands[i].name)) {
            if (count != commands[i].words) {
                text_put("error: usage: ");
                text_put(commands[i].name);
                text_put_line(commands[i].arguments);
            } else {
                commands[i].run(words);
            }
            return;
        }
    }
    error_about(words[0], "unknown command; 'help' lists them");
}
