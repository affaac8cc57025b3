/* SPDX-License-Identifier: MIT */
/* The scope at the console: signals, captures, records, the stream, frequency responses. */
#include "firmware/operate/commands.h"
#include "lib/polar.h"

/* ---- words ---- */

/* clang-format off */
static const struct {
    const char *name, *text;
} signal_texts[] = {
    {"i_a", "phase current as sampled"},
    {"i_b", "phase current as sampled"},
    {"i_c", "phase current as sampled; without three sensors 0, or what the fabric calculates"},
    {"vbus", "bus voltage"},
    {"count", "encoder at the sample, within its turn"},
    {"gate", "GATE.STATUS, its bits"},
    {"sequence", "conversions, the sample's own number"},
    {"i_d", "current along the field, at the sample"},
    {"i_q", "current across the field, at the sample"},
    {"i_d_ref", "its reference"},
    {"i_q_ref", "its reference"},
    {"v_d", "voltage that answers the sample"},
    {"v_q", "voltage that answers the sample"},
    {"angle", "rotor, electrical, foreseen for the next sample"},
    {"turning", "electrical speed of the interrupt's observer"},
    {"field", "prescribed field, while one is prescribed"},
    {"flux_a", "flux observer, alpha"},
    {"flux_b", "flux observer, beta"},
    {"speed", "speed of the shaft"},
    {"speed_ref", "reference of the speed loop"},
    {"target", "target of the ramp"},
    {"position", "shaft from its zero, the lower 32 bits"},
    {"error", "following error"},
    {"winding", "temperature of the winding, estimated"},
    {"state", "state of the drive, enum axis_state"},
    {"fault", "cause that is latched, enum fault"},
    {"time", "milliseconds since the start"},
};
/* clang-format on */

const char *signal_text(const char *name)
{
    for (size_t i = 0; i < sizeof signal_texts / sizeof signal_texts[0]; i++) {
        if (text_equal(signal_texts[i].name, name)) {
            return signal_texts[i].text;
        }
    }
    return "unknown";
}

/* In the order of their enums. */
static const char *const when_words[] = {"never", "above", "below", "rises", "falls"};
static const char *const state_texts[] = {"off", "waits for its trigger", "triggered", "done"};
static const char *const cause_texts[] = {"", " by the signal", " by a fault", " by command"};

/* ---- state ---- */

static void put_name(struct session *s, uint32_t which)
{
    if (which < signal_count) {
        text_put(&s->out, signal_table[which].name);
    } else {
        text_print(&s->out, "@%08x", which);
    }
}

static void put_names(struct session *s, const struct signal_choice *choice, const char *between)
{
    for (uint32_t i = 0; i < choice->count; i++) {
        text_put(&s->out, i > 0u ? between : "");
        put_name(s, choice->which[i]);
    }
}

static void put_scales(struct session *s, const struct signal_choice *choice)
{
    for (uint32_t i = 0; i < choice->count; i++) {
        const struct signal_scale scale = signal_scale(signal_of(choice->which[i]), s->axis);
        text_print(&s->out, "%s%d/%u", i == 0u ? "\n" : " ", scale.milli, scale.per);
    }
    text_put(&s->out, "\n");
}

static void put_values(struct session *s, const int32_t *values, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        text_print(&s->out, i + 1u < count ? "%d " : "%d\n", values[i]);
    }
}

static void put_signals(struct session *s)
{
    for (size_t i = 0; i < signal_count; i++) {
        const struct signal_info *const info = &signal_table[i];
        const struct signal_scale scale = signal_scale(info, s->axis);
        text_print(&s->out, "%s %s %d/%u: %s\n", info->name, signal_unit(info->format), scale.milli, scale.per,
                   signal_text(info->name));
    }
}

/* Words are in the operator's sign: for a signal of opposite sign `below` and `above` are exchanged. */
static enum capture_when when_directed(enum capture_when when, const struct signal_info *info, const struct axis *a)
{
    const bool opposite = when != CAPTURE_NEVER && info->directed && axis_forward(a) < 0;
    return opposite ? (enum capture_when)(((uint32_t)when - CAPTURE_ABOVE) ^ 1u) + CAPTURE_ABOVE : when;
}

