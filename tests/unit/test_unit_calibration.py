# SPDX-License-Identifier: MIT
"""The sensors' zero: 128 samples, mean to nearest, refused beyond 5 % of the range with the old values kept."""
import random

import pytest

NOMINAL, LIMIT = 32768, 102 * 16


def calibrate(c, samples, offsets=(NOMINAL,) * 3):
    adc, calibration = c.adc_regs(), c.calibration()
    adc.OFFSET_A, adc.OFFSET_B, adc.OFFSET_C = offsets
    calibration.count = 99  # a start forgets what was before
    for phase in range(3):
        calibration.sum_q15[phase] = 12345
    c.calibration_start(calibration)
    for count, sample in enumerate(samples, 1):
        adc.IA, adc.IB, adc.IC = sample
        result = c.calibration_step(calibration, adc)
        if result != c.CALIBRATION_RUNNING:
            return result, count, (adc.OFFSET_A, adc.OFFSET_B, adc.OFFSET_C)
    raise AssertionError("it never ends")


def test_the_mean_of_128_samples_to_nearest(c):
    draw = random.Random(1)
    for _ in range(50):
        samples = [[draw.randint(-200, 200) for _ in range(3)] for _ in range(128)]
        result, count, offsets = calibrate(c, samples + [[9999] * 3] * 9)
        assert (result, count) == (c.CALIBRATION_DONE, 128)
        assert offsets == tuple(NOMINAL + (sum(s[k] for s in samples) * 2 + 128) // 256 for k in range(3))


def test_it_starts_from_the_offsets_in_effect(c):
    """The samples come with them subtracted."""
    assert calibrate(c, [(5, -5, 0)] * 128, (NOMINAL + 100, NOMINAL - 100, NOMINAL))[2] == (
        NOMINAL + 105, NOMINAL - 105, NOMINAL)


@pytest.mark.parametrize("phase", range(3))
@pytest.mark.parametrize("sign", (1, -1))
def test_a_zero_out_of_range_keeps_the_old_values(c, phase, sign):
    sample = [0, 0, 0]
    sample[phase] = sign * LIMIT
    result, _, offsets = calibrate(c, [sample] * 128)
    assert result == c.CALIBRATION_DONE and offsets[phase] == NOMINAL + sign * LIMIT
    sample[phase] = sign * (LIMIT + 1)
    result, _, offsets = calibrate(c, [sample] * 128)
    assert result == c.CALIBRATION_OUT_OF_RANGE and offsets == (NOMINAL,) * 3
