/* SPDX-License-Identifier: MIT */
/*
 * Characters at the console. The first byte of the input says whether the drive is in operation; each line behind it is judged
 * by a second look at its words. One that is no command, or that is refused, changes nothing; `set` changes its parameter, and
 * no other; every line is answered, and nothing that is typed touches the bridge.
 */
#include "firmware/operate/console.h"
#include "drive.h"

#define WORDS (ARGUMENTS_MAX + 2u)

extern char host_said[65536], host_heard[4096];
extern uint32_t host_said_bytes, host_heard_bytes, host_heard_taken;

static struct console console;
static struct scope scope;
static uint32_t pend;

static void enter(void)
{
}

static void (*vector)(void);
static const struct loop_handlers handlers = {.vector = &vector,
                                              .handler = {enter, enter, enter, enter, enter},
                                              .weakening = enter,
                                              .overmodulating = enter,
                                              .rippled = enter};

static void begin(bool on)
{
    static struct mmuart uart;
    static struct idle idle;
    static struct postmortem last_run;
    static struct nvm_report kept;
    begin_drive(on);
    memset(&scope, 0, sizeof scope);
    memset(&idle, 0, sizeof idle);
    vector = enter;
    idle.time_ms = &axis.time_ms;
    axis.loop.handlers = &handlers;
    scope_init(&scope, &axis, enter, &pend, 1u << 9);
    const struct session session = {.out = {.uart = &uart, .idle = &idle},
                                    .axes = &axis,
                                    .axis = &axis,
                                    .scope = &scope,
                                    .last_run = &last_run,
                                    .slots = &slots,
                                    .loaded = &kept};
    host_said_bytes = host_heard_bytes = host_heard_taken = 0;
    console_start(&console, &session);
}

/*
 * Character by character: the answer to each has an end. They stand in host_said, with a 0 behind them; the first ones not,
 * where a hundred keys have each listed all parameters.
 */
static void type(const void *line, size_t count)
{
    host_heard_bytes = host_heard_taken = 0;
    (void)console_poll(&console); /* what the line before has done is announced */
    host_said_bytes = 0;
    for (size_t n = 0; n < count; n++) {
        host_said_bytes = host_said_bytes < sizeof host_said / 2u ? host_said_bytes : 0u;
        host_heard[0] = ((const char *)line)[n];
        host_heard_bytes = 1;
        host_heard_taken = 0;
        while (console_poll(&console)) {
        }
        HOLDS(host_said_bytes < sizeof host_said - 1u, "an answer has an end");
    }
    host_said[host_said_bytes] = '\0';
}

static bool ends_in(const char *end)
{
    const size_t length = strlen(end);
    return host_said_bytes >= length && strcmp(host_said + host_said_bytes - length, end) == 0;
}

static size_t split(char *line, char **words)
{
    size_t count = 0;
    for (char *word = strtok(line, " "); word != NULL && count < WORDS; word = strtok(NULL, " ")) {
        words[count++] = word;
    }
    return count;
}

/* A row of 'help' has a blank before each argument. */
static const char *command_of(char *const *words, size_t count)
{
    const struct command *row;
    for (uint32_t n = 0; count > 0u && (row = commands_row(n)) != NULL; n++) {
        size_t arguments = 0;
        for (const char *c = row->arguments; *c != '\0'; c++) {
            arguments += *c == ' ';
        }
        if (strcmp(row->name, words[0]) == 0 && count == arguments + 1u) {
            return row->name;
        }
    }
    return NULL;
}

static bool is_one_of(const char *name, const char *names)
{
    char word[32];
    (void)snprintf(word, sizeof word, " %s ", name);
    return strstr(names, word) != NULL;
}

