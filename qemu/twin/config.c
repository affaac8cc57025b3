/* SPDX-License-Identifier: GPL-2.0-or-later */
#define _GNU_SOURCE
#include "config.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "random.h"
#include "watchdog.h"

#define DUMP_BYTES_MAX (1u << 20)

/* Where the keys of each prefix go. */
static const struct section {
    const char *prefix;
    const struct config_key *keys;
    size_t base;
    bool of_axis, of_motor;
} sections[] = {
    {"motor.", motor_keys, offsetof(struct config, axis[0].plant.motor), true, true},
    {"load.", load_keys, offsetof(struct config, axis[0].plant.load), true, true},
    {"inverter.", inverter_keys, offsetof(struct config, axis[0].plant.inverter), true, false},
    {"sensor.", sensor_keys, offsetof(struct config, axis[0].plant.sensors), true, false},
    {"cycles.", cycles_keys, offsetof(struct config, cycles), false, false},
    {"envm.", envm_keys, offsetof(struct config, envm), false, false},
};
#define SECTIONS (sizeof sections / sizeof sections[0])

struct reader {
    const char *path;
    int line;
    struct config *config;
    unsigned axis; /* that the lines are of, from 0 */
};

__attribute__((noreturn, format(printf, 2, 3))) static void fail(const struct reader *r, const char *format, ...)
{
    va_list args;
    fprintf(stderr, "mssfoc twin: %s:", r->path);
    if (r->line) {
        fprintf(stderr, "%d:", r->line);
    }
    fputc(' ', stderr);
    va_start(args, format);
    vfprintf(stderr, format, args);
    va_end(args);
    fputc('\n', stderr);
    exit(1);
}

static double *value_of(struct config *c, unsigned axis, const struct section *s, const struct config_key *k)
{
    size_t of_axis = s->of_axis ? axis * sizeof c->axis[0] : 0;
    return (double *)((char *)c + s->base + of_axis + k->offset);
}

static double number(const struct reader *r, const char *word, const char *what)
{
    char *end;
    double value = strtod(word, &end);
    if (*word == '\0' || *end != '\0' || !isfinite(value)) {
        fail(r, "%s: '%s' is not a number", what, word);
    }
    return value;
}

static void read_key(const struct reader *r, const struct section *s, const char *name, const char *word)
{
    for (const struct config_key *k = s->keys; k->name; k++) {
        if (strcmp(k->name, name) != 0) {
            continue;
        }
        double value = number(r, word, name);
        if (value < k->min || value > k->max) {
            fail(r, "%s%s: %s is outside %g...%g", s->prefix, name, word, k->min, k->max);
        }
        *value_of(r->config, r->axis, s, k) = value;
        return;
    }
    fail(r, "unknown key '%s%s'", s->prefix, name);
}

static void *grown(void *array, size_t count, size_t size)
{
    void *bigger = realloc(array, (count + 1) * size);
    if (!bigger) {
        fputs("mssfoc twin: out of memory\n", stderr);
        exit(1);
    }
    memset((char *)bigger + count * size, 0, size);
    return bigger;
}

static char *next_word(char **rest)
{
    char *word = *rest + strspn(*rest, " \t");
    char *end = word + strcspn(word, " \t");
    *rest = *end ? end + 1 : end;
    *end = '\0';
    return word;
}

static uint32_t whole(const struct reader *r, const char *word, const char *what)
{
    char *end;
    unsigned long long value = strtoull(word, &end, 0);
    if (*word == '\0' || *word == '-' || *end != '\0' || value > UINT32_MAX) {
        fail(r, "%s: '%s' is not a number of 32 bits", what, word);
    }
    return (uint32_t)value;
}

/* True if it is the second. */
static bool either(const struct reader *r, const char *what, const char *word, const char *first, const char *second)
{
    bool is_second = strcmp(word, second) == 0;
    if (!is_second && strcmp(word, first) != 0) {
        fail(r, "%s: '%s' is neither %s nor %s", what, word, first, second);
    }
    return is_second;
}

/* The place in `names`, which ends with NULL. */
static int one_of(const struct reader *r, const char *what, const char *word, const char *const *names,
                  const char *list)
{
    for (int n = 0; names[n]; n++) {
        if (strcmp(word, names[n]) == 0) {
            return n;
        }
    }
    fail(r, "%s: '%s' is none of %s", what, word, list);
}

static enum chip_wiring wiring(const struct reader *r, const char *what, const char *word)
{
    static const char *const names[] = {"core_reset_p", "m2f", "held", "no_clock", NULL};
    return WIRED_CORE_RESET_P + one_of(r, what, word, names, "core_reset_p, m2f, held, no_clock");
}

