/* SPDX-License-Identifier: MIT */
/*
 * Bytes and silences on the drive's line, one by one. The first byte of the input says whether the drive is in operation; then
 * come parts: what precedes (SILENCE, LOSS, WAIT, PATIENCE), whether the check sum is put behind, and how many bytes follow.
 * Something is changed or answered only at the last byte of a frame with its check sum to this drive or to all; the answer is
 * that of the function, and what is refused changes nothing but by a word that stops; behind a pause a right request is always
 * answered.
 */
#include "firmware/operate/modbus.h"
#include "drive.h"
#include "tests/unit/host/bus.h"

enum { SILENCE = 1, LOSS = 2, WAIT = 4, PATIENCE = 8, CHECK_SUM = 16 };
#define FRAME_MOST 256u
#define FAR_MS     60

static struct modbus modbus;
static struct rs485 rs485;
static uint8_t heard[8192];
static size_t heards;

/* Modbus over Serial Line V1.02, 6.2.2: x^16 + x^15 + x^2 + 1, reflected, from 0xFFFF; 0 over a frame with its check sum. */
static uint16_t remainder_of(const uint8_t *bytes, size_t count)
{
    uint32_t value = 0xFFFF;
    for (size_t n = 0; n < count; n++) {
        value ^= bytes[n];
        for (int bit = 0; bit < 8; bit++) {
            value = value >> 1 ^ ((value & 1u) != 0u ? 0xA001u : 0u);
        }
    }
    return (uint16_t)value;
}

static uint32_t word(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] << 8 | bytes[1];
}

/* Of the functions that there are; 0: of no such request. (MODBUS Application Protocol V1.1b3, chapter 6) */
static size_t length_of_request(const uint8_t *b, size_t count)
{
    switch (count > 1u ? b[1] : 0) {
    case 0x03:
    case 0x04:
    case 0x06:
        return 8;
    case 0x10:
        return count > 6u ? 9u + b[6] : 0u;
    case 0x16:
        return 10;
    case 0x17:
        return count > 10u ? 13u + b[10] : 0u;
    case 0x2B:
        return 7;
    default:
        return 0;
    }
}

/* Whether an answer may be one to this request, which has as many bytes as its function says. */
static bool fits(const uint8_t *asked, const uint8_t *said, size_t count, bool changed)
{
    if (count < 5u || said[0] != asked[0] || (said[1] | 0x80u) != (asked[1] | 0x80u) ||
        remainder_of(said, count) != 0u) {
        return false;
    }
    if (said[1] >= 0x80u) {
        return count == 5u && said[2] >= 1u && said[2] <= 4u && !changed;
    }
    switch (asked[1]) {
    case 0x03:
    case 0x04:
        return said[2] == 2u * word(&asked[4]) && count == 5u + said[2] && !changed;
    case 0x17:
        return said[2] == 2u * word(&asked[4]) && count == 5u + said[2];
    case 0x06:
    case 0x10:
        return count == 8u && memcmp(said, asked, 6) == 0;
    case 0x16:
        return count == 10u && memcmp(said, asked, 8) == 0;
    default:
        return asked[1] == 0x2Bu && said[2] == 14u && said[3] == asked[3] && !changed;
    }
}

struct all {
    struct told told;
    struct cia402_setpoints setpoints;
};

static struct all all(void)
{
    struct all a;
    memset(&a, 0, sizeof a);
    a.told = told();
    memcpy(&a.setpoints, &modbus.drives[0].cia402.setpoints, sizeof a.setpoints);
    return a;
}

/* A frame that ends in the last byte heard, and explains what has happened. */
static bool asked_for(int32_t address, bool changed)
{
    for (size_t count = 4; count <= heards && count <= FRAME_MOST; count++) {
        const uint8_t *const frame = &heard[heards - count];
        const bool to_all = frame[0] == 0u;
        if ((to_all || frame[0] == address) && remainder_of(frame, count) == 0u &&
            (to_all ? host_bus_sent_bytes == 0u : fits(frame, host_bus_sent, host_bus_sent_bytes, changed))) {
            return address != 0;
        }
    }
    return false;
}

