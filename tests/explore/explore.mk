# SPDX-License-Identifier: MIT
# `make explore`: every state of the drive that its operator, its faults and its timers can bring about, and what must hold in
# each (docs/guides/code.md). Included by the top Makefile, behind unit.mk, which defines UNIT_CFLAGS and builds the drive.

EXPLORE_SRC := $(wildcard tests/explore/*.c)
# the longest first
EXPLORE_SETUPS = bus-set-points bus encoder-kind Hall sensorless encoder set-points measuring injection learn-hall bus-owners

explore-program: $(BUILD)/explore/explore
.PHONY: explore explore-program
everything: explore-program

$(BUILD)/explore/explore: $(EXPLORE_SRC) $(wildcard tests/explore/*.h) $(BUILD)/tests/unit/firmware.so
	@mkdir -p $(@D)
	$(call say,HOSTCC)
	$(Q)$(HOSTCC) -std=gnu11 -O2 -flto -g -Wall -Wextra -Werror -Wno-int-to-pointer-cast -Itests/unit/host -I. $(EXPLORE_SRC) \
	    $(BUILD)/tests/unit/firmware.so -ldl -o $@

# two at a time; what each prints comes when all have ended
explore: LASTS = under 10 minutes: eleven ways to set the drive up, each to the last new state; leaves $(BUILD)/explore/
explore: tools-explore
	$(says)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 explore-program
	@printf '%s\n' $(EXPLORE_SETUPS) | xargs -P 2 -I SETUP sh -c '$(BUILD)/explore/explore SETUP > $(BUILD)/explore/SETUP.txt'; \
	    cat $(EXPLORE_SETUPS:%=$(BUILD)/explore/%.txt) | tee $(BUILD)/explore/all.txt
	@$(PYTHON) tests/explore/totals.py < $(BUILD)/explore/all.txt
