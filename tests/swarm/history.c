/* SPDX-License-Identifier: MIT */
/*
 * Plays histories, each in a process of its own, as the standard input has them, from "history NAME" to "end MS":
 *
 *     set NAME VALUE      a parameter, when the device is commissioned
 *     MS EVENT NUMBERS    what happens then, a row of `kinds`; `type` has a console line instead of numbers
 *
 * For each, what was wrong, and "history NAME: N findings". In this order in each millisecond: events, masters, drive, judge.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "swarm.h"

#define EVENTS_MOST 256
#define SETS_MOST   32
#define VALUES_MOST 5
#define HANGS_S     60 /* of the processor's time: no history takes a hundredth of it */
#define F(cause)    (1ULL << FAULT_##cause)
#define ROTOR \
    (F(ENCODER) | F(OVERCURRENT) | F(OVERSPEED) | F(STALL) | F(ENCODER_SLIP) | F(ENCODER_DEAD) | F(ENCODER_COUNTS) | \
     F(SPEED_DEVIATION) | F(ENCODER_DIRECTION) | F(POLE_PAIRS) | F(ROTOR_BLOCKED) | F(LOAD_TOO_HIGH) | F(LOCK_LOST) | \
     F(FOLLOWING_ERROR) | F(OUT_OF_STEP) | F(OFFSET) | F(ROTOR_TURNING) | F(HALL_SEQUENCE) | F(HOMING) | \
     F(LIMIT_CYCLE) | F(OSCILLATION))
#define CURRENTS \
    (F(OVERCURRENT) | F(CURRENT_SUM) | F(CURRENT_OFFSET) | F(OPEN_PHASE) | F(SENSOR_SIGN) | F(SENSORS_EXCHANGED))
#define SUPPLY  (F(UNDERVOLTAGE) | F(OVERVOLTAGE) | F(VOLTAGE_LIMIT) | ROTOR)
#define LOST    (F(MASTER_LOST) | F(COMMAND_TIMEOUT))
#define LATCHES (F(STO_A) | F(STO_B) | F(GATE_DRIVER) | F(OVERCURRENT_HARDWARE))

extern uint32_t host_device_fault;

struct event_kind {
    const char *name;
    void (*act)(const int32_t *v,
                bool begins); /* at its end once more, if it lasts; NULL: `member` becomes the value */
    int32_t *member;          /* of whom v[0] is not */
    size_t stride;            /* to the next one's; 0: there is only one, and v[0] is the value */
    int lasts;                /* which value is how long, ms; 0: it does not */
    uint32_t disturbs_ms;     /* the motion, at its begin and its end */
    uint64_t explains;
};

static struct {
    char name[64];
    struct event {
        uint32_t at_ms;
        const struct event_kind *kind;
        int32_t value[VALUES_MOST];
        uint32_t until_ms; /* 0: it does not last, or has ended */
        char text[81];     /* of `type` */
    } event[EVENTS_MOST];
    uint32_t events, end_ms, sets;
    struct {
        char name[32];
        int32_t value;
    } set[SETS_MOST];
} history;

/* ---- masters: v[0] is which, 0 by Modbus, 1 by CAN ---- */

static struct master *master(const int32_t *v)
{
    return &masters[v[0] == 0 ? OWNER_MODBUS : OWNER_CAN];
}

/* It knows nothing of what was. */
static void boot(const int32_t *v, bool begins)
{
    const uint32_t axis = (uint32_t)v[1] % AXIS_COUNT;
    (void)begins;
    *master(v) = (struct master){.there = true,
                                 .axis = axis,
                                 .kind = (uint32_t)v[2] | (axis != 0u ? MASTER_SDO : 0u),
                                 .period_ms = (uint32_t)v[3],
                                 .heartbeat_ms = (uint32_t)v[4]};
}

static void target(const int32_t *v, bool begins)
{
    (void)begins;
    master(v)->target_rpm = v[1];
    master(v)->told = master(v)->has_target = true;
}

/* Operation or none; a speed, 0: it says none. */
static void want(const int32_t *v, bool begins)
{
    master(v)->wants = v[1] != 0;
    master(v)->told = true;
    if (v[2] != 0) {
        target((const int32_t[]){v[0], v[2]}, begins);
    }
}

static void nmt(const int32_t *v, bool begins)
{
    (void)begins;
    masters_nmt((uint32_t)v[0]);
}

