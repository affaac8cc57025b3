/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Slots 1 and 3, ADC and GATE, against docs/fabric.md: through the registers where firmware can see it, through the
 * block's own functions where a signal from outside is needed. */
#include <string.h>

#include "bench.h"
#include "check.h"

static const uint32_t half_on[3] = {2500, 2500, 2500};
static const double period_s = BENCH_PERIOD_COUNTS * 10e-9;

/* ---- slot 1: ADC ---- */

static void adc_conversion(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    bench_before_trigger(&p, &params);
    check_hex("ADC.CONTROL after reset", bench_read(&p, ADC_CONTROL), 0);
    check_equal("ADC off: no conversion", bench_read(&p, ADC_SEQUENCE), 0);
    bench_write(&p, ADC_CONTROL, 0xFFFFFFFF);
    check_hex("ADC.CONTROL: unused bits read 0", bench_read(&p, ADC_CONTROL), 0xF);
    bench_write(&p, ADC_CONTROL, 3);

    bench_run(&p, 2.4e-6);
    check_hex("1.4 us after the trigger: no EOC", bench_read(&p, ADC_STATUS), 0);
    check_equal("results hold until the end", bench_read(&p, ADC_VBUS), 0);
    check_true("no interrupt yet", !adc_interrupt(&p.model.adc));
    bench_run(&p, 0.2e-6);
    check_hex("1.6 us after it: EOC", bench_read(&p, ADC_STATUS), 1);
    check_equal("SEQUENCE counts it", bench_read(&p, ADC_SEQUENCE), 1);
    check_near("VBUS is there", bench_read(&p, ADC_VBUS), 24.0 / 50 * 32768, 8);
    check_near("IA is there", (int32_t)bench_read(&p, ADC_IA), 0, 16);
    check_true("interrupt", adc_interrupt(&p.model.adc));
    bench_write(&p, ADC_CONTROL, 1);
    check_true("no interrupt without IRQ_ENABLE", !adc_interrupt(&p.model.adc));
    bench_write(&p, ADC_STATUS, 2);
    check_hex("writing OVERRUN leaves EOC", bench_read(&p, ADC_STATUS), 1);
    bench_write(&p, ADC_STATUS, 1);
    check_hex("writing EOC clears it", bench_read(&p, ADC_STATUS), 0);
    bench_write(&p, ADC_VBUS, 5);
    bench_write(&p, ADC_SEQUENCE, 5);
    check_near("results are read-only", bench_read(&p, ADC_VBUS), 24.0 / 50 * 32768, 8);
    check_equal("SEQUENCE is read-only", bench_read(&p, ADC_SEQUENCE), 1);
}

static void adc_overrun(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    bench_before_trigger(&p, &params);
    bench_write(&p, ADC_CONTROL, 1);
    bench_run(&p, 3e-6);
    p.sensors.current[0].stuck_code = 77; /* so that the second set is another */
    bench_run(&p, period_s);
    check_hex("EOC left: overrun", bench_read(&p, ADC_STATUS), 3);
    check_equal("newer results replace the older", (int32_t)bench_read(&p, ADC_IA), 16 * 77 - 32768);
    check_hex("the gates let go: LOOP_LOST, beside OVERRUN as it is", bench_read(&p, GATE_STATUS), 0x48);
    check_hex("in the same instant", p.gates, 0);
    bench_write(&p, ADC_STATUS, 3);
    check_hex("EOC and OVERRUN clear together", bench_read(&p, ADC_STATUS), 0);
    check_hex("OVERRUN in GATE.STATUS follows, the latch stays", bench_read(&p, GATE_STATUS), 0x8);

    bench_write(&p, GATE_STATUS, 0x8);
    bench_run(&p, 2 * period_s);
    check_hex("an overrun", bench_read(&p, ADC_STATUS), 3);
    check_hex("while LIVE is 0 latches nothing", bench_read(&p, GATE_STATUS), 0x40);

    struct adc a;
    adc_reset(&a);
    a.sequence = UINT32_MAX;
    check_true("off: no trigger", !adc_listens(&a));
    adc_write(&a, 0x00, 1);
    check_true("on and idle: the trigger starts a conversion", adc_listens(&a));
    adc_start(&a, (uint32_t[4]){1, 2, 3, 4}, 0, 0);
    check_true("busy: no second trigger", !adc_listens(&a));
    adc_finish(&a);
    check_equal("SEQUENCE wraps at 32 bit", adc_read(&a, 0x18), 0);
}