static void read_dump(const struct reader *r, char *rest)
{
    struct config *c = r->config;
    c->dumps = grown(c->dumps, c->dump_count, sizeof *c->dumps);
    struct dump *d = &c->dumps[c->dump_count++];
    char *address = next_word(&rest), *bytes = next_word(&rest);
    rest += strspn(rest, " \t");
    if (*rest == '\0') {
        fail(r, "expected: dump ADDRESS BYTES PATH");
    }
    d->path = strdup(rest);
    d->address = whole(r, address, "dump");
    d->bytes = whole(r, bytes, "dump");
    if (d->bytes > DUMP_BYTES_MAX) {
        fail(r, "dump: at most %u bytes", DUMP_BYTES_MAX);
    }
}

static void read_probe(const struct reader *r, char *rest)
{
    static const struct {
        const char *name;
        unsigned bytes;
        bool is_signed;
    } types[] = {{"s32", 4, true},  {"u32", 4, false}, {"s16", 2, true},
                 {"u16", 2, false}, {"s8", 1, true},   {"u8", 1, false}};
    struct axis_config *a = &r->config->axis[r->axis];
    a->probes = grown(a->probes, a->probe_count, sizeof *a->probes);
    struct probe *p = &a->probes[a->probe_count++];
    p->name = strdup(next_word(&rest));
    char *address = next_word(&rest), *type = next_word(&rest), *scale = next_word(&rest);
    if (*p->name == '\0' || strpbrk(p->name, ",\"") != NULL || *scale == '\0' || *next_word(&rest) != '\0') {
        fail(r, "expected: probe NAME ADDRESS TYPE SCALE");
    }
    char *end;
    unsigned long long where = strtoull(address, &end, 0);
    if (*end != '\0' || where > UINT32_MAX) {
        fail(r, "probe %s: '%s' is not an address", p->name, address);
    }
    p->address = (uint32_t)where;
    p->scale = number(r, scale, p->name);
    for (size_t n = 0; n < sizeof types / sizeof types[0]; n++) {
        if (strcmp(types[n].name, type) == 0) {
            p->bytes = types[n].bytes;
            p->is_signed = types[n].is_signed;
            return;
        }
    }
    fail(r, "probe %s: unknown type '%s'", p->name, type);
}

static void read_design(const struct reader *r, char *rest)
{
    struct config *c = r->config;
    c->design = grown(c->design, c->design_count, sizeof *c->design);
    struct flash_word *d = &c->design[c->design_count++];
    char *offset = next_word(&rest), *word = next_word(&rest), *fixed = next_word(&rest);
    if (*word == '\0' || *next_word(&rest) != '\0') {
        fail(r, "expected: design OFFSET WORD, or design OFFSET WORD FIXED_BITS");
    }
    *d = (struct flash_word){whole(r, offset, "design"), whole(r, word, "design"),
                             *fixed != '\0' ? whole(r, fixed, "design") : 0};
}

static void read_can(const struct reader *r, char *rest)
{
    char *id = next_word(&rest);
    r->config->can_id = strdup(id);
    r->config->can_slcan = either(r, "can", rest, "bus", "slcan");
}

static double event_time(const struct reader *r, const char *word)
{
    double t_s = number(r, word, "time of the event");
    if (t_s < 0 || t_s > 1e6) {
        fail(r, "the time of an event is 0...1e6 s");
    }
    return t_s;
}

static void read_event(const struct reader *r, char *rest)
{
    struct config *c = r->config;
    c->events = grown(c->events, c->event_count, sizeof *c->events);
    struct event *e = &c->events[c->event_count];
    e->t_s = event_time(r, next_word(&rest));
    e->axis = r->axis;
    const char *wrong = event_parse(rest + strspn(rest, " \t"), e);
    if (wrong) {
        fail(r, "%s", wrong);
    }
    /* Keep the list in order; most files are already. */
    size_t n = c->event_count++;
    struct event moving = *e;
    for (; n > 0 && c->events[n - 1].t_s > moving.t_s; n--) {
        c->events[n] = c->events[n - 1];
    }
    c->events[n] = moving;
}

static size_t probe_named(const struct reader *r, const char *name)
{
    const struct axis_config *a = &r->config->axis[r->axis];
    for (size_t n = 0; n < a->probe_count; n++) {
        if (strcmp(a->probes[n].name, name) == 0) {
            return n;
        }
    }
    fail(r, "after: there is no probe '%s' yet", name);
}

