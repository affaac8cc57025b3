/* SPDX-License-Identifier: MIT */
#include "firmware/drive/nvm.h"

#include <stddef.h>

#include "firmware/drive/drive.h"
#include "firmware/drive/requests.h"
#include "firmware/source/rotor.h"
#include "lib/trig.h"

const char *nvm_name_of_fault(enum fault cause)
{
    static const char *const names[FAULT_COUNT] = {
        [FAULT_ENCODER] = "encoder",
        [FAULT_OVERSPEED] = "over-speed",
        [FAULT_STALL] = "stall",
        [FAULT_ENCODER_SLIP] = "encoder_slip",
        [FAULT_ENCODER_DEAD] = "encoder_dead",
        [FAULT_ENCODER_COUNTS] = "encoder_counts",
        [FAULT_SPEED_DEVIATION] = "speed_deviation",
        [FAULT_OVERTEMPERATURE] = "over-temperature",
        [FAULT_INVERTER_OVERLOAD] = "inverter_overload",
        [FAULT_VOLTAGE_LIMIT] = "voltage_limit",
        [FAULT_LIMIT_CYCLE] = "limit_cycle",
        [FAULT_OSCILLATION] = "oscillation",
        [FAULT_FOLLOWING_ERROR] = "following_error",
        [FAULT_HOMING] = "homing",
        [FAULT_HALL_INVALID] = "hall_state",
        [FAULT_HALL_SEQUENCE] = "hall_sequence",
        [FAULT_COMMAND_TIMEOUT] = "command_time-out",
        [FAULT_MASTER_LOST] = "master_lost",
        [FAULT_THREAD_STOPPED] = "thread_stopped",
    };
    return cause < FAULT_COUNT ? names[cause] : NULL;
}

struct outcome drive_defaults(struct axis *a)
{
    if (!drive_is_off(a)) {
        return outcome_of(ERROR_DRIVE_IS_ON);
    }
    params_init(&a->params);
    a->nvm_afresh = true;
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        a->reactions.choice[cause] = fault_class((enum fault)cause)->initial;
    }
    return OUTCOME_OK;
}

/* a cos k(x + f) + b sin k(x + f) as a function of x: both turn by k f. */
void nvm_rotate_cogging(struct cogging_map *m, uint32_t from_q32)
{
    for (int32_t n = 0; n < m->count; n++) {
        struct cogging_harmonic *const h = &m->harmonics[n];
        const cossin_t turn = cossin_q15(h->order * from_q32);
        const int64_t a = h->cos_q23;
        const int64_t b = h->sin_q23;
        h->cos_q23 = (int32_t)((a * turn.cos + b * turn.sin + (1 << 14)) >> 15);
        h->sin_q23 = (int32_t)((b * turn.cos - a * turn.sin + (1 << 14)) >> 15);
    }
}

void drive_restore_cogging(struct axis *a)
{
    struct nvm_cogging *const k = &a->nvm_cogging;
    if (!k->pending || !rotor_has_encoder(a) ||
        (encoder_status(&a->fabric->encoder) & ENCODER_STATUS_INDEX_SEEN) == 0u) {
        return;
    }
    const uint32_t held = request_hold();
    nvm_rotate_cogging(&k->map, 0u - encoder_index(&a->fabric->encoder) * a->tuning.turn_scale_q32);
    cogging_set_fade(&k->map, a->params.speed_bw_hz);
    a->motion.cogging = k->map;
    k->pending = false;
    request_release(held);
}