/* One conversion: code and offset in, Q15 out. */
static int32_t converted(struct adc *a, uint32_t phase, uint32_t code, uint32_t offset)
{
    uint32_t codes[4] = {0};
    codes[phase] = code;
    adc_write(a, 0x1C + 4 * phase, offset);
    adc_start(a, codes, 0, 0);
    adc_finish(a);
    return (int32_t)adc_read(a, 0x08 + 4 * phase);
}

static void adc_results(void)
{
    struct adc a;
    adc_reset(&a);
    for (uint32_t k = 0; k < 3; k++) {
        check_equal("OFFSET_x after reset", adc_read(&a, 0x1C + 4 * k), 32768);
        adc_write(&a, 0x1C + 4 * k, 0xFFFF0000 + 30000 + k);
        check_equal("OFFSET_x has 16 bits", adc_read(&a, 0x1C + 4 * k), 30000 + k);
    }
    adc_start(&a, (uint32_t[4]){2001, 2002, 2003, 2004}, 0, 0);
    adc_finish(&a);
    for (uint32_t k = 0; k < 3; k++) {
        check_equal("IA IB IC in order, less their offsets", (int32_t)adc_read(&a, 0x08 + 4 * k),
                    16 * (2001 + k) - 30000 - k);
    }
    check_equal("VBUS", adc_read(&a, 0x14), 8 * 2004);
    adc_write(&a, 0x1C, 0);
    check_equal("a new offset leaves the result", (int32_t)adc_read(&a, 0x08), 16 * 2001 - 30000);

    for (uint32_t k = 0; k < 3; k++) {
        check_equal("mid-scale is 0", converted(&a, k, 2048, 32768), 0);
        check_equal("one code", converted(&a, k, 2047, 32768), -16);
        check_equal("largest code", converted(&a, k, 4095, 32768), 32752);
        check_equal("smallest code: -32767, not -32768", converted(&a, k, 0, 32768), -32767);
        check_equal("just inside, above", converted(&a, k, 2048, 1), 32767);
        check_equal("just inside, below", converted(&a, k, 0, 32767), -32767);
        check_equal("held at the upper end", converted(&a, k, 4095, 0), 32767);
        check_equal("held at the lower end", converted(&a, k, 0, 65535), -32767);
    }
    check_equal("VBUS from 0", adc_read(&a, 0x14), 0);
    adc_start(&a, (uint32_t[4]){0, 0, 0, 4095}, 0, 0);
    adc_finish(&a);
    check_equal("VBUS to 32760, whatever the offsets", adc_read(&a, 0x14), 32760);
}