static void read_late_event(const struct reader *r, char *rest)
{
    struct config *c = r->config;
    c->late = grown(c->late, c->late_count, sizeof *c->late);
    struct late_event *late = &c->late[c->late_count++];
    char *values = next_word(&rest), *name = strsep(&values, "="), *value;
    late->probe = probe_named(r, name);
    while (values && (value = strsep(&values, ","))) {
        if (late->count == LATE_VALUES_MAX) {
            fail(r, "after: at most %d values", LATE_VALUES_MAX);
        }
        late->values[late->count++] = number(r, value, name);
    }
    if (late->count == 0) {
        fail(r, "expected: after PROBE=VALUE,... T_S KIND ARGUMENTS...");
    }
    late->event.t_s = event_time(r, next_word(&rest));
    late->event.axis = r->axis;
    const char *wrong = event_parse(rest + strspn(rest, " \t"), &late->event);
    if (wrong) {
        fail(r, "%s", wrong);
    }
}

static void read_section_key(const struct reader *r, const char *word, char *rest)
{
    for (size_t n = 0; n < SECTIONS; n++) {
        size_t length = strlen(sections[n].prefix);
        if (strncmp(word, sections[n].prefix, length) == 0) {
            char *value = next_word(&rest);
            if (*next_word(&rest) != '\0') {
                fail(r, "%s takes one value", word);
            }
            read_key(r, &sections[n], word + length, value);
            return;
        }
    }
    fail(r, "unknown item '%s'", word);
}

static void read_axis(struct reader *r, const char *word)
{
    r->axis = either(r, "axis", word, "1", "2");
    r->config->axes = r->axis + 1 > r->config->axes ? r->axis + 1 : r->config->axes;
}

static void read_line(struct reader *r, char *line)
{
    struct config *c = r->config;
    struct axis_config *a = &c->axis[r->axis];
    line[strcspn(line, "\r\n")] = '\0';
    char *rest = line, *word = next_word(&rest);
    rest += strspn(rest, " \t");
    if (*word == '\0' || *word == '#') {
        return;
    }
    if (*rest == '\0') {
        fail(r, "'%s' needs a value", word);
    }
    if (strcmp(word, "axis") == 0) {
        read_axis(r, rest);
    } else if (strcmp(word, "trace") == 0) {
        a->trace_path = strdup(rest);
    } else if (strcmp(word, "csv") == 0) {
        a->csv_path = strdup(rest);
    } else if (strcmp(word, "progress") == 0) {
        c->progress_path = strdup(rest);
    } else if (strcmp(word, "live") == 0) {
        c->live_path = strdup(rest);
    } else if (strcmp(word, "irqlog") == 0) {
        c->irqlog_path = strdup(rest);
    } else if (strcmp(word, "envm") == 0) {
        c->envm_path = strdup(rest);
    } else if (strcmp(word, "fabric") == 0) {
        c->fabric_path = strdup(rest);
    } else if (strcmp(word, "dwt") == 0) {
        c->count_instructions = either(r, word, rest, "cycles", "instructions");
    } else if (strcmp(word, "time") == 0) {
        c->time_by_cycles = either(r, word, rest, "instructions", "cycles");
    } else if (strcmp(word, "design") == 0) {
        read_design(r, rest);
    } else if (strcmp(word, "wfi") == 0) {
        c->main_loop_wakes = either(r, word, rest, "core", "main_loop");
    } else if (strcmp(word, "console") == 0) {
        c->console_id = strdup(rest);
    } else if (strcmp(word, "bus") == 0) {
        c->bus_id = strdup(rest);
    } else if (strcmp(word, "bus_log") == 0) {
        c->bus_log_path = strdup(rest);
    } else if (strcmp(word, "can") == 0) {
        read_can(r, rest);
    } else if (strcmp(word, "can_log") == 0) {
        c->can_log_path = strdup(rest);
    } else if (strcmp(word, "seed") == 0) {
        double seed = number(r, rest, word);
        if (seed < 0 || seed > 0x1p53 || seed != floor(seed)) {
            fail(r, "seed: '%s' is not a whole number from 0", rest);
        }
        c->seed = (uint64_t)seed;
    } else if (strcmp(word, "end") == 0) {
        c->end_s = number(r, rest, word);
        if (c->end_s <= 0 || c->end_s > 1e6) {
            fail(r, "end: %s is outside 0...1e6 s", rest);
        }
    } else if (strcmp(word, "watchdog") == 0) {
        c->watchdog_load = whole(r, rest, word);
        if (c->watchdog_load > WATCHDOG_LOAD_MAX) {
            fail(r, "watchdog: %s is outside 0...0x%x", rest, WATCHDOG_LOAD_MAX);
        }
    } else if (strcmp(word, "chip") == 0) {
        c->chip.part = either(r, word, rest, "m2s010", "m2s025") ? CHIP_M2S025 : CHIP_M2S010;
    } else if (strcmp(word, "fabric_wired") == 0) {
        c->chip.wiring = wiring(r, word, rest);
    } else if (strcmp(word, "irqpath") == 0) {
        c->irqpath_exception = whole(r, next_word(&rest), word);
        c->irqpath_path = strdup(rest + strspn(rest, " \t"));
        if (*c->irqpath_path == '\0') {
            fail(r, "expected: irqpath EXCEPTION PATH");
        }
    } else if (strcmp(word, "dump") == 0) {
        read_dump(r, rest);
    } else if (strcmp(word, "probe") == 0) {
        read_probe(r, rest);
    } else if (strcmp(word, "event") == 0) {
        read_event(r, rest);
    } else if (strcmp(word, "after") == 0) {
        read_late_event(r, rest);
    } else {
        read_section_key(r, word, rest);
    }
}