/* A control word that stops is obeyed whatever else is refused with it; settings, mode and targets stay. */
static bool only_stops(const struct all *before, const struct all *after)
{
    struct all expected = *after;
    memcpy(&expected.told.params, &before->told.params, sizeof expected.told.params);
    memcpy(expected.told.choice, before->told.choice, sizeof expected.told.choice);
    expected.told.mode = before->told.mode;
    memcpy(&expected.setpoints, &before->setpoints, sizeof expected.setpoints);
    expected.setpoints.control_word = after->setpoints.control_word;
    return cia402_stops(after->setpoints.control_word) && memcmp(&expected, after, sizeof expected) == 0;
}

/* Whether it has answered. */
static bool turn(void)
{
    const struct all before = all();
    const int32_t address = axis.params.modbus_address;
    host_bus_sent_bytes = 0;
    modbus_poll(&modbus);
    take_turn();
    const struct all after = all();
    const bool changed = memcmp(&before, &after, sizeof before) != 0, answered = host_bus_sent_bytes > 0u;
    const bool stopped = answered && host_bus_sent[1] >= 0x80u && only_stops(&before, &after);
    HOLDS((!changed && !answered) || asked_for(address, changed && !stopped),
          "a request has asked for what is done and said");
    if (changed || answered) {
        see(changed ? "written" : host_bus_sent[1] >= 0x80u ? "refused" : "read");
        check_ranges();
        for (int n = 0; n < 3; n++) { /* its last echo, and what follows from it */
            rs485.driving = false;
            modbus_poll(&modbus);
            take_turn();
        }
    }
    return answered;
}

static bool hear(uint8_t byte, uint32_t marks)
{
    if (heards == sizeof heard) { /* no frame reaches back so far */
        heards = FRAME_MOST;
        memcpy(heard, heard + sizeof heard - FRAME_MOST, FRAME_MOST);
    }
    heard[heards++] = byte;
    host_bus_heard[0] = byte;
    host_bus_heard_bytes = 1;
    host_bus_heard_taken = 0;
    host_bus_marks = marks;
    return turn();
}

static void pass(int ms)
{
    for (int n = 0; n < ms; n++) {
        axis.time_ms++;
        (void)turn();
    }
}

static void take_part(struct input *in)
{
    const uint8_t before = next_byte(in);
    uint8_t frame[FRAME_MOST + 2u];
    size_t count = 0;
    for (size_t more = next_byte(in); more > 0u && in->at < in->end; more--) {
        frame[count++] = next_byte(in);
    }
    if ((before & CHECK_SUM) != 0u) {
        const uint16_t sum = remainder_of(frame, count);
        frame[count++] = (uint8_t)sum;
        frame[count++] = (uint8_t)(sum >> 8);
    }
    pass((before & PATIENCE) != 0u ? FAR_MS : (before & WAIT) != 0u ? 3 : 0);
    const bool right = (before & PATIENCE) != 0u && (before & LOSS) == 0u && count > 3u && frame[0] != 0u &&
                       frame[0] == axis.params.modbus_address && remainder_of(frame, count) == 0u &&
                       count == length_of_request(frame, count);
    bool answered = false;
    for (size_t n = 0; n < count; n++) {
        const uint32_t silence = (before & SILENCE) != 0u ? host_bus_silence_mark : 0u;
        const uint32_t loss = (before & LOSS) != 0u ? host_bus_loss_mark : 0u;
        answered = hear(frame[n], n == 0u ? silence | loss : 0u);
    }
    HOLDS(!right || answered, "a right request behind a pause is answered");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t count)
{
    static const uint8_t good[] = {1, 3, 0, 0x90, 0, 1, 0x84, 0x27}; /* map_version */
    struct input in = {data, data + count};
    begin_drive((next_byte(&in) & 1u) != 0u);
    axis.loop.vbus_q15 = axis.tuning.v_min_q15 + 100;
    host_bus_heard_bytes = host_bus_heard_taken = host_bus_marks = 0;
    heards = 0;
    modbus_start(&modbus, &rs485, &axis, &slots);
    while (in.at < in.end) {
        take_part(&in);
    }
    pass(FAR_MS);
    axis.params.modbus_address = 1;
    pass(1);
    for (size_t n = 0; n < sizeof good; n++) {
        HOLDS(hear(good[n], 0u) == (n == sizeof good - 1u), "behind all of it a good request is answered at its end");
    }
    HOLDS(host_bus_sent_bytes == 7u && word(&host_bus_sent[3]) == 1u, "and rightly");
    return 0;
}
