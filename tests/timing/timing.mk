# SPDX-License-Identifier: MIT
# The images that check the cycle model against counts made by hand and against published silicon, and `make timing`,
# which prints the comparison. Included by the top Makefile, after the variables it uses.

TIMING_IMAGES := $(patsubst tests/timing/%.S,$(BUILD)/tests/timing/%.elf,$(sort $(wildcard tests/timing/*.S)))

$(BUILD)/arm/tests/timing/%.o: tests/timing/sequence.inc

$(BUILD)/arm/tests/timing/published.o: $(BUILD)/arm/tests/timing/aes_table.inc
$(BUILD)/arm/tests/timing/published.o: CPU += -I$(BUILD)/arm/tests/timing

$(BUILD)/arm/tests/timing/aes_table.inc: tests/timing/aes_table.py
	@mkdir -p $(@D)
	$(Q)$(PYTHON) $< > $@

$(BUILD)/tests/timing/%.elf: $(BUILD)/arm/tests/timing/%.o $(BUILD)/arm/tests/timing/main.o $(HARNESS_OBJ) \
        $(PLATFORM_OBJ) $(LDSCRIPT)
	@mkdir -p $(@D)
	$(call say,LD)
	$(Q)$(CC_ARM) $(LDFLAGS_ARM) $(filter %.o,$^) -lgcc -o $@

target-tests: $(TIMING_IMAGES)

timing: tools-run
	$(ALONE) $(MAKE) --no-print-directory -s -j2 twin $(TIMING_IMAGES)
	@$(PYTHON) tests/timing/validate.py

.PHONY: timing
