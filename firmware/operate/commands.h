/* SPDX-License-Identifier: MIT */
/*
 * The console's commands: tables of rows, by which lines are parsed, refused, completed and explained. A row's text spells its
 * arguments for people, capitals for a value or a name, lower case for the word itself or one of several; its kinds say how
 * each is read (arguments.c). Thread.
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

/* What a command only begins, and the console says when it is done. */
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
    enum progress progress[AXIS_COUNT]; /* what the last one that was accepted has begun, on each axis */
    bool accepted;                      /* the present line's answer was "ok" */
    bool machine;                       /* a program reads the answers */
    struct axis *axes;                  /* AXIS_COUNT of them */
    struct axis *axis;                  /* the one that commands are for */
    struct scope *scope;                /* of the chosen axis */
    struct stream stream;               /* samples between the text */
    const struct postmortem *last_life; /* how the last life of the program ended */
    const struct slots *slots;          /* where settings are stored, for each axis */
    const struct nvm_report *loaded;    /* what was found there at the start */
};

/* The number of the session's axis, from 0. */
static inline uint32_t session_axis(const struct session *s)
{
    return AXIS_COUNT == 1u ? 0u : (uint32_t)(s->axis - s->axes);
}

#define ARGUMENTS_MOST 4u

/* A line, cut into words; number 0 is the command's name. */
struct arguments {
    char *word[ARGUMENTS_MOST + 1u];
    int32_t value[ARGUMENTS_MOST + 1u]; /* as its kind reads the word */
};

enum argument {
    ARGUMENT_NONE,
    ARGUMENT_CHOICE,  /* one of the row's words; value: which, from 0 */
    ARGUMENT_BY,      /* the word itself */
    ARGUMENT_TRIGGER, /* likewise */
    ARGUMENT_ANY,     /* the command reads it by itself */
    ARGUMENT_COMMAND,
    ARGUMENT_TOPIC, /* what help has something of */
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

/* A row: rows of the same name are adjacent and differ in their number of arguments. One of the last three is not NULL. */
struct command {
    const char *name;
    const char *arguments;
    const char *help;
    uint8_t kinds[ARGUMENTS_MOST]; /* enum argument */
    void (*run)(struct session *s, const struct arguments *a);
    struct outcome (*request)(struct axis *axis);               /* answered by its outcome */
    struct outcome (*demand)(struct axis *axis, int32_t value); /* likewise, of the first argument */
    enum progress begins;
    bool commands; /* it is the owner's, as what has a demand or begins something */
};

typedef const char *(*names_fn)(uint32_t n); /* the nth: of no length if it is none, NULL behind the last */

/* Those of each feature, in the order of 'help'. */
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

/* The nth of all rows; NULL behind the last. Its name: of no length if it is the one before's. */
const struct command *commands_row(uint32_t n);
const char *commands_name(uint32_t n);

/* The row of that name and number of words, or the first of that name; NULL if there is none. */
const struct command *commands_find(const char *name, size_t words);

/* The first row of that name whose text has the word, or NULL. */
const struct command *commands_with(const char *name, const char *word);

/* The feature that a name belongs to, if commands_find() does not know it; FEATURE_COUNT: none. */
enum feature commands_absent(const char *name);

/* The nth word that `help` is offered: a command or a parameter; as commands_name(). */
const char *help_topic(uint32_t n);

/* Words of its line, the name included. */
size_t command_words(const struct command *command);

/*
 * Carries out one line and prints the answer: lines of information, "ok", or one line "error: ..." after which nothing has
 * changed. Splits `line` in place. An empty line does nothing. Thread.
 */
void commands_execute(struct session *s, char *line);

/* ---- commands_session.c ---- */

/*
 * "axis 2 LINE": carries out LINE on that axis, for this once. Returns the LINE, the whole line if it does not begin so, and
 * NULL behind an error that it has reported; s->axis is the axis meant.
 */
char *axis_of_line(struct session *s, char *line);

/* "axis 2: " with two axes; else nothing. */
void put_axis(struct text *out, uint32_t axis);

/* ---- arguments.c ---- */

/* Reads all arguments of a line; false after reporting the first that does not fit. */
bool arguments_read(struct session *s, const struct command *command, struct arguments *a);

/* The fault of this name, with '_' for blanks; FAULT_COUNT if there is none. */
enum fault fault_typed(const char *name);

/* The nth word that completes a row's argument `number`, from 1: of no length if it is not offered, NULL behind the last. */
const char *argument_candidate(const struct command *row, uint32_t number, uint32_t n, size_t *length);

/*
 * Extends the last word of an unfinished line by what all matching names have in common, plus a blank if only one matches;
 * lists them if nothing can be added, and rings (BEL) if there are none. Names are those of commands, parameters and faults,
 * and the words that a command accepts. Returns true if it has listed: the caller prompts again.
 */
bool completion_of(struct line *l, struct text *out);

/* ---- answers.c ---- */

/* "ok", or "error: " and why. */
void answer(struct session *s, struct outcome outcome);

/* A line of messages.h: '@' stands for the first value, '#' for the second. */
void answer_filled(struct text *out, const char *text, int32_t first, int32_t second);

/* The same where the values are not known: "...". */
void answer_unfilled(struct text *out, const char *text);

/*
 * "error: WORD: what"; the second adds what may have been meant, if one of the names (NULL: none) is much like it. Names are a
 * kind's, of arguments.c.
 */
void answer_about(struct session *s, const char *word, const char *what);
void answer_unknown(struct session *s, const char *word, const char *what, names_fn names);

/* The name that is most like the word, NULL if none is much like it. Lets the buses have their turns meanwhile. */
const char *nearest_name(const char *word, names_fn name_of, struct text *others);

/* Something that the last command for this axis began has ended as it should: a line that says so, once; else NULL. */
const char *progress_said(struct session *s, uint32_t axis);

/* ---- what others say, too ---- */

/* What a signal of signal_table is; never NULL. */
const char *signal_text(const char *name);

/* The record of the processor fault before the last reset, if there is one. */
void postmortem_print(struct text *t, const struct postmortem *p);

/* Stored settings, at the start and by `load`: which slot, which save, what was skipped, is missing or damaged. */
void store_print_loaded(struct text *t, const struct nvm_report *k);

/* Which slots are damaged, if any. */
void store_print_damage(struct text *t, const struct slots_view *v);

/* By `save`: the slot, and how often pages have been written so far. */
void store_print_saved(struct text *t, const struct saved *s);

/* "mA", "rpm/s"; "" if there is none. Derived from the end of the name. */
const char *param_unit(const struct param_info *info);

#endif
