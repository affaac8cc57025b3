/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Which device of the family, and how its design has wired the fabric's reset: what decides whether the fabric answers
 * (docs/silicon.md, C1).
 *
 * On M2S005 and M2S010 traffic on FIC_0 can put what firmware has changed in some system registers back. When is not known:
 * here after a number of accesses that the seed draws, again and again. */
#ifndef TWIN_CHIP_H
#define TWIN_CHIP_H

#include <stdbool.h>
#include <stdint.h>

enum chip_part { CHIP_M2S010, CHIP_M2S025 };

enum chip_wiring {
    WIRED_AS_ADVISED,   /* by docs/fabric.md: CORE_RESET_P on an M2S010, M2F allowed on an M2S025 */
    WIRED_CORE_RESET_P, /* rst_n is CoreResetP's MSS_HPMS_READY: low in every reset of the MSS, and with it */
    WIRED_M2F,          /* rst_n is MSS_RESET_N_M2F: low as long as bit 16 of SOFT_RESET_CR is set */
    WIRED_HELD,         /* a mistake in the design: never released */
    WIRED_NO_CLOCK      /* likewise: an access never ends */
};

struct chip_params {
    enum chip_part part;
    enum chip_wiring wiring;
};

void chip_init(const struct chip_params *params, uint64_t seed);
bool chip_holds_fabric(void);
bool chip_fabric_hangs(void);
/* An access to FIC_0 begins: whether it puts back what firmware has changed. */
bool chip_traffic_puts_back(void);

#endif
