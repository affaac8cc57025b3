/* SPDX-License-Identifier: MIT */
/* What the console answers: an outcome, a word that is none, and later that what a command has begun is done. */
#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"

/* ==== the nearest name ==== */

/* Which of some names somebody may have meant: a turn for each, and whoever is far off is dropped as soon as that shows. */
#define NAME_MOST  40u
#define EDITS_MOST 3u /* with more, it is another word */

/* A name without its case and blanks. */
struct folded {
    uint32_t length; /* 0 if too long */
    char c[NAME_MOST];
};

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

static void fold(struct folded *f, const char *name)
{
    const size_t length = text_length(name);
    f->length = length <= NAME_MOST ? (uint32_t)length : 0u;
    for (uint32_t n = 0; n < f->length; n++) {
        f->c[n] = message_typed(name[n]);
    }
}

/* The next row of Levenshtein's table, for the word's letter c; few to either side of the diagonal. Returns its least. */
static uint32_t next_row(uint8_t row[NAME_MOST + 1u], uint32_t typed, char c, const struct folded *name, uint32_t few)
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

/* Characters to add, remove or replace: few at most, or few + 1 for more. */
static uint32_t edits(const struct folded *word, const struct folded *name, uint32_t few)
{
    uint8_t row[NAME_MOST + 1u];
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

/* One, if the name begins with the word. */
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
    uint32_t most = typed.length < 6u ? 1u : least(typed.length / 3u, EDITS_MOST);
    const char *best = NULL;
    const char *name;
    for (uint32_t n = 0; typed.length > 1u && (name = name_of(n)) != NULL; n++) {
        text_take_turn(others);
        fold(&other, name);
        const uint32_t far = distance(&typed, &other, most);
        if (far == 0u) {
            return name; /* in capitals */
        }
        if (far <= most) {
            most = far - 1u; /* whoever comes next must be nearer */
            best = name;
        }
    }
    return best;
}

/* ==== answers ==== */

void answer_about(struct session *s, const char *word, const char *what)
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

void answer_filled(struct text *out, const char *text, int32_t first, int32_t second)
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

void answer_unfilled(struct text *out, const char *text)
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
    answer_filled(&s->out, message_of_error(outcome.error), outcome.value, 0);
}

/* ==== progress ==== */

/* Says when what a command has begun is done. What ends otherwise, a fault or another command, has said so itself. */
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
