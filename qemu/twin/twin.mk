# SPDX-License-Identifier: MIT
# The twin: a plugin for qemu-system-arm, and the motor model alone. Included by the top Makefile, which defines BUILD
# and may define QEMU and HOSTCC. One binary serves QEMU 7.2 and 10.x; a version that does not fit says so when loaded.

HOSTCC ?= gcc
TWIN_CFLAGS := -std=gnu11 -O2 -g -fPIC -fvisibility=hidden -Wall -Wextra -Wshadow -Wstrict-prototypes \
    -Wmissing-prototypes -Werror
TWIN_DIR := qemu/twin
TWIN_PHYSICS := motor inverter bus sensors random adc corepwm encoder gate plant events config
TWIN_PLUGIN := $(TWIN_PHYSICS) qemu_api dwt watchdog sysreg mmuart trace probes console scenario twin

TWIN_OBJECTS := $(TWIN_PLUGIN:%=$(BUILD)/qemu/twin/%.o)
MODELCHECK_OBJECTS := $(TWIN_PHYSICS:%=$(BUILD)/qemu/twin/%.o) $(BUILD)/qemu/twin/modelcheck.o

$(BUILD)/qemu/twin.so: $(TWIN_OBJECTS)
	$(HOSTCC) -shared -Wl,-z,defs $^ -o $@ -ldl -lm

$(BUILD)/qemu/modelcheck: $(MODELCHECK_OBJECTS)
	$(HOSTCC) $^ -o $@ -lm

$(BUILD)/qemu/twin/%.o: $(TWIN_DIR)/%.c
	@mkdir -p $(@D)
	$(HOSTCC) $(TWIN_CFLAGS) -MMD -MP -c $< -o $@

-include $(wildcard $(BUILD)/qemu/twin/*.d)
