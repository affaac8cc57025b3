/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "probes.h"

#include "qemu_api.h"

static double value_of(const struct probe *p)
{
    uint8_t bytes[4] = {0};
    uint32_t word = 0;
    vm_read_memory(p->address, bytes, p->bytes);
    for (unsigned n = 0; n < p->bytes; n++) {
        word |= (uint32_t)bytes[n] << 8 * n;
    }
    if (!p->is_signed) {
        return word * p->scale;
    }
    unsigned unused_bits = 32 - 8 * p->bytes;
    return (double)((int32_t)(word << unused_bits) >> unused_bits) * p->scale;
}

void probes_read(const struct probe *probes, size_t count, double *values)
{
    for (size_t n = 0; n < count; n++) {
        values[n] = value_of(&probes[n]);
    }
}