/* Gains, phases that are not valid, and what takes their place. */
static void adc_gains_and_valid(void)
{
    struct adc a;
    adc_reset(&a);
    adc_write(&a, 0x40, 0x17F);
    adc_write(&a, 0x44, 0x80);
    check_hex("GAIN_A has 8 bits", adc_read(&a, 0x40), 0x7F);
    adc_start(&a, (uint32_t[4]){3048, 3048, 1048, 0}, 0, 0);
    adc_finish(&a);
    check_equal("a gain of 1 + 127/2048, rounded", (int32_t)adc_read(&a, 0x08), 16992);
    check_equal("of 1 - 128/2048", (int32_t)adc_read(&a, 0x0C), 15000);
    check_equal("of 1", (int32_t)adc_read(&a, 0x10), -16000);
    check_hex("SETTLE 0: all valid", adc_read(&a, 0x3C), 7);

    adc_reset(&a);
    adc_write(&a, 0x4C, 0xF0FF);
    check_hex("SETTLE has 12 bits", adc_read(&a, 0x4C), 0xFF);
    adc_see_gates(&a, 0x2A, 0);
    adc_see_gates(&a, 0x29, 1000);     /* A high */
    adc_see_gates(&a, 0x2A, 20000000); /* and low again */
    adc_start(&a, (uint32_t[4]){1000, 2148, 2248, 0}, 20000000 + 0xFE * 10000, 0);
    adc_finish(&a);
    check_hex("A's low side has just come on", adc_read(&a, 0x3C), 6);
    check_equal("its result is the sensor's", (int32_t)adc_read(&a, 0x08), 16 * (1000 - 2048));
    adc_write(&a, 0x00, 4);
    adc_start(&a, (uint32_t[4]){1000, 2148, 2248, 0}, 20000000 + 0xFE * 10000, 0);
    adc_finish(&a);
    check_equal("RECONSTRUCT: minus the sum of the others", (int32_t)adc_read(&a, 0x08), -16 * 300);
    adc_start(&a, (uint32_t[4]){1000, 2148, 2248, 0}, 20000000 + 0xFF * 10000, 0);
    adc_finish(&a);
    check_hex("after SETTLE clocks it is valid", adc_read(&a, 0x3C), 7);
    check_equal("and measured", (int32_t)adc_read(&a, 0x08), 16 * (1000 - 2048));
    check_hex("MODULATOR after reset", adc_read(&a, 0x50), 0x511);
    check_hex("MODULATOR_TRIP after reset", adc_read(&a, 0x54), 0x1FFFF);
}

static void adc_off_drops_what_is_under_way(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    bench_before_trigger(&p, &params);
    bench_write(&p, ADC_CONTROL, 1);
    bench_run(&p, 1.5e-6);
    bench_write(&p, ADC_CONTROL, 0);
    bench_write(&p, ADC_CONTROL, 1);
    bench_run(&p, 10e-6);
    check_equal("switched off within a conversion: none ends", bench_read(&p, ADC_SEQUENCE), 0);
}

/* ---- slot 3: GATE ---- */

static void gate_start(struct gate *g)
{
    memset(g, 0, sizeof *g);
    gate_reset(g);
    gate_write(g, 0x00, 1, 0);
}

static void gate_enable(void)
{
    struct gate g;
    memset(&g, 0, sizeof g);
    gate_reset(&g);
    check_hex("GATE.ID", gate_read(&g, 0x08), 0x464F4331);
    check_hex("GATE.STATUS after reset", gate_read(&g, 0x04), 0);
    check_hex("LIVE 0: all outputs low", gate_follow(&g, 0x15), 0);
    gate_write(&g, 0x00, 0xFFFFFFFF, 0);
    check_hex("GATE.CONTROL: unused bits read 0", gate_read(&g, 0x00), 1);
    check_hex("LIVE", gate_read(&g, 0x04), 1);
    check_hex("outputs follow", gate_follow(&g, 0x2A), 0x2A);
    check_hex("only six", gate_follow(&g, 0x40), 0);
    gate_write(&g, 0x04, 1, 0);
    check_hex("LIVE is read-only", gate_read(&g, 0x04), 1);
    gate_write(&g, 0x00, 0, 0);
    check_hex("off again", gate_follow(&g, 0x2A), 0);
}

/* An input with a latch: named by its latch, seen in STATUS as `latch`, and live as `now`. */
static void gate_input(enum gate_latch pin, uint32_t latch, uint32_t now)
{
    struct gate g;
    gate_start(&g);
    gate_pin(&g, pin, true);
    check_hex("an input trips: latch and input, LIVE 0", gate_read(&g, 0x04), latch | now);
    check_hex("and clears ENABLE", gate_read(&g, 0x00), 0);
    gate_write(&g, 0x04, latch, 0);
    check_hex("no clearing while the input is active", gate_read(&g, 0x04), latch | now);
    gate_pin(&g, pin, false);
    check_hex("the latch outlasts its input", gate_read(&g, 0x04), latch);
    gate_write(&g, 0x00, 1, 0);
    check_hex("ENABLE is ignored while a latch is set", gate_read(&g, 0x00), 0);
    gate_write(&g, 0x04, ~latch, 0);
    check_hex("other bits do not clear it", gate_read(&g, 0x04), latch);
    gate_write(&g, 0x04, latch, 0);
    check_hex("its own does", gate_read(&g, 0x04), 0);
    check_hex("which does not enable", gate_read(&g, 0x00), 0);
    gate_write(&g, 0x00, 1, 0);
    check_hex("now it enables", gate_read(&g, 0x04), 1);
    gate_pin(&g, pin, true);
    gate_reset(&g);
    check_hex("a reset does not silence the input", gate_read(&g, 0x04), latch | now);
}