static void put_trigger(struct session *s)
{
    const struct capture *const c = &s->scope->capture;
    const struct signal_info *const info = signal_of(s->scope->trigger_on);
    if (c->when == CAPTURE_NEVER) {
        text_put(&s->out, "trigger: never");
    } else {
        text_put(&s->out, "trigger: ");
        put_name(s, s->scope->trigger_on);
        text_print(&s->out, " %s %.3d %s", when_words[when_directed(c->when, info, s->axis)],
                   signal_milli(signal_scale(info, s->axis), c->level), signal_unit(info->format));
    }
    text_print(&s->out, ", before: %u of %u samples\n", c->before, scope_capacity(s->scope));
}

static void run_scope(struct session *s, const struct arguments *a)
{
    (void)a;
    const struct capture *const c = &s->scope->capture;
    const uint32_t state = c->state;
    const bool caused = state == CAPTURE_TRIGGERED || state == CAPTURE_DONE;
    text_put(&s->out, "signals: ");
    put_names(s, &s->scope->choice, ",");
    text_print(&s->out, ", every: %u samples of the current loop\n", s->scope->every);
    put_trigger(s);
    text_print(&s->out, "capture: %s%s, dropped: %u, late: %u\n", state_texts[state],
               caused ? cause_texts[c->cause] : "", s->scope->dropped, s->scope->late);
    text_print(&s->out, "kept from the last fault: %u samples, one a millisecond\n",
               scope_extent(s->scope, SCOPE_FAULT).samples);
}

/* ---- a record ---- */

static void put_heading(struct session *s, enum scope_record record, const struct scope_extent *extent)
{
    const bool fault = record == SCOPE_FAULT; /* one a millisecond, none missing */
    text_print(&s->out, "samples: %u, trigger: %u, every: %u, a millisecond has: %u, dropped: %u, late: %u\n",
               extent->samples, extent->trigger, fault ? 1u : s->scope->every, fault ? 1u : s->scope->rate_of,
               fault ? 0u : s->scope->dropped, fault ? 0u : s->scope->late);
    put_names(s, extent->choice, " ");
    put_scales(s, extent->choice);
}

static void put_sample(struct session *s, enum scope_record record, uint32_t first, uint32_t words)
{
    int32_t values[SIGNALS_MAX];
    (void)scope_read(s->scope, record, first, values, words);
    put_values(s, values, words);
}

/*
 * A heading, the names, the scales, then a line of raw values per sample. A record that is overwritten while being read ends
 * early: its last line has the number of samples.
 */
static void print_samples(struct session *s, enum scope_record record)
{
    const struct scope_extent extent = scope_extent(s->scope, record);
    if (extent.samples == 0u) {
        text_put(&s->out, record == SCOPE_FAULT ? "error: no fault has left samples yet\n"
                                                : "error: no capture is done; 'scope' says how far it is\n");
        return;
    }
    put_heading(s, record, &extent);
    const uint32_t kept = s->scope->recorder.kept;
    uint32_t sample = 0;
    for (; sample < extent.samples && (record != SCOPE_FAULT || s->scope->recorder.kept == kept); sample++) {
        put_sample(s, record, sample * extent.words, extent.words);
    }
    text_print(&s->out, "end: %u\n", sample);
}

/* The row's words, in order. */
enum { LIST, ARM, FIRE, OFF, READ, FAULT };

static void run_scope_do(struct session *s, const struct arguments *a)
{
    switch (a->value[1]) {
    case LIST:
        put_signals(s);
        break;
    case ARM:
        answer(s, scope_arm(s->scope));
        break;
    case FIRE:
        answer(s, outcome_of(scope_fire(s->scope)));
        break;
    case OFF:
        scope_off(s->scope);
        answer(s, OUTCOME_OK);
        break;
    default:
        print_samples(s, a->value[1] == READ ? SCOPE_CAPTURE : SCOPE_FAULT);
        break;
    }
}

/* ---- settings of a capture ---- */

/* "i_q,speed": false after reporting what is wrong. */
static bool parse_choice(struct session *s, char *names, struct signal_choice *choice)
{
    for (char *name = names; name != NULL;) {
        size_t length = 0;
        while (name[length] != ',' && name[length] != '\0') {
            length++;
        }
        const bool last = name[length] == '\0';
        const uint32_t found = signal_find(name, length);
        name[length] = '\0';
        if (!scope_knows(s->scope, found)) {
            answer_error(s, name,
                         name[0] == '@' ? "not in the RAM that may be read"
                                        : "no such signal; 'scope list' has them, separate them by commas only");
            return false;
        }
        if (choice->count == SIGNALS_MAX) {
            answer_error(s, name, "is one too many; 8 signals at most");
            return false;
        }
        choice->which[choice->count++] = found;
        name = last ? NULL : name + length + 1;
    }
    return true;
}

