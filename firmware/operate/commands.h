/* SPDX-License-Identifier: MIT */
/*
 * The console's commands: tables of rows, from which lines are parsed, refused, completed and explained. A row's text shows its
 * arguments: capitals for a value or a name, lower case for a literal word or one of several; its kinds say how each is parsed
 * (arguments.c). Thread.
 */
#ifndef FIRMWARE_OPERATE_COMMANDS_H
#define FIRMWARE_OPERATE_COMMANDS_H

#include <stddef.h>

#include "firmware/drive/drive.h"
#include "firmware/operate/line.h"
#include "firmware/operate/stream.h"
#include "firmware/operate/text.h"
#include "firmware/scope/scope.h"
#include "firmware/settings/features.h"
#include "firmware/system/boot.h"

/* What a command only starts; the console reports when it is done. */
enum progress {
    PROGRESS_NONE,
    PROGRESS_ON,
    PROGRESS_IDENTIFY,
    PROGRESS_LEARN,
    PROGRESS_MOVE,
    PROGRESS_HOME,
    PROGRESS_SWEEP,
};

/* What a command needs to carry out its line and to answer. */
struct session {
    struct text out;
    enum progress progress[AXIS_COUNT]; /* started by the last accepted command, on each axis */
    bool accepted;                      /* this line was answered by "ok" */
    bool machine;                       /* a program reads the answers */
    struct axis *axes;                  /* AXIS_COUNT of them */
    struct axis *axis;                  /* the one that commands act on */
    struct scope *scope;                /* of the chosen axis */
    struct stream stream;               /* samples between the text */
    const struct postmortem *last_run;  /* how the program's last run ended */
    const struct slots *slots;          /* of the settings, for each axis */
    const struct nvm_report *loaded;    /* what was found in them at the start */
};

/* The number of the session's axis, from 0. */
static inline uint32_t session_axis(const struct session *s)
{
    return AXIS_COUNT == 1u ? 0u : (uint32_t)(s->axis - s->axes);
}

#define ARGUMENTS_MAX 4u

/* A line split into words; word 0 is the command's name. */
struct arguments {
    char *word[ARGUMENTS_MAX + 1u];
    int32_t value[ARGUMENTS_MAX + 1u]; /* the word parsed by its kind */
};

enum argument {
    ARGUMENT_NONE,
    ARGUMENT_CHOICE,  /* one of the row's words; value: which, from 0 */
    ARGUMENT_BY,      /* the word itself */
    ARGUMENT_TRIGGER, /* likewise */
    ARGUMENT_ANY,     /* parsed by the command */
    ARGUMENT_COMMAND,
    ARGUMENT_TOPIC, /* of `help` */
    ARGUMENT_WHOLE,
    ARGUMENT_RPM,
    ARGUMENT_COUNTS,
    ARGUMENT_AMPERES,     /* thousandths, as the next one */
    ARGUMENT_DECIMAL,     /* at most three decimals */
    ARGUMENT_PARAM,       /* row of param_table */
    ARGUMENT_PARAM_GROUP, /* the same, or PARAMS_ALL, PARAMS_CHANGED */
    ARGUMENT_FAULT,       /* enum fault */
    ARGUMENT_SIGNAL,      /* row of signal_table */
    ARGUMENT_STREAM_MS,
    ARGUMENT_BAUD,
    ARGUMENT_KINDS
};

#define PARAMS_ALL     (-1)
#define PARAMS_CHANGED (-2)

/* Rows of the same name are adjacent and differ in their number of arguments. One of the three functions is not NULL. */
struct command {
    const char *name;
    const char *arguments;
    const char *help;
    uint8_t kinds[ARGUMENTS_MAX]; /* enum argument */
    void (*run)(struct session *s, const struct arguments *a);
    struct outcome (*request)(struct axis *axis);               /* its outcome is the answer */
    struct outcome (*demand)(struct axis *axis, int32_t value); /* likewise, of the first argument */
    enum progress begins;
    bool owner_only; /* as are those that have a demand or start something */
};

typedef const char *(*names_fn)(uint32_t n); /* the nth; empty: to be skipped; NULL past the end */

