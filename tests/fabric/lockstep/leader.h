/* SPDX-License-Identifier: MIT */
/* Axis 0 beside an axis that follows its carrier: the twin's model of it, started, stopped and set anew at random. What the RTL
 * that follows is shown of it is worked out here from its registers, as pwm_carrier.v does, and not by the model's forecast. */
#ifndef TESTS_FABRIC_LEADER_H
#define TESTS_FABRIC_LEADER_H

#include "random.h"

extern "C" {
#include "fabric_model.h"
}

class leader
{
  public:
    explicit leader(uint32_t period);
    /* sync_in: this axis is at its valley in the next clock. */
    bool syncs() const;
    /* From clock n to n + 1, and what is written then. */
    void clock(random_source &r, int64_t n);
    /* As it was some clocks ago: the twin brings axis 0 to the present when that matters to somebody. */
    const fabric_model *model() const
    {
        return &shown;
    }

  private:
    fabric_model axis, shown;
    uint32_t longest;
    void write(uint32_t offset, uint32_t value, int64_t n);
};

#endif