/* ---- faults that are more than a member ---- */

static void slip(const int32_t *v, bool begins)
{
    (void)begins;
    world.plants[(uint32_t)v[0] % AXIS_COUNT].zero += v[1];
    judged[(uint32_t)v[0] % AXIS_COUNT].slipped = true;
}

/* The controller counts it in its interrupt, whatever the thread does. */
static void bus_off(const int32_t *v, bool begins)
{
    lines_can.offs += begins && world_can_is_up();
    world.cut = begins ? v[0] : 0;
}

/* The PLL loses its lock: the fabric shuts the gates, and the device says so as long as it lasts. */
static void clock_lost(const int32_t *v, bool begins)
{
    (void)v;
    host_device_fault = begins ? FAULT_CLOCK : FAULT_NONE;
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        world.plants[n].latches = begins ? (int32_t)GATE_STATUS_CLOCK_LOST : 0;
    }
}

static void power(const int32_t *v, bool begins)
{
    (void)v;
    if (begins == world.powered) {
        world_power(!begins);
        masters_forgotten();
        judge_rebooted();
    }
}

/* It comes back, if it did fail. */
static void flash_cut(const int32_t *v, bool begins)
{
    world.flash_cut = begins ? v[0] : 0;
    if (!begins) {
        power(v, false);
    }
}

#define PLANT(name)  NULL, &world.plants[0].name, sizeof(struct plant)
#define MASTER(name) NULL, &masters[OWNER_MODBUS].name, sizeof(struct master)
#define WORLD(name)  NULL, &world.name, 0
#define ALL(how)     how, NULL, 0
#define TYPE         (&kinds[0])

static const struct event_kind kinds[] = {
    {"type", ALL(NULL), 0, 0, 0},
    {"boot", ALL(boot), 0, 0, LOST},
    {"want", ALL(want), 0, 0, 0},
    {"target", ALL(target), 0, 0, 0},
    {"die", MASTER(dead), 0, 0, LOST},
    {"mute", MASTER(mute), 1, 0, LOST},
    {"stale", MASTER(stale), 1, 0, 0},
    {"repeat", MASTER(repeats), 2, 0, 0},
    {"nmt", ALL(nmt), 0, 0, LOST},
    {"latch", PLANT(latches), 2, 0, LATCHES},
    {"supply", WORLD(supply_mv), 1, 1500, SUPPLY},
    {"encoder", PLANT(encoder), 2, 1500, ROTOR},
    {"slip", ALL(slip), 0, 1500, ROTOR},
    {"sensor", PLANT(offset_q15), 2, 1500, CURRENTS | ROTOR},
    {"load", PLANT(load_mnm), 2, 1500, ROTOR},
    {"block", PLANT(blocked), 2, 2500, ROTOR},
    {"bus-off", ALL(bus_off), 1, 0, LOST},
    {"clock", ALL(clock_lost), 1, 0, F(CLOCK) | F(PLL)},
    {"late", WORLD(skipped), 0, 0, F(LOOP_STOPPED)},
    {"hang", WORLD(hung_ms), 0, 1500, F(THREAD_STOPPED) | LOST},
    {"power", ALL(power), 1, 0, 0},
    {"flash-cut", ALL(flash_cut), 1, 0, 0},
};

/* What a line may end in; a step of csv, where it turns already. */
static void typed(const char *text)
{
    told.explained |= strstr(text, "torque") != NULL ? F(OVERSPEED) | F(STALL) : 0u;
    told.explained |= strstr(text, "hm") != NULL ? F(HOMING) : 0u;
    told.explained |= strstr(text, "csv") != NULL ? F(SPEED_DEVIATION) | F(LOCK_LOST) | F(OUT_OF_STEP) : 0u;
    (void)judge_type(text);
}

static void act(const struct event_kind *kind, const int32_t *v, bool begins)
{
    judge_disturbed(kind->disturbs_ms);
    if (kind->act != NULL) {
        kind->act(v, begins);
    } else {
        const uint32_t who = kind->stride == sizeof(struct plant) ? (uint32_t)v[0] % AXIS_COUNT
                             : kind->stride != 0u                 ? v[0] != 0
                                                                  : 0u;
        *(int32_t *)((char *)kind->member + who * kind->stride) = begins ? v[kind->stride != 0u ? 1 : 0] : 0;
    }
}