static void set_signals(struct session *s, char *names)
{
    struct signal_choice choice = {0};
    if (parse_choice(s, names, &choice)) {
        answer(s, outcome_of(scope_choose(s->scope, &choice)));
    }
}

/* What they are now, and no capture or stream is touched. */
static void show_values(struct session *s, char *names)
{
    struct signal_choice choice = {0};
    int32_t values[SIGNALS_MAX];
    if (parse_choice(s, names, &choice)) {
        for (uint32_t i = 0; i < choice.count; i++) {
            const struct signal_source source = signal_source(choice.which[i], s->axis, &s->scope->zero);
            signals_copy(&source, 1u, &values[i]);
        }
        put_names(s, &choice, " ");
        put_scales(s, &choice);
        put_values(s, values, choice.count);
    }
}

/* False after reporting what is wrong. */
static bool read_within(struct session *s, const char *word, uint32_t least, uint32_t most, uint32_t *value)
{
    int32_t number;
    if (!text_parse_int(word, &number)) {
        answer_error(s, word, "not a whole number");
        return false;
    }
    if (number < (int32_t)least || number > (int32_t)most) {
        text_print(&s->out, "error: must be %u...%u\n", least, most);
        return false;
    }
    *value = (uint32_t)number;
    return true;
}

static void run_scope_set(struct session *s, const struct arguments *a)
{
    uint32_t value;
    if (text_equal(a->word[1], "signals")) {
        set_signals(s, a->word[2]);
    } else if (text_equal(a->word[1], "values")) {
        show_values(s, a->word[2]);
    } else if (text_equal(a->word[1], "every")) {
        if (read_within(s, a->word[2], 1u, SCOPE_EVERY_MAX, &value)) {
            answer(s, outcome_of(scope_set_every(s->scope, value)));
        }
    } else if (text_equal(a->word[1], "before")) {
        if (read_within(s, a->word[2], 0u, scope_capacity(s->scope) - 1u, &value)) {
            answer(s, outcome_of(scope_set_before(s->scope, value)));
        }
    } else if (text_equal(a->word[1], "trigger") && text_equal(a->word[2], when_words[CAPTURE_NEVER])) {
        answer(s, outcome_of(scope_set_trigger(s->scope, s->scope->trigger_on, CAPTURE_NEVER, 0)));
    } else {
        answer_error(s, a->word[1],
                     "not one of signals A,B,..., values A,B,..., every TICKS, before SAMPLES, trigger never");
    }
}

static void run_scope_trigger(struct session *s, const struct arguments *a)
{
    const uint32_t signal = (uint32_t)a->value[2];
    const enum capture_when when = (enum capture_when)(CAPTURE_ABOVE + a->value[3]);
    const struct signal_info *const info = signal_of(signal);
    if (!scope_knows(s->scope, signal)) {
        answer_error(s, a->word[2], "not in the RAM that may be read");
        return;
    }
    const int32_t level = signal_raw(signal_scale(info, s->axis), a->value[4]);
    answer(s, outcome_of(scope_set_trigger(s->scope, signal, when_directed(when, info, s->axis), level)));
}

/* The answer is sent at the old rate; "0" ends the stream and ignores the rate. */
static void run_stream(struct session *s, const struct arguments *a)
{
    if (!s->machine && a->value[1] != 0) {
        answer_error(s, "stream", "its frames are not for a terminal; 'machine on' first");
        return;
    }
    answer(s, OUTCOME_OK);
    if (a->value[1] == 0) {
        stream_end(&s->stream);
    } else {
        stream_begin(&s->stream, s->scope, (uint32_t)a->value[1], (uint32_t)a->value[2]);
    }
}