/* The parameter that "set NAME WHOLE" gives a value in its range. */
static const struct param_info *set_by(char *const *words, long long *value)
{
    const char *const digits = words[2] + strspn(words[2], "-+");
    const size_t count = strlen(digits);
    *value = strtoll(words[2], NULL, 10);
    for (size_t n = 0; n < param_count; n++) {
        if (strcmp(param_table[n].name, words[1]) == 0) {
            return digits <= words[2] + 1 && count > 0u && count < 15u && strspn(digits, "0123456789") == count &&
                           *value >= param_table[n].min && *value <= param_table[n].max
                       ? &param_table[n]
                       : NULL;
        }
    }
    return NULL;
}

static bool is_refused(void)
{
    return strncmp(host_said, "error: ", 7) == 0 || strstr(host_said, "\nerror: ") != NULL;
}

/* A line of printable characters alone, and not too long. */
static void judge_words(char *line, const struct told *before, const struct axis *axis_before)
{
    char *words[WORDS];
    const size_t count = split(line, words);
    const char *const name = command_of(words, count);
    const struct told after = told();
    struct told wanted = *before;
    long long value;
    see(name == NULL ? "nonsense" : is_refused() ? "refused" : "accepted");
    if (name == NULL || is_one_of(name, " help get status version fault ")) {
        axis.command_ms = axis_before->command_ms; /* somebody speaks, whatever he says */
        HOLDS(memcmp(&axis, axis_before, sizeof axis) == 0, "'%s' changes nothing", words[0]);
    } else if (!is_one_of(name, " load defaults identify learn ")) {
        const struct param_info *const info =
            strcmp(name, "set") == 0 && drive_is_off(axis_before) ? set_by(words, &value) : NULL;
        if (info != NULL) {
            param_set(&wanted.params, info, (int32_t)value);
            see("set");
        }
        HOLDS(memcmp(&after.params, &wanted.params, sizeof after.params) == 0, "'%s' sets what it says alone", name);
    }
}

static void judge(const uint8_t *typed, size_t count)
{
    const struct told before = told();
    struct axis axis_before;
    memcpy(&axis_before, &axis, sizeof axis);
    const uint32_t gate = fabric.gate.CONTROL;
    const bool machine = console.session.machine, streams = console.session.stream.every_ms != 0u;
    char line[LINE_MAX + 1u] = "";
    bool plain = true;
    for (size_t n = 0; n + 1u < count; n++) {
        plain = plain && typed[n] >= 32u && typed[n] < 127u;
        line[n < LINE_MAX ? n : LINE_MAX] = n < LINE_MAX ? (char)typed[n] : '\0';
    }
    type(typed, count);
    take_turn();
    const struct told after = told();
    HOLDS(streams || ends_in(!console.session.machine ? "> " : machine ? ".\r\n" : "ok\r\n"), "the line is answered");
    HOLDS(machine || !plain || count - 1u > LINE_MAX || memcmp(host_said, line, count - 1u) == 0, "it is echoed");
    HOLDS(after.state == before.state && gate == fabric.gate.CONTROL, "the thread leaves the bridge alone");
    HOLDS(!is_refused() || same(&before, &after), "what is refused changes nothing");
    check_ranges();
    if (plain && count - 1u > LINE_MAX) {
        HOLDS(same(&before, &after) && is_refused(), "a line that is too long is refused");
    } else if (plain) {
        judge_words(line, &before, &axis_before);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t count)
{
    struct input in = {data, data + count};
    begin((next_byte(&in) & 1u) != 0u);
    while (in.at < in.end) {
        uint8_t line[1024];
        size_t length = 0;
        while (in.at < in.end && length < sizeof line - 1u && *in.at != '\r' && *in.at != '\n') {
            line[length++] = next_byte(&in);
        }
        in.at += in.at < in.end;
        line[length++] = '\r';
        judge(line, length);
    }
    type("\rmachine off\r", 13);
    type("get pole_pairs\r", 15);
    char wanted[64];
    const int length =
        snprintf(wanted, sizeof wanted, "get pole_pairs\r\npole_pairs = %d", (int)axis.params.pole_pairs);
    HOLDS(memcmp(host_said, wanted, (size_t)length) == 0 && ends_in("> "), "behind all of it a good line is answered");
    return 0;
}
