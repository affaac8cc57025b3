/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What a power meter would show of one period: means, effective values and peaks of the leg currents with their ripple, mean
 * torque. Currents and torque are taken as linear within a step of the integration, whose ends are where they bend. */
#ifndef TWIN_METER_H
#define TWIN_METER_H

struct meter {
    double time_s;
    double charge_as[3], square_a2s[3];
    double peak_a[3];
    double torque_nms;
    double i_a[3], torque_nm; /* at the end of the last step */
};

struct meter_reading {
    double i_mean_a[3], i_rms_a[3], i_peak_a[3], torque_mean_nm;
};

void meter_add(struct meter *m, double dt_s, const double from_a[3], const double to_a[3], double torque_nm);
/* The values since the last reading; without any time since then, those of the moment. */
void meter_read(struct meter *m, struct meter_reading *r);

#endif
