/* SPDX-License-Identifier: MIT */
/*
 * Records as another firmware may have stored them. The first byte of the input says whether they stand under a head that is
 * right (RIGHT), or are the slot, head and all, beside one that is whole. What is loaded is what a second reading of
 * docs/settings.md finds, in its ranges, and can be saved and loaded again; what is refused changes nothing.
 */
#include "drive.h"
#include "firmware/settings/slots.h"

#define RIGHT 1u

static int32_t wanted[128];

static void store(const uint8_t *data, size_t count)
{
    struct slots_view view = {.any = false};
    struct slot_writer w;
    uint8_t *const memory = (uint8_t *)(uintptr_t)slots.memory;
    slot_begin(&w, &slots, &view);
    for (size_t n = 0; n < count; n++) {
        if (slot_put(&w, data[n])) {
            memcpy(memory + w.page_offset - slots.offset_bytes, w.page, sizeof w.page);
            slot_next(&w);
        }
    }
    if (slot_pad(&w)) {
        memcpy(memory + w.page_offset - slots.offset_bytes, w.page, sizeof w.page);
        slot_next(&w);
    }
    slot_header(&w);
    memcpy(memory, w.page, sizeof w.page);
}

/* By kind, name and value: the parameters that a reader finds, up to the end; false: to a length that does not fit. */
static bool read_again(const uint8_t *r, size_t count)
{
    for (size_t n = 0; n < param_count; n++) {
        wanted[n] = param_table[n].initial;
    }
    while (count >= 4u && r[0] != 0u) {
        const size_t name = r[1], value = r[2] + 256u * r[3];
        if (name > 31u || 4u + name + value > count) {
            return false;
        }
        for (size_t n = 0; r[0] == 1u && value == 4u && n < param_count; n++) {
            const uint8_t *const v = r + 4u + name;
            if (strnlen((const char *)r + 4u, name) == strlen(param_table[n].name) &&
                memcmp(r + 4u, param_table[n].name, strlen(param_table[n].name)) == 0) {
                wanted[n] = (int32_t)(v[0] | v[1] << 8 | v[2] << 16 | (uint32_t)v[3] << 24);
            }
        }
        r += 4u + name + value;
        count -= 4u + name + value;
    }
    return true;
}

static void judge_loaded(const struct nvm_report *k)
{
    const struct params loaded = axis.params;
    struct nvm_report again;
    struct saved saved;
    HOLDS(k->problem.error == ERROR_NONE, "what is loaded has no problem");
    for (size_t n = 0; n < param_count; n++) {
        HOLDS(param_get(&axis.params, &param_table[n]) == wanted[n], "%s is what is stored", param_table[n].name);
    }
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        HOLDS((fault_class((enum fault)cause)->allowed >> axis.reactions.choice[cause] & 1u) != 0u,
              "a reaction is allowed");
    }
    HOLDS(axis.nvm_cogging.map.count >= 0 && axis.nvm_cogging.map.count <= (int32_t)COGGING_HARMONICS, "cogging fits");
    if (drive_save(&axis, &slots, &saved).error == ERROR_NONE) {
        see("saved");
        HOLDS(drive_load(&axis, &slots, &again).error == ERROR_NONE, "what is saved can be loaded");
        HOLDS(memcmp(&loaded, &axis.params, sizeof loaded) == 0, "it is the same");
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t count)
{
    struct input in = {data, data + count};
    const bool right = (next_byte(&in) & RIGHT) != 0u;
    begin_drive(false);
    const size_t room = slots.slot_bytes - (right ? ENVM_PAGE_BYTES : 0u), all = (size_t)(in.end - in.at);
    const size_t left = all < room ? all : room;
    memset((uint8_t *)(uintptr_t)slots.memory, 0, SLOTS * slots.slot_bytes);
    store(right ? in.at : NULL, right ? left : 0u);
    if (!right) {
        memcpy((uint8_t *)(uintptr_t)slots.memory + slots.slot_bytes, in.at, left);
    }
    static struct axis before;
    memcpy(&before, &axis, sizeof before);
    struct nvm_report k;
    drive_load_at_boot(&axis, &slots, &k);
    see(k.state == NVM_LOADED ? "loaded" : k.state == NVM_REFUSED ? "refused" : "nothing");
    HOLDS(strnlen(k.about, 32) < 32 && strnlen(k.first_unknown, 32) < 32, "a name has an end");
    HOLDS(k.view.state[0] == SLOT_VALID, "a whole slot is found beside one that is not");
    check_ranges();
    const uint32_t newest = k.view.newest, pages = (uint32_t)(left + ENVM_PAGE_BYTES - 1u) / ENVM_PAGE_BYTES;
    const bool fits =
        read_again(slots_records(&slots, newest), right ? pages * ENVM_PAGE_BYTES : k.view.records_bytes[newest]);
    HOLDS(fits || k.state == NVM_REFUSED, "what has a length that does not fit is refused");
    if (k.state == NVM_LOADED) {
        judge_loaded(&k);
    } else {
        HOLDS(memcmp(&before, &axis, sizeof before) == 0, "what is refused changes nothing");
    }
    return 0;
}
