/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "chip.h"

#include "random.h"
#include "sysreg.h"

/* The drive makes some 160 accesses a millisecond: several times in a second. */
#define ACCESSES_LEAST 1000u
#define ACCESSES_RANGE 65536u

static struct chip_params chip;
static struct random draws;
static uint64_t accesses_left;

static void draw(void)
{
    accesses_left = ACCESSES_LEAST + random_u64(&draws) % ACCESSES_RANGE;
}

void chip_init(const struct chip_params *params, uint64_t seed)
{
    chip = *params;
    if (chip.wiring == WIRED_AS_ADVISED) {
        chip.wiring = chip.part == CHIP_M2S010 ? WIRED_CORE_RESET_P : WIRED_M2F;
    }
    random_seed_stream(&draws, seed, STREAM_FIC0);
    draw();
}

bool chip_holds_fabric(void)
{
    return chip.wiring == WIRED_HELD || (chip.wiring == WIRED_M2F && sysreg_holds_fabric());
}

bool chip_fabric_hangs(void)
{
    return chip.wiring == WIRED_NO_CLOCK;
}

bool chip_traffic_puts_back(void)
{
    if (chip.part != CHIP_M2S010 || --accesses_left > 0) {
        return false;
    }
    draw();
    return true;
}