/* In the order of 'help'. */
extern const struct command commands_help[2];
extern const struct command commands_drive[3];
extern const struct command commands_identify[2];
extern const struct command commands_motion[5];
extern const struct command commands_position[4];
extern const struct command commands_cyclic[2];
extern const struct command commands_learn[1];
extern const struct command commands_zero[1];
extern const struct command commands_fault[2];
extern const struct command commands_angle[2];
extern const struct command commands_params[2];
extern const struct command commands_settings[2];
extern const struct command commands_defaults[1];
extern const struct command commands_reaction[2];
extern const struct command commands_machine[1];
extern const struct command commands_scope[5];
extern const struct command commands_sweep[3];
extern const struct command commands_version[1];
extern const struct command commands_axis[1];

/* The nth of all rows; NULL past the end. Its name; empty if the row before has the same. */
const struct command *commands_row(uint32_t n);
const char *commands_name(uint32_t n);

/* The row of that name and number of words, or the first of that name; NULL if there is none. */
const struct command *commands_find(const char *name, size_t words);

/* The first row of that name whose text has the word, or NULL. */
const struct command *commands_with(const char *name, const char *word);

/* The feature of a command that is not in this build; FEATURE_COUNT: none. */
enum feature commands_absent(const char *name);

/* The nth topic of `help`, a command or a parameter; as commands_name(). */
const char *help_topic(uint32_t n);

/* Number of words of its line, the name included. */
size_t command_words(const struct command *command);

/*
 * Carries out one line and prints the answer: lines of information, "ok", or one line "error: ..." after which nothing has
 * changed. Splits `line` in place. An empty line does nothing. Thread.
 */
void commands_execute(struct session *s, char *line);

/* ---- commands_session.c ---- */

/*
 * "axis 2 LINE": this one LINE acts on that axis. Returns LINE, the whole line if it does not begin so, and NULL after an error
 * that it has reported; s->axis is then the axis meant.
 */
char *axis_of_line(struct session *s, char *line);

/* "axis 2: " with two axes; with one nothing. */
void put_axis(struct text *out, uint32_t axis);

/* ---- arguments.c ---- */

/* Parses all arguments of a line; false after reporting the first that does not fit. */
bool arguments_read(struct session *s, const struct command *command, struct arguments *a);

/* The fault of this name, with '_' for blanks; FAULT_COUNT if there is none. */
enum fault fault_typed(const char *name);

/* The nth word that completes a row's argument `number`, from 1: empty: to be skipped; NULL past the end. */
const char *argument_candidate(const struct command *row, uint32_t number, uint32_t n, size_t *length);

/*
 * Tab completion: extends the last word of the line by what all matching names have in common, plus a blank if only one
 * matches; lists them if nothing can be added; BEL if there are none. Names are those of commands, parameters, faults and
 * signals, and the words that a command accepts. True if it has listed: the caller prompts again.
 */
bool completion_of(struct line *l, struct text *out);

/* ---- answers.c ---- */

/* "ok", or "error: " and the reason. */
void answer(struct session *s, struct outcome outcome);

/* A line of messages.h: '@' stands for the first value, '#' for the second. */
void answer_with_values(struct text *out, const char *text, int32_t first, int32_t second);

/* The same with "..." for values that are not known. */
void answer_template(struct text *out, const char *text);

/*
 * "error: WORD: what"; the second adds "did you mean", if one of the names (NULL: none) is close to the word.
 */
void answer_error(struct session *s, const char *word, const char *what);
void answer_unknown(struct session *s, const char *word, const char *what, names_fn names);

/* The name closest to the word, NULL if none is close. Serves the buses meanwhile. */
const char *nearest_name(const char *word, names_fn name_of, struct text *others);

/* When what the last command started on this axis has completed: a line that says so, once; else NULL. */
const char *progress_message(struct session *s, uint32_t axis);

/* ---- texts used by several files ---- */

/* Description of a signal; never NULL. */
const char *signal_text(const char *name);

/* The record of the processor fault before the last reset, if there is one. */
void postmortem_print(struct text *t, const struct postmortem *p);

/* Stored settings, at the start and by `load`: which slot, which save, what was skipped, is missing or damaged. */
void store_print_loaded(struct text *t, const struct nvm_report *k);

/* Which slots are damaged, if any. */
void store_print_damage(struct text *t, const struct slots_view *v);

/* By `save`: the slot, and how often pages have been written so far. */
void store_print_saved(struct text *t, const struct saved *s);

/* "mA", "rpm/s"; "" if there is none. By the end of the name. */
const char *param_unit(const struct param_info *info);

#endif
