/* SPDX-License-Identifier: MIT */
#include "firmware/operate/objects.h"

#include "firmware/drive/nvm.h"
#include "firmware/drive/reaction.h"
#include "firmware/settings/config.h"
#include "firmware/settings/features.h"
#include "lib/q15.h"

enum { RO, RW };

/* ==== other names of parameters ==== */

#define QUICK_STOP_FACTOR 4

/* clang-format off */
#define PROFILE_ROW(index, subindex, type, access, name, initial, how, fixed) \
    {index, subindex, OBJECT_TYPE_##type, PROFILE_##how, access == RW, fixed},
const struct profile_object profile_objects[] = {
    PROFILE_OBJECTS(PROFILE_ROW)
};
/* clang-format on */

const uint32_t profile_object_count = sizeof profile_objects / sizeof profile_objects[0];

/* Milliseconds. */
static int32_t power_of(int32_t exponent)
{
    static const int16_t powers[] = {1, 10, 100, 1000};
    return powers[q15_clamp(exponent + 3, 0, 3)];
}

/* The object is the parameter times `by` / `of`. */
struct ratio {
    const char *name; /* NULL: no parameter */
    int32_t param, by, of;
};

static struct ratio ratio_of(const struct profile_object *o, const struct params *p, int32_t exponent)
{
    switch ((enum profile_how)o->how) {
    case PROFILE_RAMP:
        return (struct ratio){"ramp_rpm_s", p->ramp_rpm_s, 1, 1};
    case PROFILE_SPEED:
        return (struct ratio){"profile_speed_pm", p->profile_speed_pm, p->speed_max_rpm, 1000};
    case PROFILE_HOME:
        return (struct ratio){"home_rpm", q15_abs(p->home_rpm), 1, 1};
    case PROFILE_FOLLOWING:
        return (struct ratio){"following_mturn", p->following_mturn, p->encoder_counts, 1000};
    case PROFILE_TORQUE:
        return (struct ratio){"i_max_ma", p->i_max_ma, 1000, p->i_rated_ma};
    case PROFILE_CYCLE:
        return (struct ratio){"cyclic_ms", p->cyclic_ms, 1, power_of(exponent)};
    case PROFILE_QUICK:
        return (struct ratio){NULL, p->ramp_rpm_s, QUICK_STOP_FACTOR, 1};
    case PROFILE_EXPONENT:
        return (struct ratio){NULL, exponent, 1, 1};
    default:
        return (struct ratio){NULL, o->fixed, 1, 1};
    }
}

/* Its value; `exponent`: what 0x60C2:2 is. */
static int32_t profile_value(const struct profile_object *o, const struct params *p, int32_t exponent)
{
    const struct ratio r = ratio_of(o, p, exponent);
    const int64_t found = (int64_t)r.param * r.by / r.of;
    const int32_t most = o->type == OBJECT_TYPE_U8 ? UINT8_MAX : o->type == OBJECT_TYPE_U16 ? UINT16_MAX : INT32_MAX;
    return found > most ? most : (int32_t)found;
}

/*
 * Name of the parameter that it sets, NULL for what sets none; and the value that this one is to have. What does not fit 32
 * bits fits no parameter.
 */
static const char *profile_param(const struct profile_object *o, const struct params *p, int32_t exponent,
                                 int32_t value, int32_t *wanted)
{
    const struct ratio r = ratio_of(o, p, exponent);
    if (o->how == PROFILE_EXPONENT) {
        *wanted = p->cyclic_ms / power_of(exponent) * power_of(value);
        return "cyclic_ms";
    }
    const int64_t found = ((int64_t)value * r.of + r.by / 2) / r.by;
    *wanted = found > INT32_MAX ? INT32_MAX : (int32_t)found;
    *wanted = o->how == PROFILE_HOME && p->home_rpm < 0 ? -*wanted : *wanted;
    return r.name;
}

/* ==== all of them ==== */

#define PRODUCT   0x6D666F63u
#define UNCHANGED UINT32_MAX

/* ---- places ---- */

/* clang-format off */
#define OBJECT_INDEX(at, index) ((index) == 0 ? OBJECTS_INDEX + (at) : (uint32_t)(index) >> 8)
#define OBJECT_ROW(at, index, type, access, name, unit, what, value) \
    {at, OBJECT_INDEX(at, index), (index) & 0xFF, OBJECT_TYPE_##type, access == RW},
const struct object_row objects[OBJECT_COUNT] = {
    OBJECTS(OBJECT_ROW)
};
/* clang-format on */

enum object_type object_type(const struct object_place *p)
{
    return p->kind == PLACE_OBJECT    ? (enum object_type)objects[p->number].type
           : p->kind == PLACE_PROFILE ? (enum object_type)profile_objects[p->number].type
           : p->kind == PLACE_PARAM   ? OBJECT_TYPE_I32
                                      : OBJECT_TYPE_U16;
}

bool object_is_writable(const struct object_place *p)
{
    return p->kind == PLACE_OBJECT    ? objects[p->number].writable
           : p->kind == PLACE_PROFILE ? profile_objects[p->number].writable
                                      : true;
}

/* ---- reading ---- */

static int32_t per_mille_of_rated(const struct axis *a, int32_t q15)
{
    const int64_t per_mille = (int64_t)quantity_milliamp(a, q15) * 1000 / a->params.i_rated_ma;
    return (int32_t)q15_clamp((int32_t)(per_mille > INT16_MAX ? INT16_MAX : per_mille), INT16_MIN, INT16_MAX);
}

/* "1.2.3" as 0x00010203. */
static uint32_t revision(void)
{
    uint32_t number = 0;
    uint32_t part = 0;
    for (const char *c = CONFIG_VERSION; *c != '\0'; c++) {
        if (*c == '.') {
            number = (number | part) << 8;
            part = 0;
        } else {
            part = part * 10u + (uint32_t)(*c - '0');
        }
    }
    return number | part;
}

/* In the unit of the table; 32 bits of it. */
static uint32_t object_value(const struct object_view *v, uint32_t object)
{
    const struct axis *const axis = v->axis;
    const struct cia402 *const cia402 = v->cia402;
    const struct drive_status *const now = &v->now;
    const struct fault_snapshot *const past = &axis->faults.snapshot;
    const struct object_writable *const w = &v->writable;
    /* clang-format off */
    switch ((enum object_id)object) {
#define OBJECT_VALUE(at, index, type, access, name, unit, what, value) \
    case OBJECT_##name: \
        return (uint32_t)(value);
        OBJECTS(OBJECT_VALUE)
    default:
        return 0;
    }
    /* clang-format on */
}

struct object_view object_view(const struct bus_drive *d)
{
    return (struct object_view){d->axis,
                                &d->cia402,
                                drive_status(d->axis),
                                {.setpoints = d->cia402.setpoints,
                                 .source = d->axis->tuning.angle_source,
                                 .owner = d->axis->owner.who,
                                 .polarity = axis_forward(d->axis) < 0 ? OBJECTS_TURNED : 0u}};
}

uint32_t object_get(const struct object_view *v, const struct object_place *p)
{
    if (p->kind == PLACE_PARAM) {
        return (uint32_t)param_get(&v->axis->params, &param_table[p->number]);
    }
    if (p->kind == PLACE_PROFILE) {
        return (uint32_t)profile_value(&profile_objects[p->number], &v->axis->params, v->cia402->exponent);
    }
    return p->kind == PLACE_REACTION ? v->axis->reactions.choice[p->number] : object_value(v, p->number);
}

/* ---- writing ---- */

void object_begin(struct object_change *c, const struct bus_drive *d)
{
    *c = (struct object_change){
        .params = d->axis->params,
        .writable = {
            .setpoints = d->cia402.setpoints, .source = UNCHANGED, .owner = UNCHANGED, .exponent = d->cia402.exponent}};
    for (uint32_t fault = 0; fault < FAULT_COUNT; fault++) {
        c->choice[fault] = d->axis->reactions.choice[fault];
    }
}

static enum object_refusal change_param(struct object_change *c, uint32_t number, int32_t value)
{
    const struct param_info *const info = &param_table[number];
    if (value < info->min || value > info->max) {
        return value < info->min ? OBJECT_TOO_LOW : OBJECT_TOO_HIGH;
    }
    c->absent = c->absent.error != ERROR_NONE ? c->absent : features_allow(info, value);
    param_set(&c->params, info, value);
    c->params_changed++;
    return OBJECT_OK;
}

static enum object_refusal change_named(struct object_change *c, const char *name, int32_t value)
{
    return change_param(c, (uint32_t)(param_find(name) - param_table), value);
}

/* Sets the parameter it maps to; without one only the present value is accepted. */
static enum object_refusal change_profile(struct object_change *c, uint32_t number, int32_t value)
{
    const struct profile_object *const o = &profile_objects[number];
    const int32_t exponent = c->writable.exponent, now = profile_value(o, &c->params, exponent);
    int32_t wanted;
    if (o->type == OBJECT_TYPE_U32 && value < 0) {
        return OBJECT_TOO_HIGH;
    }
    if (o->how == PROFILE_EXPONENT) {
        if (value < -3 || value > 0) {
            return OBJECT_BAD_VALUE;
        }
        c->writable.exponent = value;
    }
    const char *const name = profile_param(o, &c->params, exponent, value, &wanted);
    if (name != NULL) {
        const bool ramp = o->how == PROFILE_RAMP;
        return ramp && change_named(c, "profile_rpm_s", 0) != OBJECT_OK ? OBJECT_BAD_VALUE
                                                                        : change_named(c, name, wanted);
    }
    if (o->how == PROFILE_QUICK) {
        return value <= now ? OBJECT_OK : OBJECT_TOO_HIGH;
    }
    return value == now ? OBJECT_OK : OBJECT_BAD_VALUE;
}

static enum object_refusal change_choice(struct object_change *c, uint32_t fault, int32_t choice)
{
    if (fault_reaction_is_absent((enum fault)fault, (enum reaction)choice)) {
        c->absent = feature_absent(FEATURE_SENSORLESS);
        return OBJECT_OK; /* the whole write is refused later, with this reason */
    }
    if (choice < 0 || choice >= REACTION_COUNT || ((fault_class((enum fault)fault)->allowed >> choice) & 1u) == 0u) {
        return OBJECT_BAD_VALUE;
    }
    c->choice[fault] = (uint8_t)choice;
    c->choices_changed++;
    return OBJECT_OK;
}

static void set_object(struct object_writable *w, uint32_t object, int32_t value)
{
    /* clang-format off */
    switch ((enum object_id)object) {
#define WRITE_RO(name, place)
#define WRITE_RW(name, place) \
    case OBJECT_##name: \
        place = (__typeof__(place))value; \
        break;
#define OBJECT_WRITE(at, index, type, access, name, unit, what, value) WRITE_##access(name, value)
        OBJECTS(OBJECT_WRITE)
    default:
        break;
    }
    /* clang-format on */
}

/* Storing and restoring need a signature, against accidental writes. */
static enum object_refusal change_object(struct object_change *c, uint32_t object, int32_t value)
{
    const struct object_writable *const w = &c->writable;
    set_object(&c->writable, object, value);
    if (object <= OBJECT_homing_method) {
        c->setpoints |= 1u << object;
    }
    if (object == OBJECT_polarity) { /* one direction for position and velocity */
        c->params.direction = w->polarity == OBJECTS_TURNED ? 1 : 0;
        c->params_changed++;
        return w->polarity == OBJECTS_TURNED || w->polarity == 0u ? OBJECT_OK : OBJECT_BAD_VALUE;
    }
    if ((object == OBJECT_store && w->store != OBJECTS_SAVE) ||
        (object == OBJECT_restore && w->restore != OBJECTS_LOAD)) {
        return OBJECT_NO_CODE_WORD;
    }
    return object == OBJECT_angle_source && w->source >= PARAM_ANGLES ? OBJECT_BAD_VALUE : OBJECT_OK;
}

enum object_refusal object_change(struct object_change *c, const struct object_place *p, int32_t value)
{
    if (p->kind == PLACE_PARAM) {
        return change_param(c, p->number, value);
    }
    return p->kind == PLACE_REACTION  ? change_choice(c, p->number, value)
           : p->kind == PLACE_PROFILE ? change_profile(c, p->number, value)
                                      : change_object(c, p->number, value);
}

/*
 * Checks several parameters as switching on does; a single one, as at the console, only against its range. Not inline: its
 * tuning would take stack while settings are stored.
 */
static __attribute__((noinline)) bool are_consistent(const struct object_change *c, const struct axis *a)
{
    if (c->params_changed < 2u) {
        return true;
    }
    struct tuning unused = a->tuning;
    return tuning_compute(&c->params, &unused).error == ERROR_NONE &&
           tuning_check_motor(&c->params).error == ERROR_NONE;
}

static enum object_refusal check_change(const struct object_change *c, const struct axis *a)
{
    if (c->setpoints != 0u && !cia402_allows(&c->writable.setpoints, &c->params)) {
        return OBJECT_BAD_VALUE;
    }
    if (c->params_changed + c->choices_changed > 0u && !drive_is_off(a)) {
        return OBJECT_BAD_STATE;
    }
    return are_consistent(c, a) ? OBJECT_OK : OBJECT_BAD_VALUE;
}

/* Any line may stop; only the owner may write targets, modes, halt and control words that enable. */
static struct outcome check_owner(const struct object_change *c, const struct bus_drive *d)
{
    const struct object_writable *const w = &c->writable;
    const uint32_t word = c->setpoints & 1u << OBJECT_control_word;
    const bool commands =
        (word != 0u && cia402_enables(w->setpoints.control_word)) || c->setpoints != word || w->source != UNCHANGED;
    const bool stops = word != 0u && cia402_stops(w->setpoints.control_word);
    return commands && !stops && w->owner == UNCHANGED ? owner_allows(d->axis, d->cia402.who) : OUTCOME_OK;
}

static bool store_settings(struct bus_drive *d)
{
    struct saved unused;
    d->cia402.refusal =
        FEATURE_IN(SETTINGS) ? drive_save(d->axis, d->slots, &unused) : feature_absent(FEATURE_SETTINGS);
    return d->cia402.refusal.error == ERROR_NONE;
}

/* They change nothing if refused; no request combines them with parameters. */
static enum object_refusal carry_out_actions(struct bus_drive *d, const struct object_writable *w)
{
    const bool refused = (w->restore != 0u && drive_defaults(d->axis).error != ERROR_NONE) ||
                         (w->store != 0u && !store_settings(d)) ||
                         (w->source != UNCHANGED && !cia402_change_source(&d->cia402, d->axis, w->source));
    return refused ? OBJECT_BAD_STATE : OBJECT_OK;
}

/* Targets that are not written stay as they are, or as a take-over in the same write has set them. */
static void apply_setpoints(struct bus_drive *d, const struct object_change *c)
{
    const uint32_t not_targets = 1u << OBJECT_control_word | 1u << OBJECT_homing_method;
    const struct cia402_setpoints *const now = &d->cia402.setpoints;
    struct cia402_setpoints s = c->writable.setpoints;
    s.mode = (c->setpoints & 1u << OBJECT_mode) != 0u ? s.mode : now->mode;
    s.target_rpm = (c->setpoints & 1u << OBJECT_target_velocity) != 0u ? s.target_rpm : now->target_rpm;
    s.target_torque_pm = (c->setpoints & 1u << OBJECT_target_torque) != 0u ? s.target_torque_pm : now->target_torque_pm;
    cia402_accept(&d->cia402, &s, (c->setpoints & 1u << OBJECT_control_word) != 0u,
                  (c->setpoints & ~not_targets) != 0u);
}

static void apply_change(struct bus_drive *d, const struct object_change *c)
{
    if (c->params_changed > 0u) {
        d->axis->params = c->params;
    }
    d->cia402.exponent = c->writable.exponent;
    for (uint32_t fault = 0; c->choices_changed > 0u && fault < FAULT_COUNT; fault++) {
        d->axis->reactions.choice[fault] = c->choice[fault];
    }
    apply_setpoints(d, c);
}

enum object_refusal object_check(const struct object_change *c, struct bus_drive *d)
{
    if (c->absent.error != ERROR_NONE) {
        d->cia402.refusal = c->absent;
        return OBJECT_BAD_VALUE;
    }
    const struct outcome forbidden = check_owner(c, d);
    if (forbidden.error != ERROR_NONE) {
        d->cia402.refusal = forbidden;
        return OBJECT_COMMANDED;
    }
    const bool another = c->writable.owner != UNCHANGED && c->writable.owner != (uint32_t)d->cia402.who;
    return another ? OBJECT_BAD_VALUE : check_change(c, d->axis);
}

void object_stop(const struct object_change *c, struct bus_drive *d)
{
    struct cia402_setpoints s = d->cia402.setpoints;
    s.control_word = c->writable.setpoints.control_word;
    if ((c->setpoints & 1u << OBJECT_control_word) != 0u && cia402_stops(s.control_word)) {
        cia402_accept(&d->cia402, &s, true, false);
    }
}

enum object_refusal object_commit(struct object_change *c, struct bus_drive *d)
{
    enum object_refusal wrong = object_check(c, d);
    if (wrong == OBJECT_OK) {
        wrong = carry_out_actions(d, &c->writable);
    }
    if (wrong == OBJECT_OK) {
        if (c->writable.owner != UNCHANGED) {
            cia402_take_over(&d->cia402, d->axis);
        }
        apply_change(d, c);
    }
    return wrong;
}
