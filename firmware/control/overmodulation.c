/* SPDX-License-Identifier: MIT */
#include "firmware/control/overmodulation.h"

/* tests/unit/test_overmodulation.py recalculates them, by the Fourier integral of clipped duties. */
const uint16_t overmodulation_gain_q12[] = {
    4096, 4098, 4101, 4106, 4113, 4121, 4130, 4142, 4155, 4170, 4189, 4210, 4235, 4265,  4302,  4349,  4414,
    4524, 4665, 4824, 5003, 5206, 5441, 5715, 6040, 6435, 6926, 7561, 8425, 9695, 11834, 12904, 12868,
};
