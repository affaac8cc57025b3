# SPDX-License-Identifier: MIT
# The bring-up image build/bringup.elf, .hex, -envm.hex, and `make bringup`, which plays it in QEMU. Included by the top Makefile.
# It is of drivers and start-up alone: drivers/bringup, where lint keeps it to that. What the page says after resets comes from it.

BRINGUP_OBJ := $(call objects,$(call sources,drivers/bringup))

$(BUILD)/bringup/documented.h: docs/silicon.md tests/bringup/documented.py tests/silicon/facts.py
	@mkdir -p $(@D)
	$(call say,GEN)
	$(Q)$(PYTHON) tests/bringup/documented.py $@

$(BRINGUP_OBJ): $(BUILD)/bringup/documented.h
$(BRINGUP_OBJ): CFLAGS_ARM += -I$(BUILD)/bringup

$(BUILD)/bringup.elf: $(BRINGUP_OBJ) $(PLATFORM_OBJ) $(LDSCRIPT)
	$(call say,LD)
	$(Q)$(CC_ARM) $(LDFLAGS_ARM) -Wl$(comma)-Map=$(@:.elf=.map) $(filter %.o,$^) -lgcc -o $@

bringup-image: $(addprefix $(BUILD)/bringup,.elf .hex -envm.hex)

# tests/bringup plays it
everything: bringup-image

bringup: tools
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin bringup-image
	@$(PYTHON) qemu/run.py bringup

.PHONY: bringup-image bringup
