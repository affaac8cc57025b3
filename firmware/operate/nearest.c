/* SPDX-License-Identifier: MIT */
/* Which of some names somebody may have meant: a turn for each, and whoever is far off is dropped as soon as that shows. */
#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"

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
