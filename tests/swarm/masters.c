/* SPDX-License-Identifier: MIT */
#include <string.h>

#include "firmware/operate/canopen.h"
#include "firmware/settings/crc.h"
#include "swarm.h"

#define NODE        5u
#define NMT_START   1u
#define NMT_STOP    2u
#define NMT_PRE     128u
#define RESET_NODE  129u
#define RESET_COMM  130u
#define CONSUMER    3u /* heartbeats that may be missing */
#define LIVES_AT    0x7Fu
#define AXIS_OFFSET 0x800u
#define REMOTE      0x200u /* of the status word: nobody else commands */
#define AT_OWNER    9u     /* the register; the object is 0x2000 behind */

struct master masters[OWNERS];
static uint32_t node_state;  /* as a listener on the bus takes it to be: CiA 301's numbers */
static bool mapped, watched; /* the PDO of word and target is on; so is the consumer of the master's heartbeat */

void masters_forgotten(void)
{
    node_state = 0u;
    mapped = watched = false;
}

void masters_new(void)
{
    memset(masters, 0, sizeof masters);
    masters_forgotten();
}

/* ---- CAN ---- */

void masters_nmt(uint32_t command)
{
    if (!world_can(0, (const uint8_t[]){(uint8_t)command, NODE}, 2)) {
        return;
    }
    const bool resets = command == RESET_NODE || command == RESET_COMM;
    const bool leaves = node_state == NMT_OPERATIONAL && command == NMT_PRE;
    for (uint32_t axis = 0; axis < AXIS_COUNT; axis++) {
        judge_heard(OWNER_CAN, axis);
    }
    if (command == RESET_NODE) {
        judge_reset_node();
    } else if (command == RESET_COMM || command == NMT_STOP || leaves) {
        judge_lost(OWNER_CAN, command == RESET_COMM ? "NMT reset communication"
                              : command == NMT_STOP ? "NMT stop"
                                                    : "NMT pre-operational");
    }
    mapped = mapped && !resets;
    watched = watched && !resets;
    node_state = command == NMT_START ? NMT_OPERATIONAL : command == NMT_STOP ? NMT_STOPPED : NMT_PRE_OPERATIONAL;
}

static bool sdo(uint8_t command, uint32_t index, uint32_t sub, uint32_t value)
{
    uint8_t data[8] = {command, (uint8_t)index, (uint8_t)(index >> 8), (uint8_t)sub};
    canopen_put(data + 4, value, 4);
    return world_can(0x600u + NODE, data, 8) && (node_state == NMT_OPERATIONAL || node_state == NMT_PRE_OPERATIONAL);
}

/* A step each millisecond: reset, a PDO, heartbeat's consumer, start. */
static void set_up(struct master *m)
{
    switch (m->setup++) {
    case 0:
        if ((m->kind & MASTER_NMT) != 0u) {
            masters_nmt(RESET_NODE);
        }
        break;
    case 3:
        mapped = sdo(0x23, 0x1403, 1, 0x500u + NODE) || mapped;
        break;
    case 5:
        if (m->heartbeat_ms != 0u) {
            watched = sdo(0x23, 0x1016, 1, LIVES_AT << 16 | CONSUMER * m->heartbeat_ms) || watched;
        }
        break;
    case 8:
        if ((m->kind & MASTER_SDO) == 0u) {
            masters_nmt(NMT_START);
        }
        break;
    default:
        break;
    }
}

static void beat(struct master *m)
{
    if (m->heartbeat_ms != 0u && m->setup > 8u && world.now_ms - m->beat_ms >= m->heartbeat_ms) {
        m->beat_ms = world.now_ms;
        if (world_can(0x700u + LIVES_AT, (const uint8_t[]){5}, 1)) {
            judge_beat(watched ? CONSUMER * m->heartbeat_ms : 0u);
        }
    }
}

static bool command_can(const struct master *m)
{
    const uint32_t target = (uint32_t)m->target_rpm, word = m->word, more = m->axis * AXIS_OFFSET;
    if ((m->kind & MASTER_SDO) != 0u) {
        const bool told = (!m->has_target || sdo(0x23, 0x60FF + more, 0, target)) && sdo(0x2B, 0x6040 + more, 0, word);
        (void)sdo(0x40, 0x6041 + more, 0, 0);
        return told;
    }
    uint8_t data[6];
    canopen_put(data, word, 2);
    canopen_put(data + 2, target, 4);
    const bool says = world_can((m->has_target ? 0x500u : 0x200u) + NODE, data, m->has_target ? 6 : 2);
    return says && node_state == NMT_OPERATIONAL && (mapped || !m->has_target);
}

void masters_hear_can(const struct can_frame *f)
{
    struct master *const m = &masters[OWNER_CAN];
    if (f->id == 0x700u + NODE && f->count == 1u) {
        mapped = mapped && f->data[0] != 0u;
        watched = watched && f->data[0] != 0u;
        m->setup = f->data[0] == 0u && m->setup > 8u && (m->kind & MASTER_REJOINS) != 0u ? 1u : m->setup;
        node_state = f->data[0] == 0u ? (uint32_t)NMT_PRE_OPERATIONAL : f->data[0];
    }
    if (f->id == 0x80u + NODE && (f->data[0] | f->data[1]) != 0u) {
        judge_emergency(f->data[3]);
    }
    if (f->id == 0x580u + NODE && f->data[0] == 0x60u &&
        (canopen_get(f->data + 1, 2) & ~AXIS_OFFSET) == 0x2000u + AT_OWNER) {
        judge_take(OWNER_CAN, m->axis);
    }
    const bool pdo = f->id == 0x180u + NODE && (m->kind & MASTER_SDO) == 0u && f->count == 2u;
    const bool answer = f->id == 0x580u + NODE && f->data[0] == 0x4Bu && f->data[1] == 0x41u;
    if (pdo || answer) {
        m->status = (uint16_t)(f->data[pdo ? 0 : 4] | f->data[pdo ? 1 : 5] << 8);
        m->known = true;
    }
}

