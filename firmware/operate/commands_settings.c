/* SPDX-License-Identifier: MIT */
/* Parameters, stored settings, and reactions to faults. */
#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"

/* ---- parameters ---- */

/* Name endings; a longer ending comes before any that it ends with. */
static const struct {
    const char *end, *unit;
} param_units[] = {
    {"_rpm_s", "rpm/s"}, {"_rpm", "rpm"},     {"_ms", "ms"},       {"_s", "s"},           {"_ma", "mA"},
    {"_mv", "mV"},       {"_mohm", "mohm"},   {"_uh", "uH"},       {"_uwb", "uWb"},       {"_uf", "uF"},
    {"_hz", "Hz"},       {"_w", "W"},         {"_gmm2", "g mm2"},  {"_pct", "%"},         {"_pm", "per mille"},
    {"_c", "degC"},      {"_turns", "turns"}, {"_mturn", "mturn"}, {"_counts", "counts"}, {"_baud", "baud"},
    {"_unm", "uNm"},     {"_cdeg", "cdeg"},
};

/* True if `end` is a proper suffix of the name. */
static bool ends_with(const char *name, const char *end)
{
    while (*name++ != '\0') {
        if (text_equal(name, end)) {
            return true;
        }
    }
    return false;
}

const char *param_unit(const struct param_info *info)
{
    for (size_t i = 0; i < sizeof param_units / sizeof param_units[0]; i++) {
        if (ends_with(info->name, param_units[i].end)) {
            return param_units[i].unit;
        }
    }
    return "";
}

static void put_param(struct session *s, const struct param_info *info)
{
    const char *const unit = param_unit(info);
    text_print(&s->out, "%s = %d%s%s  (%d...%d)\n", info->name, param_get(&s->axis->params, info),
               *unit != '\0' ? " " : "", unit, info->min, info->max);
}

static void run_get(struct session *s, const struct arguments *a)
{
    if (a->value[1] >= 0) {
        put_param(s, &param_table[a->value[1]]);
        return;
    }
    for (size_t i = 0; i < param_count; i++) {
        const struct param_info *const info = &param_table[i];
        if (a->value[1] == PARAMS_ALL) {
            put_param(s, info);
        } else if (param_get(&s->axis->params, info) != info->initial) {
            text_print(&s->out, "set %s %d\n", info->name, param_get(&s->axis->params, info));
        }
    }
}

static void run_set(struct session *s, const struct arguments *a)
{
    const struct param_info *const info = &param_table[a->value[1]];
    const int32_t value = a->value[2];
    if (value < info->min || value > info->max) {
        const char *const unit = param_unit(info);
        text_print(&s->out, "error: %s must be %d...%d%s%s\n", info->name, info->min, info->max,
                   *unit != '\0' ? " " : "", unit);
    } else if (!drive_is_off(s->axis)) {
        answer(s, outcome_of(ERROR_DRIVE_IS_ON));
    } else {
        const struct outcome outcome = features_allow(info, value);
        if (outcome.error == ERROR_NONE) {
            param_set(&s->axis->params, info, value);
        }
        answer(s, outcome);
    }
}

/* ---- stored settings ---- */

static void put_save(struct text *t, uint32_t slot, uint32_t number)
{
    text_print(t, "slot %c, save %u", (char)('A' + slot), number);
}

void store_print_damage(struct text *t, const struct slots_view *v)
{
    for (uint32_t slot = 0; slot < SLOTS; slot++) {
        if (v->state[slot] == SLOT_DAMAGED) {
            text_print(t, "warning: slot %c is damaged, or its save was cut short%s\n", (char)('A' + slot),
                       v->any ? "; these may be the settings before it" : "");
        }
    }
}

static void put_refusal(struct text *t, const struct nvm_report *k)
{
    text_print(t, "error: settings refused, nothing has changed: %s%s", k->about, k->about[0] != '\0' ? ": " : "");
    answer_with_values(t, message_of_error(k->problem.error), k->problem.value, 0);
}

static void put_differences(struct text *t, const struct nvm_report *k)
{
    if (k->unknown > 0u) {
        text_print(t, "%d stored records are unknown to this firmware and were passed over, the first is %s\n",
                   (int32_t)k->unknown, k->first_unknown);
    }
    if (k->missing > 0u) {
        text_print(t, "%d parameters are not stored and have their initial values\n", (int32_t)k->missing);
    }
}

