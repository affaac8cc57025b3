/* SPDX-License-Identifier: MIT */
#include "firmware/operate/commands.h"

#include <stddef.h>

#include "firmware/operate/answers.h"
#include "firmware/operate/commands_parts.h"
#include "firmware/settings/config.h"

#define WORDS_MAX 5u

static void run_version(struct session *s, char *const *words)
{
    (void)words;
    text_put_line(&s->out, "mssfoc " CONFIG_VERSION);
}

static void run_help(struct session *s, char *const *words);
static void run_help_about(struct session *s, char *const *words);
static void run_machine(struct session *s, char *const *words);

const struct command command_table[] = {
    {"help", "", "this list", 1, run_help},
    {"help", " COMMAND", "what it takes and does", 2, run_help_about},
    {"status", "", "state, fault, speed, currents, bus voltage of one instant; memory errors; time since the start", 1,
     run_status},
    {"on", "", "calibrate, align if needed, enable operation", 1, run_on},
    {"identify", "", "measure the motor, then off; needs the inverter's ratings and i_rated_ma only", 1, run_identify},
    {"identify", " show|use", "what it found, with intervals; or make parameters of what is known", 2,
     run_identify_what},
    {"off", "", "bridge off within a millisecond, the motor coasts", 1, run_off},
    {"quickstop", "", "brake to standstill, then off; during a start off at once", 1, run_quick_stop},
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
    {"learn", " cogging|hall",
     "turn slowly forth and back, and find the torque that the shaft's place asks for; or, while off, the Hall "
     "switches",
     2, run_learn},
    {"zero", "", "the shaft's position is 0 from now on", 1, run_zero},
    {"fault", "", "first cause, what to look at, the drive's values at that instant; registers of a processor fault", 1,
     run_fault},
    {"clear", "", "forget the fault if its cause is gone", 1, run_clear},
    {"angle", " encoder|observer|hall",
     "what tells the rotor's angle from now on, while it turns; 'on' begins with angle_source", 2, run_angle},
    {"get", " PARAM", "a parameter and its range, or 'all', or '--changed': those that are not as they were made", 2,
     run_get},
    {"set", " PARAM VALUE", "change a parameter while off", 3, run_set},
    {"save", "", "keep parameters, reactions, index and cogging over power-off; while off and at rest", 1, run_save},
    {"load", "", "what was saved last, as at the start; while off", 1, run_load},
    {"defaults", "", "parameters and reactions as they were made, while off; what is saved stays", 1, run_defaults},
    {"reaction", "", "what follows from each fault that leaves a choice", 1, run_reactions},
    {"reaction", " FAULT off|stop|warn|carry", "choose it, while off", 3, run_reaction},
    {"machine", " on|off", "no echo, no prompt; a line with '.' behind each answer, for programs", 2, run_machine},
    {"scope", " trigger SIGNAL above|below|rises|falls VALUE",
     "what begins a capture, besides a fault and 'scope fire'", 5, run_scope_trigger},
    {"scope", " signals A,B,...|every TICKS|before SAMPLES|trigger never", "what a capture is to hold", 3,
     run_scope_set},
    {"scope", " list|arm|fire|off|read|fault", "signals there are; a capture; the last one; what the last fault left",
     2, run_scope_do},
    {"scope", "", "what is set, and what the capture does", 1, run_scope},
    {"stream", " MS BAUD", "a frame of the signals every MS between the text, at BAUD; ends 3 s after the last line", 3,
     run_stream},
    {"version", "", "of this firmware", 1, run_version},
};

const size_t command_count = sizeof command_table / sizeof command_table[0];

static void put_help(struct session *s, const struct command *command)
{
    text_put(&s->out, command->name);
    text_put(&s->out, command->arguments);
    text_put(&s->out, ": ");
    text_put_line(&s->out, command->help);
}

static void run_help(struct session *s, char *const *words)
{
    (void)words;
    for (size_t i = 0; i < command_count; i++) {
        put_help(s, &command_table[i]);
    }
}

static void run_help_about(struct session *s, char *const *words)
{
    bool found = false;
    for (size_t i = 0; i < command_count; i++) {
        if (text_equal(words[1], command_table[i].name)) {
            put_help(s, &command_table[i]);
            found = true;
        }
    }
    if (!found) {
        answer_about(s, words[1], "unknown command; 'help' lists them");
    }
}

/* The answer already uses the mode of the next line. */
static void run_machine(struct session *s, char *const *words)
{
    const bool on = text_equal(words[1], "on");
    if (on || text_equal(words[1], "off")) {
        s->machine = on;
        text_put_line(&s->out, "ok");
    } else {
        answer_about(s, words[1], "not one of on, off");
    }
}

/* Splits the line at blanks; returns the number of words, WORDS_MAX + 1 if there are too many. */
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

/* The row of that name and number of words; NULL if there is none. */
static const struct command *find(const char *name, size_t words)
{
    const struct command *found = NULL;
    for (size_t i = 0; i < command_count; i++) {
        if (text_equal(name, command_table[i].name) && (found == NULL || command_table[i].words == words)) {
            found = &command_table[i];
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
        answer_about(s, words[0], "unknown command; 'help' lists them");
    } else if (count != command->words) {
        text_put(&s->out, "error: usage: ");
        text_put(&s->out, command->name);
        text_put_line(&s->out, command->arguments);
    } else {
        command->run(s, words);
    }
}
