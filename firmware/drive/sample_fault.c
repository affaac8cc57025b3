/* SPDX-License-Identifier: MIT */
/* The current loop's interrupt ends here when a sample has a fault: the cause of what it shows. ISR, cold. */
#include "firmware/axis/axis.h"
#include "firmware/drive/drive.h"
#include "firmware/drive/failover.h"
#include "firmware/source/rotor.h"

/* Switches that gave a wrong angle report it themselves later; they are named only if the drive carries on without them. */
static enum fault blamed_for_overcurrent(const struct axis *a)
{
    if (rotor_has_encoder(a)) {
        return encoder_watch_blame(a, FAULT_OVERCURRENT);
    }
    return rotor_has_hall(a) ? hall_watch_blame(a, FAULT_OVERCURRENT) : FAULT_OVERCURRENT;
}

/* Gates first: an over-current may result from something that has just begun, but none of its causes leaves them on. */
static void raise_overcurrent(struct axis *a)
{
    int32_t phase;
    gate_disable(&a->fabric->gate);
    if (phase_watch_suspects(a, &phase)) {
        fault_raise_with(a, FAULT_OPEN_PHASE, phase, 0);
        return;
    }
    if (failover_absorbs_trip(a)) {
        return;
    }
    const enum fault cause = blamed_for_overcurrent(a);
    if (cause == FAULT_OVERCURRENT || !failover_from_sample(a, cause)) {
        fault_raise(a, rotor_has_encoder(a) ? cause : FAULT_OVERCURRENT);
    }
}

static void raise_encoder(struct axis *a)
{
    if (!failover_from_sample(a, FAULT_ENCODER)) {
        fault_raise(a, FAULT_ENCODER);
    }
}

/*
 * First cause: hardware latches before conclusions from a sample, and the cause of an over-current before the over-current.
 * Rare enough to branch.
 */
void drive_sample_fault(struct axis *a)
{
    const uint32_t gate = gate_status(&a->fabric->gate);
    const enum fault sampled = fault_from_adc(adc_status(&a->fabric->adc));
    if ((gate & GATE_STATUS_LATCHES) != 0u) {
        fault_raise(a, fault_from_gate(gate));
    } else if ((gate & GATE_STATUS_ENCODER) != 0u && rotor_has_encoder(a) && a->failover.pending == FAULT_NONE) {
        raise_encoder(a);
    } else if (sampled == FAULT_OVERCURRENT) {
        raise_overcurrent(a);
    } else if (sampled != FAULT_NONE) {
        fault_raise(a, sampled);
    } else if ((gate & GATE_STATUS_OVERRUN) != 0u) {
        fault_raise(a, FAULT_LOOP_OVERRUN);
    }
}
