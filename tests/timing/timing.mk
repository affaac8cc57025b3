# SPDX-License-Identifier: MIT
# The images that check the cycle model against counts made by hand and against published silicon, and `make timing`,
# which prints the comparison. Included by the top Makefile, after the variables it uses.

TIMING_COUNTED := rules waits esram fetch
TIMING_IMAGES := $(TIMING_COUNTED:%=$(BUILD)/tests/timing/%.elf) $(BUILD)/tests/timing/published.elf

$(BUILD)/arm/tests/timing/%.o: tests/timing/sequence.inc

$(TIMING_COUNTED:%=$(BUILD)/arm/tests/timing/%.o): %.o: %.S tests/timing/exceptions.inc
	$(call say,AS)
	$(Q)$(CC_ARM) $(CPU) -I. -c $< -o $@

$(TIMING_COUNTED:%=$(BUILD)/arm/tests/timing/%.S): $(BUILD)/arm/tests/timing/%.S: tests/timing/sequences.py \
        tests/timing/sequences.txt
	@mkdir -p $(@D)
	$(Q)$(PYTHON) $< $* > $@

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
	@PYTHONPATH=tests $(PYTHON) -m pytest -q -rP -p no:cacheprovider tests/timing

.PHONY: timing