static void set_initial(struct config *c)
{
    memset(c, 0, sizeof *c);
    c->axes = 1;
    c->watchdog_load = WATCHDOG_LOAD;
    for (size_t n = 0; n < SECTIONS * CONFIG_AXES_MAX; n++) {
        for (const struct config_key *k = sections[n % SECTIONS].keys; k->name; k++) {
            *value_of(c, (unsigned)(n / SECTIONS), &sections[n % SECTIONS], k) = k->initial;
        }
    }
}

static void check_cycles(const struct reader *r)
{
    for (const struct config_key *k = cycles_keys; k->name; k++) {
        double value = *(const double *)((const char *)&r->config->cycles + k->offset);
        if (value != floor(value)) {
            fail(r, "cycles.%s is a whole number", k->name);
        }
    }
}

static bool is_typed(const struct event *e)
{
    return e->kind == EVENT_CONSOLE || e->kind == EVENT_KEYS;
}

static void check_typing(const struct reader *r)
{
    const struct config *c = r->config;
    bool types = false;
    for (size_t n = 0; n < c->event_count; n++) {
        types = types || is_typed(&c->events[n]);
    }
    for (size_t n = 0; n < c->late_count; n++) {
        types = types || is_typed(&c->late[n].event);
    }
    if (types && !c->console_id) {
        fail(r, "a console event needs 'console CHARDEV_ID'");
    }
}

static void check_keys(const struct reader *r, const char *of, bool motor_only)
{
    for (size_t n = 0; n < SECTIONS; n++) {
        for (const struct config_key *k = sections[n].keys; k->name; k++) {
            if (isnan(*value_of(r->config, r->axis, &sections[n], k)) && (sections[n].of_motor || !motor_only)) {
                fail(r, "%smissing key '%s%s'", of, sections[n].prefix, k->name);
            }
        }
    }
}

static void check_axis(const struct reader *r, bool motor_only)
{
    const struct plant_params *p = &r->config->axis[r->axis].plant;
    const char *of = r->axis == 0 ? "" : "axis 2: ";
    check_keys(r, of, motor_only);
    const char *conflict = motor_only ? NULL : sensor_conflict(&p->sensors);
    if (conflict) {
        fail(r, "%s%s", of, conflict);
    }
    if (!motor_only && p->sensors.modulators != 0 && !r->config->fabric_path) {
        fail(r, "%ssensor.modulators need 'fabric PATH': the C models have none", of);
    }
    const char *mismatch = motor_only ? NULL : inverter_mismatch(&p->inverter);
    if (mismatch) {
        fail(r, "%sinverter: %s", of, mismatch);
    }
    double i_max_a = p->inverter.oc_trip_a; /* not a number: not given */
    const char *wrong = motor_params_check(&p->motor, &p->load, isnan(i_max_a) ? 0 : i_max_a);
    if (wrong) {
        fail(r, "%s%s", of, wrong);
    }
}

static void check_complete(struct reader *r, bool motor_only)
{
    for (r->axis = 0; r->axis < r->config->axes; r->axis++) {
        check_axis(r, motor_only);
    }
    check_typing(r);
    check_cycles(r);
    if (r->config->axes > 1 && r->config->fabric_path) {
        fail(r, "axis 2 has C models only: leave 'fabric PATH' out");
    }
}

/* Two plants must not have the same noise. */
static void draw_seeds(struct config *c)
{
    struct random random;
    random_seed_stream(&random, c->seed, STREAM_SECOND_AXIS);
    c->axis[0].plant.seed = c->seed;
    c->axis[1].plant.seed = random_u64(&random);
}

void config_load(struct config *config, const char *path, bool motor_only)
{
    struct reader r = {path, 0, config, 0};
    set_initial(config);
    FILE *file = fopen(path, "r");
    if (!file) {
        fail(&r, "cannot read: %s", strerror(errno));
    }
    char *line = NULL;
    size_t room = 0;
    while (getline(&line, &room, file) >= 0) {
        r.line++;
        read_line(&r, line);
    }
    r.line = 0;
    if (ferror(file)) {
        fail(&r, "cannot read: %s", strerror(errno));
    }
    free(line);
    fclose(file);
    check_complete(&r, motor_only);
    draw_seeds(config);
}
