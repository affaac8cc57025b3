# SPDX-License-Identifier: MIT
# The benchmark image build/bench.elf, and `make bench`. Included by the top Makefile, which defines BUILD, CFLAGS_ARM, Q, say
# and the objects. Its objects stand beside the firmware's, not among them: tools that read those see the firmware only.

BENCH_OBJ := $(patsubst tests/bench/%.c,$(BUILD)/bench/%.o,$(sort $(wildcard tests/bench/*.c)))
BENCH_FIRMWARE = $(filter-out %/main.o,$(FIRMWARE_OBJ))

# The reference builds differ in this alone.
$(BUILD)/bench/kernels_o3.o: BENCH_LEVEL := -O3

$(BUILD)/bench/%.o: tests/bench/%.c tests/bench/bench.mk Makefile $(BUILD)/choices
	@mkdir -p $(@D)
	$(call say,CC)
	$(Q)$(CC_ARM) $(CFLAGS_ARM) $(BENCH_LEVEL) -MMD -MP -c $< -o $@

$(BUILD)/bench.elf: $(BENCH_OBJ) $(BENCH_FIRMWARE) $(PLATFORM_OBJ) $(BUILD)/libmssfoc.a $(LDSCRIPT)
	$(call say,LD)
	$(Q)$(CC_ARM) $(LDFLAGS_ARM) $(filter %.o,$^) $(BUILD)/libmssfoc.a -lgcc -o $@

bench-image: $(BUILD)/bench.elf $(BUILD)/bench.hex

# tests/budgets measures with it
everything: bench-image

bench: tools-run
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin bench-image
	@$(PYTHON) tests/bench/run_bench.py
	@$(PYTHON) tests/tools/front.py

.PHONY: bench-image

-include $(wildcard $(BUILD)/bench/*.d)
