# SPDX-License-Identifier: MIT
# Parsers under libFuzzer, on the firmware's own sources with every undefined behaviour and every access outside trapped: one
# program for each of tests/fuzz/*.c. Included by the top Makefile, behind unit.mk.

FUZZ_CFLAGS := -std=gnu11 -O1 -g -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize=function -fno-sanitize-recover=all \
    -fno-pie -w -Itests/unit/host -I. -I$(BUILD)/packed/1
FUZZ_OBJ := $(patsubst $(BUILD)/host/%,$(BUILD)/fuzz/%,$(filter-out %/interrupt.o,$(UNIT_FIRMWARE)))
FUZZERS := $(patsubst tests/fuzz/%.c,$(BUILD)/tests/fuzz/%,$(wildcard tests/fuzz/*.c))

.PHONY: fuzzers fuzz
fuzzers: $(FUZZERS)

fuzz: LASTS = a minute, longer by N=runs; leaves what fails in $(BUILD)/fuzz/
fuzz: tools-fuzz
	$(says)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 fuzzers
	@FUZZ_RUNS=$(N) $(PYTHON) -m pytest -q -s -p no:cacheprovider tests/fuzz

$(BUILD)/tests/fuzz/%: $(BUILD)/fuzz/tests/fuzz/%.o $(FUZZ_OBJ)
	@mkdir -p $(@D)
	$(call say,LD)
	$(Q)clang -no-pie -fsanitize=fuzzer,address,undefined $^ -lm -o $@

$(BUILD)/fuzz/%.o: %.c tests/fuzz/fuzz.mk
	@mkdir -p $(@D)
	$(call say,CLANG)
	$(Q)clang $(FUZZ_CFLAGS) -MMD -MP -c $< -o $@

$(BUILD)/fuzz/firmware/operate/canopen_sdo.o: $(BUILD)/packed/1/data_sheet_text.h
$(BUILD)/fuzz/firmware/operate/messages.o: $(BUILD)/packed/1/message_texts.h

-include $(shell find $(BUILD)/fuzz -name '*.d' 2>/dev/null)
