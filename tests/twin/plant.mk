# SPDX-License-Identifier: MIT
# The twin's models as a shared library of this machine, for tests/twin: what needs no QEMU, and the CAN bus, for which
# vm.c plays it. Every undefined behaviour is trapped. Included by qemu/twin/twin.mk.

PLANT_CFLAGS := -std=gnu11 -O2 -g -fPIC -fsanitize=undefined,bounds-strict \
    -fno-sanitize-recover=all -Wall -Wextra -Wshadow -Werror -Iqemu/twin
PLANT_OBJECTS := $(patsubst %,$(BUILD)/tests/twin/%.o,$(TWIN_PHYSICS) \
    cycles_cache sysreg watchdog can_bus can_device lines fabric_rtl rtl_clock rtl_ahead loops vm)

plant: $(BUILD)/tests/twin/plant.so
.PHONY: plant
everything: plant

$(BUILD)/tests/twin/plant.so: $(PLANT_OBJECTS)
	$(call say,LD)
	$(Q)$(HOSTCC) -shared -fsanitize=undefined -Wl,-z,defs $^ -lm -ldl -o $@

PLANT_CC = $(HOSTCC) $(PLANT_CFLAGS) -MMD -MP -c $< -o $@
$(BUILD)/tests/twin/%.o: qemu/twin/%.c tests/twin/plant.mk
	@mkdir -p $(@D)
	$(call say,HOSTCC)
	$(Q)$(PLANT_CC)

$(BUILD)/tests/twin/%.o: tests/twin/%.c tests/twin/plant.mk
	@mkdir -p $(@D)
	$(call say,HOSTCC)
	$(Q)$(PLANT_CC)

-include $(wildcard $(BUILD)/tests/twin/*.d)
