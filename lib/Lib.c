/* SPDX-License-Identifier: MIT */
/*
 * The functions of Lib.h in portable C: each reads its whole input, calls one kernel and writes, so input and output may
 * overlap. For the Cortex-M3 they are in Lib_thumb2.S.
 */
#define LIB_DEFINES /* by their plain names */
#include "lib/Lib.h"

#include "lib/thumb2.h"
#include "lib/transform_s32.h"

#ifndef LIB_THUMB2

void Clarke_Lib_Do(const clarkeinput_type *threephasecurrent_ptr, clarkeoutput_type *twophaserefcurrent_ptr)
{
    const int32_t ia = threephasecurrent_ptr->ia;
    const int32_t ib = threephasecurrent_ptr->ib;

    twophaserefcurrent_ptr->ialpha = ia;
    twophaserefcurrent_ptr->ibeta = s32_clarke_beta(ia, ib);
}

void InvClarke_Lib_Do(const invclarkeinput_type *invclarkeinput_ptr, invclarkeoutput_type *invclarkeoutput_ptr)
{
    const int32_t valpha = invclarkeinput_ptr->valpha;
    const int32_t vbeta = invclarkeinput_ptr->vbeta;
    const s32_pair_t bc = s32_invclarke_bc(valpha, vbeta);

    invclarkeoutput_ptr->va = valpha;
    invclarkeoutput_ptr->vb = bc.x;
    invclarkeoutput_ptr->vc = bc.y;
}

void Park_Lib_Do(const parkinput_type *parkinput_ptr, parkoutput_type *parkoutput_ptr)
{
    const parkinput_type in = *parkinput_ptr;
    const s32_pair_t dq = s32_park(in.ialpha, in.ibeta, in.cos, in.sin, LIB_TRIG_FRAC);

    parkoutput_ptr->id = dq.x;
    parkoutput_ptr->iq = dq.y;
}
LIB_NAMED_BY_FRAC(Park_Lib_Do)

void InvPark_Lib_Do(const invparkinput_type *invparkinput_ptr, invparkoutput_type *invparkoutput_ptr)
{
    const invparkinput_type in = *invparkinput_ptr;
    const s32_pair_t alphabeta = s32_invpark(in.vd, in.vq, in.cos, in.sin, LIB_TRIG_FRAC);

    invparkoutput_ptr->valpha = alphabeta.x;
    invparkoutput_ptr->vbeta = alphabeta.y;
}
LIB_NAMED_BY_FRAC(InvPark_Lib_Do)

#endif
