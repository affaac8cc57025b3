# SPDX-License-Identifier: MIT
# The twin: a plugin for qemu-system-arm, and the motor model alone on a test bench. Included by the top Makefile,
# which defines BUILD, HOSTCC, Q and say. One binary serves QEMU 7.2 to 10: the plugin chooses the interface version
# and checks the symbols when it is loaded, and says in one line what does not fit.

# No pairs of scalars as vectors: a pair written one by one and read together, as the cycle counts are for every
# instruction and the slopes for every step, stalls each time; and with -flto a function takes the options of the file it
# is inlined into.
# Nobody looks at errno or at floating-point exceptions; of what changes a result, nothing is allowed.
TWIN_CFLAGS := -std=gnu11 -O3 -fno-tree-vectorize -fno-math-errno -fno-trapping-math -flto=auto -g -fPIC \
    -fvisibility=hidden -Wall -Wextra -Wshadow -Wstrict-prototypes -Wmissing-prototypes -Werror

# no contact with QEMU:
TWIN_PHYSICS := motor motor_step motor_params motor_field motor_map slots shaft winding_short bus supply circuit coss \
    diodes comparators terminals inverter account advance meter sampling sensor_keys sensors amplifier modulator \
    bit_streams disc hall thermometer can can_frame socketcand can_link can_hub random pwm adc encoder gate sto chopper watch \
    fabric_model plant envm envm_file events config cycles_keys
# the rest of the plugin:
TWIN_PLUGIN := qemu_symbols qemu_plugin qemu_memory qemu_machine qemu_chardev qemu_registers qemu_sleep core cycles \
    cycles_cache cycles_decode cycles_fetch cycles_price cycles_rules cycles_table irqlog irqpath reach dump dwt \
    can_bus can_device watchdog sysreg chip mmuart serial_bus gpio trace trace_csv recording probes console scenario live \
    lines envm_board fabric_rtl rtl_clock rtl_ahead rtl_motor plant_words axes twin

TWIN_OBJECTS := $(patsubst %,$(BUILD)/qemu/twin/%.o,$(TWIN_PHYSICS) $(TWIN_PLUGIN))
MODELCHECK_OBJECTS := $(patsubst %,$(BUILD)/qemu/twin/%.o,$(TWIN_PHYSICS) \
    modelcheck modelcheck_drive modelcheck_field modelcheck_shaft modelbench)

$(BUILD)/qemu/twin.so: $(TWIN_OBJECTS)
	$(call say,LD)
	$(Q)$(HOSTCC) -O2 -flto=auto -shared -Wl,-z,defs $^ -o $@ -ldl -lm

$(BUILD)/qemu/canbus: $(patsubst %,$(BUILD)/qemu/twin/%.o,can_hub_main can_hub can_link can_frame socketcand)
	$(call say,LD)
	$(Q)$(HOSTCC) -O2 -flto=auto $^ -o $@

$(BUILD)/qemu/replay: $(patsubst %,$(BUILD)/qemu/twin/%.o,$(TWIN_PHYSICS) replay)
	$(call say,LD)
	$(Q)$(HOSTCC) -O2 -flto=auto $^ -o $@ -lm

$(BUILD)/qemu/modelcheck: $(MODELCHECK_OBJECTS)
	$(call say,LD)
	$(Q)$(HOSTCC) -O2 -flto=auto $^ -o $@ -lm

$(BUILD)/qemu/twin/plant_words.o $(BUILD)/qemu/twin/rtl_motor.o: $(BUILD)/fabric/plant_addresses.h

$(BUILD)/qemu/twin/%.o: qemu/twin/%.c qemu/twin/twin.mk
	@mkdir -p $(@D)
	$(call say,CC)
	$(Q)$(HOSTCC) $(TWIN_CFLAGS) -I$(BUILD)/fabric -MMD -MP -c $< -o $@

-include $(wildcard $(BUILD)/qemu/twin/*.d)

-include tests/twin/plant.mk tests/timing/timing.mk