static void begin(struct event *e)
{
    told.explained |= e->kind->explains;
    if (e->kind == TYPE) {
        typed(e->text);
        return;
    }
    act(e->kind, e->value, true);
    e->until_ms = e->kind->lasts != 0 ? world.now_ms + (uint32_t)e->value[e->kind->lasts] : 0u;
}

static void end_events(bool all)
{
    for (struct event *e = history.event; e < history.event + history.events; e++) {
        if (e->until_ms != 0u && (all || world.now_ms >= e->until_ms)) {
            e->until_ms = 0u;
            act(e->kind, e->value, false);
        }
    }
}

/* ---- a history ---- */

static bool commission(struct axis *a)
{
    for (uint32_t n = 0; n < history.sets; n++) {
        const struct param_info *const row = param_find(history.set[n].name);
        memcpy((char *)&a->params + row->offset, &history.set[n].value, sizeof(int32_t));
    }
    return true;
}

static void play(void)
{
    world_new(commission);
    masters_new();
    judge_new();
    uint32_t next = 0;
    while (world.now_ms < history.end_ms) {
        for (; next < history.events && history.event[next].at_ms <= world.now_ms; next++) {
            begin(&history.event[next]);
        }
        end_events(false);
        masters_step();
        world_millisecond();
        judge_millisecond();
    }
    end_events(true);
    power(NULL, false);
    masters_new();
    told.explained |= LOST;
    judge_end();
}

/* A child's end by a signal is a finding of its own: undefined behaviour traps. */
static bool play_apart(void)
{
    fflush(stdout);
    const pid_t child = fork();
    int status = 0;
    if (child == 0) {
        (void)setrlimit(RLIMIT_CPU, &(struct rlimit){HANGS_S, HANGS_S});
        play();
        printf("history %s: %u findings\n", history.name, (unsigned)judge_findings);
        fflush(stdout);
        _exit(judge_findings != 0u);
    }
    (void)waitpid(child, &status, 0);
    if (WIFSIGNALED(status)) {
        printf("wrong at 0: the program ends by signal %d\nhistory %s: 1 findings\n", WTERMSIG(status), history.name);
    }
    return status != 0;
}

static bool read_event(const char *line)
{
    struct event *const e = &history.event[history.events];
    int32_t *const v = e->value;
    char name[24];
    int at = 0;
    if (history.events == EVENTS_MOST || sscanf(line, "%u %23s%n", &e->at_ms, name, &at) < 2) {
        return false;
    }
    for (size_t n = 0; n < sizeof kinds / sizeof kinds[0]; n++) {
        e->kind = strcmp(kinds[n].name, name) == 0 ? &kinds[n] : e->kind;
    }
    (void)sscanf(line + at, "%d %d %d %d %d", &v[0], &v[1], &v[2], &v[3], &v[4]);
    snprintf(e->text, sizeof e->text, "%s", line + at + (line[at] != '\0'));
    history.events += e->kind != NULL;
    return e->kind != NULL;
}

static bool read_line(const char *line)
{
    char name[sizeof history.name];
    int32_t value;
    if (sscanf(line, "history %63s", name) == 1) {
        memset(&history, 0, sizeof history);
        memcpy(history.name, name, sizeof name);
        return true;
    }
    if (sscanf(line, "set %31s %d", name, &value) == 2 && history.sets < SETS_MOST && param_find(name) != NULL) {
        snprintf(history.set[history.sets].name, sizeof history.set[0].name, "%.31s", name);
        history.set[history.sets++].value = value;
        return true;
    }
    return (sscanf(line, "axes %d", &value) == 1 && value == (int32_t)AXIS_COUNT) ||
           sscanf(line, "end %u", &history.end_ms) == 1 || line[0] == '\0' || line[0] == '#' || read_event(line);
}

int main(int argc, char **argv)
{
    char line[160];
    bool wrong = false;
    judge_traces = argc > 1 && strcmp(argv[1], "trace") == 0;
    while (fgets(line, sizeof line, stdin) != NULL) {
        line[strcspn(line, "\n")] = '\0';
        const char *const at = line + strspn(line, " ");
        if (!read_line(at)) {
            fprintf(stderr, "%s: no such line in a history: '%s'; tests/swarm/history.c lists the events\n", argv[0],
                    at);
            return 2;
        }
        wrong = (strncmp(at, "end ", 4) == 0 && play_apart()) || wrong;
    }
    return wrong;
}