void store_print_loaded(struct text *t, const struct nvm_report *k)
{
    text_put(t, "settings: ");
    if (k->state == NVM_NOTHING) {
        text_put(t, "none stored, initial values\n");
    } else {
        put_save(t, k->view.newest, k->view.number[k->view.newest]);
        text_put(t, k->state == NVM_LOADED ? ", loaded\n" : "\n");
    }
    store_print_damage(t, &k->view);
    if (k->state == NVM_REFUSED) {
        put_refusal(t, k);
    } else if (k->state == NVM_LOADED) {
        put_differences(t, k);
    }
}

/* Saves alternate between the slots: every second one has written each page of this slot. */
void store_print_saved(struct text *t, const struct saved *s)
{
    put_save(t, s->slot, s->number);
    text_print(t, "; writes of its pages so far: about %u\n", s->number / 2u + s->number % 2u);
    if (s->worn) {
        text_put(t, "warning: eNVM: a page has been written more often than it is made for\n");
    }
    if (s->cogging_dropped) {
        text_put(t,
                 "warning: the cogging map is not stored: the encoder's index, from which it counts, was not seen\n");
    }
}

static void run_save(struct session *s, const struct arguments *a)
{
    (void)a;
    struct saved report;
    const struct outcome outcome = drive_save(s->axis, &s->slots[session_axis(s)], &report);
    answer(s, outcome);
    if (outcome.error == ERROR_NONE) {
        store_print_saved(&s->out, &report);
    }
}

static void run_load(struct session *s, const struct arguments *a)
{
    (void)a;
    struct nvm_report loaded;
    const struct outcome outcome = drive_load(s->axis, &s->slots[session_axis(s)], &loaded);
    if (loaded.state == NVM_NOTHING) {
        answer(s, outcome);
        store_print_damage(&s->out, &loaded.view);
    } else {
        store_print_loaded(&s->out, &loaded);
    }
}

/* clang-format off */
const struct command commands_params[] = {
    {"get", " PARAM", "a parameter and its range; or 'all'; or '--changed': lines that set what differs from the defaults",
     {ARGUMENT_PARAM_GROUP}, .run = run_get},
    {"set", " PARAM VALUE", "change a parameter while off", {ARGUMENT_PARAM, ARGUMENT_WHOLE}, .run = run_set},
};

const struct command commands_settings[] = {
    {"save", "", "keep parameters, reactions, index and cogging over power-off; while off and at rest",
     .run = run_save},
    {"load", "", "what was saved last, as at the start; while off", .run = run_load},
};

const struct command commands_defaults[] = {
    {"defaults", "", "factory defaults for parameters and reactions, while off; saved settings stay",
     .request = drive_defaults},
};
/* clang-format on */

/* ---- reactions to faults ---- */

/* For a fault with a choice: the present one, and the options. */
static void put_reaction(struct session *s, enum fault cause)
{
    text_print(&s->out, "%s: %s  (", message_of_fault(cause), message_of_reaction(s->axis->reactions.choice[cause]));
    const char *before = "";
    for (uint32_t choice = 0; choice < REACTION_COUNT; choice++) {
        if (((fault_class(cause)->allowed >> choice) & 1u) != 0u) {
            text_print(&s->out, "%s%s", before, message_of_reaction((enum reaction)choice));
            before = ", ";
        }
    }
    text_put(&s->out, ")\n");
}

static void run_reactions(struct session *s, const struct arguments *a)
{
    (void)a;
    for (uint32_t cause = FAULT_NONE + 1u; cause < FAULT_COUNT; cause++) {
        if (fault_class((enum fault)cause)->allowed != 1u << REACTION_OFF) {
            put_reaction(s, (enum fault)cause);
        }
    }
}

static void run_reaction(struct session *s, const struct arguments *a)
{
    answer(s, drive_choose_reaction(s->axis, (enum fault)a->value[1], (enum reaction)a->value[2]));
}

/* clang-format off */
const struct command commands_reaction[] = {
    {"reaction", "", "faults whose reaction can be chosen, and the present choice", .run = run_reactions},
    {"reaction", " FAULT off|stop|warn|carry", "choose it, while off",
     {ARGUMENT_FAULT, ARGUMENT_CHOICE}, .run = run_reaction},
};
/* clang-format on */