static void gate_interlock(void)
{
    static const unsigned both[3] = {0x03, 0x0C, 0x30};
    for (int k = 0; k < 3; k++) {
        struct gate g;
        gate_start(&g);
        check_hex("both sides of a phase: outputs low at once", gate_follow(&g, both[k]), 0);
        check_hex("INTERLOCK", gate_read(&g, 0x04), 0x10);
        gate_write(&g, 0x04, 0x10, 0);
        check_hex("no clearing while both are commanded", gate_read(&g, 0x04), 0x10);
        gate_follow(&g, 0);
        gate_write(&g, 0x04, 0x10, 0);
        check_hex("then it clears", gate_read(&g, 0x04), 0);
        gate_follow(&g, both[k]);
        check_hex("INTERLOCK while LIVE is 0", gate_read(&g, 0x04), 0x10);
    }
    struct gate g;
    gate_start(&g);
    check_hex("high sides of two phases are no interlock", gate_follow(&g, 0x15), 0x15);
    check_hex("nor a high side and the next phase's low side", gate_follow(&g, 0x06), 0x06);
}

/* All the way from a pin to the switches. */
static void a_stop_in_the_plant(enum gate_latch pin, uint32_t latch)
{
    struct plant_params params = bench_plant();
    struct plant p;
    bench_start(&p, &params, half_on);
    bench_run(&p, 1e-3);
    check_hex("live in the valley: the low sides", p.gates & 0x3F, 0x2A);
    plant_stop(&p, pin, true);
    check_hex("a pin asks to stop: all six off at once", p.gates, 0);
    check_hex("and what the switches follow", p.inverter.gates, 0);
    check_hex("the latch says which", bench_read(&p, GATE_STATUS) & 0x1FFF, latch);
    bench_run(&p, 1e-4);
    check_hex("none comes back", p.gates, 0);
    plant_stop(&p, pin, false);
    bench_write(&p, GATE_STATUS, latch);
    bench_run(&p, 1e-4);
    check_hex("not by clearing alone", p.gates, 0);
    bench_write(&p, GATE_CONTROL, 1);
    check_hex("after ENABLE a dead time passes", p.gates, 0);
    bench_run(&p, 2e-6);
    check_true("then they follow the PWM", p.gates != 0);
}

/* ---- the brake chopper ---- */

static void convert_once(struct plant *p)
{
    uint32_t sequence = bench_read(p, ADC_SEQUENCE);
    bench_write(p, ADC_CONTROL, 1);
    while (bench_read(p, ADC_SEQUENCE) == sequence) {
        bench_run(p, 1e-6);
    }
    bench_write(p, ADC_STATUS, 3);
    bench_write(p, ADC_CONTROL, 0);
}

static bool chops_at(struct plant *p, double bus_v)
{
    p->inverter.p.vbus_v = bus_v; /* the supply sinks and has little resistance */
    for (int n = 0; n < 5; n++) {
        bench_run(p, 0.4e-3);
        convert_once(p);
    }
    return bench_read(p, GATE_CHOPPER) & 2u;
}