/* ---- Modbus ---- */

static bool framed(uint8_t *bytes, uint32_t count)
{
    const uint16_t crc = crc16(bytes, count);
    bytes[count] = (uint8_t)crc;
    bytes[count + 1u] = (uint8_t)(crc >> 8);
    return world_modbus(bytes, count + 2u);
}

static bool write_modbus(const struct master *m, uint32_t at, uint32_t value)
{
    uint8_t bytes[8] = {(uint8_t)(1u + m->axis), 6, 0, (uint8_t)at, (uint8_t)(value >> 8), (uint8_t)value};
    return framed(bytes, 6);
}

/* Word, mode pv and target in one request, or the word alone. */
static bool command_modbus(const struct master *m)
{
    const uint32_t target = (uint32_t)m->target_rpm;
    uint8_t all[17] = {(uint8_t)(1u + m->axis), 16, 0, 0, 0, 4, 8, (uint8_t)(m->word >> 8), (uint8_t)m->word, 0, 3};
    for (uint32_t n = 0; n < 4u; n++) {
        all[11u + n] = (uint8_t)(target >> (24u - 8u * n));
    }
    return m->has_target ? framed(all, 15) : write_modbus(m, 0, m->word);
}

static bool ask_modbus(const struct master *m)
{
    uint8_t bytes[8] = {(uint8_t)(1u + m->axis), 3, 0, 0x10, 0, 1};
    return framed(bytes, 6);
}

void masters_hear_modbus(const uint8_t *bytes, uint32_t count)
{
    if (count == 8u && bytes[1] == 6u && bytes[3] == AT_OWNER) {
        judge_take(OWNER_MODBUS, masters[OWNER_MODBUS].axis);
    }
    if (count == 7u && bytes[1] == 3u) {
        masters[OWNER_MODBUS].status = (uint16_t)(bytes[3] << 8 | bytes[4]);
        masters[OWNER_MODBUS].known = true;
    }
}

/* ---- the program of each ---- */

/* The next control word on the way to what it wants (IEC 61800-7-201). */
static uint16_t next_word(const struct master *m)
{
    const uint32_t s = m->status;
    if ((s & 0x4Fu) == 0x08u && m->wants && (m->kind & MASTER_WAITS) != 0u) {
        return 0x0Fu;
    }
    if ((s & 0x4Fu) == 0x08u) {
        return m->wants && (m->kind & MASTER_RESETS) != 0u && m->word != 0x80u ? 0x80u : 0u;
    }
    if (!m->wants) {
        return 0x06u;
    }
    return (s & 0x6Fu) == 0x21u ? 0x07u : (s & 0x6Fu) == 0x23u || (s & 0x6Fu) == 0x27u ? 0x0Fu : 0x06u;
}

/* Each second request by Modbus, and SDOs where nothing is to be said, ask for the status word. */
static void cycle(struct master *m, enum owner line)
{
    const uint16_t before = m->word;
    const bool asks = line == OWNER_MODBUS && (world.now_ms / m->period_ms) % 2u == 0u;
    const bool forced = m->repeats != 0 || m->stale != 0;
    if (m->repeats != 0) {
        m->word = (uint16_t)m->repeats;
    } else if (m->stale == 0 && m->known) {
        m->word = next_word(m);
    }
    const bool says = m->told || m->word != before || forced || (m->kind & MASTER_CYCLIC) != 0u;
    const bool takes =
        !asks && !forced && m->wants && m->known && (m->status & REMOTE) == 0u && (m->kind & MASTER_TAKES) != 0u;
    if (asks || takes || (!says && (m->kind & MASTER_SDO) != 0u)) {
        m->word = before;
        if (line == OWNER_MODBUS
                ? (takes ? write_modbus(m, AT_OWNER, line) : ask_modbus(m))
                : sdo(takes ? 0x2B : 0x40, (takes ? 0x2000u + AT_OWNER : 0x6041u) + m->axis * AXIS_OFFSET, 0, line)) {
            judge_heard(line, m->axis);
        }
    } else if (says && (line == OWNER_MODBUS ? command_modbus(m) : command_can(m))) {
        m->told = false;
        judge_heard(line, m->axis);
        judge_word(line, m->axis, m->word, m->has_target ? &m->target_rpm : NULL);
    } else if (says) {
        m->word = before; /* and once more */
    }
}

static void step(struct master *m, enum owner line)
{
    if (!m->there || m->dead != 0 || m->mute != 0) {
        return;
    }
    if (line == OWNER_CAN) {
        if (m->setup <= 8u) {
            set_up(m);
            return;
        }
        beat(m);
    }
    if (world.now_ms >= m->next_ms) {
        m->next_ms = world.now_ms + m->period_ms;
        cycle(m, line);
    }
}

void masters_step(void)
{
    step(&masters[OWNER_MODBUS], OWNER_MODBUS);
    step(&masters[OWNER_CAN], OWNER_CAN);
}