/* clang-format off */
const struct command commands_scope[] = {
    {"scope", " trigger SIGNAL above|below|rises|falls VALUE",
     "what begins a capture, besides a fault and 'scope fire'",
     {ARGUMENT_TRIGGER, ARGUMENT_SIGNAL, ARGUMENT_CHOICE, ARGUMENT_DECIMAL}, .run = run_scope_trigger},
    {"scope", " signals A,B,...|values A,B,...|every TICKS|before SAMPLES|trigger never",
     "what a capture is to hold; what they are now; also words of RAM, as @2000a1bc",
     {ARGUMENT_ANY, ARGUMENT_ANY}, .run = run_scope_set},
    {"scope", " list|arm|fire|off|read|fault", "signals there are; a capture; the last one; what the last fault left",
     {ARGUMENT_CHOICE}, .run = run_scope_do},
    {"scope", "", "what is set, and what the capture does", .run = run_scope},
    {"stream", " MS BAUD", "a frame of the signals every MS between the text, at BAUD; ends 3 s after the last line",
     {ARGUMENT_STREAM_MS, ARGUMENT_BAUD}, .run = run_stream},
};
/* clang-format on */

/* ---- frequency responses ---- */

static const char *const loop_names[] = {[SWEEP_D] = "d", [SWEEP_Q] = "q", [SWEEP_SPEED] = "speed"};
static const char *const state_names[] = {
    [SWEEP_NONE] = "none", [SWEEP_RUNS] = "runs", [SWEEP_DONE] = "done", [SWEEP_ENDED] = "ended before its end"};

static void run_sweep(struct session *s, const struct arguments *a)
{
    answer(s, scope_sweep(s->scope, (enum sweep_loop)a->value[1], a->value[2]));
}

static void put_state(struct text *out, const struct sweep *w)
{
    text_print(out, "sweep: %s, loop: %s, amplitude: %.3d A, points: %u\n", state_names[w->state], loop_names[w->loop],
               quantity_milliamp(w->axis, w->amplitude_q15), w->count);
}

static void run_sweep_state(struct session *s, const struct arguments *a)
{
    (void)a;
    put_state(&s->out, &s->scope->sweep);
}

static void put_point(struct text *out, const struct sweep_point *p)
{
    const int32_t size_q14 = magnitude_q15(q15_sat16(p->re_q14), q15_sat16(p->im_q14));
    const int32_t angle_q32 = (int32_t)atan2_q32(p->im_q14, p->re_q14);
    text_print(out, "%.3d Hz: %.3d, %.3d deg\n", p->millihertz, size_q14 * 1000 / SWEEP_UNITY,
               (int32_t)(((int64_t)angle_q32 * 360000) >> 32));
}

static void put_frequency(struct text *out, const char *what, int32_t millihertz)
{
    if (millihertz == 0) {
        text_print(out, "%s: not among these frequencies\n", what);
    } else {
        text_print(out, "%s: %.3d Hz\n", what, millihertz);
    }
}

static void put_response(struct session *s)
{
    const struct sweep *const w = &s->scope->sweep;
    const struct sweep_summary found = sweep_summary(w);
    put_state(&s->out, w);
    for (uint32_t n = 0; n < w->count; n++) {
        put_point(&s->out, &w->points[n]);
    }
    put_frequency(&s->out, "closed loop, -3 dB", found.bandwidth_mhz);
    put_frequency(&s->out, "closed loop, -90 degrees", found.lag_mhz);
    put_frequency(&s->out, "open loop, crossover", found.crossover_mhz);
    if (found.crossover_mhz != 0) {
        text_print(&s->out, "phase margin: %.3d degrees\n", found.margin_ddeg * 100);
    }
}

static void run_sweep_do(struct session *s, const struct arguments *a)
{
    if (a->value[1] == 0) {
        put_response(s);
    } else {
        sweep_end(&s->scope->sweep);
        answer(s, OUTCOME_OK);
    }
}

/* clang-format off */
const struct command commands_sweep[] = {
    {"sweep", " d|q|speed A", "the frequency response of a loop in operation, by a sine of A peak amperes",
     {ARGUMENT_CHOICE, ARGUMENT_AMPERES}, .run = run_sweep, .begins = PROGRESS_SWEEP},
    {"sweep", " read|off", "what it found: the closed loop by frequency, bandwidth, phase margin; or end it",
     {ARGUMENT_CHOICE}, .run = run_sweep_do},
    {"sweep", "", "how far it is", .run = run_sweep_state},
};
/* clang-format on */
