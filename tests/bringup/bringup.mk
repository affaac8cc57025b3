# SPDX-License-Identifier: MIT
# The bring-up image build/bringup.elf, .hex, -envm.hex, and `make bringup`, which plays it in QEMU. Included by the top
# Makefile.
# It is of drivers and start-up alone: drivers/bringup, where lint keeps it to that. Its objects stand beside the
# drive's, not among them: tools that read those see the drive only. What docs/silicon.md says after resets comes from it.

BRINGUP_OBJ := $(patsubst drivers/bringup/%,$(BUILD)/bringup/%.o,$(basename $(call sources,drivers/bringup)))

$(BUILD)/bringup/documented.h: docs/silicon.md tests/bringup/documented.py tests/silicon/facts.py
	@mkdir -p $(@D)
	$(call say,GEN)
	$(Q)$(PYTHON) tests/bringup/documented.py $@

$(BRINGUP_OBJ): $(BUILD)/bringup/documented.h

$(BUILD)/bringup/%.o: drivers/bringup/%.c tests/bringup/bringup.mk Makefile $(BUILD)/choices
	@mkdir -p $(@D)
	$(call say,CC)
	$(Q)$(CC_ARM) $(CFLAGS_ARM) -I$(BUILD)/bringup -MMD -MP -c $< -o $@

$(BUILD)/bringup/%.o: drivers/bringup/%.S tests/bringup/bringup.mk Makefile
	@mkdir -p $(@D)
	$(call say,AS)
	$(Q)$(CC_ARM) $(CPU) -g3 -I. $(AS_NO_PLACE) -MMD -MP -c $< -o $@

$(BUILD)/bringup.elf: $(BRINGUP_OBJ) $(PLATFORM_OBJ) $(LDSCRIPT)
	$(call say,LD)
	$(Q)$(CC_ARM) $(LDFLAGS_ARM) -Wl$(comma)-Map=$(@:.elf=.map) $(filter %.o,$^) -lgcc -o $@

bringup-image: $(addprefix $(BUILD)/bringup,.elf .hex -envm.hex)

# tests/bringup plays it
everything: bringup-image

bringup: tools-run
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin bringup-image
	@$(PYTHON) qemu/run.py bringup

.PHONY: bringup-image bringup

-include $(wildcard $(BUILD)/bringup/*.d)
