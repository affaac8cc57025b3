/* SPDX-License-Identifier: MIT */
/*
 * The storms' lines and frames, for whoever plays them to a running drive:
 *
 *     storm_print lines|frames COUNT SEED
 *
 * A row of each: its kind, what it is good for, its bytes as hexadecimal. A line is good for the command that it is, a frame
 * for `right`; else both for `-`.
 */
#include <stdlib.h>

#include "storm_frames.h"
#include "storm_lines.h"

static void print(const char *kind, const char *good_for, const void *what, size_t count)
{
    const uint8_t *const bytes = what;
    printf("%s %s ", kind, good_for);
    for (size_t n = 0; n < count; n++) {
        printf("%02x", bytes[n]);
    }
    puts("");
}

/* Keys change a line in ways that only the console knows: what it begins as says what it may be. */
static bool begins_as(const char *line, const char *name)
{
    const size_t length = strspn(line, "abcdefghijklmnopqrstuvwxyz_");
    return strlen(name) == length && strncmp(line, name, length) == 0;
}

static const char *command_of(const char *line, size_t length, enum line_kind kind)
{
    const struct words w = cut(line, length);
    const struct command *row;
    for (uint32_t n = 0; (row = commands_row(n)) != NULL; n++) {
        const char *const name = row->name;
        if (kind == LINE_KEYS ? begins_as(line, name) : strcmp(w.word[0], name) == 0 && is_a_command(&w)) {
            return name;
        }
    }
    return "-";
}

static void print_line(void)
{
    static const char *const kinds[] = {"noise", "mutated", "keys", "right"};
    char line[2 * BYTES] = {0};
    size_t length;
    const enum line_kind kind = some_line(line, &length);
    print(kinds[kind], command_of(line, length, kind), line, length);
}

static void print_frame(void)
{
    static const char *const kinds[] = {"right", "mutated", "foreign", "noise"};
    uint8_t bytes[BYTES_MOST];
    size_t count;
    bool chance;
    const enum frame_kind kind = some_frame(bytes, &count, &chance);
    if (!chance) {
        print(kinds[kind], kind == FRAME_RIGHT ? "right" : "-", bytes, count);
    }
}

int main(int argc, char **argv)
{
    const bool lines = argc > 1 && strcmp(argv[1], "lines") == 0;
    seed = argc > 3 ? (uint32_t)strtoul(argv[3], NULL, 10) : 12345u;
    for (long n = argc > 2 ? atol(argv[2]) : 0; n > 0; n--) {
        if (lines) {
            print_line();
        } else {
            print_frame();
        }
    }
    return 0;
}
