// SPDX-License-Identifier: MIT
#include "leader.h"

namespace
{
enum { CONTROL = 0x00, PERIOD = 0x08, PHASE = 0x18 };
enum { RUN = 1, ANY_CONVERSION = 1000 };
} // namespace

leader::leader(uint32_t period) : longest(period + 3)
{
    fabric_model_init(&axis, ANY_CONVERSION, false);
    axis.fabric.ops->reset(&axis.fabric, 0);
    write(PERIOD, period, 0);
    shown = axis;
}

bool leader::syncs() const
{
    const pwm &p = axis.pwm;
    return p.running && p.rising && p.count + 1 >= p.period;
}

void leader::write(uint32_t offset, uint32_t value, int64_t n)
{
    axis.fabric.ops->write(&axis.fabric, offset, value, n * SIM_PS_PER_FABRIC_CLOCK);
}

void leader::clock(random_source &r, int64_t n)
{
    sim_ps at = (n + 1) * SIM_PS_PER_FABRIC_CLOCK;
    const fabric_ops *ops = axis.fabric.ops;
    while (ops->next_event(&axis.fabric) <= at) {
        (void)ops->take_event(&axis.fabric);
    }
    ops->catch_up(&axis.fabric, at);
    if (r.one_in(syncs() ? 10 : 10 * longest)) { /* a carrier that is stopped before its valley still leads there */
        write(CONTROL, r.below(2) * RUN, n + 1);
    } else if (!axis.pwm.running && r.one_in(5)) {
        write(PERIOD, r.below(longest), n + 1);
        write(PHASE, r.below(longest) | r.below(2) << 16, n + 1);
        write(CONTROL, RUN, n + 1);
    } else if (!r.one_in(1000)) {
        return;
    }
    shown = axis;
}
