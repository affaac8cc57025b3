/* SPDX-License-Identifier: MIT */
/* What the console answers: an outcome, an unknown word, and later that what a command has started is done. */
#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"

/* ==== the nearest name ==== */

/* The name closest to a mistyped word. Serves the buses between names; a name is given up as soon as it is too far. */
#define WORD_MAX  40u
#define EDITS_MAX 3u /* more: another word */

/* A name without its case and blanks. */
struct folded {
    uint32_t length; /* 0 if too long */
    char c[WORD_MAX];
};

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

static void fold(struct folded *f, const char *name)
{
    const size_t length = text_length(name);
    f->length = length <= WORD_MAX ? (uint32_t)length : 0u;
    for (uint32_t n = 0; n < f->length; n++) {
        f->c[n] = message_typed(name[n]);
    }
}

/* The next row of the Levenshtein matrix, for the word's letter c, within `few` of the diagonal. Returns its minimum. */
static uint32_t next_row(uint8_t row[WORD_MAX + 1u], uint32_t typed, char c, const struct folded *name, uint32_t few)
{
    const uint32_t from = typed > few ? typed - few : 1u;
    const uint32_t to = least(typed + few, name->length);
    uint32_t corner = row[from - 1u];
    uint32_t left = typed > few ? few + 1u : typed;
    uint32_t smallest = left;
    row[from - 1u] = (uint8_t)left;
    for (uint32_t n = from; n <= to; n++) {
        const uint32_t replaced = corner + (c == name->c[n - 1u] ? 0u : 1u);
        corner = row[n];
        left = least(replaced, least(corner, left) + 1u);
        row[n] = (uint8_t)left;
        smallest = least(smallest, left);
    }
    return smallest;
}

/* Levenshtein distance; few + 1 if it is larger than `few`. */
static uint32_t edits(const struct folded *word, const struct folded *name, uint32_t few)
{
    uint8_t row[WORD_MAX + 1u];
    for (uint32_t n = 0; n <= name->length; n++) {
        row[n] = (uint8_t)n;
    }
    for (uint32_t n = 0; n < word->length; n++) {
        if (next_row(row, n + 1u, word->c[n], name, few) > few) {
            return few + 1u;
        }
    }
    return least(row[name->length], few + 1u);
}

static bool is_beginning(const struct folded *word, const struct folded *name)
{
    uint32_t n = 0;
    while (n < word->length && n < name->length && name->c[n] == word->c[n]) {
        n++;
    }
    return n == word->length;
}

/* A name that begins with the word has distance 1. */
static uint32_t distance(const struct folded *word, const struct folded *name, uint32_t few)
{
    if (word->length < name->length && is_beginning(word, name)) {
        return 1u;
    }
    const bool may_be = name->length != 0u && name->length <= word->length + few && word->length <= name->length + few;
    return may_be ? edits(word, name, few) : few + 1u;
}

const char *nearest_name(const char *word, names_fn name_of, struct text *others)
{
    struct folded typed;
    struct folded other;
    fold(&typed, word);
    uint32_t most = typed.length < 6u ? 1u : least(typed.length / 3u, EDITS_MAX);
    const char *best = NULL;
    const char *name;
    for (uint32_t n = 0; typed.length > 1u && (name = name_of(n)) != NULL; n++) {
        text_yield(others);
        fold(&other, name);
        const uint32_t far = distance(&typed, &other, most);
        if (far == 0u) {
            return name; /* differs in case only */
        }
        if (far <= most) {
            most = far - 1u; /* the next must be closer */
            best = name;
        }
    }
    return best;
}

/* ==== answers ==== */

void answer_error(struct session *s, const char *word, const char *what)
{
    text_print(&s->out, "error: %s: %s\n", word, what);
}

void answer_unknown(struct session *s, const char *word, const char *what, names_fn names)
{
    const char *meant = names != NULL ? nearest_name(word, names, &s->out) : NULL;
    text_print(&s->out, "error: %s: %s%s", word, what, meant != NULL ? "; did you mean " : "");
    for (; meant != NULL && *meant != '\0'; meant++) {
        text_put_char(&s->out, message_typed(*meant));
    }
    text_put(&s->out, meant != NULL ? "?\n" : "\n");
}

void answer_with_values(struct text *out, const char *text, int32_t first, int32_t second)
{
    for (; *text != '\0'; text++) {
        if (*text == '@' || *text == '#') {
            text_print(out, "%d", *text == '@' ? first : second);
        } else if (*text == '$') {
            text_put(out, message_of_feature((enum feature)first));
        } else if (*text == '&') {
            text_put(out, message_of_owner((uint32_t)first));
        } else {
            text_put_char(out, *text);
        }
    }
    text_put(out, "\n");
}

void answer_template(struct text *out, const char *text)
{
    for (; *text != '\0'; text++) {
        const char known[] = {*text, '\0'};
        text_put(out, *text == '@' || *text == '#' || *text == '$' || *text == '&' ? "..." : known);
    }
    text_put(out, "\n");
}

void answer(struct session *s, struct outcome outcome)
{
    s->accepted = outcome.error == ERROR_NONE;
    text_put(&s->out, s->accepted ? "" : "error: ");
    answer_with_values(&s->out, message_of_error(outcome.error), outcome.value, 0);
}

/* ==== progress ==== */

/* Reports when what a command started is done. Other ends, by a fault or a command, are reported elsewhere. */
enum progress_state { IN_PROGRESS, COMPLETED, ABANDONED };

static enum progress_state unless_off(const struct axis *a, bool done)
{
    if (done) {
        return COMPLETED;
    }
    return a->state == AXIS_OPERATION_ENABLED || a->state == AXIS_SWITCHED_ON || a->state == AXIS_READY ? IN_PROGRESS
                                                                                                        : ABANDONED;
}

static enum progress_state of_sweep(const struct sweep *w)
{
    return sweep_runs(w) ? IN_PROGRESS : (w->state == SWEEP_DONE ? COMPLETED : ABANDONED);
}

static enum progress_state progress_of(const struct session *s, const struct axis *a, enum progress what)
{
    const bool operates = a->state == AXIS_OPERATION_ENABLED;
    switch (what) {
    case PROGRESS_ON:
        return unless_off(a, operates);
    case PROGRESS_IDENTIFY:
        return a->identify.running ? IN_PROGRESS : COMPLETED;
    case PROGRESS_LEARN: /* cogging ends in operation, Hall switches with the bridge off */
        return unless_off(a, operates ? a->mode != AXIS_MODE_LEARNING : a->state == AXIS_SWITCH_ON_DISABLED);
    case PROGRESS_MOVE:
        return !operates || a->mode != AXIS_MODE_POSITION ? ABANDONED
                                                          : unless_off(a, profile_is_done(&a->motion.profile));
    case PROGRESS_HOME:
        return a->mode == AXIS_MODE_HOMING ? unless_off(a, false)
                                           : (operates && a->motion.homed ? COMPLETED : ABANDONED);
    case PROGRESS_SWEEP:
        return of_sweep(&s->scope->sweep);
    default:
        return ABANDONED;
    }
}

const char *progress_message(struct session *s, uint32_t axis)
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
    const enum progress_state state = a->faults.cause != FAULT_NONE ? ABANDONED : progress_of(s, a, what);
    s->progress[axis] = state == IN_PROGRESS ? what : PROGRESS_NONE;
    return state == COMPLETED ? texts[what] : NULL;
}
