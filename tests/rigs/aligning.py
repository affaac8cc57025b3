# SPDX-License-Identifier: MIT
"""Motors to be aligned, and what their drive is told."""

TURN = 2 ** 32
# pole pairs, counts, ohm, Ld, Lq (uH), flux (uWb), inertia (g mm2), of the rotor alone, i_align, i_max, range (mA), v range
# (mV), rated torque, friction, cogging (uN m), cogging periods a turn, speed_max (rpm)
MOTORS = {
    "teknic": (4, 4000, 360, 200, 200, 6395, 56490, 7060, 5000, 10650, 23571, 57528, 272000, 2720, 2720, 24, 4000),
    "maxon_ec22": (1, 2048, 321, 27, 27, 3924, 1910, 240, 2660, 5700, 11000, 57528, 21000, 640, 0, 1, 25000),
    "hoverboard": (15, 3200, 216, 520, 656, 20200, 16000000, 8000000, 6180, 13200, 41250, 57528, 4010000, 16000, 40000, 270,
                   462),
    "abb": (3, 8192, 3600, 36000, 51000, 545000, 15000000, 5000000, 4000, 9120, 20000, 1000000, 14000000, 70000, 70000, 36,
            1600),
    "dys": (21, 8192, 91, 35, 53, 1900, 330000, 110000, 8960, 19200, 41250, 57528, 784000, 6300, 15700, 252, 2800),
}


def params_of(c, name, **told):
    pairs, counts, ohm, ld, lq, flux, inertia, _, i_align, i_max, i_range, v_range, *_, speed_max = MOTORS[name]
    speed_max = min(speed_max, 980 * 60 // told.get("pole_pairs", pairs))  # what the observer follows
    params = c.params()
    c.params_init(params)
    for key, value in dict(pole_pairs=pairs, encoder_counts=counts, resistance_mohm=ohm, ld_uh=ld, lq_uh=lq, flux_uwb=flux,
                           inertia_gmm2=inertia, i_align_ma=i_align, i_max_ma=i_max, i_trip_ma=i_max * 5 // 4 + 1,
                           i_range_ma=i_range, v_range_mv=v_range, v_min_mv=v_range // 3, v_max_mv=v_range // 10 * 9,
                           speed_max_rpm=speed_max, overspeed_rpm=speed_max * 6 // 5, speed_bw_hz=10,
                           current_bw_hz=500).items():
        setattr(params, key, told.get(key, value))
    return params