static void chopper(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    params.inverter.supply_sinks = 1;
    params.inverter.chopper_ohm = 100;
    bench_start(&p, &params, half_on);
    bench_write(&p, GATE_CONTROL, 0); /* it needs neither LIVE nor the legs */
    check_hex("thresholds after reset", bench_read(&p, GATE_CHOPPER_ON), 0x7FFF);
    check_hex("both", bench_read(&p, GATE_CHOPPER_OFF), 0x7FFF);
    bench_write(&p, GATE_CHOPPER_ON, 0xFFFF0000 | 28 * 32768 / 50);
    bench_write(&p, GATE_CHOPPER_OFF, 26 * 32768 / 50);
    check_equal("15 bits", bench_read(&p, GATE_CHOPPER_ON), 28 * 32768 / 50);
    check_true("not enabled: off", !chops_at(&p, 30));
    bench_write(&p, GATE_CHOPPER, 3);
    check_hex("CHOPPING is read-only", bench_read(&p, GATE_CHOPPER), 1);
    check_true("between the two, from below: off", !chops_at(&p, 27));
    check_true("above: on", chops_at(&p, 30));
    check_true("and so is the resistor", p.inverter.supply.chopper_on);
    check_true("between the two, from above: on", chops_at(&p, 27.3));
    check_true("below: off", !chops_at(&p, 25));
    bench_run(&p, 1e-4);
    check_true("and so is the resistor", !p.inverter.supply.chopper_on);
    check_true("on again", chops_at(&p, 30));
    bench_run(&p, 0.6e-3);
    check_hex("0.6 ms after the last sample: still", bench_read(&p, GATE_CHOPPER), 3);
    bench_run(&p, 0.1e-3);
    check_hex("0.7 ms after it: off", bench_read(&p, GATE_CHOPPER), 1);
    check_true("resistor, too", !p.inverter.supply.chopper_on);
    chops_at(&p, 30);
    plant_stop(&p, GATE_CLOCK_LOST, true);
    check_hex("no clock, no chopping", bench_read(&p, GATE_CHOPPER), 1);
}

/* One read tells everything that can be wrong: what ENC.STATUS and ADC.STATUS show is in GATE.STATUS, and no more. */
static void gate_shows_the_encoder(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    bench_start(&p, &params, half_on);
    bench_run(&p, 1e-3);
    bench_write(&p, ENC_CONTROL, 1);
    p.model.encoder.status |= 1;
    check_hex("INDEX_SEEN is nothing wrong", bench_read(&p, GATE_STATUS), 0x01);
    encoder_illegal(&p.model.encoder);
    check_hex("ILLEGAL: ENCODER; no latch, LIVE stays", bench_read(&p, GATE_STATUS), 0x21);
    bench_write(&p, GATE_STATUS, 0x20);
    check_hex("not cleared here", bench_read(&p, GATE_STATUS), 0x21);
    check_hex("nor is the encoder's", bench_read(&p, ENC_STATUS), 0x3);
    bench_write(&p, GATE_CONTROL, 0);
    bench_write(&p, GATE_CONTROL, 1);
    check_hex("it does not hold back ENABLE", bench_read(&p, GATE_STATUS), 0x21);
    bench_write(&p, ENC_STATUS, 0x2);
    check_hex("but there", bench_read(&p, GATE_STATUS), 0x01);
    encoder_cut(&p.model.encoder, true);
    check_hex("SIGNAL_LOST: ENCODER", bench_read(&p, GATE_STATUS), 0x21);
    bench_write(&p, ENC_STATUS, 0x4);
    check_hex("as long as it lasts", bench_read(&p, GATE_STATUS), 0x21);
    encoder_cut(&p.model.encoder, false);
    bench_write(&p, ENC_STATUS, 0x4);
    check_hex("and no longer", bench_read(&p, GATE_STATUS), 0x01);
    check_hex("slots end at 256 bytes", plant_read(&p, 0x400, p.now), 0);
}

int main(void)
{
    adc_conversion();
    adc_overrun();
    adc_results();
    adc_gains_and_valid();
    adc_off_drops_what_is_under_way();
    gate_shows_the_encoder();
    gate_enable();
    gate_input(GATE_OVERCURRENT, 0x2, 0x100);
    gate_input(GATE_DRIVER_FAULT, 0x4, 0x200);
    gate_input(GATE_STO_A, 0x400, 0x2000);
    gate_input(GATE_STO_B, 0x800, 0x4000);
    gate_input(GATE_CLOCK_LOST, 0x1000, 0);
    gate_interlock();
    a_stop_in_the_plant(GATE_STO_A, 0x400);
    a_stop_in_the_plant(GATE_STO_B, 0x800);
    chopper();
    return check_end();
}
